"""Figures of evaluations as self-contained SVG: no plotting library, no fonts or scripts fetched, sharp in print.

Each function returns the text of one ``<svg>``; :func:`save_figure` writes it to a file. It can be put into HTML as it
is. Text is real text, and every figure carries a title and a description for screen readers.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from legible_envs.support.files import write_atomically

if TYPE_CHECKING:
    import pandas as pd

    from predictors.evaluation.results import Evaluation, LearningCurve

__all__ = [
    "COLOURS",
    "Drawing",
    "accuracy_figure",
    "confusion_figure",
    "footnote",
    "heading",
    "learning_curve_figure",
    "round_ticks",
    "save_figure",
    "shade",
]

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#9c5b8b", "#a8780f", "#3a9fd0", "#5b5b5b", "#8c1c13")
"""Lines in order: Okabe and Ito's colours, darkened where too pale on white."""
_DASHES: Final = ("", "7 4", "2 3", "9 3 2 3")
_INK, _SOFT, _RULE = "#24292f", "#5d6670", "#e3e6ea"
_FONT: Final = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"


class Drawing:
    """SVG elements in order, coordinates in CSS pixels.

    Args:
        width: Of the figure.
        height: Of the figure.
        title: For screen readers.
        description: For screen readers.
    """

    def __init__(self, width: float, height: float, title: str, description: str) -> None:
        self.width, self.height = width, height
        self._head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
            f'height="{height:g}" role="img" font-family="{escape(_FONT)}" font-size="12" fill="{_INK}" '
            f'style="max-width:100%;height:auto">\n<title>{escape(title)}</title>\n<desc>{escape(description)}</desc>\n'
            f'<rect width="{width:g}" height="{height:g}" fill="#fff"/>'
        )
        self._parts: list[str] = []

    def text(self, x: float, y: float, text: str, anchor: str = "start", **style: Any) -> None:
        """Text with its baseline at a point; ``style`` are SVG attributes."""
        more = "".join(f' {name.replace("_", "-")}="{escape(str(value))}"' for name, value in style.items())
        self._parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{escape(text)}</text>')

    def line(self, points: Sequence[tuple[float, float]], colour: str, width: float = 1, dash: str = "") -> None:
        """A line through points."""
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self._parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" '
            f'stroke-linejoin="round" stroke-linecap="round"{dashed}/>'
        )

    def area(self, points: Sequence[tuple[float, float]], colour: str, opacity: float) -> None:
        """A filled polygon."""
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self._parts.append(f'<polygon points="{path}" fill="{colour}" fill-opacity="{opacity:g}"/>')

    def dot(self, x: float, y: float, colour: str, tip: str) -> None:
        """A dot with a tip to be read when pointed at."""
        self._parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.4" fill="{colour}" stroke="#fff" stroke-width="1">'
            f"<title>{escape(tip)}</title></circle>"
        )

    def box(self, x: float, y: float, width: float, height: float, colour: str, tip: str = "") -> None:
        """A filled rectangle."""
        inner = f"<title>{escape(tip)}</title>" if tip else ""
        self._parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{colour}">{inner}</rect>'
        )

    def render(self) -> str:
        """The text of the figure."""
        return "\n".join([self._head, *self._parts, "</svg>\n"])


