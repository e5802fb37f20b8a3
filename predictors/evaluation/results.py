"""What evaluations hand back: tidy tables, and the definitions that belong beside every figure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from legible_envs.rollouts.trajectory import CUTS
from legible_envs.support.validation import choice, real
from predictors.evaluation.metrics import calibration_error, clustered_interval, log_loss, weighted_scores
from predictors.evaluation.omissions import (
    NO_NUMBER,
    markdown_table,
    omission_notes,
    omission_table,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

__all__ = ["Evaluation", "LearningCurve"]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What :func:`predictors.evaluation.evaluate` found.

    Attributes:
        table: A row per predictor, repeat, trajectory and fraction observed: ``predictor, repeat, fold, trajectory,
            participant, condition, layout, candidates, goal, fraction, states, probability`` (of the true goal),
            ``correct`` (0 to 1, ties shared out), ``confidence`` (probability of the top goal).
        confusion: ``predictor, repeat, fold`` (and what ``by`` names), ``fraction, goal, predicted, count``; a
            prediction tied between ``k`` goals counts 1/k for each.
        cut: What "fraction observed" is a fraction of.
        ties: How ties count.
        candidate_set: Which goals count as possible.
        cv: Folds.
        repeats: Repeats.
        groups: What was kept on one side of every split.
        by: Within the parts of what the predictors were fitted and evaluated: ``"condition"``, ``"layout"`` or None.
        omitted: ``predictor`` (and what ``by`` names), ``reason``: predictors that could not be evaluated on these
            trajectories, and why. They have no rows in ``table``; :meth:`summary` and :meth:`to_markdown` list them.
        unsplit: Why trajectories could not be split into folds, so that only predictors that learn nothing were
            evaluated: ``{what by names: reason}``, the key ``""`` where ``by`` is None.
    """

    table: pd.DataFrame = field(repr=False)
    confusion: pd.DataFrame = field(repr=False)
    cut: str
    ties: str
    candidate_set: str
    cv: int
    repeats: int
    groups: str | None = None
    by: str | None = None
    omitted: pd.DataFrame = field(default_factory=omission_table, repr=False)
    unsplit: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for table in (self.table, self.confusion):
            self._describe(table)

    @property
    def definition(self) -> str:
        """What the figures mean, in a sentence; to be printed beside them."""
        grouped = ", no participant on both sides" if self.groups else ""
        whole = {""} if self.by is None else set(self.table[self.by])
        folded = f"{self.cv}-fold stratified cross-validation x {self.repeats}{grouped}; "
        if whole <= self.unsplit.keys():
            folded = ""
        for part, reason in self.unsplit.items():
            where = f" in {self.by} {part!r}" if self.by else ""
            folded += f"predictors that learn nothing evaluated without folds{where} ({reason}); "
        return (
            f"{folded}fraction f observed means {CUTS[self.cut]} (cut {self.cut!r}); ties {self.ties}; "
            f"candidate set {self.candidate_set!r}"
        )

    @property
    def predictors(self) -> list[str]:
        """Names of the predictors that were evaluated, in the order given."""
        return list(dict.fromkeys(self.table["predictor"]))

    @property
    def fractions(self) -> list[float]:
        """Fractions observed, rising."""
        return sorted(self.table["fraction"].unique().tolist())

    @property
    def keys(self) -> list[str]:
        """Columns that identify a result: ``predictor``, and what ``by`` names."""
        return ["predictor", *([self.by] if self.by else [])]

    def accuracy(self, *, level: float = 0.95, unit: str | None = None) -> pd.DataFrame:
        """Accuracy against fraction observed, with confidence bands.

        Repeats are averaged within each trajectory first: they are not more data.

        Args:
            level: Of the confidence intervals.
            unit: What counts as independent: ``"participant"`` (cluster-robust) or ``"trajectory"``. None takes
                participants if all are named.

        Returns:
            ``predictor`` (and what ``by`` names), ``fraction, accuracy, low, high, chance, trajectories, units``,
            with ``unit`` and ``level`` in ``.attrs``.

        Raises:
            ValueError: An unknown unit, participants without names, or a level outside (0, 1).
        """
        import pandas as pd

        named = not (self.table["participant"] == "").any()
        unit = ("participant" if named else "trajectory") if unit is None else unit
        choice("unit", unit, ("participant", "trajectory"))
        if unit == "participant" and not named:
            raise ValueError("some trajectories name no participant; use unit='trajectory'")
        level = real("level", level, 0, 1, closed="neither")
        rows = []
        for labels, part in self._per_trajectory().groupby([*self.keys, "fraction"], sort=False):
            units, names = pd.factorize(part[unit])
            mean, low, high = clustered_interval(part["correct"].to_numpy(), units, level)
            rows.append((*labels, mean, low, high, (1 / part["candidates"]).mean(), len(part), len(names)))
        columns = [*self.keys, "fraction", "accuracy", "low", "high", "chance", "trajectories", "units"]
        table = self._describe(pd.DataFrame(rows, columns=columns))
        table.attrs.update(unit=unit, level=level)
        return table

    def metrics(self) -> pd.DataFrame:
        """All figures of merit against fraction observed.

        Returns:
            ``predictor`` (and what ``by`` names), ``fraction, accuracy, precision, recall, f1`` (weighted by goal),
            ``log_loss, calibration_error``; each is the mean over repeats.
        """
        import pandas as pd

        keys = [*self.keys, "fraction"]
        confusions = dict(list(self.confusion.groupby([*keys, "repeat"], sort=False)))
        rows = []
        for labels, part in self.table.groupby([*keys, "repeat"], sort=False):
            scores = {"accuracy": part["correct"].mean()}
            goals = sorted({*part["goal"], *confusions[labels]["predicted"]} if labels in confusions else part["goal"])
            matrix = _square(confusions.get(labels), goals)
            counts = part["goal"].value_counts()
            support = np.array([counts.get(goal, 0) for goal in goals], dtype=np.float64)
            scores |= weighted_scores(matrix, support)
            scores["log_loss"] = log_loss(part["probability"].to_numpy())
            scores["calibration_error"] = calibration_error(part["confidence"].to_numpy(), part["correct"].to_numpy())
            rows.append(dict(zip([*keys, "repeat"], labels, strict=True)) | scores)
        means = pd.DataFrame(rows).drop(columns="repeat").groupby(keys, sort=False, as_index=False).mean()
        return self._describe(means)

    def summary(self) -> pd.DataFrame:
        """A row per predictor (and what ``by`` names): the means of :meth:`metrics` over fractions.

        Predictors that could not be evaluated come last, with NaN and the ``reason``, which is ``""`` for the others.
        """
        import pandas as pd

        means = self.metrics().drop(columns="fraction").groupby(self.keys, sort=False, as_index=False).mean()
        counts = self.table.groupby(self.keys, sort=False, as_index=False).agg(
            trajectories=("trajectory", "nunique"), participants=("participant", "nunique")
        )
        found = means.merge(counts, on=self.keys).assign(reason="")
        if len(self.omitted):
            found = pd.concat([found, self.omitted.assign(trajectories=0, participants=0)], ignore_index=True)
        return self._describe(found)

    def to_markdown(self) -> str:
        """:meth:`summary` as a Markdown table: a dash where there is no number, and the reasons below."""
        found = self.summary().drop(columns="reason")
        notes = omission_notes(self.omitted)
        return markdown_table(found) + "".join(f"\n{NO_NUMBER} {note}\n" for note in notes)

    def confusion_matrix(
        self, predictor: str | None = None, *, fraction: float | None = None, normalise: bool = False, **part: str
    ) -> pd.DataFrame:
        """Which goals are confused with which.

        Args:
            predictor: Its name; may be left out if there is only one.
            fraction: At which fraction; None averages over all.
            normalise: Rows as shares rather than trajectories.
            part: ``condition=`` or ``layout=``, if ``by`` names it.

        Returns:
            Rows are true goals, columns predicted ones, in trajectories (repeats averaged).

        Raises:
            ValueError: Nothing of that name or fraction.
        """
        import pandas as pd

        chosen = self.confusion
        if predictor is None and len(self.predictors) > 1:
            raise ValueError(f"name the predictor of the confusion matrix: one of {self.predictors}")
        wanted = {"predictor": predictor or self.predictors[0], **part}
        for column, value in wanted.items():
            if column not in self.keys or value not in set(chosen[column]):
                raise ValueError(f"no predictions were evaluated with {column} = {value!r}")
            chosen = chosen[chosen[column] == value]
        if fraction is not None:
            chosen = chosen[np.isclose(chosen["fraction"], fraction)]
            if chosen.empty:
                raise ValueError(f"fraction {fraction!r} was not observed; choose from {self.fractions}")
        goals = sorted({*chosen["goal"], *chosen["predicted"]})
        matrix = _square(chosen, goals) / (self.repeats * chosen["fraction"].nunique())
        if normalise:
            total = matrix.sum(axis=1, keepdims=True)
            matrix = np.divide(matrix, total, out=np.zeros_like(matrix), where=total > 0)
        frame = pd.DataFrame(matrix, index=pd.Index(goals, name="goal"), columns=pd.Index(goals, name="predicted"))
        return self._describe(frame)

    def _per_trajectory(self) -> pd.DataFrame:
        keep = dict.fromkeys([*self.keys, "trajectory", "participant", "candidates", "fraction"])
        return self.table.groupby(list(keep), sort=False)["correct"].mean().reset_index()

    def _describe(self, table: pd.DataFrame) -> pd.DataFrame:
        table.attrs.update(
            cut=self.cut,
            definition=CUTS[self.cut],
            ties=self.ties,
            candidate_set=self.candidate_set,
            evaluation=self.definition,
        )
        return _with_notes(table, self.omitted)


