"""Simulated people at play: a person of :mod:`legible_envs.tabletop.humans` as a policy for ``LegibleTabletop-v0``."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.tabletop.humans.model import Person
from legible_envs.tabletop.humans.simulation import simulate_reach

__all__ = ["ReachingPlayer"]

Floats = npt.NDArray[np.float64]

_PATIENCE: Final = 5
"""Corrections after which another goal is tried."""


class ReachingPlayer:
    """Reaches for a valid goal drawn uniformly, takes it, carries it to its place, pauses, and draws the next.

    Each way is a reach of this person, begun from where the hand is when it is decided on and followed sample by
    sample; where it ends beside what it was meant for, shorter ones correct it (as in Meyer et al., 1988). Which goal
    is drawn is told to the environment (``env.unwrapped.goal``), so that the hand takes nothing else on the way; robots
    are not told. If the robot takes it first the person draws another, and waits where there is none. People who cross
    obstacles do so where these are soft; hard ones stop them, and they correct.

    Args:
        person: Who plays.
        rng: Source of all randomness.

    Attributes:
        goal: What the person is reaching for, or None.

    Example:
        >>> import gymnasium as gym, legible_envs, numpy as np
        >>> from legible_envs.tabletop.humans import sample_person
        >>> rng = np.random.default_rng(0)
        >>> env, player = gym.make("LegibleTabletop-v0"), ReachingPlayer(sample_person(rng), rng)
        >>> obs, info = env.reset(seed=0)
        >>> over = False
        >>> while not over:
        ...     obs, reward, terminated, truncated, info = env.step(player(env))
        ...     over = terminated or truncated
        >>> info["done"], len(env.unwrapped.trajectories())
        (8, 8)
    """

    def __init__(self, person: Person, rng: np.random.Generator) -> None:
        self.person = person
        self.rng = rng
        self._table: Any = None
        self._time = 0.0
        self._pause = 0
        self._errand: tuple[str, str] | None = None
        self._held: str | None = None
        self._way: Floats = np.empty((0, 2))
        self._next = 0
        self._attempts = 0

    def __call__(self, env: Any) -> npt.NDArray[np.float32]:
        """The next action.

        Args:
            env: The environment, wrapped or not. A reset is noticed.

        Returns:
            ``(2,)`` velocity of the hand in units of the environment's ``max_speed``.
        """
        table = env.unwrapped
        if table is not self._table or table.time == 0 or table.time < self._time:
            self._table = table
            self._begin()
        self._time = table.time
        rate = table.metadata["render_fps"]
        self._decide(table, rate)
        if self._errand is None or self._pause > 0:
            self._pause = max(self._pause - 1, 0)
            return np.zeros(2, dtype=np.float32)
        if self._next >= len(self._way):
            self._set_out(table, rate)
        velocity = (self._way[self._next] - table.hand) * rate / table.max_speed
        self._next += 1
        return np.asarray(velocity / max(1.0, float(np.hypot(*velocity))), dtype=np.float32)

    @property
    def goal(self) -> str | None:
        """What the person is reaching for."""
        return self._errand[1] if self._errand is not None and self._errand[0] == "reach" else None

    # -- what next -----------------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._errand = self._held = None
        self._pause = 0
        self._drop_way()

    def _drop_way(self) -> None:
        self._way, self._next = np.empty((0, 2)), 0
        self._attempts = 0

    def _decide(self, table: Any, rate: float) -> None:
        """See whether something was taken or put down, and whether the goal is still there."""
        errand = ("carry", table.holding) if table.carry_to is not None else self._reach(table)
        if errand != self._errand or table.holding != self._held:
            if table.holding != self._held:
                self._pause = round(self.person.pause * rate)
            self._drop_way()
        self._errand, self._held = errand, table.holding

    def _reach(self, table: Any) -> tuple[str, str] | None:
        goals = table.goals
        if not goals:
            return None
        given_up = self._attempts > _PATIENCE and len(goals) > 1
        if table.goal not in goals or given_up:
            others = [goal for goal in goals if not given_up or goal != table.goal]
            table.goal = others[int(self.rng.integers(len(others)))]
        return "reach", table.goal

    def _set_out(self, table: Any, rate: float) -> None:
        """Plan the whole way, or a correction where one has ended in vain."""
        person = self.person
        if self._attempts:
            closer = person.endpoint_sd * 0.5**self._attempts
            person = replace(person, crossing_rate=0.0, endpoint_sd=closer, start_sd=0.0, aim=0.0)
        there = self._target(table)
        try:
            _, states = simulate_reach(table.view().layout, table.hand, there, person, self.rng, rate)
        except LayoutError:  # something was pushed to where no way leads: go as near as can be
            straight = replace(person, crossing_rate=1.0)
            _, states = simulate_reach(table.view().layout, table.hand, there, straight, self.rng, rate)
        self._way, self._next = _subdivided(np.vstack([table.hand, states[1:]]), table.max_speed / rate), 0
        self._attempts += 1

    def _target(self, table: Any) -> str | Floats:
        """What is reached for, or the point that something is carried to."""
        assert self._errand is not None
        kind, name = self._errand
        layout = table.view().layout
        if kind == "reach":
            there = np.array(table.positions[layout.index(name)])
            return name if np.array_equal(there, layout.place(name)) else there
        if self._attempts < 2 or name in table.task.configuration:
            return np.array(table.carry_to)
        x0, y0, x1, y1 = layout.table.assembly  # no room in the middle of the assembly zone
        return self.rng.uniform((x0, y0), (x1, y1))


def _subdivided(points: Floats, step: float) -> Floats:
    """The points after the first, with others between where they are more than a step apart: a hand is not faster."""
    found = []
    for before, after in pairwise(points):
        parts = max(math.ceil(float(np.hypot(*(after - before))) / step - 1e-9), 1)
        found += [before + (after - before) * (k / parts) for k in range(1, parts + 1)]
    return np.array(found)