class _Axes:
    """A plot's frame: accuracy upwards from 0 to 1, something else to the right; lines are labelled at their ends."""

    left, top, right, bottom = 70.0, 66.0, 20.0, 104.0

    def __init__(self, drawing: Drawing, low: float, high: float, legend: float) -> None:
        self.drawing, self.low, self.high = drawing, low, high if high > low else low + 1
        self.x1, self.y1 = drawing.width - self.right - legend, drawing.height - self.bottom

    def x(self, value: float) -> float:
        return self.left + (value - self.low) / (self.high - self.low) * (self.x1 - self.left)

    def y(self, value: float) -> float:
        return self.y1 - value * (self.y1 - self.top)

    def frame(self, ticks: Sequence[tuple[float, str]], x_label: str, y_label: str) -> None:
        draw = self.drawing
        for value in np.linspace(0, 1, 6):
            draw.line([(self.left, self.y(value)), (self.x1, self.y(value))], _RULE if value else _SOFT)
            draw.text(self.left - 9, self.y(value) + 4, f"{value:.0%}".replace("%", " %"), "end", fill=_SOFT)
        for place, label in ticks:
            draw.line([(self.x(place), self.y1), (self.x(place), self.y1 + 5)], _SOFT)
            draw.text(self.x(place), self.y1 + 20, label, "middle", fill=_SOFT)
        draw.text((self.left + self.x1) / 2, self.y1 + 42, x_label, "middle")
        middle = (self.top + self.y1) / 2
        draw.text(16, middle, y_label, "middle", transform=f"rotate(-90 16 {middle:.1f})")

    def series(self, number: int, name: str, table: pd.DataFrame, at: str) -> float:
        """Band, line and dots of one predictor; returns the height at which the line ends."""
        colour, dash = COLOURS[number % len(COLOURS)], _DASHES[number % len(_DASHES)]
        part = table.sort_values(at)
        xs = [self.x(value) for value in part[at]]
        known = [
            (x, self.y(low), self.y(high))
            for x, low, high in zip(xs, part["low"], part["high"], strict=True)
            if np.isfinite(low) and np.isfinite(high)
        ]
        if known:
            up = [(x, high) for x, _, high in known]
            self.drawing.area(up + [(x, low) for x, low, _ in reversed(known)], colour, 0.14)
        points = [(x, self.y(value)) for x, value in zip(xs, part["accuracy"], strict=True)]
        self.drawing.line(points, colour, 2.2, dash)
        for (x, y), (_, row) in zip(points, part.iterrows(), strict=True):
            band = f" ({row['low']:.3f} to {row['high']:.3f})" if np.isfinite(row["low"]) else ""
            self.drawing.dot(x, y, colour, f"{name}: {row['accuracy']:.3f}{band}")
        return points[-1][1]

    def names(self, ends: Sequence[tuple[str, float]]) -> None:
        """Names beside the ends of lines, moved apart where they would overlap."""
        order = sorted(range(len(ends)), key=lambda i: ends[i][1])
        heights = _apart([ends[i][1] for i in order], 16.0, self.top + 4, self.y1)
        for i, height in zip(order, heights, strict=True):
            colour, dash = COLOURS[i % len(COLOURS)], _DASHES[i % len(_DASHES)]
            self.drawing.line([(self.x1 + 10, height), (self.x1 + 28, height)], colour, 2.2, dash)
            self.drawing.text(self.x1 + 34, height + 4, ends[i][0], fill=colour, font_weight="600")


def _apart(heights: Sequence[float], gap: float, top: float, bottom: float) -> list[float]:
    """Rising heights at least ``gap`` apart, moved as little as a pass down and a pass up allow."""
    placed = list(heights)
    for i in range(1, len(placed)):
        placed[i] = max(placed[i], placed[i - 1] + gap)
    for i in range(len(placed) - 1, -1, -1):
        placed[i] = min(placed[i], bottom - gap * (len(placed) - 1 - i))
    shift = max(top - placed[0], 0.0) if placed else 0.0
    return [height + shift for height in placed]


def heading(drawing: Drawing, title: str, subtitle: str) -> None:
    """Title and subtitle at the top of a figure."""
    drawing.text(16, 26, title, font_size=16, font_weight="600")
    drawing.text(16, 45, subtitle, fill=_SOFT)


def footnote(drawing: Drawing, text: str) -> None:
    """The definition under a figure, in lines that fit its width."""
    limit = int((drawing.width - 32) / 5.2)
    lines, current = [], ""
    for word in text.split():
        if current and len(current) + 1 + len(word) > limit:
            lines.append(current)
            current = word
        else:
            current = f"{current} {word}".strip()
    lines.append(current)
    if len(lines) > 3:
        lines = [*lines[:2], lines[2][: limit - 1] + "…"]
    for i, line in enumerate(lines):
        drawing.text(16, drawing.height - 12 - 13 * (len(lines) - 1 - i), line, fill=_SOFT, font_size=10)


def _legend_width(names: Sequence[str]) -> float:
    return 44.0 + 7.2 * max((len(name) for name in names), default=0)


def _series_names(table: pd.DataFrame, keys: Sequence[str]) -> dict[str, pd.DataFrame]:
    parts = {}
    for labels, part in table.groupby(list(keys), sort=False):
        parts[", ".join(str(label) for label in labels) if isinstance(labels, tuple) else str(labels)] = part
    return parts


