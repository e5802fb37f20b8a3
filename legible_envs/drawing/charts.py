"""The look of every chart, drawn by matplotlib: for reports, slides and papers, as SVG, PDF or PNG.

A chart is a :class:`Chart`, which is a :class:`matplotlib.figure.Figure`: whatever matplotlib can do with one can be
done with it. Functions that draw put their panels on it within :func:`styled`; :func:`save_figure` writes it. Nothing
here goes through ``pyplot``, and settings of matplotlib that a program has made are neither used nor changed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.patches import Patch
from matplotlib.textpath import TextToPath
from matplotlib.ticker import MaxNLocator, PercentFormatter

from legible_envs.drawing.chart_files import FORMATS, render
from legible_envs.support.files import write_atomically

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

__all__ = [
    "COLOURS",
    "INK",
    "RULE",
    "SHADES",
    "SIZES",
    "SOFT",
    "Chart",
    "ChartSize",
    "Size",
    "label_ends",
    "legend_above",
    "line_style",
    "number_squares",
    "round_upwards",
    "save_figure",
    "shares_upwards",
    "styled",
    "text_width",
]

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#9c5b8b", "#a8780f", "#3a9fd0", "#5b5b5b", "#8c1c13")
"""Lines in order: Okabe and Ito's colours, told apart by colour-blind people too, darkened where too pale on white."""
INK: Final = "#24292f"
"""Titles and what is to be read first."""
SOFT: Final = "#5d6670"
"""Ticks, notes, and what others are compared with."""
RULE: Final = "#e3e6ea"
"""Lines of the grid."""
SHADES: Final = LinearSegmentedColormap.from_list("shades", ["#f4f7fa", "#005c94"]).with_extremes(bad="#f6f7f8")
"""From near white to the first line's blue."""

_PAD: Final = 0.12
"""Inches around everything."""
_DASHES: Final = ("-", (0, (4.5, 2.5)), (0, (1.3, 1.9)), (0, (6.0, 2.0, 1.5, 2.0)))

ChartSize = Literal["report", "column", "page"]


class Size(NamedTuple):
    """How large a chart is.

    Attributes:
        width: In inches.
        text: Size of its text in points.
        has_words: Whether title, subtitle and note stand on it; in a paper they belong into the caption.
    """

    width: float
    text: float
    has_words: bool

    @property
    def scale(self) -> float:
        """Heights of panels, as a multiple of those in a report: between that of the widths and that of the texts."""
        return (self.width / 6.0 + self.text / 9.5) / 2


SIZES: Final[dict[ChartSize, Size]] = {
    "report": Size(6.0, 9.5, has_words=True),
    "column": Size(3.4, 7.5, has_words=False),
    "page": Size(7.0, 8.5, has_words=False),
}
"""A report's figure with all its words; one column and the whole width of a paper in two columns (ACM, IEEE)."""

