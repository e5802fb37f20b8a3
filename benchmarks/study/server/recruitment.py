"""Who may join: workers of a platform or anybody, once or again, while recruitment is open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.store import Store

__all__ = ["PLATFORMS", "Worker", "is_open", "worker_of"]

PLATFORMS: Final[Mapping[str, tuple[str, str, str]]] = {
    "prolific": ("PROLIFIC_PID", "STUDY_ID", "SESSION_ID"),
    "mturk": ("workerId", "hitId", "assignmentId"),
}
"""Parameters of a platform's links: worker, study, session."""

_PREVIEW: Final = "ASSIGNMENT_ID_NOT_AVAILABLE"
_LONGEST: Final = 200


@dataclass(frozen=True, slots=True)
class Worker:
    """A participant as a platform knows them; all empty where there is none.

    Attributes:
        source: ``"prolific"``, ``"mturk"`` or ``"none"``.
        worker, study, session: The platform's ids.
        is_preview: They only look: nobody takes part yet.
    """

    source: str = "none"
    worker: str = ""
    study: str = ""
    session: str = ""
    is_preview: bool = False


def worker_of(study: Study, query: Mapping[str, Any]) -> Worker:
    """Who a link speaks of.

    Args:
        study: Says which platform.
        query: Parameters of the link.
    """
    source = study.content.recruitment.source
    if source not in PLATFORMS:
        return Worker()
    ids = [str(query.get(name, ""))[:_LONGEST].strip() for name in PLATFORMS[source]]
    return Worker(source, *ids, is_preview=not ids[0] or _PREVIEW in ids)


def is_open(study: Study, store: Store) -> bool:
    """Whether new participants may join: nobody has paused or closed recruitment, and more are wanted."""
    if store.mode == "debug":
        return True
    if store.value("recruitment") != "open":
        return False
    wanted = study.content.recruitment.wanted
    return not wanted or complete_count(store) < wanted


def complete_count(store: Store) -> int:
    """How many participants are complete."""
    return int(store.read("SELECT COUNT(*) FROM participants WHERE state = 'complete'")[0][0])
