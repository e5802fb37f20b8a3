"""Tables, figures and words from logged results alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.experiments.conditions import agreements, stacked
from benchmarks.experiments.overcooked import figures, tables
from benchmarks.experiments.overcooked.sweep import FITTED, FITTED_SOURCE, PREFERENCE
from benchmarks.reports.experiment_report import Section, write_tables

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.hypotheses import Hypotheses

__all__ = ["agreement", "sections"]

_UNIT_NOTE = (
    "Each condition has several layouts, each searched (or drawn) anew with people of its own. Tests take layouts as "
    "units (the nested analysis of variance), so that a difference holds for other layouts made in the same way, not "
    "only for other people in these. With people as units in one layout per condition, as in the paper, luck in the "
    "one search cannot be told from the effect of the condition; that analysis stands beside it."
)


def sections(folder: str | Path) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.overcooked.run.reproduce` left its results.

    Raises:
        FileNotFoundError: There are no results.
    """
    folder = Path(folder)
    results = tables.load_results(folder)
    best = tables.best_layouts(results)
    metrics = tables.metrics_table(results)
    anova = tables.anova_table(results, best)
    hypotheses = tables.hypotheses_of(results)
    tests = stacked({walker: found.tests for walker, found in hypotheses.items()}, "people")
    verdicts = stacked({walker: found.verdicts() for walker, found in hypotheses.items()}, "people")
    points = stacked({walker: found.points for walker, found in hypotheses.items()}, "people")
    published = tables.beside_published(metrics, results.predictors[0])
    fitted = _people_table(results.fits)
    layouts = _layout_table(results.layouts)
    written = {
        "layouts": layouts,
        "people": fitted,
        "metrics": metrics,
        "published": published,
        "anova": anova,
        "hypotheses": tests,
        "hypotheses_by_fraction": points,
        "verdicts": verdicts,
    }
    write_tables(folder / "tables", written.items())
    drawn = figures.draw_all(results, folder / "figures")
    return [
        Section("Layouts", _about_layouts(results, layouts), {"Layouts by condition": layouts}, drawn["layouts"]),
        Section("People", _about_people(results), {"Fitted to recorded play": fitted}),
        Section(
            "How well people are read",
            f"{_about_reading(metrics, anova, results)}\n\n{_UNIT_NOTE}",
            {"Figures of merit, mean over 10 to 90 % observed": metrics, "Over all fractions": _overall(anova)},
            drawn["accuracy"],
        ),
        Section(
            "Beside the paper",
            agreement(published),
            {f"Weighted F1, precision and recall: {results.predictors[0]}": published},
            drawn["published"],
        ),
        Section(
            "Hypotheses",
            _about_hypotheses(hypotheses),
            {"Verdicts": verdicts, "Every test": tests},
            drawn["curves"],
        ),
        Section(
            "What is taken for what, and what is learned",
            f"Confusions in the layouts shown, {results.walkers[0]} people, all fractions observed together; and what "
            "each trial is worth to these people (negative cost) as MaxEnt inverse reinforcement learning sees it. "
            "The walkers have only mild likings of their own, so that these maps are flat where nobody walks and "
            "show mostly which trials people's ways share.",
            {},
            drawn["confusion"],
        ),
    ]


# -- tables for the page ----------------------------------------------------------------------------------------------


def _layout_table(layouts: pd.DataFrame) -> pd.DataFrame:
    names = {"score": "legibility", "num_obstacles": "obstacles"}
    keep = ["condition", "layout", "score", "normalised", "distance", "num_obstacles", "evaluations"]
    return layouts[keep].rename(columns=names)


def _people_table(fits: pd.DataFrame) -> pd.DataFrame:
    """What was fitted: a row per kind of walker."""
    import pandas as pd

    if not len(fits):
        planner = pd.DataFrame(FITTED["planner"]["people"], columns=["turn_cost", "slip"])
        numbers = {key: FITTED["planner"][key] for key in ("depth", "recency", "fade")} | planner.median().to_dict()
        return pd.DataFrame([{"walker": "boltzmann", **FITTED["boltzmann"]}, {"walker": "planner", **numbers}])
    whole = fits[fits["participant"].isna() | (fits["participant"] == "")]
    columns = ["walker", "rationality", "spread", "depth", "turn_cost", "recency", "fade", "slip", "log_likelihood"]
    return whole[[c for c in [*columns, "steps", "walks", "people"] if c in whole]].reset_index(drop=True)


def _overall(anova: pd.DataFrame) -> pd.DataFrame:
    own = anova[anova["fraction"].isna()]
    return own[["walker", "predictor", "unit", "F", "df1", "df2", "p", "eta_squared"]].reset_index(drop=True)


# -- words ------------------------------------------------------------------------------------------------------------


def _about_layouts(results: tables.Results, layouts: pd.DataFrame) -> str:
    means = layouts.groupby("condition")[["legibility", "distance"]].mean()
    count = int(layouts.groupby("condition").size().min())
    steps = means["distance"]["Legible"] / means["distance"]["Efficient"]
    return (
        f"{count} layouts per condition. Random is the median by legibility of as many random layouts as a search "
        "begins with; the others are the best a search found for the expected walking distance (Efficient), for "
        "legibility (Legible), and for the sum of both, each standardised (Legible-Efficient). Shown is the best of "
        "each, a middle one of the random; the shade says how often the goal is in doubt on a trial. Legibility is "
        f"Eq. 3 per sequence. Mean legibility rises from {means['legibility']['Random']:.1f} (Random) over "
        f"{means['legibility']['Efficient']:.1f} (Efficient) to {means['legibility']['Legible']:.1f} (Legible). It is "
        f"paid for in steps: people in legible layouts walk {steps:.1f} times as far as in efficient ones "
        f"({means['distance']['Legible']:.0f} against {means['distance']['Efficient']:.0f} steps for three soups), in "
        f"legible-efficient ones {means['distance']['Legible-Efficient'] / means['distance']['Efficient']:.1f} times."
    )


