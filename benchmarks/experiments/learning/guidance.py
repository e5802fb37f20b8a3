"""What cooks are told while they begin to learn: whether a step brought them nearer to a valid goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv

from benchmarks.experiments.learning.environments import PlayerSpace, final_observations
from legible_envs.overcooked.game.observations import CONTENTS, PLAYER, SOUP_CHANNEL
from legible_envs.overcooked.grid_kernels import steps_from
from legible_envs.overcooked.layout import FLOOR, OBSTACLE, STATION_CODES, OvercookedLayout

__all__ = ["Guide", "moves_between"]

_HANDS_EMPTY = 6
"""Of a vector observation."""

Floats = npt.NDArray[np.float64]


class Guide:
    """Tells of every step of a cook whether it led nearer to a valid goal: 1, farther: -1, or neither: 0.

    A cook is as many moves away as from the nearest of their valid goals (``info["goal_mask"]``), ``H + W`` more if
    their hands are empty, and twice as many more if they hold what is of no use now and must be put away. A step that
    is rewarded, as one that puts an ingredient in a pot is with ``shaping``, has led nearer. Nothing is looked up in
    the game: the goals are in infos, the cook's cell and hands in observations.

    It is no reward. A reward of this kind (a potential, Ng, Harada and Russell 1999) is soon expected by the critic,
    and then guides no more where no other reward was found yet. It is added to advantages, see :func:`.collect`, with
    a weight that falls to 0, after which nothing but rewards counts.

    Args:
        envs: Batched kitchens.
        space: What a cook sees.

    Raises:
        ValueError: Other games than batched kitchens, or observations that are pictures.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any], space: PlayerSpace) -> None:
        from legible_envs.overcooked.vector_env import OvercookedVectorEnv

        if not isinstance(envs, OvercookedVectorEnv) or envs.settings.obs_type == "rgb":
            raise ValueError("`ppo.guide` is for kitchens seen as grids or vectors; expected 0 for others")
        self.envs, self.space = envs, space
        self.height, self.width = envs.shape
        cells = self.height * self.width
        self._moves = np.zeros((envs.num_envs, cells, cells), dtype=np.int16)
        self._takers = np.zeros((envs.num_envs, cells), dtype=np.bool_)
        self._ids = np.full(envs.num_envs, -1, dtype=np.int64)
        self._before: Floats = np.zeros(0)

    def begin(self, obs: npt.NDArray[Any], infos: Mapping[str, Any]) -> None:
        """Games have started."""
        self._enter(infos["layout_id"])
        self._before = self._away(obs, infos["goal_mask"], np.arange(len(self._ids)))

    def nearer(self, obs: npt.NDArray[Any], rewards: npt.NDArray[Any], infos: Mapping[str, Any]) -> Floats:
        """``(N, players)`` 1, -1 or 0 for a step; arguments are what the step returned."""
        everyone = np.arange(len(self._ids))
        ended = np.flatnonzero(infos["_final_obs"]) if "_final_obs" in infos else np.empty(0, dtype=np.intp)
        reached = None
        if len(ended):  # in the kitchen that they ended in, which the next episode may change
            last = final_observations(dict(infos), ended)
            reached = self._away(last, infos["final_info"]["goal_mask"][ended], ended)
            self._enter(infos["layout_id"])
        after = self._away(obs, infos["goal_mask"], everyone)
        gained = self._before - after
        if reached is not None:
            gained[ended] = self._before[ended] - reached
        self._before = after
        return np.where(rewards[:, None] > 0, 1.0, np.sign(gained))

    def _enter(self, layout_ids: npt.NDArray[np.int64]) -> None:
        """Work out the moves of kitchens that are new."""
        for i in np.flatnonzero(layout_ids != self._ids):
            self._ids[i] = layout_ids[i]
            same = np.flatnonzero(self._ids[:i] == layout_ids[i])
            if len(same):
                self._moves[i], self._takers[i] = self._moves[same[0]], self._takers[same[0]]
                continue
            layout = self.envs.layout(int(i))
            self._moves[i] = moves_between(layout, soft=self.envs.settings.rules.soft_obstacles)
            self._takers[i] = np.isin(layout.cells.ravel(), [STATION_CODES["pot"], STATION_CODES["serving"]])

    def _away(self, obs: npt.NDArray[Any], goals: npt.NDArray[Any], which: npt.NDArray[np.intp]) -> Floats:
        """``(k, players)`` how far cooks of ``k`` games are from what they need; 0 when a game is over."""
        players, cells = self.space.players, self.height * self.width
        rows = obs.reshape(-1, *self.space.shape)
        own, empty = (found.reshape(len(which), players) for found in self._cells_and_hands(rows))
        marked = np.asarray(goals, dtype=np.bool_).reshape(len(which), players, cells)
        away = self._moves[which[:, None], own]  # (k, players, cells)
        nearest = np.where(marked, away, cells).min(axis=2)
        # What is held is of use where a pot or the serving station takes it, and these take nothing else.
        useful = (marked & self._takers[which, None]).any(axis=2)
        behind = np.where(useful, 0, np.where(empty, 1, 2)) * (self.height + self.width)
        return np.where(marked.any(axis=2), nearest + behind, 0).astype(np.float64)

    def _cells_and_hands(self, rows: npt.NDArray[Any]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
        """``(B,)`` the cells that cooks stand in, and whether their hands are empty."""
        if self.space.is_grid:
            cells = rows.reshape(len(rows), -1, rows.shape[-1])
            own = cells[..., PLAYER].argmax(axis=1)
            held = cells[np.arange(len(rows)), own, CONTENTS : SOUP_CHANNEL + 1]
            return np.asarray(own), np.asarray(~held.any(axis=1))
        row, column = np.rint(rows[:, 0] * (self.height - 1)), np.rint(rows[:, 1] * (self.width - 1))
        return (row * self.width + column).astype(np.intp), rows[:, _HANDS_EMPTY] > 0.5


def moves_between(layout: OvercookedLayout, *, soft: bool = False) -> npt.NDArray[np.int16]:
    """Fewest moves from every cell to a place beside every other.

    Args:
        layout: The kitchen.
        soft: Whether virtual obstacles can be crossed.

    Returns:
        ``(H*W, H*W)``, from the row's cell to beside the column's; ``H*W`` where no path leads.
    """
    height, width = layout.shape
    codes = layout.cells.ravel()
    floor = (codes == FLOOR) | (soft & (codes == OBSTACLE))
    steps = np.empty(height * width, dtype=np.int32)
    found = np.empty((height * width, height * width), dtype=np.int16)
    for cell in range(height * width):
        steps_from(np.array([cell]), floor, height, width, steps)
        found[:, cell] = np.where(steps < 0, height * width, np.maximum(steps - 1, 0))
    return found
