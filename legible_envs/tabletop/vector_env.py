"""Several tables in one: single environments one after another, with arguments that are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit

from legible_envs.errors import LayoutError
from legible_envs.support.per_env import check_count, read_autoreset_mode, read_reset_mask, read_seeds, read_step_limit
from legible_envs.support.specs import JsonSpec, check_options
from legible_envs.support.validation import as_array, integer, shown
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.settings import layout_entries

__all__ = ["TabletopVectorEnv"]

Infos = dict[str, Any]

MOST_TABLES: Final = 4_096
"""Environments of one vector environment."""


class TabletopVectorEnv(JsonSpec, SyncVectorEnv):
    """``num_envs`` environments :class:`~legible_envs.tabletop.env.TabletopEnv`, one after another in one process.

    Made by ``gymnasium.make_vec("LegibleTabletop-v0", num_envs=N)``. It is Gymnasium's ``SyncVectorEnv`` with arguments
    that are checked: nothing has changed where one is refused. ``envs.reset(options={"layout": ...})`` takes one layout
    for all environments or one for each, see "Vectors" there; names of goals are in ``envs.call("goals")``.

    Args:
        num_envs: Number of environments.
        max_episode_steps: Steps after which an episode is truncated; None or -1: never.
        autoreset_mode: ``gymnasium.vector.AutoresetMode`` or its value. Given directly: Gymnasium's ``vector_kwargs``
            are for ``vectorization_mode="sync"`` and ``"async"`` alone.
        **kwargs: As for :class:`~legible_envs.tabletop.env.TabletopEnv`.

    Raises:
        ValueError: See :class:`~legible_envs.tabletop.env.TabletopEnv`, and numbers out of range.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = 1800,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **kwargs: Any,
    ) -> None:
        count = integer("num_envs", num_envs, 1, MOST_TABLES, whole_floats=True)
        self.max_episode_steps = read_step_limit(max_episode_steps)
        mode = read_autoreset_mode(autoreset_mode)
        super().__init__([partial(_make, self.max_episode_steps, kwargs)] * count, autoreset_mode=mode)
        self._begun = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], Infos]:
        """Start all episodes, or those of a mask.

        Args:
            seed: None, a number (environment ``i`` gets ``seed + i``), or one per environment.
            options: As for :meth:`.TabletopEnv.reset`; ``"layout"`` may be a list or array with one for each
                environment (None: the one it has); and ``{"reset_mask": (N,) bool}`` resets only some.

        Returns:
            ``(observations, infos)``.

        Raises:
            LayoutError: A bad layout, or another number of layouts than of environments; nothing is changed.
            ValueError: Options that are no mapping, unknown keys, or seeds or a mask that are not as above; likewise.
        """
        asked = dict(check_options(options, ("layout", "start", "goal", "reset_mask")))
        seeds = read_seeds(seed, self.num_envs)
        if "reset_mask" in asked:
            asked["reset_mask"] = read_reset_mask(asked, self.num_envs)
        if "layout" in asked:
            asked["layout"] = self._read_layouts(asked["layout"])
        self._begun = True
        return super().reset(seed=seeds, options=asked)

    def step(self, actions: npt.ArrayLike) -> Any:
        """Advance all environments by one step.

        Args:
            actions: ``(N, 2)`` finite numbers.

        Returns:
            ``(observations, rewards, terminations, truncations, infos)``, the middle three of shape ``(N,)``.

        Raises:
            ResetNeeded: Before the first reset; or, without autoreset, while a finished episode is not reset.
            ValueError: Actions of another shape, or not finite.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call envs.step() before calling envs.reset()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._autoreset_envs.any():
            over = np.flatnonzero(self._autoreset_envs).tolist()
            raise ResetNeeded(
                f"environments {over} are over and autoreset is disabled: reset them with "
                "envs.reset(options={'reset_mask': mask})"
            )
        return super().step(self._read_actions(actions))

    def _read_actions(self, actions: npt.ArrayLike) -> npt.NDArray[Any]:
        hands, shape = as_array(actions), (self.num_envs, 2)
        if hands.shape != shape or hands.dtype.kind not in "biuf" or not np.isfinite(hands).all():
            raise ValueError(f"expected actions of shape {shape}, finite numbers, got {shown(actions)}")
        return hands

    def _read_layouts(self, value: Any) -> Any:
        """The layouts read once, before any environment is reset."""
        settings = self.envs[0].unwrapped.settings  # type: ignore[attr-defined]
        layouts = layout_entries(value)
        if layouts is None:
            return None if value is None else settings.read(value)
        check_count("layout", layouts, self.num_envs, partial(LayoutError, rule="count"))
        return [None if layout is None else settings.read(layout) for layout in layouts]


def _make(max_episode_steps: int | None, arguments: Mapping[str, Any]) -> gym.Env[Any, Any]:
    """One table as ``gymnasium.make`` wraps it."""
    env = TabletopEnv(**arguments)
    return env if max_episode_steps is None else TimeLimit(env, max_episode_steps)
