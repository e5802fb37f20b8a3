"""The figures behind the sentences of ``templates/experiments/overcooked``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.experiments.conditions import agreements
from benchmarks.experiments.overcooked.sweep import FITTED_SOURCE, PREFERENCE
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.hypotheses import Hypotheses
    from benchmarks.experiments.overcooked.tables import Results

__all__ = ["about_accuracy", "about_agreement", "about_hypotheses", "about_layouts", "about_participants"]


def about_layouts(layouts: pd.DataFrame) -> str:
    """Which layouts there are, and what they cost."""
    means = layouts.groupby("condition")[["legibility", "distance"]].mean()
    return narrate(
        "overcooked/layouts",
        count=int(layouts.groupby("condition").size().min()),
        legibility=means["legibility"].to_dict(),
        distance=means["distance"].to_dict(),
    )


def about_participants(results: Results) -> str:
    """How participants are simulated, and what they were fitted to."""
    return narrate(
        "overcooked/participants", preference=PREFERENCE, source=FITTED_SOURCE, fit=_fit(results.fits) or None
    )


def _fit(fits: pd.DataFrame) -> dict[str, Any]:
    if not len(fits):
        return {}
    whole = fits[fits["participant"].isna() | (fits["participant"] == "")].set_index("walker")
    likelihood = whole["log_likelihood"]
    return {
        "walks": int(whole["walks"].iloc[0]),
        "people": int(whole["people"].max()),
        "steps": int(whole["steps"].iloc[0]),
        "better": str(likelihood.idxmax()),
        "high": likelihood.max(),
        "low": likelihood.min(),
    }


def about_accuracy(metrics: pd.DataFrame, anova: pd.DataFrame, results: Results) -> str:
    """Which predictor predicts the goals of which participants how well."""
    walkers = []
    for walker in results.walkers:
        own = metrics[metrics["walker"] == walker]
        wide = own.pivot_table(index="predictor", columns="condition", values="accuracy", sort=False)
        walkers.append(
            {
                "walker": walker,
                "from_random": list((wide["Legible"] - wide["Random"]).items()),
                "from_efficient": list((wide["Legible"] - wide["Efficient"]).items()),
                "best": {"name": wide["Legible"].idxmax(), "value": wide["Legible"].max()},
            }
        )
    each = anova[(anova["unit"] == "layout") & anova["fraction"].notna()]
    first = each[(each["walker"] == results.walkers[0]) & (each["predictor"] == results.predictors[0])]
    return narrate(
        "overcooked/accuracy",
        walkers=walkers,
        predictor=results.predictors[0],
        percent=[f"{100 * fraction:.0f}" for fraction in first[first["p_holm"] < 0.05]["fraction"]],
    )


def about_agreement(published: pd.DataFrame) -> str:
    """What agrees with the paper and what differs, from the table of both.

    Args:
        published: As of :func:`benchmarks.experiments.overcooked.tables.beside_published`.
    """
    found = agreements(published, "Legible", "Random")
    return narrate("overcooked/published", agreements=[{"who": who, **vars(it)} for who, it in found.items()])


def about_hypotheses(found: dict[str, Hypotheses]) -> str:
    """The verdicts, and whether they hold for every predictor."""
    walkers = []
    for walker, result in found.items():
        first = result.tests[result.tests["hypothesis"] == "H1"]
        good = first.groupby("predictor", sort=False)["supported"].all()
        walkers.append(
            {
                "walker": walker,
                "verdicts": result.words(),
                "supported": good.index[good].tolist(),
                "others": good.index[~good].tolist(),
                "worse": first[first["high"] < 0]["predictor"].unique().tolist(),
            }
        )
    return narrate("overcooked/hypotheses", walkers=walkers)
