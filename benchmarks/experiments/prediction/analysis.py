"""Tables from logged rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.experiments.prediction.sweep import LAYOUTS, POINTING_REFERENCE, REFERENCE
from predictors.evaluation.omissions import markdown_row

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

__all__ = ["accuracy_table", "compare_with_reference", "reference_rows", "summarise", "to_markdown"]


def summarise(rows: pd.DataFrame) -> pd.DataFrame:
    """Means over trajectories: the rows of :func:`benchmarks.experiments.prediction.run.score_recorded_play`."""
    scores = (
        rows.assign(chance=1.0 / rows["candidates"])
        .groupby(["layout", "predictor", "fraction"], sort=False)
        .agg(
            accuracy=("correct", "mean"),
            chance=("chance", "mean"),
            walks=("trajectory", "nunique"),
            participants=("participant", "nunique"),
            repeats=("repeat", "nunique"),
        )
        .reset_index()
    )
    scores.attrs.update(rows.attrs)
    return scores


def accuracy_table(scores: pd.DataFrame) -> pd.DataFrame:
    """A table to print: a row per kitchen and predictor, a column per percentage observed, and their mean.

    Args:
        scores: The rows of :func:`benchmarks.experiments.prediction.run.score_recorded_play`.

    Returns:
        Columns ``layout``, ``predictor``, ``walks``, ``10 %``, …, ``mean``, ``chance``, in the order of the sweep.
    """
    keys = ["layout", "predictor"]
    wide = scores.pivot_table(index=keys, columns="fraction", values="accuracy", sort=False)
    wide = wide.reindex(columns=sorted(wide.columns))
    wide.columns = [f"{100 * fraction:.3g} %" for fraction in wide.columns]
    means = scores.groupby(keys, sort=False).agg(
        walks=("walks", "first"), mean=("accuracy", "mean"), chance=("chance", "first")
    )
    table = means[["walks"]].join(wide).join(means[["mean", "chance"]]).reset_index()
    table.attrs.update(scores.attrs)
    return table


def compare_with_reference(scores: pd.DataFrame) -> pd.DataFrame:
    """Mean accuracy beside that measured before with other implementations of the same ideas.

    Args:
        scores: The rows of :func:`benchmarks.experiments.prediction.run.score_recorded_play` or ``score_pointing``.

    Returns:
        Columns ``layout``, ``predictor``, ``accuracy``, ``reference`` and ``difference`` (NaN where none was measured).
    """
    table = scores.groupby(["layout", "predictor"], sort=False)["accuracy"].mean().reset_index()
    known = {
        (layout, predictor): value
        for predictor, values in REFERENCE.items()
        for layout, value in zip(LAYOUTS, values, strict=True)
    }
    known |= {("pointing", predictor): value for predictor, value in POINTING_REFERENCE.items()}
    pairs = zip(table["layout"], table["predictor"], strict=True)
    table["reference"] = [known.get(pair, float("nan")) for pair in pairs]
    table["difference"] = table["accuracy"] - table["reference"]
    table.attrs.update(scores.attrs)
    return table


def reference_rows(scores: pd.DataFrame) -> list[dict[str, str]]:
    """:func:`compare_with_reference` for reading: a row per predictor, per kitchen its accuracy and the difference.

    Where a predictor could not be evaluated there is a dash.
    """
    table = compare_with_reference(scores)
    repeats = scores.groupby("predictor", sort=False)["repeats"].first()
    rows = []
    for predictor, part in table.groupby("predictor", sort=False):
        row = {"predictor": str(predictor), **dict.fromkeys(map(str, table["layout"]), "\u2013")}
        for layout, accuracy, difference in zip(part["layout"], part["accuracy"], part["difference"], strict=True):
            beside = "" if difference != difference else f" ({round(difference, 3) + 0.0:+.3f})".replace("-", "\u2212")
            row[str(layout)] = f"{accuracy:.3f}{beside}"
        rows.append({**row, "repeats": str(repeats[predictor])})
    return rows


def to_markdown(rows: Sequence[dict[str, str]]) -> str:
    """Rows as a Markdown table."""
    columns = list(rows[0])
    lines = [markdown_row(columns), "| --- |" + " ---: |" * (len(columns) - 1)]
    lines += [markdown_row([row[name] for name in columns]) for row in rows]
    return "\n".join(lines) + "\n"
