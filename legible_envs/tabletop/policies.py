"""Simulated participants at play: a person of :mod:`legible_envs.tabletop.humans` as a policy for the environment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, Literal, NamedTuple

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.tabletop.humans.model import Person
from legible_envs.tabletop.humans.simulation import simulate_reach

__all__ = ["ReachingPlayer"]

Floats = npt.NDArray[np.float64]

_PATIENCE: Final = 5
"""Corrections after which another goal is tried."""


class _Errand(NamedTuple):
    """What the person is doing with an object."""

    kind: Literal["reach", "carry"]
    name: str


class ReachingPlayer:
    """Reaches for a valid goal drawn uniformly, takes it, carries it to its place, pauses, and draws the next.

    Each movement is a reach of this person that begins where the hand is when it is planned. The hand follows it sample
    by sample; where it ends beside its target, shorter reaches correct it (as in Meyer et al., 1988). The player sets
    the drawn goal in the environment (``env.unwrapped.goal``), so that the hand takes no other object meanwhile; robots
    do not see it. If the robot takes the goal first the person draws another, and waits where there is none. A person
    who crosses obstacles does so where these are soft; hard ones stop the hand, and the person corrects.

    Args:
        env: An environment made by ``gymnasium.make("LegibleTabletop-v0")``, wrapped or not. A reset is noticed. In a
            vector of tables, make one player for each.
        person: How the person reaches.
        rng: Source of all randomness.

    Attributes:
        goal: Name of the object that the person is reaching for, or None.

    Raises:
        ValueError: A vector environment.

    Example:
        >>> import gymnasium as gym, legible_envs, numpy as np
        >>> from legible_envs.tabletop.humans import sample_person
        >>> rng = np.random.default_rng(0)
        >>> env = gym.make("LegibleTabletop-v0")
        >>> player = ReachingPlayer(env, sample_person(rng), rng)
        >>> obs, info = env.reset(seed=0)
        >>> over = False
        >>> while not over:
        ...     obs, reward, terminated, truncated, info = env.step(player(obs, info))
        ...     over = terminated or truncated
        >>> info["num_done"], len(env.unwrapped.trajectories())
        (8, 8)
    """

    def __init__(self, env: gym.Env[Any, Any], person: Person, rng: np.random.Generator) -> None:
        if hasattr(env, "num_envs"):
            raise ValueError("expected one environment, got a vector of them: make a ReachingPlayer for each table")
        self.env = env
        self.person = person
        self.rng = rng
        # A TabletopEnv, which lies on a higher floor than policies.
        self._table: Any = env.unwrapped
        self._rate = float(self._table.metadata["render_fps"])
        self._time = math.inf
        self._errand: _Errand | None = None
        self._held: str | None = None
        self._pause = 0
        self._path: Floats = np.empty((0, 2))
        self._next = 0
        self._attempts = 0

    def __call__(self, obs: object, info: Mapping[str, Any]) -> npt.NDArray[np.float32]:
        """The next action.

        Args:
            obs: The observation; not needed, taken so that every policy is called alike.
            info: The info returned with it.

        Returns:
            ``(2,)`` velocity of the hand in units of the environment's ``max_speed``.
        """
        table, time = self._table, info["time"]
        if time == 0 or time < self._time:
            self._begin()
        self._time = time
        self._decide()
        if self._errand is None or self._pause > 0:
            self._pause = max(self._pause - 1, 0)
            return np.zeros(2, dtype=np.float32)
        if self._next >= len(self._path):
            self._set_out(self._errand)
        velocity = (self._path[self._next] - table.hand) * self._rate / table.max_speed
        self._next += 1
        return np.asarray(velocity / max(1.0, float(np.hypot(*velocity))), dtype=np.float32)

    @property
    def goal(self) -> str | None:
        """Name of the object that the person is reaching for."""
        return self._errand.name if self._errand is not None and self._errand.kind == "reach" else None

    # -- decisions -----------------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._errand = self._held = None
        self._pause = 0
        self._drop_path()

    def _drop_path(self) -> None:
        self._path, self._next = np.empty((0, 2)), 0
        self._attempts = 0

    def _decide(self) -> None:
        """Notice an object that was taken or put down, and a goal that is no longer valid."""
        held: str | None = self._table.holding
        if held is not None and self._table.carry_to is not None:
            errand: _Errand | None = _Errand("carry", held)
        else:
            errand = self._choose_goal(self._table.goals)
        if errand != self._errand or held != self._held:
            if held != self._held:
                self._pause = round(self.person.pause * self._rate)
            self._drop_path()
        self._errand, self._held = errand, held

    def _choose_goal(self, goals: tuple[str, ...]) -> _Errand | None:
        table = self._table
        if not goals:
            return None
        given_up = self._attempts > _PATIENCE and len(goals) > 1
        if table.goal not in goals or given_up:
            others = [goal for goal in goals if not given_up or goal != table.goal]
            table.goal = others[int(self.rng.integers(len(others)))]
        return _Errand("reach", table.goal)

    def _set_out(self, errand: _Errand) -> None:
        """Plan the whole path, or a correction where one has missed its target."""
        table, person = self._table, self.person
        if self._attempts:
            closer = person.endpoint_sd * 0.5**self._attempts
            person = replace(person, crossing_rate=0.0, endpoint_sd=closer, start_sd=0.0, aim=0.0)
        target, layout = self._target(errand), table.view().layout
        try:
            reach = simulate_reach(layout, table.hand, target, person, self.rng, rate=self._rate)
        except LayoutError:  # no path leads to where an object was pushed: go as near as can be
            straight = replace(person, crossing_rate=1.0)
            reach = simulate_reach(layout, table.hand, target, straight, self.rng, rate=self._rate)
        path = np.vstack([table.hand, reach.states[1:]])
        self._path, self._next = _subdivided(path, table.max_speed / self._rate), 0
        self._attempts += 1

    def _target(self, errand: _Errand) -> str | Floats:
        """The object that is reached for, or the point that it is carried to."""
        table = self._table
        layout = table.view().layout
        if errand.kind == "reach":
            there = np.array(table.positions[layout.index(errand.name)])
            return errand.name if np.array_equal(there, layout.place(errand.name)) else there
        if self._attempts < 2 or errand.name in table.task.configuration:
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