_STYLE: Final[dict[str, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": SOFT,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": INK,
    "axes.spines.left": False,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": "medium",
    "axes.titleweight": "bold",
    # Comes with matplotlib: charts have the same layout on every machine. SVG files leave the font to their viewer.
    "font.sans-serif": ["DejaVu Sans"],
    "grid.color": RULE,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.0,
    "legend.columnspacing": 1.6,
    "legend.frameon": False,
    "legend.handlelength": 0.9,
    "legend.handletextpad": 0.5,
    "lines.markeredgecolor": "white",
    "pdf.fonttype": 42,  # TrueType: publishers refuse Type 3
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "legible-envs",
    "text.color": INK,
    "text.parse_math": False,  # names may hold dollars
    "xtick.color": SOFT,
    "xtick.labelcolor": SOFT,
    "ytick.color": SOFT,
    "ytick.labelcolor": SOFT,
    "ytick.major.size": 0.0,
}


@contextmanager
def styled(size: ChartSize = "report", *, font: str | None = None) -> Iterator[Size]:
    """The style of all charts, whatever settings and style sheets are in force outside, which come back afterwards.

    Args:
        size: Of the chart; see :data:`SIZES`.
        font: A family of fonts installed here; None takes the one that comes with matplotlib.

    Yields:
        The size.

    Raises:
        ValueError: There is no such size, or no such font.
    """
    if size not in SIZES:
        raise ValueError(f"size must be one of {list(SIZES)}, got {size!r}")
    text = SIZES[size].text
    changes: dict[str, Any] = {"font.size": text, "lines.linewidth": 0.18 * text, "lines.markersize": 0.52 * text}
    changes["lines.markeredgewidth"] = 0.085 * text
    if font is not None:
        _check_font(font)
        changes["font.sans-serif"] = [font, *_STYLE["font.sans-serif"]]
    with matplotlib.style.context(["default", _STYLE | changes]):
        yield SIZES[size]


def _check_font(family: str) -> None:
    try:
        findfont(FontProperties(family=family), fallback_to_default=False)
    except ValueError as error:
        raise ValueError(f"font must be a family of fonts installed here, got {family!r}") from error


class Chart(Figure):
    """A figure with a heading, room for panels, and a note at its foot; to be made within :func:`styled`.

    Args:
        title: Heading, and the name for screen readers.
        subtitle: Line below it.
        note: At the foot, in as many lines as it takes.
        description: What is to be seen, for screen readers.
        size: See :data:`SIZES`; sizes of papers leave out heading and note.
        height: Of the panels in inches, in a report; other sizes multiply it by their ``scale``.
        width: Of the whole in inches; None takes the size's.

    Attributes:
        title: As given.
        description: As given.
        tips: For each mark of an artist, by the artist's ``gid``: what SVG viewers show when it is pointed at.
    """

    def __init__(
        self,
        title: str,
        subtitle: str = "",
        note: str = "",
        *,
        description: str,
        size: ChartSize = "report",
        height: float = 2.9,
        width: float | None = None,
    ) -> None:
        own = SIZES[size]
        width, text = own.width if width is None else width, own.text
        room = width - 2 * _PAD
        above = [(line, 1.25 * text, INK, "bold") for line in _wrap(title, room, 1.25 * text, "bold")]
        above += [(line, text, SOFT, "normal") for line in _wrap(subtitle, room, text)]
        below = [(line, 0.82 * text, SOFT, "normal") for line in _wrap(note, room, 0.82 * text)]
        if not own.has_words:
            above, below = [], []
        head, foot = (sum(_LINE * size for _, size, _, _ in lines) / 72 for lines in (above, below))
        head, foot = head + _PAD * bool(above), foot + _PAD * bool(below)
        tall = height * own.scale + head + foot
        super().__init__(figsize=(width, tall), layout="constrained")
        self.title, self.description = title, description
        self.tips: dict[str, list[str]] = {}
        self._bottom, self._top = foot, tall - head
        self.reserve_above(0.0)
        self._write(above, _PAD, tall - _PAD)
        self._write(below, _PAD, foot)

    def _write(self, lines: Sequence[tuple[str, float, str, str]], left: float, top: float) -> None:
        width, tall = self.get_size_inches()
        for line, size, colour, weight in lines:
            top -= size / 72
            self.text(left / width, top / tall, line, size=size, color=colour, weight=weight, in_layout=False)
            top -= (_LINE - 1) * size / 72

    def reserve_above(self, height: float) -> float:
        """Keep ``height`` inches above the panels free; returns its upper end as a share of the figure."""
        tall, top = float(self.get_size_inches()[1]), self._top
        self._top -= height
        at = (0, self._bottom / tall, 1, (self._top - self._bottom) / tall)
        self.get_layout_engine().set(w_pad=_PAD, h_pad=_PAD, rect=at)  # type: ignore[union-attr, call-arg]
        return (top - _PAD / 2) / tall if height else top / tall

    def tip(self, artist: Artist, texts: Sequence[str]) -> None:
        """Say what each mark of an artist is; texts in the order of its points, bars or squares."""
        name = f"marks-{len(self.tips)}"
        artist.set_gid(name)
        self.tips[name] = list(texts)

    def _repr_svg_(self) -> str:
        """What notebooks show."""
        return _rendered(self, "svg").decode()


def save_figure(path: str | os.PathLike[str], figure: Figure, *, font: str | None = None) -> Path:
    """Write a figure, all or nothing; folders that are missing are made. The same figure has the same bytes.

    Args:
        path: Where to; ends in ``.svg`` (text stays text, in a font of the viewer's machine), ``.pdf`` (fonts inside,
            as TrueType) or ``.png`` (200 dots per inch).
        figure: Of this package, or any of matplotlib.
        font: A family of fonts installed here; None takes the one that comes with matplotlib.

    Returns:
        The path written.

    Raises:
        ValueError: The name has another ending, or there is no such font.
        OSError: The file cannot be written.
    """
    target = Path(path)
    if target.suffix not in FORMATS:
        raise ValueError(f"figures are written as one of {list(FORMATS)}; got the name {target.name!r}")
    content = _rendered(figure, target.suffix[1:], font)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(target, lambda stream: stream.write(content))
    return target


def _rendered(figure: Figure, kind: str, font: str | None = None) -> bytes:
    with styled(font=font):
        if not isinstance(figure, Chart):
            return render(figure, kind, font=font)
        return render(figure, kind, title=figure.title, description=figure.description, tips=figure.tips, font=font)


# -- text -------------------------------------------------------------------------------------------------------------

_LINE: Final = 1.35
"""From one line of text to the next, in sizes of the text."""


def text_width(text: str, size: float, weight: str = "normal") -> float:
    """Width of a line of text in inches, in the font that comes with matplotlib; others are narrower, nearly all."""
    font = FontProperties(family=_STYLE["font.sans-serif"], size=size, weight=weight)
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0]) / 72


def _wrap(text: str, width: float, size: float, weight: str = "normal") -> list[str]:
    """Lines no wider than ``width`` inches, but for single words."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size, weight) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


# -- axes and legends -------------------------------------------------------------------------------------------------


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
    room = float(chart.get_size_inches()[0]) - 2 * _PAD
    columns = len(names) if sum(widths) <= room else max(1, int(room / max(widths)))
    top = chart.reserve_above(1.4 * size / 72 * -(-len(names) // columns))
    order = [i for column in range(columns) for i in range(column, len(names), columns)]  # legends fill columns first
    chart.legend(
        [Patch(color=colours[i]) for i in order],
        [names[i] for i in order],
        loc="upper left",
        bbox_to_anchor=(_PAD / chart.get_size_inches()[0], top),
        ncols=columns,
    ).set_in_layout(False)
