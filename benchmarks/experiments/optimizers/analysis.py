"""Tables, figures and prose from logged results alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.csv_tables import write_tables
from benchmarks.experiments.optimizers import narrative
from benchmarks.experiments.optimizers.figures import anytime_figure
from benchmarks.experiments.optimizers.sweep import (
    LEARNED,
    LOCAL_SEARCH,
    METHODS,
    OPTIMUM_5X5,
    OURS,
    PAPER_METHODS,
    PUBLISHED,
)
from benchmarks.reports.experiment_report import Section
from legible_envs.drawing.charts import save_figure
from predictors.evaluation.statistics import hedges_g, holm

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "anytime",
    "beside_local_search",
    "beside_published",
    "gaps",
    "leaderboard",
    "learned_beside",
    "ours_against",
    "pairwise",
    "sections",
    "summary",
]

_KEYS = ["grid", "budget", "method"]
_REACHED = 1e-9


def sections(folder: str | Path) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*.svg``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.optimizers.run.reproduce` left its results.

    Raises:
        FileNotFoundError: There are no results.
    """
    import pandas as pd

    folder = Path(folder)
    rows = pd.read_csv(folder / "searches.csv", dtype={"budget": str})
    ends = rows[rows["moment"] == "end"]
    best, pairs, curves = summary(ends), pairwise(ends), anytime(rows)
    gap, published, local = gaps(ends), beside_published(ends), beside_local_search(ends)
    ours, board = ours_against(pairs, "improve"), leaderboard(best)
    tables = {"summary": best, "leaderboard": board, "pairs": pairs, "ours": ours, "gaps": gap}
    tables |= {"published": published, "local_search": local, "anytime": curves}
    learned = learned_beside(best)
    tables |= {} if learned.empty else {"learned": learned}
    write_tables(folder / "tables", tables.items())
    drawn = []
    for (grid, budget), part in curves.groupby(["grid", "budget"], sort=False):
        if budget == "paper":
            continue
        figure = anytime_figure(part, title=f"Best layout so far, {grid}, {int(str(budget)):,} evaluations")
        drawn.append(folder / "figures" / f"anytime_{grid}_{budget}.svg")
        save_figure(drawn[-1], figure)
    parts = [
        Section(
            "What each search finds",
            narrative.about_searches(board),
            {"Best score: mean (standard deviation) over searches": board, "At every budget": best},
            drawn,
        ),
        Section(
            "Are the differences luck?",
            narrative.about_differences(ours),
            {f"`{OURS}` against `improve`": ours, "Pairs of methods": pairs},
        ),
        Section("Optimality on 5x5", narrative.about_optimum(gap), {"Gap to the proven optimum": gap}),
        Section("Beside a plain local search", narrative.about_local_search(), {f"Searches by `{OURS}`": local}),
        Section("Beside the paper", narrative.about_published(published), {"Ranks of the paper's methods": published}),
    ]
    if not learned.empty:
        text = narrative.about_learned(learned)
        parts.append(Section("A designer that learns", text, {"Best score: mean (standard deviation)": learned}))
    return parts


# -- tables -----------------------------------------------------------------------------------------------------------


def summary(ends: pd.DataFrame) -> pd.DataFrame:
    """A row per grid, budget and method: mean (sd) of best score, QD score and coverage over seeds.

    Args:
        ends: The last row of each search.
    """
    import pandas as pd

    rows = []
    for (grid, budget, method), part in ends.groupby(_KEYS, sort=False):
        row: dict[str, Any] = {"grid": grid, "budget": budget, "method": method, "searches": len(part)}
        row["scored"] = float(part["scored"].mean())
        for name in ("best", "qd_score", "coverage"):
            row[name], row[f"{name}_sd"] = float(part[name].mean()), float(part[name].std(ddof=1))
        rows.append({**row, "best_of_all": float(part["best"].max())})
    return pd.DataFrame(rows)


