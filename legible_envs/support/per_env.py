"""Arguments of vectors of environments: one value for all or one for each, seeds, masks, modes; checked alike."""

from __future__ import annotations

import math
import multiprocessing
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from types import FrameType
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from legible_envs.support.validation import choice, entries, integer, is_integer, is_masked, shown

__all__ = [
    "check_count",
    "own_entry",
    "place_in_vector",
    "read_autoreset_mode",
    "read_reset_mask",
    "read_seeds",
    "read_step_limit",
]


def place_in_vector(env: gym.Env[Any, Any]) -> tuple[int, int | None] | None:
    """The number of an environment in the Gymnasium vector that is calling it, and the size of that vector.

    Gymnasium hands every environment of a vector the same options and tells none which one it is. But a
    ``SyncVectorEnv`` is among the callers of its environments, and an ``AsyncVectorEnv`` numbers the processes it runs
    them in (``Worker<AsyncVectorEnv>-3``). Looking there costs some microseconds: do so only where it matters.

    Args:
        env: The environment itself, not wrapped.

    Returns:
        ``(number, size)``, the size None where nobody tells it; or None if no vector is calling.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        caller = frame.f_locals.get("self")
        if isinstance(caller, SyncVectorEnv):
            for number, member in enumerate(caller.envs):
                if member.unwrapped is env:
                    return number, caller.num_envs
        frame = frame.f_back
    worker = re.fullmatch(r"Worker<\w+>-(\d+)", multiprocessing.current_process().name)
    return (int(worker[1]), None) if worker else None


def own_entry(
    name: str, values: Sequence[Any], env: gym.Env[Any, Any], error: Callable[[str], Exception] = ValueError
) -> Any:
    """The value for one environment of a vector, out of those for all of them.

    In an ``AsyncVectorEnv`` nobody tells an environment how many there are: values that are too many pass.

    Args:
        name: Of the argument, for messages.
        values: One for each environment of the vector.
        env: The environment itself, not wrapped.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: another number of values, or an environment in no vector of Gymnasium's.
    """
    place = place_in_vector(env)
    if place is None:
        raise error(
            f"`{name}` holds {len(values)} values, one per environment of a vector, but this environment is in none "
            f"that Gymnasium has made: give it one value, or give each its own by `set_attr({name!r}, [...])`"
        )
    number, size = place
    if number >= len(values) or (size is not None and size != len(values)):
        check_count(name, values, number + 1 if size is None else size, error)
    return values[number]


def check_count(
    name: str, values: Sequence[Any], num_envs: int, error: Callable[[str], Exception] = ValueError
) -> None:
    """Check that there is one value for each environment.

    Raises:
        ValueError: Or what ``error`` makes.
    """
    if len(values) != num_envs:
        raise error(f"`{name}` must hold {num_envs} values, one per environment, got {len(values)}")


def read_seeds(seed: object, num_envs: int) -> list[int | None]:
    """A seed for each environment, as Gymnasium's vectors deal them out.

    Args:
        seed: None, an integer (environment ``i`` gets ``seed + i``), or one of these for each environment.
        num_envs: Number of environments.

    Raises:
        ValueError: Anything else.
    """
    if seed is None:
        return [None] * num_envs
    if is_integer(seed):
        first = integer("seed", seed, 0, math.inf)
        return [first + i for i in range(num_envs)]
    seeds = [] if is_masked(seed) else entries(seed)
    if len(seeds) != num_envs:
        raise ValueError(
            f"`seed` must be None, an integer >= 0, or one of these for each of {num_envs} environments, "
            f"got {shown(seed)}"
        )
    return [None if each is None else integer("seed", each, 0, math.inf, also="None") for each in seeds]


def read_reset_mask(options: Mapping[str, Any], num_envs: int) -> npt.NDArray[np.bool_]:
    """``(N,)`` which environments a reset is for: a copy of ``options["reset_mask"]``, all where there is none.

    Raises:
        ValueError: Not a bool array of this length, or it marks nothing.
    """
    if "reset_mask" not in options:
        return np.ones(num_envs, dtype=np.bool_)
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise ValueError(f"`reset_mask` must be a bool array of shape ({num_envs},), got {shown(mask)}")
    if not mask.any():
        raise ValueError("`reset_mask` must mark at least one environment")
    return np.array(mask)


def read_autoreset_mode(mode: object) -> AutoresetMode:
    """An autoreset mode from itself or its value.

    Raises:
        ValueError: Neither.
    """
    asked = getattr(mode, "value", mode)
    return AutoresetMode(choice("autoreset_mode", asked, [known.value for known in AutoresetMode]))


def read_step_limit(max_episode_steps: object) -> int | None:
    """Steps after which an episode is truncated; None where it never is.

    Args:
        max_episode_steps: An integer >= 1; None or -1 for no limit.

    Raises:
        ValueError: Anything else.
    """
    if max_episode_steps is None or (is_integer(max_episode_steps) and max_episode_steps == -1):
        return None
    return integer("max_episode_steps", max_episode_steps, 1, whole_floats=True, also="None or -1 for no limit,")