def _with_notes(table: pd.DataFrame, omitted: pd.DataFrame) -> pd.DataFrame:
    """The table, whose attributes say which predictors are not in it."""
    if len(omitted):
        table.attrs["omitted"] = omission_notes(omitted)
    return table


def _square(confusion: Any, goals: Sequence[str]) -> Any:
    """``(K, K)`` counts of a tidy confusion table; zeros for None."""
    matrix = np.zeros((len(goals), len(goals)))
    if confusion is not None:
        place = {goal: i for i, goal in enumerate(goals)}
        rows, columns = ([place[name] for name in confusion[which]] for which in ("goal", "predicted"))
        np.add.at(matrix, (rows, columns), confusion["count"].to_numpy())
    return matrix


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """What :func:`predictors.evaluation.learning_curve` found.

    Attributes:
        table: ``predictor, repeat, size`` (trajectories learned from), ``judged`` (number held out to evaluate on),
            ``fraction, accuracy``.
        cut: What "fraction observed" is a fraction of.
        ties: How ties count.
        candidate_set: Which goals count as possible.
        test_share: Share held out.
        omitted: ``predictor, reason``: predictors that could not be evaluated on these trajectories, and why. They have
            no rows in ``table``; :meth:`to_markdown` lists them.
    """

    table: pd.DataFrame = field(repr=False)
    cut: str
    ties: str
    candidate_set: str
    test_share: float
    omitted: pd.DataFrame = field(default_factory=omission_table, repr=False)

    @property
    def definition(self) -> str:
        """What the figures mean, in a sentence."""
        return (
            f"nested training sets, {self.test_share:.0%} held out anew in each repeat; fraction f observed means "
            f"{CUTS[self.cut]} (cut {self.cut!r}); ties {self.ties}; candidate set {self.candidate_set!r}"
        )

    def summary(self) -> pd.DataFrame:
        """``predictor, size, accuracy, low, high, repeats``: the mean over fractions, and one standard deviation.

        The band shows how much results vary between splits; it is no confidence interval, as splits overlap.
        """
        each = self.table.groupby(["predictor", "size", "repeat"], sort=False, as_index=False)["accuracy"].mean()
        grouped = each.groupby(["predictor", "size"], sort=False)["accuracy"]
        table = grouped.agg(accuracy="mean", sd="std", repeats="count").reset_index()
        sd = table.pop("sd").fillna(0.0)
        table.insert(3, "low", (table["accuracy"] - sd).clip(0, 1))
        table.insert(4, "high", (table["accuracy"] + sd).clip(0, 1))
        table.attrs.update(cut=self.cut, definition=CUTS[self.cut], evaluation=self.definition)
        return _with_notes(table, self.omitted)

    def to_markdown(self) -> str:
        """Accuracy (mean over fractions and repeats) by size as a Markdown table; dashes and reasons for the others."""
        import pandas as pd

        wide = self.summary().pivot_table(index="predictor", columns="size", values="accuracy", sort=False)
        wide = wide.reindex([*wide.index, *self.omitted["predictor"]]).rename_axis("predictor").reset_index()
        notes = omission_notes(self.omitted)
        return markdown_table(pd.DataFrame(wide)) + "".join(f"\n{NO_NUMBER} {note}\n" for note in notes)