def pairwise(ends: pd.DataFrame) -> pd.DataFrame:
    """Two-sided Mann-Whitney tests of the best scores of every two methods at the same grid and budget.

    Args:
        ends: The last row of each search.

    Returns:
        Columns ``grid, budget, a, b, difference`` (of means, a - b), ``superiority`` (Vargha and Delaney's A: the
        probability that a search by ``a`` ends better than one by ``b``, ties counting half), ``hedges_g``
        (infinite or 0 where nothing varies, see :func:`predictors.evaluation.statistics.hedges_g`), ``p`` and
        ``p_holm`` (Holm's correction over all pairs at that grid and budget). Designers that learn are not among them:
        they run at few budgets, where they are installed, and would change the corrected p of the others.
    """
    import pandas as pd
    from scipy.stats import mannwhitneyu

    tables = []
    for (grid, budget), part in ends.groupby(["grid", "budget"], sort=False):
        names = [name for name in METHODS if name in set(part["method"])]
        rows: list[dict[str, Any]] = []
        for i, a in enumerate(names):
            for b in names[i + 1 :]:
                # Scores that differ in the last bits only are the same score.
                x, y = (part.loc[part["method"] == name, "best"].round(9).to_numpy() for name in (a, b))
                test = mannwhitneyu(x, y, alternative="two-sided")
                row = {
                    "grid": grid,
                    "budget": budget,
                    "a": a,
                    "b": b,
                    "difference": _zero_or(float(x.mean() - y.mean())),
                }
                row |= {"superiority": float(test.statistic / (len(x) * len(y))), "hedges_g": hedges_g(x, y)}
                rows.append({**row, "p": float(test.pvalue)})
        if rows:
            tables.append(pd.DataFrame(rows).assign(p_holm=holm(np.array([row["p"] for row in rows]))))
    columns = ["grid", "budget", "a", "b", "difference", "superiority", "hedges_g", "p", "p_holm"]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=columns)


def ours_against(pairs: pd.DataFrame, other: str) -> pd.DataFrame:
    """The rows of :func:`pairwise` for our emitter and another, with a ``verdict`` at the 1 % level of single tests."""
    own = pairs[(pairs["a"] == OURS) & (pairs["b"] == other)].drop(columns=["a", "b"])
    better = np.where(own["difference"] > 0, "better", "worse")
    return own.assign(verdict=np.where(own["p"] < 0.01, better, "no difference shown")).reset_index(drop=True)


def leaderboard(best: pd.DataFrame) -> pd.DataFrame:
    """Best scores at the largest budget that every method was given, a row per method and a column per grid.

    Args:
        best: What :func:`summary` returns; designers that learn are left out, as they run at small budgets only.

    Returns:
        Columns ``method``, ``budget``, and a text ``"mean (sd)"`` for each grid; ordered by their mean rank.
    """
    import pandas as pd

    equal = best[(best["budget"] != "paper") & ~best["method"].isin(LEARNED)]
    shared = equal.groupby("budget", sort=False)["method"].nunique()
    shared = shared[shared == equal["method"].nunique()]
    if shared.empty:
        return pd.DataFrame(columns=["method", "budget"])
    return _by_grid(equal, max(shared.index, key=int))


def learned_beside(best: pd.DataFrame) -> pd.DataFrame:
    """The leaderboard at the largest budget of designers that learn, with them; empty where none was run.

    Args:
        best: What :func:`summary` returns.
    """
    ran = best[best["method"].isin(LEARNED)]
    return ran[["method", "budget"]] if ran.empty else _by_grid(best, max(ran["budget"], key=int))


def _by_grid(best: pd.DataFrame, budget: str) -> pd.DataFrame:
    """Best scores at one budget, a row per method and a column per grid, ordered by their mean rank."""
    own = best[best["budget"] == budget]
    own = own.assign(text=[f"{mean:.1f} ({sd:.1f})" for mean, sd in zip(own["best"], own["best_sd"], strict=True)])
    table = own.pivot(index="method", columns="grid", values="text")[list(dict.fromkeys(own["grid"]))]
    ranks = own["best"].round(9).groupby(own["grid"]).rank(ascending=False).groupby(own["method"]).mean()
    return (
        table.loc[ranks.sort_values(kind="stable").index]
        .reset_index()
        .assign(budget=budget)[["method", "budget", *table.columns]]
    )


def _zero_or(difference: float) -> float:
    """A difference of scores; sums of the same terms in another order differ in the last bits: that is none."""
    return 0.0 if abs(difference) <= _REACHED else difference


