"""The still parts of a table: its top, region and slots, the starts of the hand, virtual obstacles."""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Final

import numpy as np

from legible_envs.drawing.canvas import Canvas, Image, mix, paste, rgb
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import Table, VirtualObstacle
from legible_envs.tabletop.rendering.frame import Frame
from legible_envs.tabletop.rendering.glyphs import draw_glyph
from legible_envs.tabletop.rendering.objects import colour_of, outline
from legible_envs.tabletop.rendering.palette import TABLE
from legible_envs.tabletop.task import TabletopTask

__all__ = ["surface_of"]


def _draw_surface(layout: TabletopLayout, task: TabletopTask | None, width: int, grown: bool) -> Image:
    frame = Frame.of(layout.table, width)
    image = np.empty((frame.height, frame.width, 3), np.uint8)
    image[...] = rgb(TABLE["page"])
    canvas = Canvas(width, tall=frame.height / width)
    _draw_top(canvas, frame, layout.table)
    if task is not None:
        _draw_slots(canvas, frame, task)
    if grown:
        for obstacle in layout.obstacles:
            _draw_obstacle(canvas, frame, obstacle, layout.table.hand, TABLE["grown"])
    for x, y in layout.table.starts.values():
        _draw_start(canvas, frame, x, y, layout.table.hand)
    for obstacle in layout.obstacles:
        line = max(0.0016, 1.1 / frame.scale)
        _draw_obstacle(canvas, frame, obstacle, line / 2, TABLE["obstacle_edge"])
        _draw_obstacle(canvas, frame, obstacle, -line / 2, TABLE["obstacle"])
    paste(image, canvas.sprite(), 0, 0)
    return image


def _box(canvas: Canvas, frame: Frame, box: tuple[float, float, float, float], colour: str, radius: float) -> None:
    """A rectangle ``(x0, y0, x1, y1)`` on the table, in metres."""
    left, top = frame.unit(box[0], box[3])
    canvas.rectangle(
        left, top, frame.length(box[2] - box[0]), frame.length(box[3] - box[1]), colour, radius=frame.length(radius)
    )


def _draw_top(canvas: Canvas, frame: Frame, table: Table) -> None:
    (width, depth), rim = table.size, 0.8 * frame.margin / frame.scale
    _box(canvas, frame, (-rim, -rim, width + rim, depth + rim), TABLE["rim"], 0.022)
    _box(canvas, frame, (0, 0, width, depth), TABLE["top"], 0.012)
    line = max(0.0022, 1.0 / frame.scale)
    for box, fill, edge in (
        (table.region, "region", "region_line"),
        (table.assembly, "assembly", "assembly_line"),
    ):
        x0, y0, x1, y1 = box
        pad = 0.0225 + 0.008  # the region is for centres: show where boxes may be
        pad = pad if fill == "region" else 0.0
        box = (max(x0 - pad, 0), max(y0 - pad, 0), min(x1 + pad, width), min(y1 + pad, depth))
        _box(canvas, frame, box, TABLE[edge], 0.014)
        inner = (box[0] + line, box[1] + line, box[2] - line, box[3] - line)
        _box(canvas, frame, inner, TABLE[fill], 0.012)


def _draw_slots(canvas: Canvas, frame: Frame, task: TabletopTask) -> None:
    line = max(0.0016, 0.9 / frame.scale)
    for name, (x, y) in task.configuration.items():
        obj = task.layout.objects[task.layout.index(name)]
        for grow, colour in ((0.004, TABLE["slot_line"]), (0.004 - 2 * line, TABLE["slot"])):
            long, wide = (frame.length(side + grow) for side in obj.size)
            canvas.polygon(outline(*frame.unit(x, y), long, wide, obj.angle, frame.length(0.006)), colour)
        faint = mix(colour_of(obj), TABLE["slot"], 0.68)
        size = 0.62 * frame.length(min(obj.size))
        draw_glyph(canvas, obj.shape, *frame.unit(x, y), size, obj.angle, faint, TABLE["slot"])


def _draw_start(canvas: Canvas, frame: Frame, x: float, y: float, hand: float) -> None:
    """A ring of the hand's size with a dot in it."""
    at, radius = frame.unit(x, y), frame.length(max(hand, 0.012))
    line = max(frame.length(0.0035), 1.3 / frame.width)
    ink = mix(TABLE["start"], TABLE["top"], 0.15)
    canvas.arc(*at, radius - line / 2, (0, 1), line, ink)
    canvas.circle(*at, max(frame.length(0.005), 1.2 / frame.width), ink)


def _draw_obstacle(canvas: Canvas, frame: Frame, obstacle: VirtualObstacle, grow: float, colour: str) -> None:
    long, wide = (frame.length(max(side + 2 * grow, 0.0015)) for side in obstacle.size)
    canvas.polygon(outline(*frame.unit(*obstacle.at), long, wide, obstacle.angle), colour)


class _Surfaces:
    """The last few surfaces drawn, up to a number of bytes; a game draws one many times."""

    def __init__(self, room: int) -> None:
        self._room, self._held = room, 0
        self._images: OrderedDict[object, Image] = OrderedDict()
        self._lock = threading.Lock()

    def __call__(self, layout: TabletopLayout, task: TabletopTask | None, width: int, *, grown: bool = False) -> Image:
        """The surface as a read-only array; objects of the layout are not on it."""
        slots = () if task is None else tuple(task.configuration.items())
        looks = () if task is None else tuple((o.size, o.angle, o.colour, o.shape) for o in task.layout.objects)
        key = (layout.table, layout.obstacles, slots, looks, width, grown)
        with self._lock:
            if key in self._images:
                self._images.move_to_end(key)
                return self._images[key]
        image = _draw_surface(layout, task, width, grown)
        image.setflags(write=False)
        with self._lock:
            if key not in self._images:
                self._images[key] = image
                self._held += image.nbytes
            while self._held > self._room and len(self._images) > 1:
                self._held -= self._images.popitem(last=False)[1].nbytes
        return image


surface_of: Final = _Surfaces(room=64 * 2**20)
