"""What the records in a file of trajectories may hold: keys, types and bounds."""

from __future__ import annotations

from typing import Annotated, Final

from legible_envs.support.models import Choice, FileModel, Flag, Length, Real, Text, Whole

__all__ = ["Records", "TrajectoryRecord"]

_MOST_CANDIDATES: Final = 10_000

Label = Annotated[str, Text(100_000, empty=True)]
Name = Annotated[str, Text(100_000)]


class LayoutRecord(FileModel):
    """A layout as its kind (:mod:`legible_envs.layout_kinds`) writes it."""

    kind: Name
    text: Annotated[str, Text(1_000_000, empty=True)]


class TrajectoryRecord(FileModel):
    """What a trajectory has beside its states and times; see :class:`~legible_envs.rollouts.trajectory.Trajectory`."""

    start: Label = ""
    goal: Name | None = None
    candidates: Annotated[list[Name], Length(1, _MOST_CANDIDATES)]
    participant: Label = ""
    condition: Label = ""
    layout: Annotated[int, Whole(0)] | None
    layout_name: Label = ""
    candidate_set: Annotated[str, Choice("task", "game", "all")] = "all"
    complete: Annotated[bool, Flag()] = True
    goal_positions: Annotated[list[list[Annotated[float, Real()]]], Length(1, _MOST_CANDIDATES)] | None = None


class Records(FileModel):
    """All layouts, each once, and all trajectories."""

    layouts: list[LayoutRecord]
    trajectories: list[TrajectoryRecord]
