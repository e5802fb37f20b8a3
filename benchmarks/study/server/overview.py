"""What the monitor shows of a database: participants, orders, endings, problems, volume. Never who they are."""

from __future__ import annotations

import sqlite3
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.store import open_readonly
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import timeline

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study

__all__ = ["PROBLEMS", "Overviews"]

PROBLEMS: Final = (
    "error", "page_error", "incomplete", "refused", "bad_message", "too_fast", "idle_warning",
)  # fmt: skip
"""Kinds of events in the error log."""
_TABLES: Final = ("participants", "visits", "steps", "pointer", "answers", "events", "texts")
_MOST_PROBLEMS: Final = 200
_MOST_PEOPLE: Final = 2000
_VOLUME_AGE: Final = 20.0
"""Seconds after which rows are counted again; counting reads whole tables."""


class Overviews:
    """Reads a database for the monitor, with a connection of its own: call it from a thread.

    Args:
        study: The design.
        path: The database.
        mode: ``"live"`` or ``"debug"``.
    """

    def __init__(self, study: Study, path: Path, mode: str) -> None:
        self._study = study
        self._path = path
        self._mode = mode
        self._volume: tuple[float, dict[str, Any]] | None = None
        self._screens = lru_cache(maxsize=1024)(self._screens_of)

    def read(self, connected: Mapping[str, float], now: float) -> dict[str, Any]:
        """Everything that the monitor's page shows of this database.

        Args:
            connected: Since when each participant who is connected has given no sign of life, seconds since 1970.
            now: Seconds since 1970.

        Returns:
            ``mode, recruitment, wanted, complete, earlier`` (participants of other designs), ``participants``,
            ``orders``, ``endings``, ``problems`` and ``volume``; plain JSON data.
        """
        with open_readonly(self._path) as database:
            people = [
                self._person(row, database, connected, now)
                for row in database.execute(
                    "SELECT * FROM participants ORDER BY joined DESC, participant DESC LIMIT ?", (_MOST_PEOPLE,)
                )
            ]
            self._add_attention(database, people)
            counts = database.execute("SELECT state, COUNT(*) FROM participants GROUP BY state").fetchall()
            values = dict(database.execute("SELECT key, value FROM study").fetchall())
            return {
                "mode": self._mode,
                "recruitment": values.get("recruitment", ""),
                "wanted": self._study.content.recruitment.wanted,
                "complete": self._count(database, "design = ? AND state = 'complete'"),
                "earlier": self._count(database, "design != ?"),
                "participants": people,
                "orders": self._orders(database),
                "endings": {str(row[0]): int(row[1]) for row in counts},
                "problems": self._problems(database),
                "volume": self._volume_of(database),
            }

    def _count(self, database: sqlite3.Connection, where: str) -> int:
        sql = f"SELECT COUNT(*) FROM participants WHERE {where}"
        return int(database.execute(sql, (self._study.design_hash,)).fetchone()[0])

    def _person(
        self, row: sqlite3.Row, database: sqlite3.Connection, connected: Mapping[str, float], now: float
    ) -> dict[str, Any]:
        participant, is_old = str(row["participant"]), row["design"] != self._study.design_hash
        screens = () if is_old else self._screens(str(row["conditions"]))
        screen = screens[row["screen"]] if row["screen"] < len(screens) else None
        visit = database.execute(
            "SELECT visit, attempt, finished FROM visits WHERE participant = ? ORDER BY visit DESC LIMIT 1",
            (participant,),
        ).fetchone()
        steps = 0
        if visit is not None and visit["finished"] is None:
            top = "SELECT COALESCE(MAX(step), -1) FROM steps WHERE visit = ?"
            steps = 1 + database.execute(top, (visit["visit"],)).fetchone()[0]
        return {
            "participant": participant,
            "state": row["state"],
            "order_number": row["order_number"],
            "conditions": from_row(row["conditions"]),
            "screen": min(int(row["screen"]), len(screens)) if screens else int(row["screen"]),
            "screens": len(screens),
            "name": "" if screen is None or row["state"] != "active" else screen.name,
            "kind": "" if screen is None else screen.kind,
            "condition": "" if screen is None else screen.condition,
            "round": 0 if screen is None else screen.round,
            "attempt": 1 if visit is None else visit["attempt"],
            "steps": steps,
            "joined": row["joined"],
            "seen": row["seen"],
            "connected": participant in connected,
            "idle": round(now - connected[participant], 1) if participant in connected else None,
            "earlier_design": is_old,
            "attention": [0, 0],
        }

    def _screens_of(self, conditions: str) -> tuple[Any, ...]:
        return tuple(timeline(self._study, from_row(conditions)))

    def _add_attention(self, database: sqlite3.Connection, people: Sequence[dict[str, Any]]) -> None:
        """How many attention checks each participant has passed, of how many."""
        expected = {
            (name, item.name): item.expected
            for name, asked in self._study.questionnaires.items()
            for item in asked.items
            if item.kind == "attention"
        }
        if not expected:
            return
        marks = ", ".join("?" * len(expected))
        right: Counter[str] = Counter()
        asked_of: Counter[str] = Counter()
        sql = f"SELECT participant, questionnaire, item, value FROM answers WHERE item IN ({marks})"
        for row in database.execute(sql, [item for _, item in expected]):
            answer = expected.get((row["questionnaire"], row["item"]))
            if answer is not None:
                asked_of[row["participant"]] += 1
                right[row["participant"]] += from_row(row["value"]) == answer
        for person in people:
            person["attention"] = [right[person["participant"]], asked_of[person["participant"]]]

    def _orders(self, database: sqlite3.Connection) -> list[dict[str, Any]]:
        """Participants of this design by row of the order policy: complete, active, and ended otherwise."""
        found: dict[int, dict[str, Any]] = {}
        sql = (
            "SELECT order_number, conditions, state, COUNT(*) AS n FROM participants "
            "WHERE design = ? GROUP BY order_number, conditions, state"
        )
        for row in database.execute(sql, (self._study.design_hash,)):
            number, conditions = row["order_number"], from_row(row["conditions"])
            order = found.setdefault(
                number, {"number": number, "conditions": conditions, "complete": 0, "active": 0, "ended": 0}
            )
            if order["conditions"] != conditions:  # orders are drawn
                order["conditions"] = []
            order[row["state"] if row["state"] in ("complete", "active") else "ended"] += row["n"]
        return [found[number] for number in sorted(found)]

    def _problems(self, database: sqlite3.Connection) -> list[dict[str, Any]]:
        marks = ", ".join("?" * len(PROBLEMS))
        found = database.execute(
            f"SELECT event, participant, at, kind, detail FROM events WHERE kind IN ({marks}) "
            "ORDER BY event DESC LIMIT ?",
            (*PROBLEMS, _MOST_PROBLEMS),
        )
        return [{key: row[key] for key in row.keys()} for row in found]  # noqa: SIM118  # a Row has no items

    def _volume_of(self, database: sqlite3.Connection) -> dict[str, Any]:
        now = time.monotonic()
        if self._volume is None or now - self._volume[0] > _VOLUME_AGE:
            files = [self._path, self._path.with_name(f"{self._path.name}-wal")]
            found = {
                "bytes": sum(file.stat().st_size for file in files if file.exists()),
                "rows": {name: int(database.execute(f"SELECT COUNT(*) FROM {name}").fetchone()[0]) for name in _TABLES},
            }
            self._volume = (now, found)
        return self._volume[1]
