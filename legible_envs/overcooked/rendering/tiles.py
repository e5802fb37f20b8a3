"""The fixed parts of a kitchen, one tile each: floor, counters, virtual obstacles and the seven stations."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final

from legible_envs.drawing.canvas import Canvas, Sprite, mix
from legible_envs.drawing.svg_canvas import Pen
from legible_envs.overcooked.grid import NEIGHBOURS
from legible_envs.overcooked.layout import COUNTER, FLOOR, OBSTACLE, STATION_TYPES
from legible_envs.overcooked.rendering.food import draw_ingredient
from legible_envs.overcooked.rendering.palette import PALETTE

__all__ = [
    "COUNTER_TOP",
    "draw_counter",
    "draw_edges",
    "draw_floor",
    "draw_light",
    "draw_station",
    "tile_sprite",
]

COUNTER_TOP: Final = 0.42
"""Height at which objects stand on a counter, in tiles from the top of its cell."""

_FRONT: Final = 0.18  # how much of a counter's cell shows its front


def draw_floor(canvas: Pen, around: int, odd: bool) -> None:
    """Floor, with the shadow of a counter to the north (bit 0 of ``around``) and to the west (bit 1)."""
    canvas.rectangle(0, 0, 1, 1, PALETTE["floor_line"])
    colour = PALETTE["floor_alternate" if odd else "floor"]
    canvas.rectangle(0.012, 0.012, 0.976, 0.976, colour)
    canvas.rectangle(0.03, 0.03, 0.94, 0.022, mix(colour, "#ffffff", 0.4))
    if around & 1:  # a counter to the north throws a soft shadow, one to the west a thin one
        for depth in (0.05, 0.1, 0.15, 0.2):
            canvas.rectangle(0, 0, 1, depth, PALETTE["shadow"], 0.075)
    if around & 2:
        for depth in (0.035, 0.07):
            canvas.rectangle(0, 0, depth, 1, PALETTE["shadow"], 0.07)


def draw_counter(canvas: Pen, front: bool, odd: bool) -> None:
    """A counter, whose front shows where no other one stands below it."""
    wood = mix(PALETTE["counter"], PALETTE["counter_light"], 0.16 if odd else 0.0)
    canvas.rectangle(0, 0, 1, 1, wood)
    light, line = PALETTE["counter_light"], PALETTE["counter_line"]
    canvas.rectangle(0, 0, 1, 0.035, light)
    for y, x0, x1 in ((0.25, 0.12, 0.58), (0.47, 0.44, 0.9), (0.66, 0.1, 0.4)):
        canvas.stroke([(x0, y), (x1, y)], 0.018, line, 0.4)
    canvas.rectangle(0.986, 0, 0.014, 1, line, 0.8)
    if not front:
        canvas.rectangle(0, 0.985, 1, 0.015, line, 0.6)
        return
    canvas.rectangle(0, 1 - _FRONT, 1, _FRONT, PALETTE["counter_front"])
    canvas.rectangle(0, 1 - _FRONT - 0.035, 1, 0.04, light)
    canvas.rectangle(0, 1 - _FRONT, 1, 0.03, PALETTE["counter_dark"], 0.55)
    canvas.rectangle(0, 0.965, 1, 0.035, PALETTE["counter_dark"])
    canvas.rectangle(0.986, 1 - _FRONT, 0.014, _FRONT, PALETTE["counter_dark"], 0.7)


def _obstacle(canvas: Pen, around: int) -> None:
    """Light projected on the floor, with edges where there are no neighbouring obstacles."""
    draw_light(canvas)
    draw_edges(canvas, around)


def draw_light(canvas: Pen) -> None:
    """The light of a virtual obstacle without its edges."""
    canvas.rectangle(0, 0, 1, 1, PALETTE["obstacle"], 0.7)
    for k in range(-4, 5):  # the stripes meet those of the neighbouring cells
        canvas.polygon(
            [(k / 4, 1), (k / 4 + 0.085, 1), (k / 4 + 1.085, 0), (k / 4 + 1, 0)], PALETTE["obstacle_light"], 0.55
        )


def draw_edges(canvas: Pen, around: int) -> None:
    """Edges of a virtual obstacle where the neighbour (bits N, E, S, W, then NE, SE, SW, NW) is none."""
    edge, width = PALETTE["obstacle_edge"], 0.075
    sides = ((0, 0, 1, width), (1 - width, 0, width, 1), (0, 1 - width, 1, width), (0, 0, width, 1))
    for bit, side in enumerate(sides):
        if not around >> bit & 1:
            canvas.rectangle(*side, edge)
    for bit, (x, y) in enumerate(((1 - width, 0), (1 - width, 1 - width), (0, 1 - width), (0, 0)), 4):
        if not around >> bit & 1:
            canvas.rectangle(x, y, width, width, edge)


def _crate(canvas: Pen, kind: str, spots: tuple[tuple[float, float], ...], radius: float) -> None:
    wood, dark = PALETTE["crate"], PALETTE["crate_dark"]
    canvas.rectangle(0.07, 0.13, 0.88, 0.7, PALETTE["shadow"], 0.3, radius=0.06)
    canvas.rectangle(0.07, 0.08, 0.86, 0.7, dark, radius=0.06)
    canvas.rectangle(0.12, 0.13, 0.76, 0.5, mix(dark, "#000000", 0.45), radius=0.04)
    for x, y in spots:
        draw_ingredient(canvas, kind, x, y, radius)
    for y in (0.56, 0.68):
        canvas.rectangle(0.07, y, 0.86, 0.105, wood, radius=0.025)
        canvas.rectangle(0.07, y, 0.86, 0.025, mix(wood, "#ffe2b8", 0.35), radius=0.012)
    for x in (0.1, 0.82):
        canvas.rectangle(x, 0.55, 0.08, 0.24, mix(wood, dark, 0.45), radius=0.02)
        canvas.circle(x + 0.04, 0.61, 0.016, dark)
        canvas.circle(x + 0.04, 0.73, 0.016, dark)


def _tomatoes(canvas: Pen, out: int) -> None:
    _crate(canvas, "tomato", ((0.36, 0.26), (0.65, 0.26), (0.27, 0.45), (0.51, 0.44), (0.74, 0.45)), 0.165)


def _onions(canvas: Pen, out: int) -> None:
    _crate(canvas, "onion", ((0.36, 0.26), (0.65, 0.26), (0.27, 0.44), (0.51, 0.44), (0.74, 0.44)), 0.155)


def _cabbages(canvas: Pen, out: int) -> None:
    _crate(canvas, "cabbage", ((0.5, 0.23), (0.31, 0.42), (0.69, 0.42)), 0.205)


def _fishes(canvas: Pen, out: int) -> None:
    steel, dark, ice = PALETTE["steel"], PALETTE["steel_dark"], PALETTE["ice"]
    canvas.rectangle(0.07, 0.13, 0.88, 0.7, PALETTE["shadow"], 0.3, radius=0.06)
    canvas.rectangle(0.07, 0.08, 0.86, 0.72, dark, radius=0.06)
    canvas.rectangle(0.1, 0.11, 0.8, 0.5, ice, radius=0.04)
    for x, y in ((0.16, 0.18), (0.4, 0.14), (0.7, 0.16), (0.2, 0.44), (0.5, 0.48), (0.78, 0.42)):
        canvas.polygon([(x, y), (x + 0.1, y + 0.01), (x + 0.08, y + 0.1), (x - 0.02, y + 0.08)], "#ffffff")
        canvas.polygon(
            [(x, y + 0.06), (x + 0.08, y + 0.06), (x + 0.08, y + 0.1), (x - 0.02, y + 0.08)], mix(ice, "#5fa4c4", 0.4)
        )
    draw_ingredient(canvas, "fish", 0.46, 0.27, 0.27)
    draw_ingredient(canvas, "fish", 0.54, 0.49, 0.27)
    canvas.rectangle(0.07, 0.62, 0.86, 0.18, steel, radius=0.04)
    canvas.rectangle(0.07, 0.62, 0.86, 0.035, "#eef2f5", radius=0.015)
    canvas.rectangle(0.38, 0.69, 0.24, 0.05, dark, radius=0.025)


def _dishes(canvas: Pen, out: int) -> None:
    white = PALETTE["dish"]
    rim = mix(white, "#6f7b8c", 0.55)
    canvas.ellipse(0.5, 0.68, 0.4, 0.14, PALETTE["shadow"], 0.35)
    for level in range(5):
        y = 0.62 - 0.075 * level
        canvas.ellipse(0.5, y + 0.03, 0.39, 0.2, rim)
        canvas.ellipse(0.5, y, 0.39, 0.2, mix(white, rim, 0.12))
    canvas.ellipse(0.5, 0.325, 0.25, 0.115, mix(white, rim, 0.55))
    canvas.ellipse(0.5, 0.335, 0.235, 0.1, mix(white, rim, 0.25))


def _stove(canvas: Pen, out: int) -> None:
    dark = PALETTE["stove"]
    canvas.rectangle(0.03, 0.03, 0.94, 0.79, mix(dark, "#000000", 0.4), radius=0.08)
    canvas.rectangle(0.03, 0.02, 0.94, 0.77, dark, radius=0.08)
    canvas.rectangle(0.05, 0.035, 0.9, 0.03, mix(dark, "#ffffff", 0.22), radius=0.015)
    canvas.circle(0.5, COUNTER_TOP, 0.36, mix(dark, "#000000", 0.35))
    canvas.circle(0.5, COUNTER_TOP, 0.32, mix(dark, "#ffffff", 0.08))


def _serving(canvas: Pen, out: int) -> None:
    """A hatch with a domed dish in front of it and arrows that point away from the room (0 N, 1 S, 2 E, 3 W)."""
    green = PALETTE["serving"]
    canvas.rectangle(0.04, 0.06, 0.92, 0.76, PALETTE["shadow"], 0.3, radius=0.08)
    canvas.rectangle(0.04, 0.03, 0.92, 0.76, mix(green, "#0c3424", 0.45), radius=0.08)
    canvas.rectangle(0.07, 0.06, 0.86, 0.69, green, radius=0.06)
    dy, dx = NEIGHBOURS[out]
    for ahead in (0.16, 0.29):
        x, y = 0.5 + dx * (ahead + 0.06), 0.405 + dy * ahead * 0.88
        wing = [(x - dx * 0.1 + side * dy * 0.24, y - dy * 0.1 + side * dx * 0.24) for side in (-1, 1)]
        canvas.stroke([wing[0], (x, y), wing[1]], 0.055, "#e6fbf0", 0.75)
    _cloche(canvas, 0.5 - dx * 0.13, 0.53 - dy * 0.14)


def _cloche(canvas: Pen, x: float, y: float) -> None:
    """A domed dish, its plate's centre at the point."""
    gold = PALETTE["flame_light"]
    canvas.ellipse(x, y + 0.03, 0.28, 0.07, PALETTE["shadow"], 0.4)
    canvas.ellipse(x, y, 0.28, 0.065, "#fffdf6")
    dome = [
        (-0.215, -0.015),
        (-0.2, -0.14),
        (-0.135, -0.235),
        (0, -0.27),
        (0.135, -0.235),
        (0.2, -0.14),
        (0.215, -0.015),
    ]
    canvas.polygon([(x + a, y + b) for a, b in dome], mix(gold, "#8a5a10", 0.25))
    canvas.polygon([(x + 0.9 * a, y + b + 0.012) for a, b in dome], gold)
    canvas.stroke([(x - 0.125, y - 0.09), (x - 0.105, y - 0.155), (x - 0.055, y - 0.205)], 0.036, "#ffffff", 0.85)
    canvas.circle(x, y - 0.285, 0.045, mix(gold, "#8a5a10", 0.35))


