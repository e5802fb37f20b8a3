"""Tables at rest: a layout, the shortest paths of the hand, and where its goal is ambiguous."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.canvas import Canvas, Image, heat_colour, paste, rgb, text_sprite
from legible_envs.drawing.sheets import banner
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.rendering.ambiguity import ambiguous_reaches
from legible_envs.tabletop.rendering.frame import Frame, check_width
from legible_envs.tabletop.rendering.objects import paste_centred, paste_object
from legible_envs.tabletop.rendering.palette import TABLE
from legible_envs.tabletop.rendering.surface import surface_of
from legible_envs.tabletop.task import TabletopTask

__all__ = ["draw_ambiguity_scale", "draw_table"]

Floats = npt.NDArray[np.float64]
_PIECES: Final = 48


def draw_table(
    layout: TabletopLayout,
    *,
    task: TabletopTask | None = None,
    width: int = 640,
    paths: bool | str | Iterable[str] = False,
    ambiguity: bool = False,
    beta: float = 20.0,
    scale: bool = True,
    grown: bool = False,
    labels: Mapping[str, str] | None = None,
    title: str | None = None,
) -> Image:
    """Draw a table at rest, without hand or robot.

    Args:
        layout: The table and the objects on it.
        task: The task; its slots are drawn in the assembly zone.
        width: Pixels, 120 to 4096.
        paths: Shortest paths to draw: from all starts (True), or from the starts (or objects) named.
        ambiguity: Whether to colour the shortest reaches of the task by how unsure an observer is of their goal at each
            point (Bayesian goal inference, Eq. 1, the mean over the task's stages).
        beta: Rationality per metre, of ``ambiguity``.
        scale: Whether to explain the colours of ``ambiguity`` below the drawing.
        grown: Whether to show where an obstacle keeps the centre of the hand away.
        labels: Short texts to set above objects, by name.
        title: A line above the drawing.

    Returns:
        ``(height, width, 3)`` uint8, the table's depth to scale; higher with a title or a scale. A new array each time.

    Raises:
        ValueError: A width out of range, an object whose colour is none, or ``ambiguity`` without a task.
        LayoutError: A start or an object of this name is not there.
    """
    frame = Frame.of(layout.table, check_width(width))
    if ambiguity and task is None:
        raise ValueError(
            "ambiguity is a property of the reaches of a task: give task=, such as TabletopTask.named('columns')"
        )
    image = surface_of(layout, task, frame.width, grown=grown).copy()
    if paths:
        starts = list(layout.table.starts) if paths is True else [paths] if isinstance(paths, str) else list(paths)
        _draw_paths(image, frame, layout, starts)
    if ambiguity and task is not None:
        _draw_ambiguity(image, frame, layout, task, beta)
    for obj in layout.objects:
        paste_object(image, frame, obj, *obj.at)
    for name, text in (labels or {}).items():
        _draw_label(image, frame, layout, name, text)
    if ambiguity and scale:
        image = np.concatenate([image, draw_ambiguity_scale(frame.width)])
    return banner(image, title, max(28, frame.width // 14)) if title else image


def _draw_paths(image: Image, frame: Frame, layout: TabletopLayout, starts: list[str]) -> None:
    canvas = Canvas(frame.width, tall=frame.height / frame.width)
    lines = [
        [frame.unit(*point) for point in path.tolist()]
        for start in starts
        for path in layout.paths.polylines(layout.place(start))
        if path is not None
    ]
    for width, ink in ((3.4, TABLE["region"]), (1.6, TABLE["start"])):
        for line in lines:
            canvas.stroke(line, width * max(1.0, frame.width / 640) / frame.width, ink)
    paste(image, canvas.sprite(), 0, 0)


def _draw_ambiguity(image: Image, frame: Frame, layout: TabletopLayout, task: TabletopTask, beta: float) -> None:
    """Every reach as a ribbon, the clearest pieces first, so that ambiguous ones lie on top."""
    canvas, unit = Canvas(frame.width, tall=frame.height / frame.width), max(1.0, frame.width / 640) / frame.width
    pieces = [
        (float(value), [frame.unit(*a), frame.unit(*b)])
        for reach in ambiguous_reaches(layout, task, beta=beta, pieces=_PIECES)
        for value, (a, b) in zip(reach.ambiguity, itertools.pairwise(reach.points.tolist()), strict=True)
    ]
    for _, line in pieces:
        canvas.stroke(line, 5.4 * unit, TABLE["rim"])
    for value, line in sorted(pieces, key=lambda piece: piece[0]):
        canvas.stroke(line, 3.6 * unit, heat_colour(value))
    paste(image, canvas.sprite(), 0, 0)


def draw_ambiguity_scale(width: int) -> Image:
    """A strip that explains the colours of ambiguity, ``(h, width, 3)``."""
    size = max(13, min(24, round(width * 0.03)))
    strip = np.empty((round(size * 1.7), width, 3), np.uint8)
    strip[...] = rgb(TABLE["page"])
    words = [text_sprite(text, size, TABLE["ink"]) for text in ("the goal is clear", "ambiguous")]
    bar = max(24, round(width * 0.25))
    left = (width - bar - sum(word.colour.shape[1] for word in words) - 2 * size) // 2
    for word, at in zip(words, (left, left + words[0].colour.shape[1] + 2 * size + bar), strict=True):
        paste(strip, word, (len(strip) - len(word.colour)) // 2 + 1, at)
    ramp = np.array([rgb(heat_colour(value)) for value in np.linspace(0, 1, bar)], np.uint8)
    middle = left + words[0].colour.shape[1] + size
    third = len(strip) // 3
    strip[third - 1 : len(strip) - third + 1, middle - 1 : middle + bar + 1] = rgb(TABLE["rim"])
    strip[third : len(strip) - third, middle : middle + bar] = ramp
    return strip


def _draw_label(image: Image, frame: Frame, layout: TabletopLayout, name: str, text: str) -> None:
    obj = layout.objects[layout.index(name)]
    words = text_sprite(text, max(10, round(0.034 * frame.scale)), TABLE["ink"])
    column, row = frame.pixel(*obj.at)
    paste_centred(image, words, column, row - (obj.size[1] / 2 + 0.02) * frame.scale)
