"""A robot that an agent steers, in place of one that decides for itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import is_masked, shown
from legible_envs.tabletop.partner.interface import Command, Floats, Senses, State, gripper_home

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["SteeredRobot"]

_REST: Final = 0.01
"""Slower than this a gripper is at rest, m/s."""


class SteeredRobot:
    """A partner that does what it is told: velocity of the gripper, and jaws that are open or closed.

    An open gripper that is told to close takes the nearest object that it may take within its reach; a closed one that
    is told to open puts its object at its place where it is near enough, else drops it.

    Args:
        speed: Of the gripper at an action of length 1, m/s.
        reach: How near to an object or its place the gripper can close or open, m.
    """

    def __init__(self, speed: float, reach: float) -> None:
        self.speed = speed
        self.reach = reach
        self._senses: Senses | None = None
        self._row: dict[str, int] = {}

    def reset(self, layout: TabletopLayout, task: TabletopTask, rng: np.random.Generator | None = None) -> Floats:
        """Begin an episode; ``(2,)`` where the gripper is."""
        self._row = {name: row for row, name in enumerate(layout.goals)}
        return np.array(gripper_home(layout))

    def step(self, senses: Senses) -> Command:
        """Take note of the senses, and rest until :meth:`command`."""
        self._senses = senses
        return Command(np.zeros(2), target=senses.holding, state=_state(senses.holding, 0.0))

    def command(self, action: npt.ArrayLike) -> Command:
        """The command of one step.

        Args:
            action: ``(3,)`` velocity along ``x`` and ``y`` in units of ``speed``, shortened to length 1; and the jaws,
                closed above 0.

        Raises:
            ValueError: Not three finite numbers.
        """
        senses = self._senses
        assert senses is not None
        x, y, jaws = _read(action)
        length = max(math.hypot(x, y), 1.0)
        velocity = np.array([x, y]) * (self.speed / length)
        nearest = self._nearest(senses)
        grasp = None
        if jaws > 0 and senses.holding is None and nearest is not None and nearest[1] <= self.reach:
            grasp = nearest[0]
        moves = math.hypot(*velocity) > _REST
        target = senses.holding or grasp or (nearest[0] if moves and nearest is not None else None)
        return Command(
            velocity,
            grasp=grasp,
            release=jaws <= 0 and senses.holding is not None,
            target=target,
            state="grasp" if grasp is not None else _state(senses.holding, math.hypot(*velocity)),
        )

    def _nearest(self, senses: Senses) -> tuple[str, float] | None:
        """The object nearest to the gripper of those it may take, and how far it is."""
        there = [(math.dist(senses.gripper, senses.positions[self._row[name]]), name) for name in senses.free]
        distance, name = min(there, default=(math.inf, ""))
        return (name, distance) if there else None


def _state(holding: str | None, speed: float) -> State:
    if holding is not None:
        return "carry"
    return "approach" if speed > _REST else "wait"


def _read(action: npt.ArrayLike) -> tuple[float, float, float]:
    try:
        if isinstance(action, str | bytes) or is_masked(action):
            raise ValueError
        array = np.asarray(action)
        if array.shape != (3,) or array.dtype.kind not in "biuf" or not np.isfinite(array).all():
            raise ValueError
    except (TypeError, ValueError):
        raise ValueError(f"expected a robot's action of three finite numbers, got {shown(action)}") from None
    x, y, jaws = array.tolist()
    return x, y, jaws
