"""How well predictors tell the goals of a study's participants, with participants as units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.experiments.conditions import Comparisons, figures_of_merit
from benchmarks.experiments.hypotheses import Hypotheses, assess_hypotheses
from benchmarks.experiments.predictor_settings import PredictorSetting
from benchmarks.experiments.trial_rows import accuracy_rows, by_table
from benchmarks.study.analysis.settings import AnalysisSettings, Claim

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory
    from predictors.base import GoalPredictor

__all__ = ["Readings", "compare", "hypotheses_of", "metrics_table", "participant_curve", "read_goals", "whole_units"]

Settings = dict[str, tuple[str, str]]
"""Condition and sitting by the name of the layout that trajectories have."""

_REDRAWS = 1000
"""Splits that are drawn to find those whose smallest training set mentions every goal."""


@dataclass(frozen=True, eq=False)
class Readings:
    """What predictors made of the trajectories.

    Attributes:
        tables: ``accuracy``, ``metrics`` and ``confusion`` rows (as of :func:`.accuracy_rows`), each with ``predictor,
            condition, sitting, layout``.
        curves: ``predictor, condition, sitting, layout, split, size, share, participant, accuracy``; may be empty.
        unsaid: What could not be evaluated, and why.
    """

    tables: dict[str, pd.DataFrame]
    curves: pd.DataFrame
    unsaid: list[str] = field(default_factory=list)

    @property
    def predictors(self) -> list[str]:
        """That could be evaluated somewhere, in order."""
        return list(dict.fromkeys(self.tables["accuracy"]["predictor"])) if "accuracy" in self.tables else []


def read_goals(
    trajectories: Sequence[Trajectory],
    layouts: Settings,
    settings: AnalysisSettings,
    *,
    progress: Callable[[str], object] | None = None,
) -> Readings:
    """Cross-validate every predictor within every layout, and trace learning curves.

    Args:
        trajectories: Of participants, with two goals or more to choose from.
        layouts: What they may be told apart by.
        settings: How much is done.
        progress: Called with what comes next, in words.
    """
    import pandas as pd

    parts: dict[str, list[pd.DataFrame]] = {}
    unsaid: list[str] = []
    for layout, (condition, sitting) in layouts.items():
        own = [each for each in trajectories if each.layout_name == layout]
        labels = {"condition": condition, "sitting": sitting, "layout": layout}
        if not own:
            unsaid.append(f"{layout}: there are no trajectories with two goals or more to choose from.")
            continue
        for setting in settings.predictors:
            if progress is not None:
                progress(f"{setting.label}: {layout}")
            try:
                rows = by_table(pd.DataFrame(_accuracy(own, setting, settings)))
            except ValueError as error:
                unsaid.append(f"{layout}: {setting.label} could not be evaluated: {_first_line(error)}")
                continue
            for name, table in rows.items():
                parts.setdefault(name, []).append(table.drop(columns="table").assign(predictor=setting.label, **labels))
            if not setting.learns or not settings.curve_repeats:
                continue
            try:
                curve = participant_curve(
                    setting.make(), own, shares=settings.shares, repeats=setting.repeats(settings.curve_repeats),
                    seed=settings.seed,
                )  # fmt: skip
                parts.setdefault("curves", []).append(curve.assign(predictor=setting.label, **labels))
            except ValueError as error:
                unsaid.append(f"{layout}: no learning curve of {setting.label}: {_first_line(error)}")
    tables = {name: pd.concat(found, ignore_index=True) for name, found in parts.items()}
    curves = tables.pop("curves", pd.DataFrame())
    return Readings(tables, curves, unsaid)


def _accuracy(own: Sequence[Trajectory], setting: PredictorSetting, settings: AnalysisSettings) -> list[dict[str, Any]]:
    return accuracy_rows(
        setting.make(),
        own,
        folds=settings.folds,
        repeats=setting.repeats(settings.repeats),
        seed=settings.seed,
        starts=False,
    )


def _first_line(error: BaseException) -> str:
    return (" ".join(str(error).split()) or type(error).__name__).rstrip(".") + "."


def participant_curve(
    predictor: GoalPredictor, trajectories: Sequence[Trajectory], *, shares: Sequence[float], repeats: int, seed: int
) -> pd.DataFrame:
    """A learning curve whose accuracies are told for each participant.

    In each of ``repeats`` splits a quarter is held out, and training sets are nested; splits whose smallest training
    set does not mention every goal are drawn anew.

    Args:
        predictor: Unfitted.
        trajectories: Of one layout.
        shares: Of the trajectories not held out, to learn from.
        repeats: Splits.
        seed: Of the splits.

    Returns:
        ``split, size, share, participant, accuracy`` (mean over fractions and the trajectories held out).

    Raises:
        ValueError: There are no such splits, or the predictor refuses the trajectories.
    """
    import pandas as pd
    from sklearn.base import clone

    from predictors.evaluation.cross_validation import accuracy_at
    from predictors.evaluation.splits import check_learnable

    check_learnable(trajectories)
    parts = []
    for split, (pool, test) in enumerate(_splits(trajectories, min(shares), repeats, np.random.default_rng(seed))):
        held_out = [trajectories[i] for i in test]
        for share in sorted(shares):
            size = max(1, round(share * len(pool)))
            fitted = clone(predictor).fit([trajectories[i] for i in pool[:size]])
            means = accuracy_at(fitted, held_out).groupby("participant", sort=False)["correct"].mean()
            parts.append(means.rename("accuracy").reset_index().assign(split=split, size=size, share=share))
    return pd.concat(parts, ignore_index=True)


def _splits(
    trajectories: Sequence[Trajectory], least: float, repeats: int, rng: np.random.Generator
) -> list[tuple[Any, Any]]:
    from predictors.evaluation.splits import nested_training_sets

    names = {name for each in trajectories for name in each.candidates}
    found = []
    for seed in rng.integers(2**31, size=_REDRAWS).tolist():
        pool, test = nested_training_sets(trajectories, 0.25, np.random.default_rng(seed))
        first = pool[: max(1, round(least * len(pool)))]
        goals = {trajectories[i].goal for i in first}
        if len(goals) > 1 and {name for i in first for name in trajectories[i].candidates} == names:
            found.append((pool, test))
        if len(found) == repeats:
            return found
    raise ValueError(
        f"in only {len(found)} of {_REDRAWS} splits do {round(least * 0.75 * len(trajectories))} trajectories mention "
        f"every goal; {repeats} splits are needed"
    )


# -- comparisons ------------------------------------------------------------------------------------------------------


def whole_units(table: pd.DataFrame, factor: str, value: str) -> pd.DataFrame:
    """The rows of participants who have a value at every level of a factor (and every fraction, if there are any)."""
    known = table.dropna(subset=[value])
    keys = [factor, *(["fraction"] if "fraction" in known else [])]
    if not len(known):
        return known
    wanted = len(known[keys].drop_duplicates())
    counts = known.drop_duplicates(["participant", *keys]).groupby("participant").size()
    return known[known["participant"].isin(counts.index[counts == wanted])].reset_index(drop=True)


def compare(table: pd.DataFrame, value: str, *, factor: str = "condition", alpha: float = 0.05) -> Comparisons:
    """Levels of a factor compared within participants: at each fraction (if there are any) and over all.

    Raises:
        ValueError: Fewer than two levels, or than two participants with values at all of them.
    """
    from predictors.evaluation.comparison import compare_conditions

    own = whole_units(table, factor, value)
    people = own["participant"].nunique()
    if people < 2:
        raise ValueError(f"{people} participant(s) with values at every {factor}; 2 are needed")
    each = compare_conditions(own, factor=factor, value=value, design="within", correct_fractions="holm", alpha=alpha)
    return Comparisons(
        each, compare_conditions(own, factor=factor, value=value, at="mean", design="within", alpha=alpha)
    )


def metrics_table(rows: pd.DataFrame, predictors: Sequence[str], conditions: Sequence[str]) -> pd.DataFrame:
    """Figures of merit per predictor and condition: means over fractions, and over sittings where there are several."""
    found = figures_of_merit(rows, {"predictor": list(predictors), "condition": list(conditions)})
    return found.drop(columns="accuracy_sd")


def hypotheses_of(
    readings: Readings, claim: Claim, settings: AnalysisSettings, rows: pd.DataFrame, curves: pd.DataFrame
) -> Hypotheses:
    """H1 to H3 for one claim, participants as units, within participants.

    Args:
        readings: Of whom.
        claim: What is claimed.
        settings: Of the analysis.
        rows: ``accuracy`` rows of the sittings that count.
        curves: Learning curves of the same.

    Raises:
        ValueError: There are fewer than two participants with values in all conditions of the claim.
    """
    import pandas as pd

    wanted = [claim.treatment, *claim.controls]
    kept = [whole_units(part, "condition", "correct") for part in _by_predictor(rows, wanted)]
    useful = [part for part in kept if part["participant"].nunique() > 1 and set(wanted) <= set(part["condition"])]
    if not useful:
        raise ValueError("fewer than two participants have values in all conditions of the claim")
    curve_parts = []
    for part in _by_predictor(curves, wanted):
        wide = part.assign(factor=part["condition"] + "/" + part["share"].astype(str))
        own = whole_units(wide, "factor", "accuracy")
        if own["participant"].nunique() > 1 and set(wanted) <= set(own["condition"]):
            curve_parts.append(own)
    return assess_hypotheses(
        pd.concat(useful, ignore_index=True),
        treatment=claim.treatment,
        controls=list(claim.controls),
        curves=pd.concat(curve_parts, ignore_index=True) if curve_parts else None,
        unit="participant",
        share=settings.share,
        alpha=settings.alpha,
    )


def _by_predictor(table: pd.DataFrame, conditions: Sequence[str]) -> list[pd.DataFrame]:
    if not len(table):
        return []
    own = table[table["condition"].isin(conditions)]
    return [part for _, part in own.groupby("predictor", sort=False)]
