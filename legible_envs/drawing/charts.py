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
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.textpath import TextToPath

from legible_envs.drawing.chart_files import FORMATS, render
from legible_envs.support.files import write_atomically
from legible_envs.support.names import printable
from legible_envs.support.validation import choice

if TYPE_CHECKING:
    from matplotlib.artist import Artist

__all__ = [
    "COLOURS",
    "INK",
    "PAD",
    "RULE",
    "SHADES",
    "SIZES",
    "SOFT",
    "Chart",
    "ChartSize",
    "Size",
    "save_figure",
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

PAD: Final = 0.12
"""Inches around everything."""

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
    choice("size", size, SIZES)
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
        room = width - 2 * PAD
        above = [(line, 1.25 * text, INK, "bold") for line in _wrap(title, room, 1.25 * text, "bold")]
        above += [(line, text, SOFT, "normal") for line in _wrap(subtitle, room, text)]
        below = [(line, 0.82 * text, SOFT, "normal") for line in _wrap(note, room, 0.82 * text)]
        if not own.has_words:
            above, below = [], []
        head, foot = (sum(_LINE * size for _, size, _, _ in lines) / 72 for lines in (above, below))
        head, foot = head + PAD * bool(above), foot + PAD * bool(below)
        tall = height * own.scale + head + foot
        super().__init__(figsize=(width, tall), layout="constrained")
        self.title, self.description = title, description
        self.tips: dict[str, list[str]] = {}
        self._bottom, self._top = foot, tall - head
        self.reserve_above(0.0)
        self._write(above, PAD, tall - PAD)
        self._write(below, PAD, foot)

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
        self.get_layout_engine().set(w_pad=PAD, h_pad=PAD, rect=at)  # type: ignore[union-attr, call-arg]
        return (top - PAD / 2) / tall if height else top / tall

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
    return float(TextToPath().get_text_width_height_descent(printable(text), font, ismath=False)[0]) / 72


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
