"""Episodes of the kitchen as they are played, by whoever plays, and the walks in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import gymnasium as gym
import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.overcooked.trajectories import trajectories_from_views

if TYPE_CHECKING:
    from legible_envs.overcooked.game.view import GameView
    from legible_envs.overcooked.human_play import Played
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Episode", "RecordReaches", "RecordRollouts", "trajectories_from_played"]


@dataclass(eq=False)
class Episode:
    """One episode: ``T`` steps between ``T + 1`` states.

    Attributes:
        observations: ``T + 1``.
        actions: ``T``.
        rewards: ``T``.
        terminations: ``T``.
        truncations: ``T``.
        views: ``T + 1``, what could be seen of the game.
        valid_goals: ``T + 1``, the goals of the running game.
        seed: What ``reset`` was given.
    """

    observations: list[Any] = field(default_factory=list)
    actions: list[int] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    terminations: list[bool] = field(default_factory=list)
    truncations: list[bool] = field(default_factory=list)
    views: list[GameView] = field(default_factory=list)
    valid_goals: list[Sequence[str]] = field(default_factory=list)
    seed: int | None = None

    def __len__(self) -> int:
        return len(self.actions)

    def trajectories(self, *, candidate_set: Literal["game", "all"] = "game", **labels: Any) -> list[Trajectory]:
        """The walks to dispensers; see :func:`legible_envs.overcooked.trajectories.trajectories_from_views` for labels.

        Args:
            candidate_set: Whether the candidates are the goals valid in the running game or all in reach.
            labels: Such as ``participant``, ``condition``, ``min_positions``.
        """
        goals = self.valid_goals if candidate_set == "game" else None
        return trajectories_from_views(self.views, valid_goals=goals, **labels)


class RecordRollouts(gym.Wrapper, gym.utils.RecordConstructorArgs):  # type: ignore[type-arg]
    """Keeps every episode of ``LegibleOvercooked-v0``, whoever acts: a policy, a learner, ``gymnasium.utils.play``.

    Args:
        env: The environment, wrapped or not.

    Attributes:
        episodes: :class:`Episode` for each reset, the running one last; those without a step are left out.

    Raises:
        LayoutError: The environment shows no kitchen.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        gym.utils.RecordConstructorArgs.__init__(self)
        super().__init__(env)
        game = env.unwrapped
        if not hasattr(game, "view") or not hasattr(game, "valid_goal_names"):
            raise LayoutError(f"expected a LegibleOvercooked environment, got {type(game).__name__}", rule="type")
        self._game: Any = game
        self._all: list[Episode] = []

    @property
    def episodes(self) -> list[Episode]:
        """Episodes with at least one step."""
        return [episode for episode in self._all if len(episode)]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset, and begin an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._all.append(Episode(seed=seed))
        self._keep(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and keep it."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        episode = self._all[-1]
        episode.actions.append(int(action))
        episode.rewards.append(float(reward))
        episode.terminations.append(bool(terminated))
        episode.truncations.append(bool(truncated))
        self._keep(observation)
        return observation, reward, terminated, truncated, info

    def trajectories(self, *, candidate_set: Literal["game", "all"] = "game", **labels: Any) -> list[Trajectory]:
        """The walks of all episodes; see :meth:`Episode.trajectories`."""
        return [
            walk for episode in self.episodes for walk in episode.trajectories(candidate_set=candidate_set, **labels)
        ]

    def _keep(self, observation: Any) -> None:
        episode = self._all[-1]
        episode.observations.append(np.array(observation, copy=True))
        episode.views.append(self._game.view())
        episode.valid_goals.append(self._game.valid_goal_names())


def trajectories_from_played(
    played: Played, *, candidate_set: Literal["game", "all"] = "game", **labels: Any
) -> list[Trajectory]:
    """The walks in what ``legible play --record`` wrote, by playing its actions again.

    Args:
        played: As of :func:`legible_envs.overcooked.human_play.load_played`.
        candidate_set: Whether the candidates are the goals valid in the running game or all in reach.
        labels: Such as ``participant``, ``condition``, ``seconds_per_tick``.

    Raises:
        ValueError: The actions do not give the recorded rewards, so that this is another game.
    """
    env = RecordRollouts(played.make_env())
    try:
        current = None
        for number, (action, episode) in enumerate(zip(played.actions, played.episodes, strict=True)):
            if episode != current:
                env.reset(seed=played.seed if current is None else None)
                current = episode
            _, reward, *_ = env.step(int(action))
            if not np.isclose(float(reward), played.rewards[number]):
                raise ValueError(
                    f"step {number} was recorded with reward {played.rewards[number]:g} and gives {float(reward):g} "
                    "now; the recording belongs to another version of the game"
                )
        return env.trajectories(candidate_set=candidate_set, **labels)
    finally:
        env.close()


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