def _about_people(results: tables.Results) -> str:
    first = (
        "People are simulated. Two kinds, neither of them the walker that layouts are scored with (which takes a "
        "shortest path): noisily rational ones (a softmax over steps), and planners who look a few steps ahead, "
        "dislike turning, avoid where they have just been, and slip. What differs between people: rationality, "
        f"or the cost of turning and the rate of slips; and the cost of each trial (log spread {PREFERENCE:g}, an "
        "assumption: recorded walks are too few to fit it). Each person cooks three soups. Walks with one valid goal "
        "are left out: there is nothing to predict."
    )
    fits = results.fits
    if not len(fits):
        return f"{first}\n\nThe recordings are not there; people are as fitted before, on {FITTED_SOURCE}."
    whole = fits[fits["participant"].isna() | (fits["participant"] == "")].set_index("walker")
    likelihood = whole["log_likelihood"]
    better = str(likelihood.idxmax())
    return (
        f"{first}\n\nFitted to {int(whole['walks'].iloc[0]):,} recorded walks of {int(whole['people'].max())} people "
        f"(Overcooked-AI's published games of 2019). The {better} model explains their "
        f"{int(whole['steps'].iloc[0]):,} steps better: log-likelihood {likelihood.max():,.0f} against "
        f"{likelihood.min():,.0f}."
    )


def _about_reading(metrics: pd.DataFrame, anova: pd.DataFrame, results: tables.Results) -> str:
    lines = []
    for walker in results.walkers:
        own = metrics[metrics["walker"] == walker]
        wide = own.pivot_table(index="predictor", columns="condition", values="accuracy", sort=False)
        gain = wide["Legible"] - wide["Random"]
        beyond = wide["Legible"] - wide["Efficient"]
        lines.append(
            f"{walker.capitalize()} people: from Random to Legible, accuracy (mean over 10 to 90 % seen) changes by "
            + ", ".join(f"{value:+.3f} ({name})" for name, value in gain.items())
            + "; from Efficient to Legible by "
            + ", ".join(f"{value:+.3f} ({name})" for name, value in beyond.items())
            + f". The best reader of legible layouts is {wide['Legible'].idxmax()} ({wide['Legible'].max():.3f})."
        )
    each = anova[(anova["unit"] == "layout") & anova["fraction"].notna()]
    first = each[(each["walker"] == results.walkers[0]) & (each["predictor"] == results.predictors[0])]
    differ = first[first["p_holm"] < 0.05]["fraction"]
    points = ", ".join(f"{100 * f:.0f}" for f in differ)
    said = f"at {points} % observed" if len(differ) else "at no point alone"
    lines.append(
        f"{results.predictors[0]}, {results.walkers[0]} people: conditions differ {said} (one-way ANOVA over layouts, "
        "Holm over points)."
    )
    return "\n\n".join(lines)


def agreement(published: pd.DataFrame) -> str:
    """What agrees with the paper and what differs, from the table of both.

    Args:
        published: As of :func:`benchmarks.experiments.overcooked.tables.beside_published`.
    """
    lines = []
    for walker, it in agreements(published, "Legible", "Random").items():
        same = (
            f"{it.swapped} of 6 pairs of conditions in another order than"
            if it.swapped
            else "the same order of conditions as"
        )
        lines.append(
            f"{walker.capitalize()} people: {same} in the paper ({', '.join(it.ranked)}, the best read first). Legible "
            f"layouts raise F1 by {it.gain:+.3f} over random ones, {it.gain_said} the paper's "
            f"{it.published_gain:+.3f}. Over all conditions our F1 is {it.level_said}."
        )
    lines.append(
        "Why values may differ: the paper's are of human participants, who learn, hesitate and change their minds; "
        "ours are simulated, though fitted to recorded play. Ours are means over several layouts, not one. Our "
        "predictors know which goals are still valid, so chance is higher; what a figure of the paper is averaged over "
        "(fractions observed, repeats) we do not know, and ours is the mean over 10 to 90 %. Our kitchens are "
        "searched to the paper's number of iterations, with an exact score rather than a sampled one."
    )
    return "\n\n".join(lines)


def _about_hypotheses(found: dict[str, Hypotheses]) -> str:
    from benchmarks.experiments.hypotheses import __doc__ as about

    source = " ".join((about or "").split("\n\n")[1].split())
    parts = [source]
    for walker, result in found.items():
        parts.append(f"{walker.capitalize()} people.\n\n{result.words()}")
        parts.append(_agnostic(result))
    return "\n\n".join(parts)


def _agnostic(result: Hypotheses) -> str:
    """Whether the layout helps every predictor, in words."""
    first = result.tests[result.tests["hypothesis"] == "H1"]
    good = first.groupby("predictor", sort=False)["supported"].all()
    harmed = first[(first["high"] < 0)]["predictor"].unique()
    if good.all():
        return "Classifier-agnostic: yes, every predictor reads people in legible layouts better."
    said = f"Classifier-agnostic: no. H1 holds for {', '.join(good.index[good]) or 'none'}, not for "
    said += ", ".join(good.index[~good])
    return said + (
        f"; significantly worse for {', '.join(harmed)}." if len(harmed) else "; none is significantly worse."
    )
