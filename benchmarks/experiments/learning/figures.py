"""Figures of the experiment: learning curves beside the scripted cook."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from legible_envs.drawing.chart_parts import line_style
from legible_envs.drawing.charts import SOFT, Chart, ChartSize, styled

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["curve_figure"]


def curve_figure(curve: pd.DataFrame, reference: float, *, title: str, size: ChartSize = "report") -> Chart:
    """Return against steps: the mean over seeds, a band from the least to the greatest, and the scripted cook's.

    Args:
        curve: ``steps, score, low, high, seeds``.
        reference: Return of the scripted cook; NaN where there is none.
        title: Heading.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    ordered = curve.sort_values("steps")
    seeds = int(ordered["seeds"].max())
    with styled(size):
        note = "" if math.isnan(reference) else "Dashed: the scripted cook, who knows the kitchen."
        chart = Chart(
            title,
            f"mean over {seeds} seed{'' if seeds == 1 else 's'} of the episodes that end; band: least and greatest",
            note,
            description=f"{title}: return against steps.",
            size=size,
            height=2.7,
        )
        axes = chart.subplots()
        style = line_style(0)
        steps = ordered["steps"] / 1000
        axes.fill_between(steps, ordered["low"], ordered["high"], color=style["color"], alpha=0.15, linewidth=0)
        axes.plot(steps, ordered["score"], **style)
        if not math.isnan(reference):
            axes.axhline(reference, color=SOFT, linestyle="--", linewidth=1)
        axes.set_xlim(0, float(steps.max()))
        axes.margins(y=0.05)
        axes.set_xlabel("thousand steps of all games")
        axes.set_ylabel("return")
        return chart
