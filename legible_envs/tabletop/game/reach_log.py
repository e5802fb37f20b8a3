"""The reaches of an episode as they happen: the points and times of the hand, and the goal it took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["Reach", "ReachLog"]

Floats = npt.NDArray[np.float64]

_ROOM = 128


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """One finished reach.

    Attributes:
        points: ``(k, 2)`` where the hand was, the start first, the point of the grasp last.
        times: ``(k,)`` seconds since the episode began.
        start: Name of where it began.
        goal: The object reached.
        candidates: The goals that were valid when it ended.
        positions: ``(len(candidates), 2)`` where these were then.
    """

    points: Floats
    times: Floats
    start: str
    goal: str
    candidates: tuple[str, ...]
    positions: Floats


class ReachLog:
    """The present reach, and the reaches before it.

    Attributes:
        finished: The reaches of this episode that ended at a goal.
        number: How many have begun.
        start: ``(x, y)`` where the present one did.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin an episode."""
        self.finished: list[Reach] = []
        self.number = 0
        self.start = (0.0, 0.0)
        self._renew()

    def _renew(self) -> None:
        # New arrays, so that views of the old ones stay as they are.
        self._count = 0
        self._points = np.empty((_ROOM, 2))
        self._times = np.empty(_ROOM)

    @property
    def points(self) -> Floats:
        """``(k, 2)`` where the hand was since the reach began; not a copy, read it only."""
        return self._points[: self._count]

    @property
    def times(self) -> Floats:
        """``(k,)`` seconds of these points; not a copy, read it only."""
        return self._times[: self._count]

    def begin(self, hand: Floats, time: float) -> None:
        """The person sets out."""
        self.number += 1
        self.start = (float(hand[0]), float(hand[1]))
        self._renew()
        self.add(hand, time)

    def add(self, hand: Floats, time: float) -> None:
        """The hand is somewhere."""
        if self._count == len(self._times):
            self._points = np.concatenate([self._points, np.empty_like(self._points)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
        self._points[self._count] = hand
        self._times[self._count] = time
        self._count += 1

    def finish(self, start: str, goal: str, candidates: tuple[str, ...], positions: Floats) -> None:
        """The reach ended at a goal."""
        self.finished.append(Reach(self.points.copy(), self.times.copy(), start, goal, candidates, positions))

    def trajectories(self, layout: TabletopLayout, *, participant: str, condition: str) -> list[Trajectory]:
        """The finished reaches, in order."""
        return [
            Trajectory(
                reach.points,
                reach.times,
                start=reach.start,
                goal=reach.goal,
                candidates=reach.candidates,
                participant=participant,
                condition=condition,
                layout=layout,
                candidate_set="game",
                goal_positions=tuple((x, y) for x, y in reach.positions.tolist()),
            )
            for reach in self.finished
        ]
