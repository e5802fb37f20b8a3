"""The batched kitchen as a vector environment of Stable-Baselines3; imported by :func:`.as_sb3` alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv

from legible_envs.overcooked.layout_batches import layout_entries
from legible_envs.overcooked.vector_env import OvercookedVectorEnv

__all__ = ["StableBaselinesVecEnv"]

Rows = list[dict[str, Any]]
Indices = int | Sequence[int] | None


class StableBaselinesVecEnv(VecEnv):
    """Behaves as Stable-Baselines3's ``DummyVecEnv`` over single kitchens; see :func:`.as_sb3`.

    Args:
        envs: The batched kitchen, in any autoreset mode.
    """

    def __init__(self, envs: OvercookedVectorEnv) -> None:
        self.envs = envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self._actions: npt.NDArray[Any] = np.empty(0, dtype=np.int64)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the seeds of the next reset: ``seed + i`` in game ``i``; None draws new ones from no global state."""
        if seed is None:
            seed = int(np.random.default_rng().integers(2**32))
        return super().seed(seed)

    def reset(self) -> npt.NDArray[Any]:
        """Start all episodes with the seeds of :meth:`seed` and the options of ``set_options``, which count once.

        Options are those of :meth:`.OvercookedEnv.reset`, one dictionary for all games or a list of one for each.

        Returns:
            ``(N, …)`` observations.
        """
        shape = self.envs.settings.shape
        for index, options in enumerate(self._options):
            unknown = sorted(str(key) for key in options if key != "layout")
            if unknown:
                raise ValueError(f"unknown reset options {unknown}; known: ['layout']")
            if "layout" in options:
                layouts = layout_entries(options["layout"], shape)
                if layouts is None:
                    self.envs.set_layout(index, options["layout"])
                elif layouts[index] is not None:
                    self.envs.set_layout(index, layouts[index])
        observations, infos = self.envs.reset(seed=self._seeds)
        self.reset_infos = _rows(infos)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keep ``(N,)`` actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[npt.NDArray[Any], npt.NDArray[np.float32], npt.NDArray[np.bool_], Rows]:
        """Advance all games by one tick; those that end start again at once.

        Returns:
            ``(observations, rewards, dones, infos)``. The info of a game that ended has its last observation as
            ``"terminal_observation"``; all have ``"TimeLimit.truncated"``: whether the limit of steps alone ended it.
        """
        observations, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        dones = terminated | truncated
        rows = _rows(infos)
        for row, cut_off in zip(rows, (truncated & ~terminated).tolist(), strict=True):
            row["TimeLimit.truncated"] = cut_off
        if dones.any():
            ended = np.flatnonzero(dones).tolist()
            if self.envs.autoreset_mode == AutoresetMode.SAME_STEP:
                last, begun, final = infos["final_obs"], rows, _rows(infos["final_info"])
                rows = [{**final[i], **_told(rows[i])} if dones[i] else row for i, row in enumerate(rows)]
            else:
                last = observations
                observations, infos = self.envs.reset(options={"reset_mask": dones.copy()})
                begun = _rows(infos)
            for i in ended:
                rows[i]["terminal_observation"] = last[i]
                self.reset_infos[i] = {key: value for key, value in begun[i].items() if key != "TimeLimit.truncated"}
        return observations, rewards.astype(np.float32), dones, rows

    def close(self) -> None:
        """Close the window, if there is one."""
        self.envs.close()

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """One picture per game; None where ``render_mode`` is not ``"rgb_array"``."""
        return [self.envs.game(i).render() for i in range(self.num_envs)]

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of the games; see :meth:`.OvercookedVectorEnv.call` for what there is."""
        return [getattr(self.envs.game(i), attr_name) for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Set the kitchen of some games' next resets; ``"layout"`` is all that can be set."""
        if attr_name != "layout":
            raise AttributeError(f"only the attribute 'layout' can be set in the games of a batch, not {attr_name!r}")
        for i in self._get_indices(indices):
            self.envs.set_layout(i, value)

    def env_method(self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any) -> list[Any]:
        """Call a method of the games, such as ``action_masks``."""
        if method_name == "action_masks" and indices is None:
            return list(self.envs.action_masks())
        return [getattr(self.envs.game(i), method_name)(*args, **kwargs) for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """No game is wrapped."""
        return [False for _ in self._get_indices(indices)]


def _rows(infos: dict[str, Any]) -> Rows:
    """The info of each game out of the arrays of all."""
    told = [key for key in infos if not key.startswith("_") and not key.startswith("final_")]
    columns = [infos[key].tolist() if infos[key].ndim == 1 else infos[key] for key in told]
    return [dict(zip(told, row, strict=True)) for row in zip(*columns, strict=True)]


def _told(row: dict[str, Any]) -> dict[str, Any]:
    return {"TimeLimit.truncated": row["TimeLimit.truncated"]}
