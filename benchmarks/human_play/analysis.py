"""Tables from logged rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.human_play.sweep import LAYOUTS, REFERENCE

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["accuracy_table", "compare_with_reference", "summarise"]


def summarise(rows: pd.DataFrame) -> pd.DataFrame:
    """Means over walks: the rows of :func:`benchmarks.human_play.run.score_recorded_play`."""
    scores = (
        rows.assign(chance=1.0 / rows["candidates"])
        .groupby(["layout", "predictor", "fraction"], sort=False)
        .agg(
            accuracy=("correct", "mean"),
            chance=("chance", "mean"),
            walks=("trajectory", "nunique"),
            participants=("participant", "nunique"),
        )
        .reset_index()
    )
    scores.attrs.update(rows.attrs)
    return scores


def accuracy_table(scores: pd.DataFrame) -> pd.DataFrame:
    """A table to print: a row per kitchen and predictor, a column per percentage observed, and their mean.

    Args:
        scores: The rows of :func:`benchmarks.human_play.run.score_recorded_play`.

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
        scores: The rows of :func:`benchmarks.human_play.run.score_recorded_play`.

    Returns:
        Columns ``layout``, ``predictor``, ``accuracy``, ``reference`` and ``difference`` (NaN where none was measured).
    """
    table = scores.groupby(["layout", "predictor"], sort=False)["accuracy"].mean().reset_index()
    known = {
        (layout, predictor): value
        for predictor, values in REFERENCE.items()
        for layout, value in zip(LAYOUTS, values, strict=True)
    }
    pairs = zip(table["layout"], table["predictor"], strict=True)
    table["reference"] = [known.get(pair, float("nan")) for pair in pairs]
    table["difference"] = table["accuracy"] - table["reference"]
    table.attrs.update(scores.attrs)
    return table
