"""A study of two kitchens of four cells, and pages that talk to its server as a browser does, without one."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient, WebSocketTestSession

from benchmarks.study.design.models import StudyContent
from benchmarks.study.design.package_files import default_words
from benchmarks.study.design.questionnaires import Questionnaire
from benchmarks.study.design.study import Study
from benchmarks.study.design.text_names import known_texts
from benchmarks.study.server.app import create_app
from benchmarks.study.server.context import Pace
from benchmarks.study.store import database_path

KITCHEN = "XPSX\nO 1D\nX  X\nXXXX"
WAY = [3, 3, 5, 0, 5, 2, 2, 5, 3, 0, 5, 2, 0, 5]
"""Actions that cook and serve the soup of one onion."""
DEVICE = {"keyboard": True, "pointer": "fine", "width": 1000, "height": 800, "round_trip": 10}
ASKED = {
    "title": "Questions",
    "items": [
        {"name": "easy", "kind": "likert", "text": "It was easy."},
        {
            "name": "look",
            "kind": "attention",
            "text": "Choose the second.",
            "options": ["first", "second"],
            "expected": "second",
        },
        {"name": "why", "kind": "text", "text": "Why?", "required": False},
    ],
}
ANSWERS = {"easy": 4, "look": "second", "why": "because"}


def tiny_study(folder: Path, *, design: str = "a" * 16, asked: bool = True, **settings: Any) -> Study:
    """A study of two rounds of at most 20 steps.

    Args:
        folder: Where its data go.
        design: Its hash.
        asked: Whether there is a questionnaire at the end.
        **settings: Tables of ``study.toml``.
    """
    content: dict[str, Any] = {
        "schema": 1,
        "name": "tiny",
        "title": "Tiny",
        "domain": "overcooked",
        "conditions": [{"name": "A", "layout": "k.txt"}, {"name": "B", "layout": "k.txt"}],
        "rounds": {"max_steps": 20},
        "kitchen": {"soups": [["onion"]], "cook_time": 1},
        "orders": {"policy": "fixed"},
        "questionnaires": [{"name": "asked", "after": "study"}] if asked else [],
        **settings,
    }
    return Study(
        folder=folder,
        content=StudyContent.model_validate(content),
        texts={name: f"# {name}" for name in known_texts()},
        words=default_words(),
        layouts={"k.txt": KITCHEN},
        questionnaires={"asked": Questionnaire.model_validate(ASKED)} if asked else {},
        design_hash=design,
    )


class Clock:
    """A clock that tests turn on."""

    def __init__(self) -> None:
        self.time = 1_800_000_000.0

    def __call__(self) -> float:
        return self.time


class Page:
    """A page of a participant.

    Attributes:
        screen: What it was told to show last.
        state: Of the game, last.
    """

    def __init__(self, socket: WebSocketTestSession) -> None:
        self.socket = socket
        self.screen: dict[str, Any] = {}
        self.state: dict[str, Any] = {}

    @property
    def name(self) -> str:
        return str(self.screen["name"])

    def send(self, message: str, /, **fields: Any) -> None:
        self.socket.send_json({"type": message, **fields})

    def read(self) -> dict[str, Any]:
        message: dict[str, Any] = self.socket.receive_json()
        if message["type"] == "screen":
            self.screen = message
            self.state = message.get("state", self.state)
        if message["type"] == "state":
            self.state = message["state"]
        return message

    def say(self, message: str, /, **fields: Any) -> dict[str, Any]:
        """Send a message and read the answer."""
        self.send(message, **fields)
        return self.read()

    def step(self, action: int, n: int | None = None) -> dict[str, Any]:
        """A key; reads the new screen, too, where the round is over."""
        answer = self.say("step", n=self.state["n"] if n is None else n, action=action, down=1.0, shown=0.5)
        if answer["type"] == "state" and answer["state"]["over"]:
            self.read()
        return answer

    def play(self, actions: list[int] = WAY) -> None:
        """Begin a round and take steps."""
        if not self.screen["begun"]:
            self.say("next")
        for action in actions:
            self.step(action)

    def agree(self) -> None:
        """From the device check to the first round or practice."""
        self.say("device", **DEVICE)
        self.say("consent", agreed=True)
        self.say("next")

    def pass_screen(self) -> None:
        """Do what the present screen asks for."""
        kind = self.screen["kind"]
        if kind in ("practice", "round"):
            self.play()
        elif kind == "questionnaire":
            self.say("answers", values=ANSWERS, seconds=3.5)
        elif kind == "device":
            self.say("device", **DEVICE)
        elif kind == "consent":
            self.say("consent", agreed=True)
        else:
            self.say("next")

    def finish(self) -> dict[str, Any]:
        """Go on to the end."""
        while self.screen["kind"] != "end":
            before = self.screen
            self.pass_screen()
            assert self.screen is not before, before
        return self.screen


class Served:
    """A server in this process.

    Attributes:
        client: Sends it requests.
        study: What it serves.
    """

    def __init__(self, client: TestClient, study: Study, app: Any) -> None:
        self.client = client
        self.study = study
        self.app = app

    def join(self, **query: str) -> str:
        """Take part; the token."""
        answer = self.client.post("/api/join", json={"query": query})
        assert answer.status_code == 200, answer.text
        return str(answer.json()["token"])

    @contextlib.contextmanager
    def page(self, token: str, tab: str = "tab") -> Iterator[Page]:
        """Open a page."""
        with self.client.websocket_connect("/socket") as socket:
            page = Page(socket)
            page.say("hello", token=token, tab=tab)
            yield page

    def rows(self, sql: str, *values: Any, mode: Any = "live") -> list[Any]:
        """Rows of the database."""
        with contextlib.closing(sqlite3.connect(database_path(self.study.folder, mode), timeout=30)) as database:
            database.row_factory = sqlite3.Row
            found = database.execute(sql, values).fetchall()
            database.commit()
            return found

    def kinds(self, participant: str = "P001") -> list[str]:
        """Kinds of a participant's events, in order."""
        sql = "SELECT kind FROM events WHERE participant = ? ORDER BY event"
        return [row["kind"] for row in self.rows(sql, participant)]


@contextlib.contextmanager
def served(study: Study, *, clock: Clock | None = None, **settings: Any) -> Iterator[Served]:
    """Serve a study.

    Args:
        study: The design.
        clock: The server's; a real one where left out.
        **settings: Of :class:`~benchmarks.study.server.context.Pace`.
    """
    import time

    app = create_app(study, now=clock or time.time, pace=Pace(**settings))
    with TestClient(app, raise_server_exceptions=False) as client:
        yield Served(client, study, app)