_STATIONS: Final[tuple[Callable[[Pen, int], None], ...]] = (
    _tomatoes,
    _onions,
    _cabbages,
    _fishes,
    _dishes,
    _stove,
    _serving,
)


def draw_station(canvas: Pen, code: int, out: int) -> None:
    """A station without the counter under it and without the pot on a stove; ``out`` as for :func:`tile_sprite`."""
    assert len(_STATIONS) == len(STATION_TYPES)
    _STATIONS[code - OBSTACLE - 1](canvas, out)


@lru_cache(maxsize=1024)
def tile_sprite(code: int, around: int, odd: bool, out: int, size: int) -> Sprite:
    """One cell of a kitchen.

    Args:
        code: Cell code.
        around: Floor: bit 0 a counter to the north, bit 1 to the west. Obstacle: bits N, E, S, W, NE, SE, SW, NW of
            neighbouring obstacles. Counter or station: bit 0 the front shows.
        odd: The darker squares of the floor's chequer, the lighter wood.
        out: The side of a serving hatch away from the room, 0 N, 1 S, 2 E, 3 W; else 0.
        size: Pixels of the tile.
    """
    canvas = Canvas(size)
    if code == FLOOR:
        draw_floor(canvas, around, odd)
    elif code == OBSTACLE:
        _obstacle(canvas, around)
    else:
        draw_counter(canvas, bool(around & 1), odd)
        if code != COUNTER:
            draw_station(canvas, code, out)
    return canvas.sprite()
