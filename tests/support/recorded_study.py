"""Studies and databases made in the process: simulated participants play through a study's games, row by row.

No server has a part in it: rows are written as the tables of :mod:`benchmarks.study.store.schema` say.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.study.design.models import StudyContent
from benchmarks.study.design.questionnaires import Questionnaire
from benchmarks.study.design.study import Study
from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.store.schema import SCHEMA, TABLES
from benchmarks.study.timeline import GAMES, Screen, timeline

KITCHENS = {
    "Random": "XXTXOXX\nX     X\nC     D\nX  V  X\nF     P\nX  1  X\nXXXSXXX",
    "Efficient": "XXOPTXX\nX     X\nF     D\nX     X\nX     C\nX  1  X\nXXXSXXX",
    "Legible": "XXOXTXX\nX  V  X\nX     F\nX     X\nC     D\nX  1  X\nXPXSXXX",
}
BOLTZMANN = {"walker": "boltzmann", "preference": 0.2, "rationality": 1.236, "spread": 0.138}
TLX = {
    "title": "Workload",
    "items": [
        {"name": "mental", "kind": "slider", "text": "Mental demand", "scale": "workload"},
        {"name": "effort", "kind": "slider", "text": "Effort", "scale": "workload"},
        {"name": "ease", "kind": "likert", "text": "It was easy", "scale": "ease", "reverse": True},
        {"name": "sure", "kind": "attention", "text": "Choose blue", "options": ["red", "blue"], "expected": "blue"},
        {"name": "note", "kind": "text", "text": "Anything?", "required": False},
    ],
}


def kitchen_study(folder: Path, *, conditions: Sequence[str] = tuple(KITCHENS), **settings: Any) -> Study:
    """A study in kitchens with one soup a round."""
    content = {
        "conditions": [{"name": name, "layout": f"layouts/{name}.txt"} for name in conditions],
        "practice": {"layout": "layouts/Random.txt", "max_steps": 300},
        "kitchen": {"soups": [["tomato", "tomato", "onion"], ["onion", "cabbage", "fish"]]},
        "questionnaires": [{"name": "tlx"}],
        **settings,
    }
    layouts = {f"layouts/{name}.txt": KITCHENS[name] for name in KITCHENS}
    return _study(folder, "overcooked", content, layouts)


def table_study(folder: Path, **settings: Any) -> Study:
    """A study at tables with a robot, four reaches in each of two conditions."""
    from legible_envs.tabletop import TabletopWorkspace

    workspace = TabletopWorkspace("columns", "obstacles")
    other = workspace.decode(workspace.sample(1, np.random.default_rng(3))[0])
    layouts = {
        "layouts/Baseline.json": json.dumps(workspace.baseline.to_dict()),
        "layouts/Obstacles.json": json.dumps(other.to_dict()),
    }
    content = {
        "conditions": [
            {"name": "Baseline", "layout": "layouts/Baseline.json"},
            {"name": "Virtual Obstacle", "layout": "layouts/Obstacles.json"},
        ],
        "rounds": {"per_condition": 2, "reaches": 4, "max_steps": 1800},
        "partner": {},
        "questionnaires": [{"name": "tlx"}],
        **settings,
    }
    return _study(folder, "tabletop", content, layouts)


def _study(folder: Path, domain: str, content: Mapping[str, Any], layouts: Mapping[str, str]) -> Study:
    settings = StudyContent.model_validate(
        {"schema": 1, "name": "probe", "title": "A probe", "domain": domain, **content}
    )
    for path, text in layouts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    (folder / "study.toml").write_text("# made by a test\n")
    digest = sha256(json.dumps([settings.model_dump(mode="json"), dict(layouts)]).encode()).hexdigest()[:16]
    texts = {"consent": "You may stop at any time."}
    return Study(folder, settings, texts, {}, layouts, {"tlx": Questionnaire.model_validate(TLX)}, digest)


def new_database(path: Path, *, mode: str = "live") -> sqlite3.Connection:
    """An empty database."""
    path.parent.mkdir(parents=True, exist_ok=True)
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.executescript(TABLES)
    about = {"schema": str(SCHEMA), "mode": mode, "study": "probe", "created": "0", "recruitment": "open"}
    connection.executemany("INSERT INTO study VALUES (?, ?)", about.items())
    connection.commit()
    return connection


class Recorder:
    """Writes simulated participants into a database.

    Args:
        study: What they play.
        connection: To its database.
        people: Kitchens: as of ``draw_person``.
        answer: What a participant in a condition answers to an item, called with (item, condition, rng).
    """

    def __init__(
        self,
        study: Study,
        connection: sqlite3.Connection,
        *,
        people: Mapping[str, Any] = BOLTZMANN,
        answer: Callable[[Any, str, np.random.Generator], Any] | None = None,
    ) -> None:
        self.study = study
        self.connection = connection
        self.people = people
        self.answer = answer or _any_answer

    def record(self, number: int, *, until: int | None = None, state: str = "complete", worker: str = "") -> str:
        """A participant; returns their name.

        Args:
            number: From 1; their seed.
            until: Screens they get through; None: all.
            state: In which they end.
            worker: Their id on a platform.
        """
        study, name = self.study, f"P{number:03d}"
        conditions = study.conditions
        order = [conditions[(i + number) % len(conditions)] for i in range(len(conditions))]
        screens = timeline(study, order)
        now = 1_700_000_000.0 + 10_000 * number
        done = len(screens) if until is None else until
        person = {
            "participant": name,
            "design": study.design_hash,
            "token_sha256": sha256(name.encode()).hexdigest(),
            "order_number": number % len(conditions),
            "conditions": json.dumps(order),
            "seed": number,
            "joined": now,
            "seen": now + 5000,
            "screen": done,
            "state": state,
            "ended": now + 5000 if state != "active" else None,
            "language": "en",
        }
        self._insert("participants", person)
        if worker:
            row = {"participant": name, "source": "prolific", "worker": worker, "study": "S", "session": "X"}
            self._insert("workers", row | {"joined": now})
        self.event(name, now, "connected")
        finished: list[tuple[Screen, dict[str, Any]]] = []
        walker = person_of(study, number, self.people)
        for index, screen in enumerate(screens[:done]):
            rng = np.random.default_rng((number, index))
            left = reaches_left(study, screen, finished)
            if left == 0:
                continue
            now += 60
            visit = self._visit(name, index, screen, now, int(rng.integers(2**31)))
            outcome: dict[str, Any] = {}
            if screen.kind in GAMES:
                outcome, now = self._play(name, visit, screen, walker, rng, now, left)
                finished.append((screen, outcome))
            elif screen.kind == "questionnaire":
                self._answer(name, visit, screen, rng, now)
            done_at = {"finished": now, "outcome": json.dumps(outcome)}
            self.connection.execute(
                "UPDATE visits SET finished = :finished, outcome = :outcome WHERE visit = :visit",
                done_at | {"visit": visit},
            )
        self.event(name, now, "ended")
        self.connection.commit()
        return name

    def event(self, name: str, at: float, kind: str) -> None:
        """A row of ``events``."""
        row = {"participant": name, "design": self.study.design_hash, "at": at, "kind": kind, "detail": "{}"}
        self._insert("events", row)

    def _insert(self, table: str, row: Mapping[str, Any]) -> int:
        names = ", ".join(f":{key}" for key in row)
        cursor = self.connection.execute(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({names})", row)
        return int(cursor.lastrowid or 0)

    def _visit(self, name: str, index: int, screen: Screen, now: float, seed: int) -> int:
        row = {
            "participant": name,
            "design": self.study.design_hash,
            "screen": index,
            "name": screen.name,
            "kind": screen.kind,
            "sitting": screen.sitting,
            "condition": screen.condition,
            "round": screen.round,
            "attempt": 1,
            "layout_id": "",
            "seed": seed,
            "begun": now,
        }
        return self._insert("visits", row)

    def _play(
        self, name: str, visit: int, screen: Screen, walker: Any, rng: np.random.Generator, now: float, left: int | None
    ) -> tuple[dict[str, Any], float]:
        seed = self.connection.execute("SELECT seed FROM visits WHERE visit = ?", (visit,)).fetchone()[0]
        game = make_game(self.study, screen, seed, reaches_left=left)
        act = player_of(self.study, game.env, walker, rng)
        clock, pace = 1000.0, np.random.default_rng((visit, 1))
        while not game.is_over:
            action = game.read_action(np.asarray(act(game.obs, game.info)).tolist())
            clock += 1000 / 30 if self.study.content.domain == "tabletop" else float(pace.uniform(100, 250))
            self._insert(
                "steps",
                {
                    "visit": visit,
                    "step": game.steps,
                    "participant": name,
                    "design": self.study.design_hash,
                    "action": json.dumps(action),
                    "before": game.digest(),
                    "key_down": clock,
                    "frame_shown": clock - 50,
                    "received": now + (clock + float(pace.exponential(20))) / 1000,
                },
            )
            game.step(action)
        outcome = json.loads(json.dumps(game.outcome()))
        game.close()
        return outcome, now + clock / 1000

    def _answer(self, name: str, visit: int, screen: Screen, rng: np.random.Generator, now: float) -> None:
        for item in self.study.questionnaires[screen.questionnaire].items:
            value = self.answer(item, screen.condition, rng)
            row = {"visit": visit, "item": item.name, "participant": name, "design": self.study.design_hash}
            row |= {"questionnaire": screen.questionnaire, "value": json.dumps(value), "answered": now}
            self._insert("answers", row)


def person_of(study: Study, number: int, people: Mapping[str, Any] = BOLTZMANN) -> Any:
    """How a participant walks or reaches: the same in all conditions."""
    rng = np.random.default_rng((number, 77))
    if study.content.domain == "overcooked":
        from legible_envs.overcooked.humans.planner_fitting import draw_person

        return draw_person(people)((7, 7), rng)
    from legible_envs.tabletop.humans.simulation import Person, ReachModel, sample_person

    return sample_person(rng, ReachModel(Person(crossing_rate=0.0)))


def player_of(study: Study, env: Any, person: Any, rng: np.random.Generator) -> Callable[[Any, Any], Any]:
    """The participant at a game."""
    if study.content.domain == "overcooked":
        from legible_envs.overcooked.policies import WalkingPlayer

        return WalkingPlayer(env, person, rng)
    from legible_envs.tabletop.policies import ReachingPlayer

    return ReachingPlayer(SilentTable(env), person, rng)  # type: ignore[arg-type]


class SilentTable:
    """A table to which no player tells its goal: participants cannot either, and a replay would not know."""

    def __init__(self, env: Any) -> None:
        self._env = env.unwrapped
        self.goal: str | None = None

    @property
    def unwrapped(self) -> SilentTable:
        """Itself."""
        return self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._env, name)


def _any_answer(item: Any, condition: str, rng: np.random.Generator) -> Any:
    if item.kind == "slider":
        return float(5 * rng.integers(0, 21))
    if item.kind == "likert":
        return int(rng.integers(1, item.points + 1))
    return item.expected if item.kind == "attention" else "=1+1, fine" if item.kind == "text" else None


def record_study(study: Study, count: int, *, database: str = "live", **how: Any) -> Path:
    """A database of ``count`` participants who are complete."""
    path = study.folder / "data" / f"{database}.sqlite"
    connection = new_database(path, mode=database)
    recorder = Recorder(study, connection, **how)
    for number in range(1, count + 1):
        recorder.record(number, worker=f"worker-secret-{number}")
    connection.close()
    return path
