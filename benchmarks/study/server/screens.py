"""What the page is told to show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import quote

from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import GAMES

if TYPE_CHECKING:
    import sqlite3

    from benchmarks.study.games.base import Game
    from benchmarks.study.server.context import Context
    from benchmarks.study.timeline import Screen

__all__ = ["Place", "describe"]


class Place(Protocol):
    """Where a participant is; see :class:`benchmarks.study.server.progress.Progress`."""

    context: Context
    participant: str
    screens: list[Screen]
    index: int
    state: str
    attempt: int

    @property
    def screen(self) -> Screen | None:
        """The present screen."""

    @property
    def game(self) -> Game | None:
        """The round in play."""

    def gap(self) -> tuple[float | None, float | None]:
        """When the sitting after a pause can begin."""

    def visits(self) -> list[sqlite3.Row]:
        """All visits."""


def describe(session: Place) -> dict[str, Any]:
    """The message ``screen`` of a session; see :mod:`benchmarks.study.server.protocol`."""
    context, screen = session.context, session.screen
    if screen is None:
        return _end(session)
    found: dict[str, Any] = {
        "type": "screen",
        "name": screen.name,
        "kind": screen.kind,
        "progress": _share(session),
        "html": context.text(screen.text) if screen.text else "",
    }
    if screen.kind == "device":
        found["needs"] = context.study.content.device.model_dump()
    elif screen.kind in GAMES:
        found |= _game(session, screen)
    elif screen.kind == "questionnaire":
        asked = context.study.questionnaires[screen.questionnaire]
        # Which answer of an attention check is right is not the page's business.
        items = [item.model_dump(exclude={"expected", "scale", "reverse"}) for item in asked.items]
        found |= {"title": asked.title, "html": context.html(asked.text), "items": items, "errors": {}}
    elif screen.kind == "pause":
        opens, closes = session.gap()
        found |= {"from": opens, "until": closes}
    return found


def _game(session: Place, screen: Screen) -> dict[str, Any]:
    content, game = session.context.study.content, session.game
    conditions = list(
        dict.fromkeys(s.condition for s in session.screens if s.kind == "round" and s.sitting == screen.sitting)
    )
    practice = content.practice
    found: dict[str, Any] = {
        "begun": game is not None,
        "attempt": session.attempt,
        "attempts": practice.attempts if screen.kind == "practice" and practice is not None else 0,
        "round": screen.round,
        "rounds": content.rounds.per_condition,
        "condition_number": conditions.index(screen.condition) + 1 if screen.condition in conditions else 0,
        "conditions": len(conditions),
    }
    if content.domain == "overcooked":
        found |= {"waiting": content.kitchen.waiting, "keys": content.look.keys}
    if game is not None:
        found |= {"scene": game.scene(), "state": game.state(content.look.show_belief)}
        if content.domain == "tabletop":
            found["clock"] = game.steps * 1000.0 / 30
    return found


def _end(session: Place) -> dict[str, Any]:
    context, ending = session.context, session.state
    recruitment = context.study.content.recruitment
    is_live = context.store.mode == "live"
    code = recruitment.codes.get(ending) or context.secrets.code(session.participant, ending)
    url = recruitment.completion_url.replace("{code}", quote(code, safe="")).replace("{ending}", ending)
    found = {
        "type": "screen",
        "name": ending,
        "kind": "end",
        "progress": 1.0 if ending == "complete" else _share(session),
        "html": context.text(ending),
        "ending": ending,
        "code": code,
        "url": url.replace("{participant}", session.participant) if is_live else "",
    }
    if ending == "device_failed":
        checks = [from_row(row["outcome"]) for row in session.visits() if row["kind"] == "device" and row["outcome"]]
        found["failed"] = checks[-1].get("failed", []) if checks else []
    return found


def _share(session: Place) -> float:
    """How much of the study lies behind a participant, 0 to 1."""
    return round(session.index / max(1, session.index, len(session.screens)), 3)
