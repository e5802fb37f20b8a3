"""The time-series Gaussian: at the same moment, reaches to one goal are alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Cut, Trajectory
from legible_envs.support.validation import choice, flag, integer, real
from predictors.base import (
    FRACTIONS,
    GoalPredictor,
    GoalStream,
    TrajectoryError,
    check_fractions,
    check_trajectories,
    prefix_lengths,
)
from predictors.reaching.alignment_kernels import dba_step, match_means, pairwise_costs
from predictors.reaching.features import Reach, check_reach, check_reaches, resample
from predictors.reaching.open_end_kernels import observe

__all__ = ["ReachStream", "TimeSeriesGaussian"]

Alignment = Literal["none", "mean", "medoid", "dba"]
Online = Literal["open-end", "index", "fraction"]

_DBA_ITERATIONS: Final = 10
_LEAST_FLOOR: Final = 1e-6
_WORST_CONDITION: Final = 1e13


class TimeSeriesGaussian(GoalPredictor):
    r"""Predicts the goal under whose earlier reaches the motion so far is most likely.

    For every goal, its reaches are resampled to ``n_samples`` steps and aligned in time; each step has a mean and a
    covariance over reaches. A person's motion is aligned to each goal's mean online, and goals are weighed by the mean
    log-density of the samples so far, with a uniform prior (Perez-D'Arpino and Shah, ICRA 2015, as used by Tung et al.,
    HRI 2024). All positions are relative to the reach's first, which therefore carries no information: with no or one
    position observed the belief is the prior.

    A goal reached once borrows the covariance of the others (the floor alone if there is none). A candidate that was
    never reached in ``fit`` gets no probability beside candidates that were.

    Args:
        n_samples: Steps K of the mean reach.
        velocity: Whether velocities join the positions as features.
        alignment: How the reaches to a goal are aligned: ``"none"``: by the share of their duration. By dynamic time
            warping to their ``"mean"``, to their ``"medoid"`` (the reach with the least cost to the others) or to their
            ``"dba"`` barycentre. Alignment lowers determinant and trace of the covariance by construction: compare
            these only at equal ``alignment``, ``n_samples``, ``band`` and number of reaches.
        online: Which step of a goal's mean a sample is compared with: ``"open-end"``: by warping the samples so far to
            a beginning of the mean. ``"index"``: by the time since the first sample, in units of the mean duration of
            reaches to the goal. ``"fraction"``: by the share of the reach's own duration, as in the paper; this needs
            the whole duration, so it works only with complete trajectories and :meth:`predict_proba_at`, not while a
            reach is going on.
        band: How far warping may move a sample from where the clock says, as a share of the reach, offline and online;
            None: anywhere.
        floor: Standard deviation added to every position, in metres; 1e-6 at least.
        velocity_floor: The same for velocities, in metres per second.
        half_life: Seconds after which a sample counts half; None: all samples count the same; 0: only the newest.

    On 1,258 real pointing movements to ten targets by 53 participants (mean accuracy over 10..90 %, participants
    held out) the defaults reach .71, ``online="index"`` .73, with ``velocity=True`` .75, and ``velocity=True,
    half_life=0`` .78 in either mode: old samples mostly repeat the information in the newest one.

    Attributes:
        classes_: ``(C,)`` names of all goals and candidates seen in ``fit``, sorted.
        goals_: ``(G,)`` names of the goals reached in ``fit``, sorted.
        means_: ``(G, K, f)`` mean of positions (and velocities) over time.
        covariances_: ``(G, K, f, f)`` covariances over time, floor included.
        durations_: ``(G,)`` mean duration of the reaches, seconds.
        counts_: ``(G,)`` number of reaches.

    Example:
        >>> from legible_envs.rollouts import Trajectory
        >>> progress = np.linspace(0, 1, 20)[:, None]
        >>> ends = {"a": (-1, 1), "b": (1, 1)}
        >>> reach = {g: Trajectory(progress * end, goal=g, candidates=("a", "b")) for g, end in ends.items()}
        >>> gaussian = TimeSeriesGaussian().fit(list(reach.values()))
        >>> gaussian.predict([reach["a"].first(8), reach["b"].first(8)]).tolist()
        ['a', 'b']
    """

    def __init__(
        self,
        n_samples: int = 50,
        *,
        velocity: bool = False,
        alignment: Alignment = "none",
        online: Online = "open-end",
        band: float | None = 0.05,
        floor: float = 0.01,
        velocity_floor: float = 0.05,
        half_life: float | None = None,
    ) -> None:
        self.n_samples = n_samples
        self.velocity = velocity
        self.alignment = alignment
        self.online = online
        self.band = band
        self.floor = floor
        self.velocity_floor = velocity_floor
        self.half_life = half_life

    # -- learning -----------------------------------------------------------------------------------------------------

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn from complete reaches.

        Args:
            X: Reaches with at least two states, some duration and a known goal, all of one dimension.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ValueError: Parameters out of range; a prefix, an unknown goal, cells, a reach of one state or without
                duration, mixed dimensions; positions that spread so far beside ``floor`` that covariances have no
                inverse.
        """
        super().fit(X, y)
        trajectories = list(X)
        self.n_dims_ = check_reaches(trajectories)
        by_goal: dict[str, list[Reach]] = {}
        for trajectory in trajectories:
            by_goal.setdefault(str(trajectory.goal), []).append(Reach(trajectory))
        self.goals_ = np.array(sorted(by_goal))
        self.counts_ = np.array([len(by_goal[goal]) for goal in self.goals_])
        self.durations_ = np.array([np.mean([r.duration for r in by_goal[goal]]) for goal in self.goals_])
        aligned = [self._aligned(by_goal[goal]) for goal in self.goals_]
        self.means_ = np.array([series.mean(axis=0) for series in aligned])
        self.covariances_ = self._covariances(aligned)
        self._check_covariances()
        self._precisions: npt.NDArray[np.float64] = np.linalg.inv(self.covariances_).astype(np.float64)
        width = self.means_.shape[2]
        self._log_norms = -0.5 * (np.linalg.slogdet(self.covariances_)[1] + width * np.log(2 * np.pi))
        return self

    def _aligned(self, reaches: list[Reach]) -> npt.NDArray[np.float64]:
        """``(n, K, f)`` features of the reaches to one goal, step by step in common time."""
        features = np.array([resample(r.features(self.velocity), r.times, self.n_samples) for r in reaches])
        if self.alignment == "none":
            return features
        points = np.ascontiguousarray(features[:, :, : self.n_dims_])
        radius = self._radius()
        reference = np.ascontiguousarray(points.mean(axis=0))
        if self.alignment == "medoid":
            reference = points[int(pairwise_costs(points, radius).sum(axis=1).argmin())]
        elif self.alignment == "dba":
            for _ in range(_DBA_ITERATIONS):
                reference = dba_step(points, reference, radius)
        return match_means(points, features, reference, radius)

    def _covariances(self, aligned: list[npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
        """``(G, K, f, f)``, pooled over the other goals where there is one reach only."""
        sums = []
        for series, mean in zip(aligned, self.means_, strict=True):
            gaps = series - mean
            sums.append(np.einsum("nki,nkj->kij", gaps, gaps))
        freedom = np.maximum(self.counts_ - 1, 0)
        pooled = np.sum(sums, axis=0) / max(int(freedom.sum()), 1)
        floors = np.repeat([self.floor, self.velocity_floor], self.n_dims_)[: self.means_.shape[2]]
        found = [s / n if n else pooled for s, n in zip(sums, freedom, strict=True)]
        return np.array(found) + np.diag(floors**2)

    def _check_covariances(self) -> None:
        """Refuse covariances whose inverse would be rounding errors."""
        spread = np.sqrt(np.diagonal(self.covariances_, axis1=2, axis2=3))
        worst = np.linalg.cond(self.covariances_ / (spread[..., None] * spread[..., None, :])).max()
        if not worst < _WORST_CONDITION:
            raise ValueError(
                f"positions spread up to {spread.max():.3g} along a line, beside which `floor` ({self.floor:g}) and "
                f"`velocity_floor` ({self.velocity_floor:g}) vanish; raise these, or give positions in metres"
            )

    def _radius(self) -> int:
        """Half-width of the band in steps; -1: none."""
        return -1 if self.band is None else int(self.band * self.n_samples)

    def _check_parameters(self) -> None:
        integer("n_samples", self.n_samples, 2, 10_000)
        choice("alignment", self.alignment, ("none", "mean", "medoid", "dba"))
        choice("online", self.online, ("open-end", "index", "fraction"))
        if self.band is not None:
            real("band", self.band, 0, 1, also="None")
        flag("velocity", self.velocity)
        for name in ("floor", "velocity_floor"):
            real(name, real(name, getattr(self, name), 0, closed="neither"), _LEAST_FLOOR)
        if self.half_life is not None:
            real("half_life", self.half_life, 0, also="None")

    # -- predicting ---------------------------------------------------------------------------------------------------

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`.

        Raises:
            ValueError: Also a prefix if ``online="fraction"``, which needs the whole duration.
        """
        trajectories = check_trajectories(X)
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        probabilities = np.zeros((len(trajectories), len(self.classes_)))
        for row, trajectory in enumerate(trajectories):
            check_reach(trajectory, row, self.n_dims_)
            if self.online == "fraction" and not trajectory.complete and trajectory.num_states > 1:
                raise TrajectoryError(
                    row,
                    trajectory.participant,
                    "online='fraction' needs the duration of the whole reach, which a prefix lacks; use "
                    "`predict_proba_at`, or online='open-end' for motion that is still going on",
                )
            duration = float(trajectory.times[-1] - trajectory.times[0]) if trajectory.num_states else 0.0
            scores = self._scores(trajectory, duration)
            probabilities[row, columns[row]] = self._belief(scores[-1] if len(scores) else None, trajectory.candidates)
        return probabilities

    def predict_proba_at(
        self, X: Sequence[Trajectory], fractions: Sequence[float] = FRACTIONS, cut: Cut = "steps"
    ) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba_at`; one pass over each reach answers all fractions."""
        trajectories, fractions = check_trajectories(X), check_fractions(fractions, cut)
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        probabilities = np.zeros((len(trajectories), len(fractions), len(self.classes_)))
        for row, lengths in enumerate(prefix_lengths(trajectories, fractions, cut)):
            trajectory = trajectories[row]
            check_reach(trajectory, row, self.n_dims_)
            scores = self._scores(
                trajectory.first(max(lengths, default=0)), float(trajectory.times[-1] - trajectory.times[0])
            )
            for i, length in enumerate(lengths):
                probabilities[row, i, columns[row]] = self._belief(scores[length - 1], trajectory.candidates)
        return probabilities

    def stream(self, context: Trajectory) -> GoalStream:
        """See :meth:`GoalPredictor.stream`; an update takes the same time at every length of the reach.

        Raises:
            ValueError: ``online="fraction"``, which is not causal.
        """
        if self.online == "fraction":
            raise ValueError("online='fraction' needs the duration of the whole reach; stream with online='open-end'")
        return ReachStream(self, context)

    def _scores(self, trajectory: Trajectory, duration: float) -> npt.NDArray[np.float64]:
        """``(T, G)`` mean log-density of the samples so far, after each sample."""
        if not trajectory.num_states:
            return np.zeros((0, len(self.goals_)))
        reach = Reach(trajectory)
        lows, highs = self._windows(reach.times, duration)
        return observe(
            reach.points,
            reach.features(self.velocity),
            lows,
            highs,
            self._decays(np.diff(reach.times, prepend=reach.times[0])),
            self.means_,
            self._precisions,
            self._log_norms,
            np.zeros((3, *self._log_norms.shape)),
            False,
        )

    def _windows(
        self, times: npt.NDArray[np.float64], duration: float, reached: npt.NDArray[np.int64] | None = None
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """First step and one past the last that each sample may be compared with.

        Args:
            times: ``(T,)`` seconds since the first sample.
            duration: Of the whole reach; only ``online="fraction"`` looks at it.
            reached: ``(G,)`` one past the last step of the sample before, if there was one.

        Returns:
            Two of ``(T, G)``.
        """
        last = self.n_samples - 1
        radius = self._radius()
        lengths = np.full(len(self.goals_), duration or 1.0) if self.online == "fraction" else self.durations_
        steps = np.minimum(np.rint(times[:, None] / lengths * last), last).astype(np.int64)
        if self.online != "open-end" or radius == 0:
            return steps, steps + 1
        if radius < 0:
            return np.zeros_like(steps), np.full_like(steps, last + 1)
        highs = np.minimum(steps + radius + 1, last + 1)
        before = np.concatenate([np.zeros_like(highs[:1]) if reached is None else reached[None], highs[:-1]])
        # A pause in the data must not tear the alignment: a window begins where the one before ended, or earlier.
        return np.minimum(np.maximum(steps - radius, 0), np.minimum(before, last)), highs

    def _decays(self, gaps: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The factor of earlier samples' weight after so many seconds."""
        if self.half_life is None:
            return np.ones_like(gaps)
        with np.errstate(over="ignore"):  # after more half-lives than any number nothing is left
            return np.exp2(-gaps / self.half_life) if self.half_life > 0 else np.zeros_like(gaps)

    def _belief(self, scores: npt.NDArray[np.float64] | None, candidates: Sequence[str]) -> npt.NDArray[np.float64]:
        """``(len(candidates),)`` probabilities in their order."""
        columns = np.minimum(np.searchsorted(self.goals_, candidates), len(self.goals_) - 1)
        modelled = self.goals_[columns] == np.array(candidates)
        weights = np.where(modelled, 1.0, 0.0) if modelled.any() else np.ones(len(candidates))
        if scores is not None and modelled.any():
            known = scores[columns[modelled]]
            weights[modelled] = np.exp(known - known.max())
        return weights / weights.sum()


class ReachStream(GoalStream):
    """A stream that keeps the alignment so far instead of the samples' past."""

    def __init__(self, predictor: TimeSeriesGaussian, context: Trajectory) -> None:
        super().__init__(predictor, context, cells=False)
        self._gaussian = predictor
        self._state = np.zeros((3, *predictor._log_norms.shape))
        self._scores: npt.NDArray[np.float64] | None = None
        self._reached: npt.NDArray[np.int64] | None = None
        self._reach = Reach.empty(predictor.n_dims_)

    @property
    def belief(self) -> dict[str, float]:
        """``{goal: probability}`` now; the prior before the first point."""
        row = self._gaussian._belief(self._scores, self._context.candidates)
        return dict(zip(self._context.candidates, row.tolist(), strict=True))

    def add(self, point: npt.ArrayLike, time: float | None = None) -> None:
        """Add a state without asking for the belief; see :meth:`update`."""
        gaussian = self._gaussian
        count, dimension = len(self._points), np.shape(point)[-1:] or (0,)
        if not count and np.ndim(point) == 1 and dimension != (gaussian.n_dims_,):
            raise ValueError(f"expected a point of dimension {gaussian.n_dims_} as in `fit`, got {dimension[0]}")
        super().add(point, time)
        if len(self._points) == count:
            return
        features, when, gap = self._reach.append(self._points[-1], self._times[-1], gaussian.velocity)
        lows, highs = gaussian._windows(np.array([when]), 0.0, self._reached)
        self._reached = highs[0]
        self._scores = observe(
            features[:, : gaussian.n_dims_],
            features,
            lows,
            highs,
            gaussian._decays(np.array([gap])),
            gaussian.means_,
            gaussian._precisions,
            gaussian._log_norms,
            self._state,
            count > 0,
        )[0]
