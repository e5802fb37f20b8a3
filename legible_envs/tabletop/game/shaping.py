"""Potential-based reward shaping: how far a table in play is from done, told at every step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.tabletop.game.game import TableGame
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.objects import Point

__all__ = ["SHAPING", "Shaping"]

Floats = npt.NDArray[np.float64]

SHAPING: Final[Mapping[str, float]] = {"distance": 2.0, "taking": 1.0, "placing": 2.0, "discount": 1.0}
"""Weights of ``shaping=True``: per metre of the way ahead, for an object in the hand, for a subtask done; and gamma."""


class Shaping:
    """The shaping reward ``discount * potential(after) - potential(before)`` of every step.

    Rewards of this form leave the optimal policies as they are if ``discount`` is the learner's own (Ng, Harada and
    Russell, *Policy Invariance under Reward Transformations*, ICML 1999). The potential of a finished task is 0, which
    episodes of finite length need (Grzes, *Reward Shaping in Episodic Reinforcement Learning*, AAMAS 2017). With
    ``discount=1`` the return of every finished episode is shifted by the same constant, and a hand at rest earns
    nothing; below 1 it earns ``(discount - 1) * potential`` a step, which is positive, so a discount below the
    learner's own makes waiting worthwhile.

    Args:
        game: The table in play.
        weights: A number for each key of :data:`SHAPING`.
    """

    def __init__(self, game: TableGame, weights: Mapping[str, float]) -> None:
        self._game = game
        self._weights = dict(weights)
        self._paths: tuple[bytes, ShortestPaths] | None = None
        self.begin()

    def begin(self) -> None:
        """An episode begins."""
        self._layout_paths = self._game.layout.paths
        self._paths = None
        self._before = self.potential()

    def reward(self) -> float:
        """The shaping reward of the step that has just been made."""
        after = self.potential()
        reward = self._weights["discount"] * after - self._before
        self._before = after
        return reward

    def potential(self) -> float:
        """``- placing * subtasks left - distance * metres ahead + taking * (an object is carried)``; 0 when done."""
        progress, weights = self._game.progress, self._weights
        if progress.is_over:
            return 0.0
        left = progress.task.graph.states.length - progress.num_done
        carried = self._game.holding >= 0
        return weights["taking"] * carried - weights["placing"] * left - weights["distance"] * self.way_ahead()

    def way_ahead(self) -> float:
        """Metres of the hand's shortest path to where it should go next; 0 if nowhere.

        That is the place of the object it holds, else the nearest object that is valid now (the goal that was set,
        where there is one). Hard obstacles are walked round; what they shut off entirely counts by its straight line.
        """
        game, delivery = self._game, self._game.delivery
        if delivery is not None and delivery.kind != "goal":
            return self._length(self._place(delivery.at))
        rows = [game.index[name] for name in game.goals if game.goal in (None, name)]
        return float(self._to_objects()[rows].min()) if rows else 0.0

    def _place(self, at: Point | None) -> Point:
        """Where a held object belongs; anywhere in the assembly zone is its nearest point."""
        if at is not None:
            return at
        (x, y), (x0, y0, x1, y1) = self._game.hand, self._game.layout.table.assembly
        return min(max(x, x0), x1), min(max(y, y0), y1)

    def _length(self, at: Point) -> float:
        straight = math.dist(self._game.hand, at)
        if not self._is_hindered:
            return straight
        return float(self._lengths(self._paths_to(np.array([at])))[0])

    def _to_objects(self) -> Floats:
        """``(n,)`` metres from the hand to each object, where it lies now."""
        positions = self._game.positions
        if not self._is_hindered:
            return np.hypot(*(positions - self._game.hand).T)
        layout = self._game.layout
        is_moved = not np.array_equal(positions, layout.centres)
        return self._lengths(self._paths_to(positions) if is_moved else self._layout_paths)

    @property
    def _is_hindered(self) -> bool:
        return self._game.rules.virtual_obstacles == "hard" and len(self._layout_paths.boxes) > 0

    def _paths_to(self, points: Floats) -> ShortestPaths:
        """Shortest paths to points, which are the same for many steps: objects move seldom, places never."""
        key = points.tobytes()
        if self._paths is None or self._paths[0] != key:
            # An object pushed into a grown obstacle is touched from beside it.
            free = self._layout_paths.nearest_free(points)
            self._paths = key, ShortestPaths.of(self._game.layout, np.where(np.isfinite(free), free, points))
        return self._paths[1]

    def _lengths(self, paths: ShortestPaths) -> Floats:
        hand = np.array([self._game.hand])
        lengths = paths.lengths(self._layout_paths.nearest_free(hand))[0]
        return np.where(np.isfinite(lengths), lengths, np.hypot(*(paths.goals - hand).T))
