"""The statements that a server writes, one function each; the only place beside the schema that knows columns."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.study.store.store import Statement
    from benchmarks.study.timeline import Screen

__all__ = [
    "answer_rows",
    "event_row",
    "finish_visit",
    "moved_on",
    "participant_row",
    "sample_rows",
    "seen",
    "step_rows",
    "study_value",
    "text_row",
    "visit_row",
    "worker_row",
]


def participant_row(values: Mapping[str, Any]) -> Statement:
    """A new participant; keys are the columns."""
    columns = (
        "participant", "design", "token_sha256", "order_number", "conditions", "seed", "joined", "seen", "screen",
        "state", "ended", "language",
    )  # fmt: skip
    marks = ", ".join("?" * len(columns))
    return f"INSERT INTO participants ({', '.join(columns)}) VALUES ({marks})", [values[name] for name in columns]


def worker_row(participant: str, source: str, worker: str, study: str, session: str, at: float) -> Statement:
    """Who a participant is on a platform."""
    return "INSERT INTO workers VALUES (?, ?, ?, ?, ?, ?)", [participant, source, worker, study, session, at]


def seen(participant: str, at: float) -> Statement:
    """A sign of life."""
    return "UPDATE participants SET seen = ? WHERE participant = ?", [at, participant]


def moved_on(participant: str, screen: int, at: float, *, state: str = "active") -> Statement:
    """The participant is at another screen, or has ended."""
    return (
        "UPDATE participants SET screen = ?, state = ?, seen = ?, ended = ? WHERE participant = ?",
        [screen, state, at, None if state == "active" else at, participant],
    )


def visit_row(
    visit: int,
    participant: str,
    design: str,
    index: int,
    screen: Screen,
    at: float,
    *,
    attempt: int = 1,
    layout_id: str = "",
    seed: int = 0,
) -> Statement:
    """A screen is begun."""
    return (
        "INSERT INTO visits VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, NULL, NULL)",
        [
            visit, participant, design, index, screen.name, screen.kind, screen.sitting, screen.condition, screen.round,
            attempt, layout_id, seed, at,
        ],
    )  # fmt: skip


def finish_visit(visit: int, at: float, outcome: Mapping[str, Any]) -> Statement:
    """A screen is done with."""
    return (
        "UPDATE visits SET finished = ?, outcome = ? WHERE visit = ?",
        [at, json.dumps(outcome, allow_nan=False), visit],
    )


def step_rows(visit: int, participant: str, design: str, rows: Sequence[Sequence[Any]]) -> Statement:
    """Steps of a game: ``(step, action, before, key_down, frame_shown, received)`` each."""
    return (
        "INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        [
            [visit, step, participant, design, json.dumps(action), before, down, shown, received]
            for step, action, before, down, shown, received in rows
        ],
    )


def sample_rows(visit: int, participant: str, design: str, first: int, rows: Sequence[Sequence[float]]) -> Statement:
    """Samples of the pointer: ``(at, x, y)`` each; the first has the given number."""
    return (
        "INSERT INTO pointer VALUES (?, ?, ?, ?, ?, ?, ?)",
        [[visit, first + i, participant, design, at, x, y] for i, (at, x, y) in enumerate(rows)],
    )


def answer_rows(
    visit: int, participant: str, design: str, questionnaire: str, values: Mapping[str, Any], at: float
) -> Statement:
    """Answers, by name of item."""
    return (
        "INSERT OR REPLACE INTO answers VALUES (?, ?, ?, ?, ?, ?, ?)",
        [[visit, item, participant, design, questionnaire, json.dumps(value), at] for item, value in values.items()],
    )


def event_row(participant: str, design: str, at: float, kind: str, /, **detail: Any) -> Statement:
    """Something happened."""
    return (
        "INSERT INTO events (participant, design, at, kind, detail) VALUES (?, ?, ?, ?, ?)",
        [participant, design, at, kind, json.dumps(detail)],
    )


def text_row(sha256: str, name: str, text: str, at: float) -> Statement:
    """A text as it was shown."""
    return "INSERT OR IGNORE INTO texts VALUES (?, ?, ?, ?)", [sha256, name, text, at]


def study_value(key: str, value: str) -> Statement:
    """A value of the table ``study``."""
    return "INSERT OR REPLACE INTO study VALUES (?, ?)", [key, value]
