"""The games that a learner plays: vectors of environments, and what one player sees and does in them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv

from benchmarks.experiments.learning.settings import Environment
from legible_envs.support.models import Choice, FileModel, Length, Whole

__all__ = ["PlayerSpace", "Transition", "final_observations", "make_envs", "observation_scale"]

_OURS = ("LegibleOvercooked-v0", "LegibleTabletop-v0")

Size = Annotated[int, Whole(1, 1_000_000)]


class PlayerSpace(FileModel):
    """What one player sees and does; a network is made for it, and fits no other.

    Attributes:
        shape: Of an observation: ``(size,)``, or ``(rows, columns, channels)`` of a grid.
        dtype: Of an observation.
        actions: One of several, or numbers.
        size: How many actions there are, or numbers of one.
        players: Players of a game, all of whom the one network plays.
    """

    shape: Annotated[list[Size], Length(1, 3)]
    dtype: Annotated[str, Choice("uint8", "float32", "float64", "int64", "int32")]
    actions: Annotated[Literal["discrete", "continuous"], Choice("discrete", "continuous")]
    size: Size
    players: Annotated[int, Whole(1, 64)] = 1

    @classmethod
    def of(cls, envs: VectorEnv[Any, Any, Any]) -> PlayerSpace:
        """What one player sees and does in these games.

        A game for several has the action space ``MultiDiscrete([n] * players)``, and observations with an axis of
        players in front.

        Raises:
            ValueError: Spaces that no network here is made for; says which are.
        """
        seen, done = envs.single_observation_space, envs.single_action_space
        if not isinstance(seen, spaces.Box):
            raise ValueError(f"expected observations in a Box, got {seen}")
        shape, players = [int(n) for n in seen.shape], 1
        if isinstance(done, spaces.Discrete):
            actions, size = "discrete", int(done.n)
        elif isinstance(done, spaces.Box) and len(done.shape) == 1:
            if (done.low != -1).any() or (done.high != 1).any():
                raise ValueError(
                    f"expected numbers from -1 to 1 as actions, got {done}; gymnasium's RescaleAction helps"
                )
            actions, size = "continuous", int(done.shape[0])
        elif isinstance(done, spaces.MultiDiscrete) and len(done.nvec) == shape[0] and len({*done.nvec.tolist()}) == 1:
            actions, size, players, shape = "discrete", int(done.nvec[0]), len(done.nvec), shape[1:]
        else:
            raise ValueError(
                "expected actions of Discrete(n), of a Box of one dimension, or of MultiDiscrete([n] * players) "
                f"with as many observations, got {done} and observations of shape {tuple(shape)}"
            )
        if len(shape) not in (1, 3):
            raise ValueError(f"expected observations of shape (size,) or (rows, columns, channels), got {tuple(shape)}")
        return cls.model_validate(
            {"shape": shape, "dtype": str(seen.dtype), "actions": actions, "size": size, "players": players}
        )

    def __str__(self) -> str:
        """In words."""
        does = f"{self.size} actions" if self.actions == "discrete" else f"actions of {self.size} numbers"
        team = "" if self.players == 1 else f" for each of {self.players} players"
        return f"observations of shape {tuple(self.shape)} ({self.dtype}) and {does}{team}"

    @property
    def is_grid(self) -> bool:
        """Whether an observation is a grid of cells."""
        return len(self.shape) == 3


class Transition(NamedTuple):
    """What one step of all games gave; ``N`` games.

    Attributes:
        obs: ``(N, ...)`` observations, of the next episode where one has ended.
        rewards: ``(N,)``.
        terminated: ``(N,)`` bool: over.
        truncated: ``(N,)`` bool: cut off.
        infos: Infos, of the next episode where one has ended.
    """

    obs: npt.NDArray[Any]
    rewards: npt.NDArray[np.float64]
    terminated: npt.NDArray[np.bool_]
    truncated: npt.NDArray[np.bool_]
    infos: dict[str, Any]


def make_envs(environment: Environment, num_envs: int) -> VectorEnv[Any, Any, Any]:
    """Games that begin anew in the step in which they end (``SAME_STEP``).

    Args:
        environment: Which.
        num_envs: How many.

    Raises:
        gymnasium.error.Error: No such environment.
        ValueError: Bad arguments of it.
    """
    import legible_envs  # noqa: F401  registers the environments

    arguments = dict(environment.arguments)
    if environment.id in _OURS:
        return gym.make_vec(environment.id, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **arguments)
    how = {"autoreset_mode": AutoresetMode.SAME_STEP}
    return gym.make_vec(environment.id, num_envs=num_envs, vectorization_mode="sync", vector_kwargs=how, **arguments)


def final_observations(infos: dict[str, Any], which: npt.NDArray[np.intp]) -> npt.NDArray[Any]:
    """``(k, ...)`` the last observations of the episodes of ``k`` games that have just ended."""
    return np.stack([infos["final_obs"][i] for i in which])


def observation_scale(envs: VectorEnv[Any, Any, Any], space: PlayerSpace) -> npt.NDArray[np.float32]:
    """What observations are multiplied with: whole numbers, such as counts in grids, come to [0, 1].

    Returns:
        An array of the observations' shape; ones where they are no whole numbers.
    """
    seen = envs.single_observation_space
    assert isinstance(seen, spaces.Box)
    high = seen.high if space.players == 1 else seen.high[0]
    if np.dtype(space.dtype).kind not in "ui" or not math.isfinite(float(np.max(high))):
        return np.ones(tuple(space.shape), dtype=np.float32)
    return (1.0 / np.maximum(high, 1)).astype(np.float32)
