"""Multinomial logistic regression on prefixes of walks: a baseline that knows nothing about how people walk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts import Trajectory
from predictors.grid.prefixes import PrefixEncoder, PrefixPredictor, Steps, distinct_prefixes

__all__ = ["GridLogistic"]


class GridLogistic(PrefixPredictor):
    """Logistic regression from a prefix to the goal.

    Features are those of :class:`~predictors.grid.prefixes.PrefixEncoder`; every prefix of every walk is an example,
    those of one walk weigh 1 together. Answers are shrunk toward the prior as if each goal had been seen once more.

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
        for name in ("C", "max_iter"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
                raise ValueError(f"`{name}` must be a finite number above 0, got {value!r}")

    def _learn(self, walks: Sequence[Trajectory]) -> None:
        from sklearn.linear_model import LogisticRegression

        self._encoder = PrefixEncoder(walks, self.classes_)
        features, weights = distinct_prefixes(walks, self._encoder, self.classes_)
        count = len(self.classes_)
        self.coef_ = np.zeros((count, self._encoder.width))
        self.intercept_ = np.full(count, -np.inf)
        rows, goals = np.nonzero(weights)
        seen = np.unique(goals)
        self._trust = len(walks) / (len(walks) + count)
        self._fallback = self._prior.of(self.classes_.tolist())
        if len(seen) == 1:
            self.intercept_[seen] = 0.0
            return
        model = LogisticRegression(C=self.C, max_iter=int(self.max_iter))
        model.fit(features[rows], goals, sample_weight=weights[rows, goals])
        coef, intercept = model.coef_, model.intercept_
        if len(seen) == 2:  # scikit-learn keeps one row for two classes
            coef, intercept = np.vstack([-coef, coef]) / 2, np.concatenate([-intercept, intercept]) / 2
        self.coef_[seen], self.intercept_[seen] = coef, intercept

    def _read(self, walk: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        scores = self.coef_ @ self._encoder.encode(walk, cells) + self.intercept_
        weights = np.exp(scores - scores.max())
        return self._trust * weights / weights.sum() + (1 - self._trust) * self._fallback
