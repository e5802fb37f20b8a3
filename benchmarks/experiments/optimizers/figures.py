"""Figures of the comparison: scores against evaluations, as self-contained SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from predictors.evaluation.figures import COLOURS, Drawing, footnote, heading, round_ticks

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["anytime_figure"]

_SOFT, _RULE = "#5d6670", "#e3e6ea"
_DASHES = ("", "7 4", "2 3", "9 3 2 3")
_LEFT, _TOP, _BOTTOM, _LEGEND = 70.0, 66.0, 84.0, 225.0


def anytime_figure(curves: pd.DataFrame, *, title: str, width: float = 760, height: float = 420) -> str:
    """Best score so far against evaluations (logarithmic), a line and a band per method.

    Args:
        curves: Columns ``method, scored, best, low, high``.
        title: Its heading.
        width: In pixels.
        height: In pixels.

    Returns:
        The SVG.
    """
    names = list(dict.fromkeys(curves["method"]))
    drawing = Drawing(width, height, title, f"Best score against evaluations for {', '.join(names)}.")
    heading(drawing, title, "mean over seeds; bands: from the lower to the upper quartile")
    right, foot = width - _LEGEND, height - _BOTTOM
    first, last = np.log10(curves["scored"].min()), np.log10(curves["scored"].max())
    low, high = float(curves["low"].min()), float(curves[["high", "best"]].max().max())

    def x(scored: float) -> float:
        return float(_LEFT + (np.log10(scored) - first) / ((last - first) or 1.0) * (right - _LEFT))

    def y(score: float) -> float:
        return float(foot - (score - low) / ((high - low) or 1.0) * (foot - _TOP))

    for value in round_ticks(low, high):
        drawing.line([(_LEFT, y(value)), (right, y(value))], _RULE)
        drawing.text(_LEFT - 8, y(value) + 4, f"{value:g}", "end", fill=_SOFT)
    for power in range(int(np.floor(first)), int(np.ceil(last)) + 1):
        for step in (1, 2, 5) if last - first < 2 else (1,):
            scored = float(step * 10**power)
            if first - 1e-9 <= np.log10(scored) <= last + 1e-9:
                drawing.line([(x(scored), foot), (x(scored), foot + 5)], _SOFT)
                drawing.text(x(scored), foot + 20, f"{scored:,.0f}", "middle", fill=_SOFT)
    drawing.line([(_LEFT, foot), (right, foot)], _SOFT)
    drawing.text((_LEFT + right) / 2, foot + 42, "layouts scored", "middle")
    ends = []
    for i, name in enumerate(names):
        part = curves[curves["method"] == name].sort_values("scored")
        xs = [x(scored) for scored in part["scored"]]
        highs = [(a, y(b)) for a, b in zip(xs, part["high"], strict=True)]
        lows = [(a, y(b)) for a, b in zip(xs, part["low"], strict=True)]
        colour, dash = COLOURS[i % len(COLOURS)], _DASHES[i % len(_DASHES)]
        drawing.area(highs + lows[::-1], colour, 0.12)
        drawing.line([(a, y(b)) for a, b in zip(xs, part["best"], strict=True)], colour, 2.2, dash)
        ends.append((float(part["best"].iloc[-1]), i, name))
    for place, (score, i, name) in enumerate(sorted(ends, reverse=True)):
        colour, dash = COLOURS[i % len(COLOURS)], _DASHES[i % len(_DASHES)]
        at = _TOP + 12 + 20 * place
        drawing.line([(right + 10, at), (right + 30, at)], colour, 2.2, dash)
        drawing.text(right + 36, at + 4, f"{name} {score:.1f}", fill=colour, font_weight="600")
    footnote(
        drawing, "The first point is the random layouts every search begins with. Score: legibility per execution."
    )
    return drawing.render()
