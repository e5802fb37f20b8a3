"""Everything that an analysis finds in an export: tables, tests, and what cannot be said."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from benchmarks.experiments import conditions as tables
from benchmarks.experiments.conditions import Comparisons
from benchmarks.experiments.hypotheses import Hypotheses
from benchmarks.study.analysis.data import StudyData
from benchmarks.study.analysis.evaluate import Readings, compare, hypotheses_of, metrics_table, read_goals
from benchmarks.study.analysis.measures import (
    MEASURES,
    Family,
    compare_family,
    long_form,
    per_condition,
    scale_values,
    trend_rows,
)
from benchmarks.study.analysis.played import setting_name
from benchmarks.study.analysis.settings import AnalysisSettings, Claim, published_for
from benchmarks.study.design.study import Study

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Findings", "find", "main_rows", "settings_of"]


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found.

    Attributes:
        data: The export.
        readings: What predictors made of it.
        metrics: Figures of merit per predictor and condition.
        comparisons: Accuracy by condition, for each predictor that two participants or more can be compared with.
        published: Beside the paper's figures; empty without any of its conditions.
        hypotheses: By treatment.
        work: Measures of work, compared over conditions.
        scales: Scales of questionnaires, likewise.
        sittings: Accuracy and work compared over sittings, within each condition; None with one sitting.
        trends: How measures change over positions and rounds.
        spread: Determinant and trace of covariances of reaches; empty for kitchens.
        unsaid: What cannot be said, and why, in sentences.
    """

    data: StudyData
    readings: Readings
    metrics: pd.DataFrame
    comparisons: dict[str, Comparisons]
    published: pd.DataFrame
    hypotheses: dict[str, Hypotheses]
    work: Family
    scales: Family
    sittings: Family | None
    trends: pd.DataFrame
    spread: pd.DataFrame
    unsaid: list[str] = field(default_factory=list)


def settings_of(study: Study) -> dict[str, tuple[str, str]]:
    """Condition and sitting by the name that trajectories and tables give to both."""
    sittings = study.content.sittings
    found = {}
    for number in range(max(1, len(sittings))):
        own = sittings[number].conditions if sittings else None
        for condition in study.conditions:
            if own is None or condition in own:
                name = sittings[number].name if sittings else ""
                found[setting_name(study, condition, number)] = condition, name
    return found


