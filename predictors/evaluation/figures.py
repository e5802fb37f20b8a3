"""Figures of evaluations: matplotlib figures, for reports and for papers.

Each function draws a table or the result that it comes from, and returns a :class:`matplotlib.figure.Figure`;
:func:`legible_envs.drawing.charts.save_figure` writes it as SVG, PDF or PNG. With ``size="column"`` or ``size="page"``
a figure has the width of a paper's column or page, and no heading and note, which belong into the caption there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from legible_envs.drawing.chart_parts import label_ends, line_style, number_squares, shares_upwards
from legible_envs.drawing.charts import SOFT, Chart, ChartSize, styled, text_width

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from predictors.evaluation.results import Evaluation, LearningCurve

__all__ = ["accuracy_figure", "confusion_figure", "learning_curve_figure"]

_AT_EDGE: Final[dict[str, Any]] = {
    "xycoords": ("axes fraction", "data"),
    "textcoords": "offset points",
    "ha": "right",
}


def accuracy_figure(
    results: Evaluation | pd.DataFrame,
    *,
    title: str = "Goals predicted correctly",
    subtitle: str | None = None,
    size: ChartSize = "report",
) -> Chart:
    """Accuracy against percentage observed, a line and a confidence band per predictor.

    Args:
        results: An evaluation, or the table of its :meth:`~predictors.evaluation.results.Evaluation.accuracy`.
        title: Its heading.
        subtitle: What the line and the band are; None says it of the tables named above.
        size: See :data:`legible_envs.drawing.charts.SIZES`.

    Returns:
        The figure.

    Raises:
        ValueError: A table without the columns it needs, or without rows.
    """
    table = _table(results, "accuracy")
    _check(table, ("predictor", "fraction", "accuracy", "low", "high"))
    series = _series(table, ["predictor", *(name for name in ("condition", "layout") if name in table)])
    about = table.attrs
    units = f", {about['unit']}s as units" if "unit" in about else ""
    with styled(size):
        chart = Chart(
            title,
            subtitle or f"mean over trajectories; bands: {about.get('level', 0.95):.0%} confidence{units}",
            _note(about, str(about.get("evaluation", about.get("definition", "")))),
            description=f"Accuracy against percentage observed for {', '.join(series)}.",
            size=size,
            height=max(2.9, 0.24 * len(series) + 0.6),
        )
        axes = chart.subplots()
        fractions = sorted(table["fraction"].unique().tolist())
        shown = fractions[:: max(1, -(-len(fractions) // (11 if size != "column" else 5)))]
        axes.set_xticks(shown, [f"{100 * fraction:.3g} %" for fraction in shown])
        axes.set_xlim(fractions[0], fractions[-1] if len(fractions) > 1 else fractions[0] + 1)
        axes.set_xlabel("observed")
        if "chance" in table:
            chance = float(table["chance"].mean())
            axes.axhline(chance, color=SOFT, linestyle=":", linewidth=1)
            axes.annotate("chance", (1, chance), (-3, 3), size="small", color=SOFT, **_AT_EDGE)
        _draw_series(chart, axes, series, "fraction")
        return chart


def learning_curve_figure(
    curve: LearningCurve | pd.DataFrame,
    *,
    title: str = "What more data buys",
    subtitle: str | None = None,
    size: ChartSize = "report",
) -> Chart:
    """Accuracy against the number of trajectories learned from.

    Args:
        curve: A learning curve, or the table of its :meth:`~predictors.evaluation.results.LearningCurve.summary`.
        title: Its heading.
        subtitle: What the line and the band are; None says it of the tables named above.
        size: See :data:`legible_envs.drawing.charts.SIZES`.

    Returns:
        The figure.

    Raises:
        ValueError: A table without the columns it needs, or without rows.
    """
    table = _table(curve, "summary")
    _check(table, ("predictor", "size", "accuracy", "low", "high"))
    series = _series(table, ["predictor"])
    with styled(size):
        chart = Chart(
            title,
            subtitle or "mean over fractions observed; bands: one standard deviation between splits",
            _note(table.attrs, str(table.attrs.get("evaluation", ""))),
            description=f"Accuracy against training size for {', '.join(series)}.",
            size=size,
            height=max(2.9, 0.24 * len(series) + 0.6),
        )
        axes = chart.subplots()
        sizes = sorted(int(number) for number in table["size"].unique())
        axes.set_xlim(0, max(sizes))
        shown: list[int] = []
        for number in reversed(sizes):  # the largest is always named, others where there is room
            if not shown or shown[-1] - number >= max(sizes) * (0.09 if size != "column" else 0.2):
                shown.append(number)
        axes.set_xticks(shown, [f"{number:,}" for number in shown])
        axes.set_xlabel("trajectories learned from")
        _draw_series(chart, axes, series, "size")
        return chart


def confusion_figure(
    matrix: pd.DataFrame, *, title: str = "Which goals are predicted for which", size: ChartSize = "report"
) -> Chart:
    """A confusion matrix: shade and number are shares of each true goal.

    Args:
        matrix: As of :meth:`~predictors.evaluation.results.Evaluation.confusion_matrix`, in trajectories.
        title: Its heading.
        size: See :data:`legible_envs.drawing.charts.SIZES`; with many goals the figure becomes wider.

    Returns:
        The figure.

    Raises:
        ValueError: Not a square table over the same goals, or an empty one.
    """
    goals = [str(goal) for goal in matrix.index]
    if not goals or goals != [str(goal) for goal in matrix.columns]:
        raise ValueError(f"a confusion matrix has the same goals as rows and columns, got {goals} and more")
    counts = matrix.to_numpy(dtype=np.float64)
    total = counts.sum(axis=1, keepdims=True)
    shares = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)
    with styled(size) as own:
        names = max(text_width(goal, own.text, "bold") for goal in goals)
        names_and_counts = max(names, text_width(f"n = {total.max():.0f}", 0.83 * own.text))
        beside, least = names_and_counts + 5.5 * own.text / 72, 2.7 * own.text / 72
        cell = max(least, min(6.5 * own.text / 72, (own.width - beside) / len(goals)))
        is_slanted = names > 0.95 * cell
        below = (0.6 * names if is_slanted else 0.0) + 5.5 * own.text / 72
        chart = Chart(
            title,
            "share of each true goal in per cent; ties shared out",
            str(matrix.attrs.get("evaluation", "")),
            description=f"Confusion matrix of {', '.join(goals)}.",
            size=size,
            height=(cell * len(goals) + below) / own.scale,
            width=max(own.width, beside + cell * len(goals)),
        )
        axes = chart.subplots()
        axes.set_aspect("equal")
        squares = number_squares(axes, shares, [f"{100 * share:.0f}" for share in shares.flat])
        chart.tip(
            squares,
            [
                f"{goal} predicted as {other}: {counts[i, j]:.1f} of {total[i, 0]:.0f}"
                for i, goal in enumerate(goals)
                for j, other in enumerate(goals)
            ],
        )
        turned: dict[str, Any] = {"rotation": 35, "rotation_mode": "anchor", "ha": "right"} if is_slanted else {}
        axes.set_xticks(range(len(goals)), goals, color="k", **turned)
        axes.set_yticks(range(len(goals)), [""] * len(goals))
        for i, goal in enumerate(goals):
            axes.annotate(goal, (0, i), (-6, 0.1 * own.text), weight="bold", **_AT_EDGE)
            axes.annotate(f"n = {total[i, 0]:.0f}", (0, i), (-6, -own.text), size="small", color=SOFT, **_AT_EDGE)
        axes.set_xlabel("predicted goal")
        axes.set_ylabel("true goal", labelpad=72 * names_and_counts + 0.2 * own.text + 6)
        return chart


def _note(about: Mapping[Any, Any], definition: str) -> str:
    """What stands below a figure: what is drawn, and which predictors are missing from it."""
    return "; ".join([definition, *map(str, about.get("omitted", ()))]).removeprefix("; ")


def _draw_series(chart: Chart, axes: Axes, series: dict[str, pd.DataFrame], at: str) -> None:
    """Bands, lines, dots and names, with accuracy upwards."""
    shares_upwards(axes)
    axes.set_ylabel("accuracy")
    ends = []
    for number, (name, table) in enumerate(series.items()):
        part, style = table.sort_values(at), line_style(number)
        band = part[np.isfinite(part["low"]) & np.isfinite(part["high"])]
        if len(band):
            axes.fill_between(band[at], band["low"], band["high"], color=style["color"], alpha=0.14, linewidth=0)
        (line,) = axes.plot(part[at], part["accuracy"], marker="o", clip_on=False, label=name, **style)
        rows = part[["accuracy", "low", "high"]].itertuples(index=False)
        chart.tip(line, [f"{name}: {value:.3f}{_between(low, high)}" for value, low, high in rows])
        ends.append((name, float(part["accuracy"].iloc[-1])))
    label_ends(chart, axes, ends)


def _between(low: float, high: float) -> str:
    return f" ({low:.3f} to {high:.3f})" if np.isfinite(low) else ""


def _series(table: pd.DataFrame, keys: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Parts of a table by the values of its keys, named by them."""
    parts = {}
    for labels, part in table.groupby(list(keys), sort=False):
        parts[", ".join(str(label) for label in labels) if isinstance(labels, tuple) else str(labels)] = part
    return parts


def _table(results: Any, method: str) -> Any:
    """The table itself, or what the result's method says."""
    import pandas as pd

    return results if isinstance(results, pd.DataFrame) else getattr(results, method)()


def _check(table: Any, columns: Sequence[str]) -> None:
    missing = [name for name in columns if name not in getattr(table, "columns", ())]
    if missing:
        raise ValueError(f"the figure needs columns {list(columns)}; {missing} are missing")
    if not len(table):
        raise ValueError("there are no rows to draw")
