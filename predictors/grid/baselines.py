"""Baselines for kitchens without a model of motion: nearest neighbours, n-grams and logistic regression of prefixes.

Each learns from all prefixes of complete trajectories, and gives the prior where it has learned nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import integer, real
from predictors.grid.nearest_kernels import votes_of_nearest
from predictors.grid.prefixes import PrefixEncoder, PrefixPredictor, Steps, distinct_prefixes

__all__ = ["GridLogistic", "GridNGram", "GridNeighbours"]


class GridNeighbours(PrefixPredictor):
    """Shares of goals among the ``k`` nearest prefixes.

    Prefixes are compared by the Euclidean distance of the features of
    :class:`~predictors.grid.prefixes.PrefixEncoder`. All prefixes as near as the ``k``-th count, so the answer does not
    depend on the order of the trajectories; the prior counts as one more neighbour.

    Args:
        k: Number of neighbours; all prefixes of one trajectory together count as one.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    def __init__(self, k: int = 15) -> None:
        self.k = k

    def _check_parameters(self) -> None:
        integer("k", self.k, 1)

    def _learn(self, trajectories: Sequence[Trajectory]) -> None:
        self._encoder = PrefixEncoder(trajectories, self.classes_)
        features, weights = distinct_prefixes(trajectories, self._encoder, self.classes_)
        self._columns_first, self._weights = np.ascontiguousarray(features.T), weights
        self._squares = (features**2).sum(axis=1)
        self._sizes = weights.sum(axis=1)

    def _weigh(self, trajectory: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        query = self._encoder.encode(trajectory, cells)
        there = np.flatnonzero(query)  # a dozen of hundreds of features
        votes = votes_of_nearest(
            there, query[there], self._columns_first, self._squares, self._weights, self._sizes, float(self.k)
        )
        return votes + self._prior_weights


class GridNGram(PrefixPredictor):
    """Shares of goals among trajectories with the same last ``n`` steps, smoothed by those with fewer steps the same.

    The start station comes before the first cell. The shares after ``m`` common steps are those of the trajectories
    counted, plus ``strength`` trajectories distributed as after ``m - 1``; after none, the prior (Dirichlet smoothing;
    MacKay and Peto, *A hierarchical Dirichlet language model*, 1995).

    Args:
        n: Steps of the longest context.
        strength: Weight of the shorter context, in trajectories.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    def __init__(self, n: int = 4, strength: float = 2.0) -> None:
        self.n = n
        self.strength = strength

    def _check_parameters(self) -> None:
        integer("n", self.n, 1)
        real("strength", self.strength, 0, closed="neither")

    def _contexts(self, trajectory: Trajectory, cells: Steps) -> Iterator[tuple[object, ...]]:
        """The last 1, 2, … n steps."""
        steps = (trajectory.start, *cells)
        place = self._places.get(trajectory.layout, -1)
        for count in range(1, min(self.n, len(steps)) + 1):
            yield (place, *steps[-count:])

    def _learn(self, trajectories: Sequence[Trajectory]) -> None:
        column = {name: number for number, name in enumerate(self.classes_.tolist())}
        self._counts: dict[tuple[object, ...], npt.NDArray[np.float64]] = {}
        layouts = dict.fromkeys(trajectory.layout for trajectory in trajectories)
        self._places = {layout: number for number, layout in enumerate(layouts)}
        for trajectory in trajectories:
            cells: Steps = tuple(map(tuple, trajectory.states[:-1].tolist()))
            for end in range(1, len(cells) + 1):
                for context in self._contexts(trajectory, cells[:end]):
                    counts = self._counts.setdefault(context, np.zeros(len(column)))
                    counts[column[trajectory.goal or ""]] += 1.0

    def _weigh(self, trajectory: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        shares = self._prior_weights
        for context in self._contexts(trajectory, cells):
            counts = self._counts.get(context)
            if counts is None:  # then longer contexts were not seen either
                break
            shares = (counts + self.strength * shares) / (counts.sum() + self.strength)
        return shares


class GridLogistic(PrefixPredictor):
    """Logistic regression from a prefix to the goal.

    Features are those of :class:`~predictors.grid.prefixes.PrefixEncoder`; every prefix of every trajectory is an
    example, and those of one trajectory weigh 1 together. Probabilities are shrunk toward the prior as if each goal had
    been seen once more.

    Args:
        C: Inverse strength of the L2 penalty.
        max_iter: Most iterations.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        coef_: ``(K, width)`` weights; those of goals never chosen are zero.
        intercept_: ``(K,)``, ``-inf`` for goals never chosen.
    """

    coef_: npt.NDArray[np.float64]
    intercept_: npt.NDArray[np.float64]

    def __init__(self, C: float = 1.0, max_iter: int = 300) -> None:
        self.C = C
        self.max_iter = max_iter

    def _check_parameters(self) -> None:
        real("C", self.C, 0, closed="neither")
        integer("max_iter", self.max_iter, 1)

    def _learn(self, trajectories: Sequence[Trajectory]) -> None:
        from sklearn.linear_model import LogisticRegression

        self._encoder = PrefixEncoder(trajectories, self.classes_)
        features, weights = distinct_prefixes(trajectories, self._encoder, self.classes_)
        count = len(self.classes_)
        self.coef_ = np.zeros((count, self._encoder.width))
        self.intercept_ = np.full(count, -np.inf)
        rows, goals = np.nonzero(weights)
        seen = np.unique(goals)
        self._trust = len(trajectories) / (len(trajectories) + count)
        if len(seen) == 1:
            self.intercept_[seen] = 0.0
            return
        model = LogisticRegression(C=self.C, max_iter=int(self.max_iter))
        model.fit(features[rows], goals, sample_weight=weights[rows, goals])
        coef, intercept = model.coef_, model.intercept_
        if len(seen) == 2:  # scikit-learn keeps one row for two classes
            coef, intercept = np.vstack([-coef, coef]) / 2, np.concatenate([-intercept, intercept]) / 2
        self.coef_[seen], self.intercept_[seen] = coef, intercept

    def _weigh(self, trajectory: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        scores = self.coef_ @ self._encoder.encode(trajectory, cells) + self.intercept_
        weights = np.exp(scores - scores.max())
        return self._trust * weights / weights.sum() + (1 - self._trust) * self._prior_weights
