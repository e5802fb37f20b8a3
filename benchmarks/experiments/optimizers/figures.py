"""Figures of the comparison: best scores against evaluations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from legible_envs.drawing.chart_parts import label_ends, line_style
from legible_envs.drawing.charts import Chart, ChartSize, styled

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["anytime_figure"]


def anytime_figure(curves: pd.DataFrame, *, title: str, size: ChartSize = "report") -> Chart:
    """Best score so far against evaluations (logarithmic), a line and a band per method.

    Args:
        curves: Columns ``method, scored, best, low, high``.
        title: Its heading.
        size: See :data:`legible_envs.drawing.charts.SIZES`.

    Returns:
        The figure.
    """
    methods = {str(name): part.sort_values("scored") for name, part in curves.groupby("method", sort=False)}
    with styled(size):
        chart = Chart(
            title,
            "mean over seeds; bands: from the lower to the upper quartile",
            "The first point is the random layouts that every search begins with. Score: legibility per execution.",
            description=f"Best score against evaluations for {', '.join(methods)}.",
            size=size,
            height=3.1,
        )
        axes = chart.subplots()
        axes.set_xscale("log")
        ends = []
        for number, (name, part) in enumerate(methods.items()):
            style, best = line_style(number), float(part["best"].iloc[-1])
            axes.fill_between(part["scored"], part["low"], part["high"], color=style["color"], alpha=0.12, linewidth=0)
            axes.plot(part["scored"], part["best"], label=name, **style)
            minus = "\u2212" if best < 0 else ""
            ends.append((f"{name} {minus}{abs(best):.1f}", best))
        first, last = float(curves["scored"].min()), float(curves["scored"].max())
        axes.set_xlim(first, last if last > first else 2 * first)
        ticks = _round_counts(first, last)
        axes.set_xticks(ticks, [f"{tick:,.0f}" for tick in ticks])
        axes.minorticks_off()
        axes.margins(y=0.02)
        axes.set_xlabel("layouts scored")
        axes.set_ylabel("best score so far")
        label_ends(chart, axes, ends)
        return chart


def _round_counts(first: float, last: float) -> list[float]:
    """Round numbers on a logarithmic axis: powers of ten, or more of them where these are fewer than three."""
    ticks: list[float] = []
    for steps in ((1.0,), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)):
        counts = [step * 10.0**power for power in range(13) for step in steps]
        ticks = [count for count in counts if first * (1 - 1e-9) <= count <= last * (1 + 1e-9)]
        if len(ticks) >= 3:
            break
    return ticks or [first]
