"""Episodes of any environment of this package as they are played, and the trajectories in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.specs import plain

__all__ = ["Episode", "RecordTrajectories", "record_episode"]


@dataclass(eq=False)
class Episode:
    """One episode: ``T`` steps between ``T + 1`` states.

    Attributes:
        seed: What ``reset`` was given.
        options: Plain data with which ``reset`` begins this episode again: the options it was given, and the layout.
        observations: ``T + 1``.
        actions: ``T``.
        rewards: ``T``.
        terminations: ``T``.
        truncations: ``T``.
        participant: Who played.
        condition: Under which condition.
    """

    seed: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    observations: list[Any] = field(default_factory=list)
    actions: list[Any] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    terminations: list[bool] = field(default_factory=list)
    truncations: list[bool] = field(default_factory=list)
    participant: str = ""
    condition: str = ""

    def __len__(self) -> int:
        return len(self.actions)


class RecordTrajectories(gym.Wrapper, gym.utils.RecordConstructorArgs):  # type: ignore[type-arg]
    """Keeps every episode, and the trajectories in it: of a policy, a learner, ``gymnasium.utils.play``.

    Works with every environment whose ``unwrapped`` has ``trajectories(participant=…, condition=…)`` and ``layout``:
    ``LegibleOvercooked-v0`` (trajectories to stations) and ``LegibleTabletop-v0`` (reaches for objects).

    Args:
        env: The environment, wrapped or not.
        participant: Who plays; may be set anew between episodes.
        condition: Under which condition; may be set anew between episodes.
        **options: Further arguments of the environment's ``trajectories``, such as ``candidate_set="all"`` in kitchens.

    Raises:
        LayoutError: An environment without trajectories.

    Example:
        >>> import legible_envs
        >>> env = RecordTrajectories(gym.make("LegibleTabletop-v0"), participant="p1")
        >>> _ = env.reset(seed=0, options={"start": "red-circle"})
        >>> _ = env.step(env.action_space.sample() * 0)
        >>> [(reach.goal, reach.participant) for reach in env.trajectories()]
        [('red-circle', 'p1')]
        >>> len(env.episodes), len(env.episodes[0])
        (1, 1)
    """

    def __init__(self, env: gym.Env[Any, Any], *, participant: str = "", condition: str = "", **options: Any) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, participant=participant, condition=condition, **options)
        super().__init__(env)
        self._game = _checked(env)
        self.participant = participant
        self.condition = condition
        self._options = options
        self._episodes: list[Episode] = []
        self._past: list[Trajectory] = []

    @property
    def episodes(self) -> list[Episode]:
        """The episodes with at least one step in order, the running one last."""
        self._sign()
        return [episode for episode in self._episodes if len(episode)]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Keep the trajectories of the episode that ends, and begin another."""
        self._sign()
        present = self._present()
        observation, info = self.env.reset(seed=seed, options=options)
        self._past += present
        self._episodes.append(Episode(seed, plain({**(options or {}), "layout": self._game.layout})))
        self._keep(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and keep it."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        episode = self._episodes[-1]
        episode.actions.append(np.array(action, dtype=self.action_space.dtype)[()])
        episode.rewards.append(float(reward))
        episode.terminations.append(bool(terminated))
        episode.truncations.append(bool(truncated))
        self._keep(observation)
        return observation, reward, terminated, truncated, info

    def trajectories(self) -> list[Trajectory]:
        """The trajectories of all episodes in order, the running one's too."""
        return [*self._past, *self._present()]

    def labels(self, episode: Episode) -> dict[str, Any]:
        """The arguments of the environment's ``trajectories`` with which those of an episode were made."""
        return {"participant": episode.participant, "condition": episode.condition, **self._options}

    def _sign(self) -> None:
        """Who plays now has played the running episode."""
        if self._episodes:
            self._episodes[-1].participant, self._episodes[-1].condition = self.participant, self.condition

    def _present(self) -> list[Trajectory]:
        found: list[Trajectory] = self._game.trajectories(
            participant=self.participant, condition=self.condition, **self._options
        )
        return found

    def _keep(self, observation: Any) -> None:
        self._episodes[-1].observations.append(np.array(observation, copy=True))


def record_episode(
    env: gym.Env[Any, Any],
    policy: Callable[[Any, dict[str, Any]], Any],
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    **labels: Any,
) -> list[Trajectory]:
    """Play one episode and return its trajectories.

    Args:
        env: The environment, wrapped or not, as for :class:`RecordTrajectories`.
        policy: Called with (observation, info), returns an action.
        seed: For ``reset``.
        options: For ``reset``.
        **labels: Arguments of the environment's ``trajectories``: ``participant``, ``condition`` and, in kitchens,
            ``candidate_set`` and others.

    Raises:
        LayoutError: An environment without trajectories.
    """
    game, over = _checked(env), False
    observation, info = env.reset(seed=seed, options=options)
    while not over:
        observation, _, terminated, truncated, info = env.step(policy(observation, info))
        over = terminated or truncated
    found: list[Trajectory] = game.trajectories(**labels)
    return found


def _checked(env: gym.Env[Any, Any]) -> Any:
    """The environment itself, which tells its layout and trajectories."""
    game = env.unwrapped
    if not hasattr(game, "trajectories") or not hasattr(game, "layout"):
        raise LayoutError(
            "expected an environment with `trajectories` and `layout`, such as LegibleOvercooked-v0 or "
            f"LegibleTabletop-v0, got {type(game).__name__}",
            rule="type",
        )
    return game
