"""Whether a participant is complete: decided by the rows that are there, never by what a page says."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from benchmarks.study.design.questionnaires import answered_names
from benchmarks.study.games import reaches_left
from benchmarks.study.timeline import GAMES, timeline

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.store import Store

__all__ = ["is_complete", "missing"]


def is_complete(store: Store, study: Study, participant: str) -> bool:
    """Whether every row of a whole session is there."""
    return not missing(store, study, participant)


def missing(store: Store, study: Study, participant: str) -> list[str]:
    """Names of the screens whose rows are not all there.

    A screen needs a finished visit; a game as many steps, numbered from 0, as its outcome says; a questionnaire all its
    answers; the consent its answer.
    """
    row = store.read("SELECT conditions FROM participants WHERE participant = ?", (participant,))
    if not row:
        return ["participant"]
    screens = timeline(study, json.loads(row[0]["conditions"]))
    visits = store.read(
        "SELECT * FROM visits WHERE participant = ? AND finished IS NOT NULL ORDER BY visit", (participant,)
    )
    last = {visit["screen"]: visit for visit in visits}
    counts = {
        row["visit"]: (row["n"], row["top"])
        for row in store.read(
            "SELECT visit, COUNT(*) AS n, MAX(step) AS top FROM steps WHERE participant = ? GROUP BY visit",
            (participant,),
        )
    }
    answers = {
        (row["visit"], row["item"])
        for row in store.read("SELECT visit, item FROM answers WHERE participant = ?", (participant,))
    }
    rounds = [(screens[v["screen"]], json.loads(v["outcome"])) for v in visits if v["kind"] == "round"]
    found = []
    for index, screen in enumerate(screens):
        visit = last.get(index)
        if visit is None:
            if screen.kind != "round" or reaches_left(study, screen, rounds) != 0:
                found.append(screen.name)
        elif screen.kind in GAMES:
            steps = json.loads(visit["outcome"])["steps"]
            if counts.get(visit["visit"], (0, -1)) != (steps, steps - 1):
                found.append(screen.name)
        elif screen.kind == "questionnaire":
            names = answered_names(study.questionnaires[screen.questionnaire])
            if any((visit["visit"], name) not in answers for name in names):
                found.append(screen.name)
        elif screen.kind == "consent" and (visit["visit"], "consent") not in answers:
            found.append(screen.name)
    return found