def gaps(ends: pd.DataFrame) -> pd.DataFrame:
    """How far each method stays below the proven optimum of 5x5, and how often it reaches it."""
    own = ends[ends["grid"] == "5x5"]
    gap = (OPTIMUM_5X5 - own["best"]).map(_zero_or)
    own = own.assign(gap=gap, reached=gap <= _REACHED)
    grouped = own.groupby(["budget", "method"], sort=False)
    return grouped.agg(
        searches=("gap", "size"), gap=("gap", "mean"), largest_gap=("gap", "max"), reached=("reached", "mean")
    ).reset_index()


def beside_local_search(ends: pd.DataFrame) -> pd.DataFrame:
    """Our emitter beside what a plain local search reaches in a million evaluations.

    Returns:
        A row per budget and grid: ``local_search`` the value to pass, ``reached`` the share of searches that do (values
        that are equal to the decimals known count).
    """
    own = ends[(ends["method"] == OURS) & ends["grid"].isin(LOCAL_SEARCH) & (ends["budget"] != "paper")]
    own = own.assign(local_search=own["grid"].map(LOCAL_SEARCH))
    own["reached"] = own["best"] >= own["local_search"] - 0.005
    grouped = own.groupby(["grid", "budget"], sort=False)
    return grouped.agg(
        searches=("best", "size"),
        local_search=("local_search", "first"),
        lowest=("best", "min"),
        best=("best", "mean"),
        highest=("best", "max"),
        reached=("reached", "mean"),
    ).reset_index()


def beside_published(ends: pd.DataFrame) -> pd.DataFrame:
    """The paper's three methods: published means and ranks beside ours, at the paper's budget and at equal evaluations.

    Returns:
        A row per budget, grid and method; ``rank`` and ``published_rank`` count from 1, the best; equal means share
        the mean of their ranks.
    """
    import pandas as pd

    own = ends[ends["method"].isin(PAPER_METHODS)]
    table = own.groupby(["budget", "grid", "method"], sort=False)["best"].agg(["mean", "std"]).reset_index()
    complete = table.groupby(["budget", "grid"])["method"].transform("nunique") == len(PAPER_METHODS)
    table = table[complete].rename(columns={"mean": "best", "std": "best_sd"})
    table["paper"] = table["method"].map(PAPER_METHODS)
    table["published"] = [PUBLISHED[name][grid] for name, grid in zip(table["paper"], table["grid"], strict=True)]
    # Scores that differ in the last bits only are the same score.
    for name, source in (("rank", table["best"].round(9)), ("published_rank", table["published"])):
        keys = [table["budget"], table["grid"]]
        table[name] = pd.Series(source, index=table.index).groupby(keys).rank(ascending=False)
    return table.reset_index(drop=True)


def anytime(rows: pd.DataFrame, points: int = 30) -> pd.DataFrame:
    """Best score so far against evaluations: mean over seeds, and a band between their quartiles.

    Args:
        rows: All logged rows.
        points: How many numbers of evaluations, at equal ratios.

    Returns:
        Columns ``grid, budget, method, scored, best, low, high``: the mean, and the quartiles over seeds.
    """
    import pandas as pd

    tables = []
    running = rows[rows["moment"] == "running"]
    for (grid, budget), part in running.groupby(["grid", "budget"], sort=False):
        first = float(part.groupby(["method", "seed"])["scored"].min().max())
        last = float(part.groupby(["method", "seed"])["scored"].max().min())
        at = np.unique(np.round(np.geomspace(first, max(first, last), points)))
        for method, own in part.groupby("method", sort=False):
            bests = np.stack([_best_at(one, at) for _, one in own.groupby("seed", sort=False)])
            low, high = np.quantile(bests, (0.25, 0.75), axis=0)
            curve = {"scored": at, "best": bests.mean(axis=0), "low": low, "high": high}
            tables.append(pd.DataFrame({"grid": grid, "budget": budget, "method": method, **curve}))
    return pd.concat(tables, ignore_index=True)


def _best_at(search: pd.DataFrame, at: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The best score known at each number of evaluations: that of the last row logged by then."""
    search = search.sort_values("scored")
    last = np.searchsorted(search["scored"].to_numpy(), at, side="right") - 1
    return search["best"].to_numpy()[np.maximum(last, 0)]
