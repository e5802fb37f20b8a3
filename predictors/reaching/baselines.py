"""Baselines for reaches: plain classifiers of the hand's position, velocity and time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, Final, Self

import numpy as np
import numpy.typing as npt
from sklearn.linear_model import LogisticRegression
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from legible_envs.rollouts.trajectory import Cut, Trajectory
from legible_envs.support.validation import choice, integer, real
from predictors.base import (
    FRACTIONS,
    GoalPredictor,
    GoalStream,
    check_fractions,
    check_trajectories,
    prefix_lengths,
)
from predictors.reaching.features import Reach, check_reach, check_reaches

__all__ = ["ReachLogistic", "ReachNeighbours"]

_LEAST_SCALE: Final = 1e-9


class _MomentClassifier(GoalPredictor):
    """Learns from every moment of every reach, and predicts from the newest moment only.

    The features are the position and velocity relative to the start, and the time since. Goals that are not
    candidates are masked; with no or one position observed the belief is how often each goal was reached in ``fit``.
    """

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn from complete reaches.

        Args:
            X: Reaches with at least two states, some duration and a known goal, all of one dimension.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ValueError: Parameters out of range; a prefix, an unknown goal, a reach of one state, mixed dimensions.
        """
        super().fit(X, y)
        trajectories = list(X)
        self.n_dims_ = check_reaches(trajectories)
        goals = np.array([trajectory.goal for trajectory in trajectories])
        self.goals_, counts = np.unique(goals, return_counts=True)
        self.prior_ = counts / counts.sum()
        moments = [_moments(trajectory)[1:] for trajectory in trajectories]
        labels = np.repeat(np.searchsorted(self.goals_, goals), [len(rows) for rows in moments])
        self._classifier = self._make(len(labels)).fit(np.concatenate(moments), labels) if len(counts) > 1 else None
        return self

    def stream(self, context: Trajectory) -> GoalStream:
        """Predict one person's goal while they move; see :meth:`GoalPredictor.stream`."""
        return GoalStream(self, context, cells=False)

    @abstractmethod
    def _make(self, moments: int) -> Any:
        """An unfitted classifier for so many moments."""

    def _smoothed(self, weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """``(n, G)`` probabilities of the classifier, for subclasses that smooth them."""
        return weights

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`."""
        trajectories = check_trajectories(X)
        rows: list[npt.NDArray[np.float64] | None] = []
        for number, trajectory in enumerate(trajectories):
            self.candidate_columns(trajectory)
            check_reach(trajectory, number, self.n_dims_)
            rows.append(_moments(trajectory)[-1] if trajectory.num_states > 1 else None)
        return self._beliefs(trajectories, rows)

    def predict_proba_at(
        self, X: Sequence[Trajectory], fractions: Sequence[float] = FRACTIONS, cut: Cut = "steps"
    ) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba_at`; features of a reach are computed once for all fractions."""
        trajectories, fractions = check_trajectories(X), check_fractions(fractions, cut)
        for trajectory in trajectories:
            self.candidate_columns(trajectory)
        rows: list[npt.NDArray[np.float64] | None] = []
        for number, lengths in enumerate(prefix_lengths(trajectories, fractions, cut)):
            check_reach(trajectories[number], number, self.n_dims_)
            moments = _moments(trajectories[number])
            rows += [moments[length - 1] if length > 1 else None for length in lengths]
        beliefs = self._beliefs([trajectory for trajectory in trajectories for _ in fractions], rows)
        return beliefs.reshape(len(trajectories), len(fractions), len(self.classes_))

    def _beliefs(
        self, trajectories: Sequence[Trajectory], rows: Sequence[npt.NDArray[np.float64] | None]
    ) -> npt.NDArray[np.float64]:
        """``(n, C)`` beliefs; a row of None stands for nothing observed."""
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        weights = np.tile(self.prior_, (len(trajectories), 1))
        seen = [i for i, row in enumerate(rows) if row is not None]
        if seen and self._classifier is not None:
            weights[seen] = self._smoothed(self._classifier.predict_proba(np.array([rows[i] for i in seen])))
        probabilities = np.zeros((len(trajectories), len(self.classes_)))
        places = np.searchsorted(self.classes_, self.goals_)
        for i, candidates in enumerate(columns):
            full = np.zeros(len(self.classes_))
            full[places] = weights[i]
            chosen = full[candidates]
            if chosen.sum() <= 0:  # all probability is on other goals, or no candidate was ever reached
                full[places] = self.prior_
                chosen = full[candidates] if full[candidates].any() else np.ones(len(candidates))
            probabilities[i, candidates] = chosen / chosen.sum()
        return probabilities


class _Scaler(StandardScaler):
    """Standardises features, but does not blow up those that hardly vary: their squares would not be finite."""

    scale_: npt.NDArray[np.float64]

    def fit(self, X: Any, y: Any = None, sample_weight: Any = None) -> Self:
        super().fit(X, y, sample_weight)
        self.scale_ = np.maximum(self.scale_, _LEAST_SCALE)
        return self


class ReachLogistic(_MomentClassifier):
    """Multinomial logistic regression on position, velocity and time.

    Args:
        C: Inverse strength of the L2 penalty on standardised features.
        degree: 1: the features. 2: also their squares and products: more accurate, and ten times slower to fit.
        max_iter: Most iterations; scikit-learn warns where they were not enough.

    Attributes:
        classes_: ``(C,)`` names of all goals and candidates seen in ``fit``, sorted.
        goals_: ``(G,)`` names of the goals reached in ``fit``, sorted.
        prior_: ``(G,)`` how often.
    """

    def __init__(self, C: float = 1.0, degree: int = 1, max_iter: int = 1000) -> None:
        self.C = C
        self.degree = degree
        self.max_iter = max_iter

    def _check_parameters(self) -> None:
        choice("degree", self.degree, (1, 2))
        real("C", self.C, 0, closed="neither")
        integer("max_iter", self.max_iter, 1)

    def _make(self, moments: int) -> Any:
        expand = PolynomialFeatures(int(self.degree), include_bias=False)
        return make_pipeline(_Scaler(), expand, LogisticRegression(C=self.C, max_iter=self.max_iter))


class ReachNeighbours(_MomentClassifier):
    """The goals of the most similar moments of earlier reaches, by standardised position, velocity and time.

    The prior votes like one more neighbour, so that few neighbours never make a goal impossible.

    Args:
        n_neighbors: Number of moments that vote; all if there are fewer.

    Attributes:
        classes_: ``(C,)`` names of all goals and candidates seen in ``fit``, sorted.
        goals_: ``(G,)`` names of the goals reached in ``fit``, sorted.
        prior_: ``(G,)`` how often.
    """

    def __init__(self, n_neighbors: int = 25) -> None:
        self.n_neighbors = n_neighbors

    def _check_parameters(self) -> None:
        integer("n_neighbors", self.n_neighbors, 1)

    def _make(self, moments: int) -> Any:
        self.n_neighbors_ = min(int(self.n_neighbors), moments)
        return make_pipeline(_Scaler(), KNeighborsClassifier(self.n_neighbors_))

    def _smoothed(self, weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return (self.n_neighbors_ * weights + self.prior_) / (self.n_neighbors_ + 1)


def _moments(trajectory: Trajectory) -> npt.NDArray[np.float64]:
    """``(T, 2 d + 1)`` position, velocity and time of every sample."""
    reach = Reach(trajectory)
    return np.column_stack([reach.features(True), reach.times])
