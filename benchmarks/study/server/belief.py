"""What the study's predictor believes about a participant now: a copy of their game, played along with them.

The copy is fed from the database, in a thread, while somebody watches; the participant's own game is not touched.
"""

from __future__ import annotations

import dataclasses
import sqlite3
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.server.completion import counted_rounds
from benchmarks.study.store import open_readonly
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import timeline
from legible_envs.overcooked.grid import NEIGHBOURS
from legible_envs.overcooked.trajectories import dispensers_in_reach
from legible_envs.rollouts.trajectory import Trajectory

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.games.overcooked import KitchenGame

__all__ = ["BeliefFollower", "KitchenPredictors", "KitchenWalk"]

_PARTICIPANTS: Final = 3
"""Simulated participants that a predictor is fitted on, as at tables."""
_TICK: Final = 0.15
"""Seconds of a step in kitchens, as in recorded trajectories."""
_DISPENSED: Final = ("pot", "serving")


class KitchenPredictors:
    """The study's predictor, fitted on simulated participants of each kitchen once.

    Args:
        study: Names it.
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        self._fitted: dict[str, Any] = {}
        self._lock = threading.Lock()

    def of(self, game: KitchenGame) -> Any:
        """The predictor of a kitchen and its soups.

        Raises:
            ValueError: There is no such predictor, or it cannot be fitted.
        """
        from legible_envs.overcooked.humans.simulation import simulate_participants
        from legible_envs.overcooked.recipes import soup_task
        from predictors import make_predictor

        layout, soups = game.layout, game.scene()["soups"]
        key = f"{layout.layout_id} {soups}"
        with self._lock:
            if key not in self._fitted:
                predictor = make_predictor(self._study.content.predictor)
                if not hasattr(predictor, "classes_"):
                    rng = np.random.default_rng(0)
                    people = simulate_participants(layout, _PARTICIPANTS, rng, task=soup_task(soups))
                    predictor = predictor.fit(people)
                self._fitted[key] = predictor
            return self._fitted[key]


class KitchenWalk:
    """The walk that a participant is on: from the use of a pot or serving station that emptied their hands.

    The same rule as :func:`legible_envs.overcooked.trajectories.find_walks`, step by step.

    Args:
        game: Before its first step.

    Attributes:
        start: Station where it began; None while there is none.
        cells: ``(row, col)`` so far, repeats left out.
        ticks: When each was reached.
        candidates: Goals that were valid when it began.
    """

    def __init__(self, game: KitchenGame) -> None:
        self._game = game
        self._player = game.env.view().players[0]
        self.start: str | None = None
        self.cells: list[tuple[int, int]] = []
        self.ticks: list[int] = []
        self.candidates: tuple[str, ...] = ()
        layout, cell = game.layout, self._player.cell
        first = next((name for name in layout.named("serving") if cell in layout.access(name)), None)
        if first is not None:
            self._begin(first)

    def _begin(self, start: str) -> None:
        cell = self._player.cell
        valid = set(self._game.env.goals)
        self.start = start
        self.cells, self.ticks = [cell], [self._game.steps]
        self.candidates = tuple(name for name in dispensers_in_reach(self._game.layout, cell) if name in valid)

    def follow(self) -> None:
        """Take in the step that the game has just taken."""
        before, self._player = self._player, self._game.env.view().players[0]
        step = NEIGHBOURS[before.facing]
        used = self._game.layout.station_at((before.cell[0] + step[0], before.cell[1] + step[1])) or ""
        if before.held is not None and self._player.held is None and used.partition("@")[0] in _DISPENSED:
            self._begin(used)
        elif (before.held is None) != (self._player.held is None):
            self.start = None
        elif self.start is not None and self._player.cell != self.cells[-1]:
            self.cells.append(self._player.cell)
            self.ticks.append(self._game.steps)

    def belief(self, predictor: Any) -> dict[str, float] | None:
        """``{goal: probability}`` of the walk so far; None where there is none, or nothing to tell apart."""
        known = {str(name) for name in predictor.classes_}
        candidates = tuple(name for name in self.candidates if name in known)
        if self.start is None or not candidates:
            return None
        context = Trajectory(
            np.zeros((0, 2), dtype=np.int64),
            start=self.start,
            candidates=candidates,
            layout=self._game.layout,
            candidate_set="game",
            complete=False,
        )
        stream = predictor.stream(context)
        add = getattr(stream, "add", stream.update)  # takes a point without the cost of a belief
        for cell, tick in zip(self.cells[:-1], self.ticks[:-1], strict=True):
            add(np.array(cell), tick * _TICK)
        found = stream.update(np.array(self.cells[-1]), self.ticks[-1] * _TICK)
        return {name: float(p) for name, p in found.items()}


class BeliefFollower:
    """Follows one participant; :meth:`look` is called from a thread, by one caller at a time.

    Args:
        study: The design, which names the predictor.
        path: The database.
        predictors: Of kitchens, shared by all who watch.
    """

    def __init__(self, study: Study, path: Path, predictors: KitchenPredictors) -> None:
        content = study.content
        look = content.look.model_copy(update={"show_belief": True})  # so that tables have a predictor, too
        self._study = dataclasses.replace(study, content=content.model_copy(update={"look": look}))
        self._path = path
        self._predictors = predictors
        self._visit = 0
        self._game: Any = None
        self._walk: KitchenWalk | None = None

    def look(self, participant: str) -> dict[str, Any] | None:
        """What the predictor believes of the participant now.

        Returns:
            ``n`` (steps), ``goals``: ``name, at`` (``[row, col]`` or ``[x, y]``) and ``p`` of each, the most probable
            first; None where no round is in play, ``goals`` empty where no reach is.

        Raises:
            ValueError: The predictor cannot be used.
        """
        with open_readonly(self._path) as database:
            visit = database.execute(
                "SELECT * FROM visits WHERE participant = ? ORDER BY visit DESC LIMIT 1", (participant,)
            ).fetchone()
            if visit is None or visit["finished"] is not None or visit["kind"] not in ("practice", "round"):
                self.close()
                return None
            if visit["visit"] != self._visit:
                self.close()
                self._begin(database, participant, visit)
            steps = database.execute(
                "SELECT action FROM steps WHERE visit = ? AND step >= ? ORDER BY step", (self._visit, self._game.steps)
            ).fetchall()
        for row in steps:
            self._game.step(self._game.read_action(from_row(row["action"])))
            if self._walk is not None:
                self._walk.follow()
        return {"n": self._game.steps, "goals": self._goals()}

    def _begin(self, database: sqlite3.Connection, participant: str, visit: sqlite3.Row) -> None:
        person = database.execute("SELECT conditions FROM participants WHERE participant = ?", (participant,))
        screens = timeline(self._study, from_row(person.fetchone()["conditions"]))
        visits = database.execute("SELECT * FROM visits WHERE participant = ? ORDER BY visit", (participant,))
        screen = screens[visit["screen"]]
        left = reaches_left(self._study, screen, counted_rounds(screens, visits.fetchall()))
        self._game = make_game(self._study, screen, int(visit["seed"]), reaches_left=left)
        self._walk = KitchenWalk(self._game) if self._study.content.domain == "overcooked" else None
        self._visit = visit["visit"]

    def _goals(self) -> list[dict[str, Any]]:
        if self._walk is not None:
            places: Mapping[str, Any] = self._game.layout.stations
            belief = self._walk.belief(self._predictors.of(self._game))
        else:
            game = self._game.env.game
            places = dict(zip(game.names, game.positions.tolist(), strict=True))
            belief = self._game.env.belief
        found = [{"name": name, "at": list(places[name]), "p": round(p, 4)} for name, p in (belief or {}).items()]
        return sorted(found, key=lambda goal: -goal["p"])

    def close(self) -> None:
        """Let go of the game."""
        if self._game is not None:
            self._game.close()
        self._visit, self._game, self._walk = 0, None, None
