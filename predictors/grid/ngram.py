"""What people who took the same last few steps were after: a baseline in the way of language models."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts import Trajectory
from predictors.grid.prefixes import PrefixPredictor, Steps

__all__ = ["GridNGram"]


class GridNGram(PrefixPredictor):
    """Shares of goals among walks with the same last ``n`` steps, smoothed by those with fewer steps the same.

    The start station comes before the first cell. The shares after ``m`` common steps are those of the walks counted,
    plus ``strength`` walks distributed as after ``m - 1``; after none, the prior (Dirichlet smoothing; MacKay and Peto,
    *A hierarchical Dirichlet language model*, 1995).

    Args:
        n: Steps of the longest context.
        strength: Weight of the shorter context, in walks.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    def __init__(self, n: int = 4, strength: float = 2.0) -> None:
        self.n = n
        self.strength = strength

    def _check_parameters(self) -> None:
        if isinstance(self.n, bool) or not isinstance(self.n, int) or self.n < 1:
            raise ValueError(f"`n` must be an integer >= 1, got {self.n!r}")
        if not isinstance(self.strength, int | float) or not 0 < self.strength < np.inf:
            raise ValueError(f"`strength` must be a finite number above 0, got {self.strength!r}")

    def _contexts(self, walk: Trajectory, cells: Steps) -> Iterator[tuple[object, ...]]:
        """The last 1, 2, … n steps."""
        steps = (walk.start, *cells)
        place = self._places.get(walk.layout, -1)
        for count in range(1, min(self.n, len(steps)) + 1):
            yield (place, *steps[-count:])

    def _learn(self, walks: Sequence[Trajectory]) -> None:
        column = {name: number for number, name in enumerate(self.classes_.tolist())}
        self._counts: dict[tuple[object, ...], npt.NDArray[np.float64]] = {}
        layouts = dict.fromkeys(walk.layout for walk in walks)
        self._places = {layout: number for number, layout in enumerate(layouts)}
        for walk in walks:
            cells: Steps = tuple(map(tuple, walk.states[:-1].tolist()))
            for end in range(1, len(cells) + 1):
                for context in self._contexts(walk, cells[:end]):
                    counts = self._counts.setdefault(context, np.zeros(len(column)))
                    counts[column[walk.goal or ""]] += 1.0
        self._fallback = self._prior.of(self.classes_.tolist())

    def _read(self, walk: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        shares = self._fallback
        for context in self._contexts(walk, cells):
            counts = self._counts.get(context)
            if counts is None:  # longer ones were not seen either
                break
            shares = (counts + self.strength * shares) / (counts.sum() + self.strength)
        return shares
