"""Parts of a chart: axes with round ticks, lines with names at their ends, numbered squares, legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import matplotlib
import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, PercentFormatter

from legible_envs.drawing.charts import COLOURS, INK, PAD, SHADES, SOFT, Chart, text_width

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

__all__ = ["label_ends", "legend_above", "line_style", "number_squares", "round_upwards", "shares_upwards"]

_DASHES: Final = ("-", (0, (4.5, 2.5)), (0, (1.3, 1.9)), (0, (6.0, 2.0, 1.5, 2.0)))


def line_style(number: int) -> dict[str, Any]:
    """Colour and dashes of a line by its number; no two of the first 32 are alike."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": _DASHES[(number + number // len(COLOURS)) % len(_DASHES)],
    }


def shares_upwards(axes: Axes) -> None:
    """An axis of shares upwards, from 0 to 100 %."""
    axes.set_ylim(0, 1)
    axes.set_yticks([0, 0.2, 0.4, 0.6, 0.8, 1.0])
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))


def round_upwards(axes: Axes, low: float, high: float) -> None:
    """An axis upwards between round values, three to seven ticks around ``low`` and ``high``, with a line at zero."""
    ticks = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3).tick_values(low, high if high > low else low + 1)
    ticks = ticks[max(0, int((ticks <= low + 1e-9 * np.ptp(ticks)).sum()) - 1) :]
    axes.set_ylim(ticks[0], ticks[-1])
    axes.set_yticks(ticks)
    axes.yaxis.set_major_formatter("{x:.3g}")
    if ticks[0] < 0 < ticks[-1]:
        axes.spines.bottom.set_visible(False)
        axes.axhline(0, color=SOFT, linewidth=0.8, zorder=1)


def number_squares(
    axes: Axes, values: npt.ArrayLike, texts: Sequence[str], *, dark: float = 0.55, text: str = "medium"
) -> QuadMesh:
    """Squares shaded by values, each with a text; the first row on top, squares at whole numbers.

    Args:
        axes: To draw on.
        values: ``(rows, columns)`` from 0 to 1; NaN is nearly white.
        texts: For each value, row by row.
        dark: Values above have white text.
        text: Its size, relative to all other text.

    Returns:
        The squares, row by row.
    """
    grid = np.asarray(values, np.float64)
    squares = axes.pcolormesh(
        np.arange(grid.shape[1] + 1) - 0.5,
        np.arange(grid.shape[0] + 1) - 0.5,
        grid,
        cmap=SHADES,
        vmin=0,
        vmax=1,
        edgecolors="white",
        linewidth=1.4,
    )
    for (i, j), told in zip(np.ndindex(grid.shape), texts, strict=True):
        colour = "white" if grid[i, j] > dark else INK
        axes.text(j, i, told, ha="center", va="center_baseline", color=colour, size=text)
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    return squares


def label_ends(chart: Chart, axes: Axes, ends: Sequence[tuple[str, float]]) -> None:
    """Names of lines beside where they end on the right, moved apart where they would overlap.

    Args:
        chart: With everything on it that its layout depends on.
        axes: One of its panels.
        ends: Name and last value of each line, in the order of :func:`line_style`.
    """
    chart.draw_without_rendering()  # heights are known once the layout is
    point = chart.dpi / 72
    bottom, top = axes.bbox.ymin / point, axes.bbox.ymax / point
    heights = [axes.transData.transform((axes.get_xlim()[1], value))[1] / point for _, value in ends]
    order = sorted(range(len(ends)), key=lambda i: heights[i])
    placed = _apart([heights[i] for i in order], 1.3 * matplotlib.rcParams["font.size"], bottom, top)
    for i, height in zip(order, placed, strict=True):
        style = line_style(i)
        arrow = {"arrowstyle": "-", "linewidth": matplotlib.rcParams["lines.linewidth"], "shrinkA": 2, "shrinkB": 5}
        axes.annotate(
            ends[i][0],
            (1.0, (heights[i] - bottom) / (top - bottom)),
            (27.0, height - heights[i]),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center_baseline",
            weight="bold",
            color=style["color"],
            arrowprops={**arrow, "relpos": (0, 0.5), **style},
        )


def _apart(heights: Sequence[float], gap: float, bottom: float, top: float) -> list[float]:
    """Rising heights at least ``gap`` apart, moved as little as a pass up and a pass down allow."""
    placed = list(heights)
    for i in range(1, len(placed)):
        placed[i] = max(placed[i], placed[i - 1] + gap)
    for i in range(len(placed) - 1, -1, -1):
        placed[i] = min(placed[i], top - gap * (len(placed) - 1 - i))
    shift = max(bottom - placed[0], 0.0) if placed else 0.0
    return [height + shift for height in placed]


def legend_above(chart: Chart, names: Sequence[str], colours: Sequence[str]) -> None:
    """Names with squares of their colours in as few lines as they need, above all panels."""
    size = matplotlib.rcParams["font.size"]
    widths = [text_width(name, size) + 3.0 * size / 72 for name in names]
    room = float(chart.get_size_inches()[0]) - 2 * PAD
    columns = len(names) if sum(widths) <= room else max(1, int(room / max(widths)))
    top = chart.reserve_above(1.4 * size / 72 * -(-len(names) // columns))
    order = [i for column in range(columns) for i in range(column, len(names), columns)]  # legends fill columns first
    chart.legend(
        [Patch(color=colours[i]) for i in order],
        [names[i] for i in order],
        loc="upper left",
        bbox_to_anchor=(PAD / chart.get_size_inches()[0], top),
        ncols=columns,
    ).set_in_layout(False)
