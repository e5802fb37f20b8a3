"""The figures behind the sentences of ``templates/experiments/tabletop``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.experiments.conditions import agreements
from benchmarks.experiments.tabletop.sweep import (
    ALONE,
    CONDITIONS,
    HAVE_OBSTACLES,
    NO_PREDICTION,
    PUBLISHED,
    PUBLISHED_SPREAD,
)
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.hypotheses import Hypotheses
    from benchmarks.experiments.tabletop.tables import Results

__all__ = [
    "about_accuracy",
    "about_agreement",
    "about_compliance",
    "about_hypotheses",
    "about_layouts",
    "about_participants",
    "about_spread",
    "about_teams",
]


def about_layouts(results: Results) -> str:
    """Which tables there are, and what they cost."""
    means = results.layouts.groupby("condition")[["score", "distance", "mean_detour", "num_obstacles"]].mean()
    found_after = results.layouts.groupby("condition")["found_after"].max()
    return narrate(
        "tabletop/layouts",
        count=int(results.layouts.groupby("condition").size().min()),
        evaluations=int(found_after["Both"]),
        initial=int(found_after["Random"]),
        scores=[(name, means["score"][name]) for name in CONDITIONS],
        distances=[(name, means["distance"][name]) for name in CONDITIONS],
        detours=[(name, means["mean_detour"][name]) for name in HAVE_OBSTACLES],
        obstacles=[(name, means["num_obstacles"][name]) for name in HAVE_OBSTACLES],
    )


def about_participants() -> str:
    """How participants are simulated."""
    return narrate("tabletop/participants")


def about_accuracy(results: Results, metrics: pd.DataFrame, anova: pd.DataFrame) -> str:
    """Which predictor predicts the goals of which participants how well."""
    wide = metrics.pivot_table(index="predictor", columns="condition", values="accuracy", sort=False)
    changes = {name: wide[name] - wide["Baseline"] for name in ("Placement", "Virtual Obstacle", "Both")}
    each = anova[(anova["unit"] == "layout") & anova["fraction"].notna() & (anova["p_holm"] < 0.05)]
    return narrate(
        "tabletop/accuracy",
        gains=[{"condition": name, "changes": list(change.items())} for name, change in changes.items()],
        best=_extremes(wide["Both"])["high"],
        sorting=_extremes(wide["Baseline"] - wide["Random"]),
        differing=[
            {"predictor": name, "percent": [f"{100 * f:.0f}" for f in each[each["predictor"] == name]["fraction"]]}
            for name in results.predictors[:2]
        ],
        starts=_starts(results),
    )


def _extremes(values: pd.Series[float]) -> dict[str, dict[str, Any]]:
    """The lowest and the highest value, each with its name."""
    return {
        "low": {"name": values.idxmin(), "value": float(values.min())},
        "high": {"name": values.idxmax(), "value": float(values.max())},
    }


def _starts(results: Results) -> dict[str, Any] | None:
    rows = results.complying("start")
    means = rows[rows["predictor"] == results.predictors[0]].groupby("start")["correct"].mean()
    if not {"home", "assembly"} <= set(means.index):
        return None
    return {"predictor": results.predictors[0], "home": means["home"], "assembly": means["assembly"]}


def about_agreement(published: pd.DataFrame, metrics: pd.DataFrame, predictors: list[str]) -> str:
    """What agrees with the paper's F1 and what differs.

    Args:
        published: As of :func:`benchmarks.experiments.tabletop.tables.beside_published`.
        metrics: As of :func:`benchmarks.experiments.tabletop.tables.metrics_table`.
        predictors: In order, the paper's first.
    """
    order = sorted(PUBLISHED, key=lambda name: -PUBLISHED[name]["f1"])
    wide = metrics.pivot_table(index="predictor", columns="condition", values="f1", sort=False)[list(PUBLISHED)]
    gains, nearest = wide["Both"] - wide["Baseline"], predictors[1]
    others = _extremes(gains.drop(nearest))
    return narrate(
        "tabletop/published",
        agreements=[{"who": who, **vars(it)} for who, it in agreements(published, "Both", "Baseline").items()],
        num_predictors=len(predictors),
        best_at_both=[name for name in predictors if max(order, key=lambda c: wide[c][name]) == "Both"],
        same_order=[name for name in predictors if sorted(order, key=lambda c: -wide[c][name]) == order],
        nearest={"change": float(gains[nearest]), "least": others["low"], "most": others["high"]},
    )


def about_spread(spread: pd.DataFrame, beside: pd.DataFrame) -> str:
    """Whether reaches to the same goal are more alike at legible tables, and more unlike those to other goals."""
    table = beside.set_index("condition")
    own = spread[spread["alignment"] == "none"].set_index("condition")
    return narrate(
        "tabletop/spread",
        alignments=[_covariances(table, suffix) for suffix in ("ours", "ours, warped")],
        published_order=list(PUBLISHED_SPREAD),
        apart=[(name, 100 * own["apart"][name]) for name in CONDITIONS],
        ratios=[(name, own["apart"][name] / own["trace"][name] ** 0.5) for name in CONDITIONS],
    )


def _covariances(table: pd.DataFrame, suffix: str) -> dict[str, Any]:
    def change(column: str) -> float:
        return float(table[column]["Both"] / table[column]["Baseline"])

    trace = table[f"trace, {suffix}"]
    return {
        "warped": "warped" in suffix,
        "ranked": sorted(PUBLISHED_SPREAD, key=lambda name: -trace[name]),
        "trace": change(f"trace, {suffix}"),
        "published_trace": change("trace, paper"),
        "determinant": change(f"determinant, {suffix}"),
        "published_determinant": change("determinant, paper"),
        "baseline": trace["Baseline"] / table["trace, paper"]["Baseline"],
    }


def about_hypotheses(found: dict[str, Hypotheses]) -> str:
    """The verdicts, and whether they hold for every predictor."""
    designs = []
    for treatment, result in found.items():
        first = result.tests[(result.tests["hypothesis"] == "H1") & (result.tests["control"] == "Baseline")]
        designs.append(
            {
                "treatment": treatment,
                "verdicts": result.words(),
                "supported": first[first["supported"]]["predictor"].tolist(),
                "others": first[~first["supported"]]["predictor"].tolist(),
                "worse": first[first["high"] < 0]["predictor"].tolist(),
            }
        )
    return narrate("tabletop/hypotheses", designs=designs)


def about_compliance(table: pd.DataFrame) -> str:
    """What happens to the gain of obstacles when participants ignore them."""
    predictors = []
    for predictor, own in table.groupby("predictor", sort=False):
        changes = [
            {
                "condition": name,
                "first": own[name].iloc[0],
                "last": own[name].iloc[-1],
                "below": own[own[name] < own["Placement"]]["crossing"].tolist(),
            }
            for name in HAVE_OBSTACLES
        ]
        predictors.append({"name": predictor, "placement": own["Placement"].iloc[0], "changes": changes})
    return narrate("tabletop/compliance", most=100 * float(table["crossing"].max()), predictors=predictors)


def about_teams(results: Results, teams: pd.DataFrame, differences: pd.DataFrame) -> str:
    """How a robot that predicts goals works at the tables."""
    robots = list(dict.fromkeys(teams["reader"]))
    first, mean = robots[0], teams.set_index(["reader", "measure", "condition"])["mean"]

    def saved(robot: str, measure: str) -> list[float]:
        """By how much the first robot lowers a measure in each condition; nothing if there is no such other robot."""
        if robot not in robots:
            return []
        return [mean[robot, measure, name] - mean[first, measure, name] for name in CONDITIONS]

    own = differences[differences["condition"] == "Both"]
    own = own.assign(measure=own["measure"].str.replace("_", " "))
    sure = own[own["p"] < 0.05]
    worth = zip(
        CONDITIONS, saved(NO_PREDICTION, "completion_time"), saved(NO_PREDICTION, "goals_lost"), strict=False
    )  # both empty without such a robot
    return narrate(
        "tabletop/teams",
        participants=int(results.teams.groupby(["reader", "condition"])["participant"].nunique().min()),
        robots=[name for name in robots if name not in (ALONE, NO_PREDICTION)],
        blind=NO_PREDICTION,
        unfinished=int(results.teams["completion_time"].isna().sum()),
        first=first,
        significant=list(zip(sure["measure"], sure["difference"], strict=True)),
        unchanged=own[own["p"] >= 0.05]["measure"].tolist(),
        times=[(name, mean[first, "completion_time", name]) for name in CONDITIONS if name in set(teams["condition"])],
        decisions=[
            {
                "name": name,
                "time": mean[first, "decision_time", name],
                "rightly": mean[first, "decided_rightly", name],
            }
            for name in CONDITIONS
        ],
        saved=list(zip(CONDITIONS, saved(ALONE, "completion_time"), strict=False)),
        worth=[{"name": name, "time": time, "count": count} for name, time, count in worth],
        sooner=mean[first, "decision_time", "Baseline"] - mean[first, "decision_time", "Both"],
        slower=mean[first, "completion_time", "Both"] - mean[first, "completion_time", "Baseline"],
    )