# -- figures ----------------------------------------------------------------------------------------------------------


def accuracy_figure(
    results: Evaluation | pd.DataFrame,
    *,
    title: str = "Goals read correctly",
    subtitle: str | None = None,
    width: float = 720,
    height: float = 430,
) -> str:
    """Accuracy against percentage observed, a line and a confidence band per predictor.

    Args:
        results: An evaluation, or the table of its :meth:`~predictors.evaluation.results.Evaluation.accuracy`.
        title: Its heading.
        subtitle: What the line and the band are; None says it of the tables named above.
        width: In pixels.
        height: In pixels.

    Returns:
        The SVG.

    Raises:
        ValueError: A table without the columns it needs, or without rows.
    """
    table = _table(results, "accuracy")
    _check(table, ("predictor", "fraction", "accuracy", "low", "high"))
    extra = [name for name in ("condition", "layout") if name in table]
    series = _series_names(table, ["predictor", *extra])
    about, level = table.attrs, table.attrs.get("level", 0.95)
    drawing = Drawing(width, height, title, f"Accuracy against percentage observed for {', '.join(series)}.")
    units = f", {about['unit']}s as units" if "unit" in about else ""
    heading(drawing, title, subtitle or f"mean over walks; bands: {level:.0%} confidence{units}")
    fractions = sorted(table["fraction"].unique().tolist())
    axes = _Axes(drawing, min(fractions), max(fractions), _legend_width(list(series)))
    ticks = [(f, f"{100 * f:.3g} %") for f in fractions[:: max(1, -(-len(fractions) // 11))]]
    axes.frame(ticks, "observed", "accuracy")
    if "chance" in table:
        chance = float(table["chance"].mean())
        drawing.line([(axes.left, axes.y(chance)), (axes.x1, axes.y(chance))], _SOFT, 1, "2 4")
        drawing.text(axes.left + 4, axes.y(chance) - 5, "chance", fill=_SOFT, font_size=11)
    axes.names([(name, axes.series(i, name, part, "fraction")) for i, (name, part) in enumerate(series.items())])
    if "evaluation" in about or "definition" in about:
        footnote(drawing, str(about.get("evaluation", about.get("definition"))))
    return drawing.render()


def learning_curve_figure(
    curve: LearningCurve | pd.DataFrame,
    *,
    title: str = "What more data buys",
    subtitle: str | None = None,
    width: float = 720,
    height: float = 430,
) -> str:
    """Accuracy against the number of trajectories learned from.

    Args:
        curve: A learning curve, or the table of its :meth:`~predictors.evaluation.results.LearningCurve.summary`.
        title: Its heading.
        subtitle: What the line and the band are; None says it of the tables named above.
        width: In pixels.
        height: In pixels.

    Returns:
        The SVG.

    Raises:
        ValueError: A table without the columns it needs, or without rows.
    """
    table = _table(curve, "summary")
    _check(table, ("predictor", "size", "accuracy", "low", "high"))
    series = _series_names(table, ["predictor"])
    drawing = Drawing(width, height, title, f"Accuracy against training size for {', '.join(series)}.")
    said = subtitle or "mean over fractions observed; bands: one standard deviation between splits"
    heading(drawing, title, said)
    sizes = sorted(int(size) for size in table["size"].unique())
    axes = _Axes(drawing, 0, max(sizes), _legend_width(list(series)))
    ticks: list[tuple[float, str]] = []
    for size in reversed(sizes):  # the largest is always named, others where there is room
        if not ticks or axes.x(ticks[-1][0]) - axes.x(size) >= 34:
            ticks.append((size, f"{size:,}"))
    axes.frame(ticks, "trajectories learned from", "accuracy")
    axes.names([(name, axes.series(i, name, part, "size")) for i, (name, part) in enumerate(series.items())])
    if "evaluation" in table.attrs:
        footnote(drawing, str(table.attrs["evaluation"]))
    return drawing.render()


def confusion_figure(matrix: pd.DataFrame, *, title: str = "Which goals are taken for which", cell: float = 0) -> str:
    """A confusion matrix: shade and label are shares of each true goal, tips tell trajectories.

    Args:
        matrix: As of :meth:`~predictors.evaluation.results.Evaluation.confusion_matrix`, in trajectories.
        title: Its heading.
        cell: Size of a square in pixels; by number of goals if 0.

    Returns:
        The SVG.

    Raises:
        ValueError: Not a square table over the same goals, or an empty one.
    """
    goals = [str(goal) for goal in matrix.index]
    if not goals or goals != [str(goal) for goal in matrix.columns]:
        raise ValueError(f"a confusion matrix has the same goals as rows and columns, got {goals} and more")
    counts = matrix.to_numpy(dtype=np.float64)
    total = counts.sum(axis=1, keepdims=True)
    shares = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)
    cell = cell or min(84.0, max(34.0, 520.0 / len(goals)))
    margin = 40 + 7.2 * max(len(goal) for goal in goals) + 46
    slanted = max(len(goal) for goal in goals) * 7.2 > cell
    foot = 48.0 + (max(len(goal) for goal in goals) * 5.2 if slanted else 18) + 46
    width = max(margin + cell * len(goals) + 60, 10 * len(title) + 32, 470)
    drawing = Drawing(width, 66 + cell * len(goals) + foot, title, f"Confusion matrix of {', '.join(goals)}.")
    heading(drawing, title, "share of each true goal; ties shared out")
    for i, goal in enumerate(goals):
        y = 66 + cell * i
        drawing.text(margin - 10, y + cell / 2 + (-1 if cell >= 30 else 4), goal, "end", font_weight="600")
        drawing.text(margin - 10, y + cell / 2 + 13, f"n = {total[i, 0]:.0f}", "end", fill=_SOFT, font_size=10)
        for j, other in enumerate(goals):
            share, x = float(shares[i, j]), margin + cell * j
            tip = f"{goal} taken for {other}: {counts[i, j]:.1f} of {total[i, 0]:.0f}"
            drawing.box(x + 1, y + 1, cell - 2, cell - 2, shade(share), tip)
            ink = "#fff" if share > 0.55 else _INK
            drawing.text(x + cell / 2, y + cell / 2 + 4, f"{100 * share:.0f}", "middle", fill=ink,
                         font_weight="600" if i == j else "400")  # fmt: skip
    for j, goal in enumerate(goals):
        x, y = margin + cell * (j + 0.5), 66 + cell * len(goals) + 16
        turned = {"transform": f"rotate(-35 {x:.1f} {y:.1f})"} if slanted else {}
        drawing.text(x, y, goal, "end" if slanted else "middle", **turned)
    middle = 66 + cell * len(goals) / 2
    drawing.text(18, middle, "true goal", "middle", fill=_SOFT, transform=f"rotate(-90 18 {middle:.1f})")
    drawing.text(margin + cell * len(goals) / 2, 66 + cell * len(goals) + foot - 60, "predicted goal, %", "middle",
                 fill=_SOFT)  # fmt: skip
    if "evaluation" in matrix.attrs:
        footnote(drawing, str(matrix.attrs["evaluation"]))
    return drawing.render()


def shade(share: float) -> str:
    """From near white to the first line's blue, by share."""
    pale, full = (244, 247, 250), (0, 92, 148)
    mixed = (round(a + (b - a) * min(max(share, 0.0), 1.0)) for a, b in zip(pale, full, strict=True))
    return "#" + "".join(f"{part:02x}" for part in mixed)


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


def save_figure(path: str | os.PathLike[str], svg: str) -> Path:
    """Write a figure, all or nothing; folders that are missing are made.

    Returns:
        The path written.

    Raises:
        ValueError: The name does not end in ``.svg``.
        OSError: The file cannot be written.
    """
    target = Path(path)
    if target.suffix != ".svg":
        raise ValueError(f"figures are SVG; name the file FILE.svg, got {target.name!r}")
    target.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(target, lambda stream: stream.write(svg.encode()))
    return target


def round_ticks(low: float, high: float) -> list[float]:
    """Two to eight round values from ``low`` to ``high``, for an axis; fewer only where there is no span."""
    span = (high - low) or 1.0
    step = 10.0 ** np.floor(np.log10(span / 5))
    step *= min((m for m in (1, 2, 5, 10) if span / (m * step) <= 7), default=10)
    # Zero instead of its negative, and no tail of digits from adding up steps.
    return [round(float(v) + 0.0, 12) for v in np.arange(np.ceil(low / step), np.floor(high / step + 1e-9) + 1) * step]