def main_rows(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """The rows on which conditions are compared: of sittings with obstacles, or of all where none has any."""
    with_obstacles = {sitting.name for sitting in study.content.sittings if sitting.obstacles}
    if not len(table) or "sitting" not in table or not with_obstacles:
        return table
    return table[table["sitting"].isin(with_obstacles)].reset_index(drop=True)


def find(
    study: Study,
    data: StudyData,
    settings: AnalysisSettings,
    claims: Sequence[Claim],
    *,
    progress: Callable[[str], object] | None = None,
) -> Findings:
    """Analyse an export.

    Args:
        study: The design.
        data: The export.
        settings: How much is done.
        claims: Where goals should be predicted better.
        progress: Called with what comes next, in words.
    """
    import pandas as pd

    readings = read_goals(data.trajectories, settings_of(study), settings, progress=progress)
    unsaid = list(readings.unsaid)
    rows = main_rows(study, readings.tables.get("accuracy", pd.DataFrame()))
    metrics = pd.DataFrame()
    if readings.predictors:
        metric_rows = main_rows(study, readings.tables["metrics"])
        metrics = metrics_table(metric_rows, readings.predictors, study.conditions)
    comparisons = _comparisons(rows, readings.predictors, study.conditions, settings, unsaid)
    hypotheses = _hypotheses(study, readings, rows, claims, settings, unsaid)
    work, sittings, trends = _work(study, data, readings, settings)
    scales = compare_family(main_rows(study, scale_values(data)), study.conditions, alpha=settings.alpha)
    spread = _spread(study, data, settings, unsaid) if study.content.domain == "tabletop" else pd.DataFrame()
    for family in (work, scales, sittings):
        unsaid += family.unsaid if family is not None else []
    return Findings(
        data=data,
        readings=readings,
        metrics=metrics,
        comparisons=comparisons,
        published=_published(study, metrics, readings.predictors),
        hypotheses=hypotheses,
        work=work,
        scales=scales,
        sittings=sittings,
        trends=trends,
        spread=spread,
        unsaid=unsaid,
    )


def _comparisons(
    rows: pd.DataFrame,
    predictors: Sequence[str],
    conditions: Sequence[str],
    settings: AnalysisSettings,
    unsaid: list[str],
) -> dict[str, Comparisons]:
    found = {}
    for predictor in predictors:
        own = tables.in_order(rows[rows["predictor"] == predictor], condition=conditions)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # who is left out is listed
                found[predictor] = compare(own, "correct", alpha=settings.alpha)
        except ValueError as error:
            unsaid.append(f"{predictor}: conditions cannot be compared: {error}.")
    return found


def _hypotheses(
    study: Study,
    readings: Readings,
    rows: pd.DataFrame,
    claims: Sequence[Claim],
    settings: AnalysisSettings,
    unsaid: list[str],
) -> dict[str, Hypotheses]:
    found = {}
    curves = main_rows(study, readings.curves)
    for claim in claims:
        if not len(rows) or not {claim.treatment, *claim.controls} <= set(rows["condition"]):
            unsaid.append(f"The hypotheses about {claim.treatment} are not tested: a condition has no trajectories.")
            continue
        try:
            found[claim.treatment] = hypotheses_of(readings, claim, settings, rows, curves)
        except ValueError as error:
            unsaid.append(f"The hypotheses about {claim.treatment} are not tested: {error}.")
    if not claims:
        unsaid.append(
            "No hypotheses are tested: the study has none of the paper's pairs of conditions. Name what should be "
            "better with --treatment CONDITION, and what it is compared with by --control CONDITION."
        )
    return found


# -- work -------------------------------------------------------------------------------------------------------------


def _work(
    study: Study, data: StudyData, readings: Readings, settings: AnalysisSettings
) -> tuple[Family, Family | None, pd.DataFrame]:
    """Measures over conditions, over sittings, and over positions and rounds."""
    import pandas as pd

    domain, content = study.content.domain, study.content
    fixed = bool(domain == "tabletop" and content.rounds.reaches)
    names = MEASURES[domain]
    each = per_condition(data, domain, fixed_reaches=fixed, by=("sitting",))
    accuracy = _accuracy_of_people(readings)
    work = compare_family(long_form(main_rows(study, each), names), study.conditions, alpha=settings.alpha)
    sittings = None
    if len(content.sittings) > 1:
        joined = each.merge(accuracy, on=["participant", "condition", "sitting"], how="left") if len(each) else each
        known = {"accuracy": f"accuracy of {readings.predictors[0]}" if readings.predictors else "accuracy", **names}
        parts = [
            long_form(part.assign(condition=part["sitting"]), known).assign(
                measure=lambda rows, name=condition: name + ": " + rows["measure"]  # type: ignore[misc]
            )
            for condition, part in joined.groupby("condition", sort=False)
        ]
        table = (
            pd.concat(parts, ignore_index=True)
            if parts
            else pd.DataFrame(columns=["participant", "condition", "measure", "value"])
        )
        sittings = compare_family(table, [sitting.name for sitting in content.sittings], alpha=settings.alpha)
    return work, sittings, _trends(study, data, names, accuracy, fixed, settings)


def _accuracy_of_people(readings: Readings) -> pd.DataFrame:
    """``participant, condition, sitting, accuracy`` of the first predictor, mean over fractions."""
    import pandas as pd

    if not readings.predictors:
        return pd.DataFrame(columns=["participant", "condition", "sitting", "accuracy"])
    rows = readings.tables["accuracy"]
    own = rows[rows["predictor"] == readings.predictors[0]]
    means = own.groupby(["participant", "condition", "sitting"], sort=False)["correct"].mean()
    return means.rename("accuracy").reset_index()


def _trends(
    study: Study,
    data: StudyData,
    names: dict[str, str],
    accuracy: pd.DataFrame,
    fixed: bool,
    settings: AnalysisSettings,
) -> pd.DataFrame:
    import pandas as pd

    from predictors.evaluation.statistics import holm

    domain, rows = study.content.domain, []
    by_position = per_condition(data, domain, fixed_reaches=fixed, by=("sitting", "position"))
    if len(by_position):
        by_position = by_position.merge(accuracy, on=["participant", "condition", "sitting"], how="left")
    known = {"accuracy": "accuracy of the first predictor", **names}
    rows += trend_rows(main_rows(study, by_position), "position", known, alpha=settings.alpha)
    if study.content.rounds.per_condition > 1 and not fixed:
        by_round = per_condition(data, domain, fixed_reaches=False, by=("round",))
        rows += trend_rows(by_round, "round", names, alpha=settings.alpha)
    table = pd.DataFrame(rows)
    return table.assign(p_holm=holm(table["p"])) if len(table) else table


# -- reaches ----------------------------------------------------------------------------------------------------------


def _spread(study: Study, data: StudyData, settings: AnalysisSettings, unsaid: list[str]) -> pd.DataFrame:
    """How much reaches to one goal differ, by condition: those from the assembly zone, where most begin."""
    import pandas as pd

    from benchmarks.experiments.tabletop.run import covariance_rows
    from benchmarks.experiments.tabletop.tables import spread_summary

    parts = []
    for layout, (condition, sitting) in settings_of(study).items():
        own = [each for each in data.trajectories if each.layout_name == layout and each.start == "assembly"]
        counts: dict[str | None, int] = {}
        for reach in own:
            counts[reach.goal] = counts.get(reach.goal, 0) + 1
        kept = [reach for reach in own if counts[reach.goal] > 1]
        try:
            rows = covariance_rows(kept, settings.samples)
        except ValueError as error:
            unsaid.append(f"{layout}: how much reaches differ is not known: {error}.")
            continue
        parts.append(pd.DataFrame(rows).assign(condition=condition, sitting=sitting, layout=layout))
    if not parts:
        return pd.DataFrame()
    whole = main_rows(study, pd.concat(parts, ignore_index=True))
    found = spread_summary(whole, study.conditions)
    return found.drop(columns="trace_sd")


def _published(study: Study, metrics: pd.DataFrame, predictors: Sequence[str]) -> pd.DataFrame:
    """F1, precision and recall of the paper and of the paper's predictors here."""
    import pandas as pd

    if not len(metrics):
        return pd.DataFrame()
    known = published_for(study.content.domain, sorted(set(metrics["condition"])))
    ours: dict[str, Any] = {}
    for predictor in predictors[:2]:
        own = metrics[metrics["predictor"] == predictor]
        if set(known) <= set(own["condition"]):
            ours[predictor] = own
    return tables.beside_published(known, ours) if known and ours else pd.DataFrame()
