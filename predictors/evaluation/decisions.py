"""Acting on a prediction: at which confidence should a robot act?

>>> from predictors import BayesianGoalPredictor, ThresholdDecision                  # doctest: +SKIP
>>> decision = ThresholdDecision(BayesianGoalPredictor().fit(trajectories), 0.8)     # doctest: +SKIP
>>> watcher = decision.stream(trajectories[0])                                       # doctest: +SKIP
>>> watcher.update((3, 2))                                                           # doctest: +SKIP
>>> watcher.update((2, 2))                                                           # doctest: +SKIP
Decision(goal='onion', probability=0.83, step=2, time=0.15)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import entries, integer, real, shown
from predictors.base import TIE_TOLERANCE, GoalPredictor, TrajectoryError, check_trajectories
from predictors.grid.base import check_recorded
from predictors.outputs import probability_fault

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Decision", "DecisionStream", "ThresholdDecision", "summarise_decisions"]


@dataclass(frozen=True, slots=True)
class Decision:
    """The goal that a robot acts on.

    Attributes:
        goal: Its name.
        probability: The belief in it when it was decided.
        step: Number of states observed by then, at least 1.
        time: Time of the last of them, as given with it.
    """

    goal: str
    probability: float
    step: int
    time: float


class ThresholdDecision:
    """Decides as soon as one goal is at least as probable as a threshold, and stays with it.

    Works with every predictor, and causally: a decision after a state depends on that state and those before. Goals
    tied at the top lead to no decision, whatever the threshold; nor does the belief before the first state.

    Args:
        predictor: A fitted predictor.
        threshold: Probability ``p``, above 0 and up to 1, at which to act. A low one decides early and is often wrong,
            a high one late and right: :meth:`trade_off` shows the curve.
        patience: Number of consecutive states at which the same goal must reach the threshold.

    Raises:
        ValueError: A threshold or patience out of range.
        TypeError: ``predictor`` is not a :class:`~predictors.base.GoalPredictor`.
    """

    def __init__(self, predictor: GoalPredictor, threshold: float = 0.9, *, patience: int = 1) -> None:
        if not isinstance(predictor, GoalPredictor):
            raise TypeError(f"`predictor` must be a GoalPredictor, got {type(predictor).__name__}")
        self.patience = integer("patience", patience, 1)
        self.predictor = predictor
        self.threshold = real("threshold", threshold, 0, 1, closed="right")

    def __repr__(self) -> str:
        return f"ThresholdDecision({self.predictor!r}, {self.threshold!r}, patience={self.patience})"

    def stream(self, context: Trajectory) -> DecisionStream:
        """Decide about one person while they move.

        Args:
            context: What is known beforehand: start, candidates, layout. Its states are ignored.
        """
        return DecisionStream(self, context)

    def decide(self, X: Sequence[Trajectory]) -> pd.DataFrame:
        """When the rule would have acted on whole trajectories, and whether it would have been right.

        The last state of a complete trajectory is left out: it is the goal's own, too late for a decision.

        Args:
            X: ``n`` complete trajectories (or prefixes, of which all states are used).

        Returns:
            A row per trajectory: ``trajectory`` (its number), ``participant``, ``condition``, ``layout``, ``goal``,
            ``threshold``, ``decided`` (bool), ``decision`` (the goal decided on, ``""`` if none), ``probability``,
            ``step`` (states observed; 0 if none), ``fraction`` (of all states, the goal's own included), ``time``
            (since the first state), ``lead`` (time left until the last state) — NaN if none — and ``correct``
            (1 or 0; undecided is 0, NaN where the goal is not known).
        """
        return self.trade_off(X, [self.threshold])

    def trade_off(self, X: Sequence[Trajectory], thresholds: Sequence[float]) -> pd.DataFrame:
        """The rows of :meth:`decide` for several thresholds; :func:`summarise_decisions` makes a curve of them."""
        import pandas as pd

        levels = [real("each of `thresholds`", each, 0, 1, closed="right") for each in entries(thresholds)]
        if not levels or len(set(levels)) < len(levels):
            raise ValueError(f"`thresholds` must be at least one number, each once, got {shown(thresholds)}")
        trajectories = check_trajectories(X)
        check_recorded(trajectories)
        beliefs = self._beliefs(trajectories)
        rows = [
            _row(number, trajectory, level, self._first_decision(trajectory, belief, level))
            for level in levels
            for number, (trajectory, belief) in enumerate(zip(trajectories, beliefs, strict=True))
        ]
        return pd.DataFrame(rows, columns=list(_row(0, _UNKNOWN, 1.0, None)))

    def _beliefs(self, trajectories: Sequence[Trajectory]) -> list[npt.NDArray[np.float64]]:
        """For each trajectory ``(steps, candidates)`` the belief after 1, 2, … states."""
        steps = [trajectory.num_states - trajectory.complete for trajectory in trajectories]
        prefixes = [
            trajectory.first(t)
            for trajectory, count in zip(trajectories, steps, strict=True)
            for t in range(1, count + 1)
        ]
        rows = self._probabilities(
            prefixes, np.repeat(np.arange(len(steps)), np.maximum(np.array(steps, dtype=np.intp), 0))
        )
        ends = np.cumsum([max(count, 0) for count in steps], dtype=np.intp)
        return [
            rows[end - max(count, 0) : end][:, self.predictor.candidate_columns(trajectory)]
            if count > 0
            else np.zeros((0, 0))
            for trajectory, count, end in zip(trajectories, steps, ends, strict=True)
        ]

    def _probabilities(self, prefixes: list[Trajectory], numbers: npt.NDArray[np.intp]) -> npt.NDArray[np.float64]:
        """Rows of the predictor for prefixes of the trajectories of these numbers."""
        if not prefixes:
            return np.zeros((0, 0))
        try:
            rows = self.predictor.predict_proba(prefixes)
        except TrajectoryError as error:  # numbered among the prefixes
            raise TrajectoryError(int(numbers[error.number]), error.participant, error.reason) from error
        fault = probability_fault(rows, prefixes, self.predictor.classes_)
        if fault:
            raise ValueError(f"{type(self.predictor).__name__}: {fault}")
        return rows

    def _first_decision(
        self, trajectory: Trajectory, beliefs: npt.NDArray[np.float64], threshold: float
    ) -> Decision | None:
        previous, count = None, 0
        for step, belief in enumerate(beliefs, 1):
            top = _confident_candidate(belief, threshold)
            count = 0 if top is None else count + 1 if top == previous else 1
            previous = top
            if top is not None and count >= self.patience:
                return Decision(trajectory.candidates[top], float(belief[top]), step, float(trajectory.times[step - 1]))
        return None


class DecisionStream:
    """Follows one person until it decides; made by :meth:`ThresholdDecision.stream`.

    Attributes:
        belief: ``{goal: probability}`` after the last update; the prior before the first.
        decision: The decision, None until there is one.
    """

    def __init__(self, rule: ThresholdDecision, context: Trajectory) -> None:
        self._rule = rule
        self._stream = rule.predictor.stream(context)
        self._goals = context.candidates
        self._top: int | None = None
        self._count = 0
        self.belief: dict[str, float] = self._stream.belief
        self.decision: Decision | None = None

    def update(self, point: npt.ArrayLike, time: float | None = None) -> Decision | None:
        """Add a state.

        Args:
            point: ``(d,)`` cell or position. Standing still on a cell of a grid adds nothing.
            time: When, in seconds; one second after the state before if None.

        Returns:
            The decision, the same from then on; None until there is one.

        Raises:
            ValueError: What :meth:`predictors.base.GoalStream.update` rejects.
        """
        seen = self._stream.num_states
        self.belief = self._stream.update(point, time)
        if self.decision is not None or self._stream.num_states == seen:
            return self.decision
        values = np.array([self.belief[goal] for goal in self._goals])
        top = _confident_candidate(values, self._rule.threshold)
        self._count = 0 if top is None else self._count + 1 if top == self._top else 1
        self._top = top
        if top is not None and self._count >= self._rule.patience:
            step, when = self._stream.num_states, self._stream.last_time
            self.decision = Decision(self._goals[top], float(values[top]), step, when)
        return self.decision


def summarise_decisions(rows: pd.DataFrame, by: Sequence[str] = ("threshold",)) -> pd.DataFrame:
    """Coverage, accuracy and timing of decisions, on average.

    Args:
        rows: From :meth:`ThresholdDecision.decide` or :meth:`ThresholdDecision.trade_off`.
        by: Columns to group by, such as ``("condition", "threshold")``.

    Returns:
        A row per group: the columns ``by``, ``trajectories``, ``decided`` (share), ``correct`` (right decisions as a
        share of all trajectories), ``precision`` (as a share of the decisions), and the means over decisions of
        ``fraction``, ``step``, ``time`` and ``lead`` (NaN without any).
    """
    made = rows[rows["decided"]]
    keys = list(by)
    means = rows.groupby(keys).agg(
        trajectories=("trajectory", "size"), decided=("decided", "mean"), correct=("correct", "mean")
    )
    of_decisions = made.groupby(keys).agg(
        precision=("correct", "mean"),
        fraction=("fraction", "mean"),
        step=("step", "mean"),
        time=("time", "mean"),
        lead=("lead", "mean"),
    )
    return means.join(of_decisions).reset_index()


_UNKNOWN: Final = Trajectory(np.zeros((0, 2), dtype=np.int64), candidates=("nothing",))


def _row(number: int, trajectory: Trajectory, threshold: float, decision: Decision | None) -> dict[str, Any]:
    nan = float("nan")
    first, last = (float(trajectory.times[0]), float(trajectory.times[-1])) if trajectory.num_states else (nan, nan)
    right = None if decision is None else decision.goal == trajectory.goal
    return {
        "trajectory": number,
        "participant": trajectory.participant,
        "condition": trajectory.condition,
        "layout": trajectory.layout_name or (trajectory.layout.layout_id if trajectory.layout is not None else ""),
        "goal": trajectory.goal or "",
        "threshold": threshold,
        "decided": decision is not None,
        "decision": "" if decision is None else decision.goal,
        "probability": nan if decision is None else decision.probability,
        "step": 0 if decision is None else decision.step,
        "fraction": nan if decision is None else decision.step / trajectory.num_states,
        "time": nan if decision is None else decision.time - first,
        "lead": nan if decision is None else last - decision.time,
        "correct": nan if trajectory.goal is None else float(bool(right)),
    }


def _confident_candidate(belief: npt.NDArray[np.float64], threshold: float) -> int | None:
    """The candidate that is alone at the top and at least as probable as the threshold."""
    best = belief.max()
    if best < threshold - TIE_TOLERANCE or np.count_nonzero(belief >= best - TIE_TOLERANCE) > 1:
        return None
    return int(belief.argmax())
