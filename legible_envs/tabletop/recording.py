"""Keeping the reaches of every episode that is played at a table, whoever plays."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from legible_envs.errors import LayoutError
from legible_envs.rollouts import Trajectory

__all__ = ["RecordReaches"]


class RecordReaches(gym.Wrapper, gym.utils.RecordConstructorArgs):  # type: ignore[type-arg]
    """Keeps the reaches of all episodes of ``LegibleTabletop-v0``: of a policy, a learner, a simulated person.

    Args:
        env: The environment, wrapped or not.
        participant: Who plays.
        condition: Under which condition.

    Raises:
        LayoutError: The environment shows no table.

    Example:
        >>> import legible_envs
        >>> env = RecordReaches(gym.make("LegibleTabletop-v0"), participant="p1")
        >>> _ = env.reset(seed=0, options={"start": "red-circle"})
        >>> _ = env.step(env.action_space.sample() * 0)
        >>> [(reach.goal, reach.participant) for reach in env.trajectories()]
        [('red-circle', 'p1')]
    """

    def __init__(self, env: gym.Env[Any, Any], participant: str = "", condition: str = "") -> None:
        gym.utils.RecordConstructorArgs.__init__(self, participant=participant, condition=condition)
        super().__init__(env)
        table = env.unwrapped
        if not hasattr(table, "trajectories") or not hasattr(table, "carry_to"):
            raise LayoutError(f"expected a LegibleTabletop environment, got {type(table).__name__}", rule="type")
        self.participant = participant
        self.condition = condition
        self._past: list[Trajectory] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Keep what has been, and begin an episode."""
        present = self._present()
        result = self.env.reset(seed=seed, options=options)
        self._past += present
        return result

    def trajectories(self) -> list[Trajectory]:
        """The reaches that ended at a goal, of all episodes in order; the running one's too."""
        return [*self._past, *self._present()]

    def _present(self) -> list[Trajectory]:
        table: Any = self.env.unwrapped
        found: list[Trajectory] = table.trajectories(participant=self.participant, condition=self.condition)
        return found
