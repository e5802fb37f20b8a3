"""Ingredients, dishes and soups: each drawn round a point, so that they fit crates, hands, pots and recipe tickets."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final

from legible_envs.drawing.canvas import Canvas, Sprite, mix
from legible_envs.drawing.svg_canvas import Pen
from legible_envs.overcooked.game.view import Item
from legible_envs.overcooked.layout import INGREDIENTS
from legible_envs.overcooked.rendering.palette import PALETTE

__all__ = [
    "draw_ingredient",
    "draw_item",
    "draw_pieces",
    "draw_plate",
    "item_sprite",
    "places_of_pieces",
    "soup_colour",
]


def _tomato(canvas: Pen, x: float, y: float, r: float) -> None:
    red = PALETTE["tomato"]
    canvas.ellipse(x, y, r, r * 0.92, mix(red, "#5a0f0c", 0.35))
    canvas.ellipse(x - r * 0.04, y - r * 0.06, r * 0.92, r * 0.84, red)
    canvas.ellipse(x - r * 0.36, y - r * 0.22, r * 0.26, r * 0.18, "#ffffff", 0.5)
    for turn in range(5):
        angle = 2 * math.pi * (turn / 5 + 0.05)
        tip = (x + 0.52 * r * math.cos(angle), y - 0.62 * r + 0.3 * r * math.sin(angle))
        canvas.stroke([(x, y - 0.62 * r), tip], 0.17 * r, PALETTE["leaf"])
    canvas.stroke([(x, y - 0.62 * r), (x + 0.08 * r, y - 0.98 * r)], 0.17 * r, mix(PALETTE["leaf"], "#000000", 0.2))


def _onion(canvas: Pen, x: float, y: float, r: float) -> None:
    gold, brown = PALETTE["onion"], mix(PALETTE["onion"], "#7a3f12", 0.6)
    bulb = [
        (x + r * (0.98 * math.sin(a)) * (1 - 0.10 * math.cos(a)), y + 0.12 * r - 0.86 * r * math.cos(a))
        for a in (2 * math.pi * i / 48 for i in range(48))
    ]
    tip = [
        (x - 0.46 * r, y - 0.52 * r),
        (x - 0.1 * r, y - 1.12 * r),
        (x + 0.12 * r, y - 1.1 * r),
        (x + 0.46 * r, y - 0.52 * r),
    ]
    canvas.polygon(bulb, brown)
    canvas.polygon(tip, brown)
    canvas.ellipse(x - 0.02 * r, y + 0.08 * r, 0.84 * r, 0.76 * r, gold)
    canvas.polygon([(x - 0.3 * r, y - 0.5 * r), (x - 0.04 * r, y - 0.96 * r), (x + 0.3 * r, y - 0.5 * r)], gold)
    for side in (-0.52, 0.0, 0.52):
        line = [
            (x + side * r * math.sin(math.pi * s), y + r * (0.84 * s * 1.0 - 0.02) - 0.62 * r * (1 - s))
            for s in (0.1, 0.3, 0.5, 0.7, 0.9)
        ]
        canvas.stroke(line, 0.09 * r, brown, 0.75)
    canvas.ellipse(x - r * 0.42, y - r * 0.08, r * 0.16, r * 0.24, "#ffffff", 0.5)
    canvas.stroke([(x - 0.14 * r, y + r * 0.98), (x + 0.14 * r, y + r * 0.98)], 0.12 * r, brown)


def _cabbage(canvas: Pen, x: float, y: float, r: float) -> None:
    green = PALETTE["cabbage"]
    dark, pale = mix(green, "#1f4d12", 0.5), mix(green, "#f4ffd8", 0.55)
    for dx, dy, size in (
        (-0.42, 0.2, 0.62),
        (0.42, 0.2, 0.62),
        (0.0, 0.34, 0.66),
        (-0.34, -0.3, 0.62),
        (0.34, -0.3, 0.62),
    ):
        canvas.circle(x + dx * r, y + dy * r, size * r, dark)
        canvas.circle(x + dx * r * 0.98, y + dy * r * 0.98 - 0.03 * r, (size - 0.09) * r, green)
    canvas.circle(x, y - 0.02 * r, 0.6 * r, dark, 0.55)
    canvas.circle(x, y - 0.05 * r, 0.54 * r, mix(green, pale, 0.55))
    canvas.stroke([(x, y + 0.5 * r), (x, y - 0.3 * r)], 0.1 * r, pale)
    for side in (-1, 1):
        canvas.stroke([(x, y + 0.26 * r), (x + side * 0.34 * r, y - 0.1 * r)], 0.08 * r, pale)
        canvas.stroke([(x, y), (x + side * 0.22 * r, y - 0.28 * r)], 0.07 * r, pale)


def _fish(canvas: Pen, x: float, y: float, r: float) -> None:
    blue = PALETTE["fish"]
    dark, belly = mix(blue, "#12284a", 0.45), mix(blue, "#ffffff", 0.62)
    canvas.polygon(
        [(x + 0.5 * r, y), (x + 1.12 * r, y - 0.52 * r), (x + 0.96 * r, y), (x + 1.12 * r, y + 0.52 * r)], dark
    )
    canvas.polygon([(x - 0.3 * r, y - 0.36 * r), (x + 0.16 * r, y - 0.82 * r), (x + 0.4 * r, y - 0.3 * r)], dark)
    body = [(x - 1.08 * r, y), (x - 0.72 * r, y - 0.4 * r), (x - 0.2 * r, y - 0.54 * r), (x + 0.34 * r, y - 0.38 * r)]
    body += [(x + 0.84 * r, y), (x + 0.34 * r, y + 0.38 * r), (x - 0.2 * r, y + 0.54 * r), (x - 0.72 * r, y + 0.4 * r)]
    canvas.polygon(body, blue)
    canvas.polygon([(x - 1.04 * r, y + 0.06 * r), (x + 0.7 * r, y + 0.08 * r), *body[5:]], belly)
    canvas.stroke([(x - 0.44 * r, y - 0.34 * r), (x - 0.34 * r, y), (x - 0.44 * r, y + 0.3 * r)], 0.08 * r, dark, 0.8)
    canvas.circle(x - 0.7 * r, y - 0.12 * r, 0.16 * r, "#ffffff")
    canvas.circle(x - 0.72 * r, y - 0.11 * r, 0.09 * r, "#14202e")


_DRAW: Final[dict[str, Callable[[Pen, float, float, float], None]]] = {
    "tomato": _tomato,
    "onion": _onion,
    "cabbage": _cabbage,
    "fish": _fish,
}


def draw_ingredient(canvas: Pen, kind: str, x: float, y: float, radius: float) -> None:
    """One whole ingredient of about the given radius round a point."""
    _DRAW[kind](canvas, x, y, radius)


def soup_colour(contents: Sequence[str]) -> str:
    """The colour of a soup of these ingredients: their colours blended, on the warm side."""
    colour = PALETTE[contents[0]]
    for number, kind in enumerate(contents[1:], 2):
        colour = mix(colour, PALETTE[kind], 1 / number)
    return mix(colour, "#ffcf87", 0.22)


def places_of_pieces(count: int) -> list[tuple[float, float, float]]:
    """``(x, y, radius)`` of each of ``count`` ingredients arranged inside a circle of radius 1 round the origin."""
    if count == 1:
        return [(0.0, 0.0, 0.62)]
    each = {2: 0.46, 3: 0.42, 4: 0.37}.get(count) or 0.82 / math.sqrt(count)
    places = []
    for number in range(count):
        if count <= 4:  # a ring, the first on top or to the left
            angle, around = 2 * math.pi * (number / count - (0.25 if count > 2 else 0.5)), 1 - each * 1.12
        else:  # the pattern of a sunflower's seeds fits any number
            angle, around = number * math.pi * (3 - math.sqrt(5)), (1 - each) * math.sqrt((number + 0.5) / count)
        places.append((around * math.cos(angle), around * math.sin(angle), each))
    return places


def draw_pieces(canvas: Pen, contents: Sequence[str], x: float, y: float, radius: float) -> None:
    """Ingredients arranged inside a circle of the given radius, smaller the more there are."""
    for kind, (dx, dy, size) in zip(contents, places_of_pieces(len(contents)), strict=True):
        draw_ingredient(canvas, kind, x + dx * radius, y + dy * radius, size * radius)


def draw_plate(canvas: Pen, x: float, y: float, radius: float) -> None:
    """An empty dish seen from above."""
    white = PALETTE["dish"]
    canvas.ellipse(x, y + radius * 0.1, radius, radius, PALETTE["shadow"], 0.28)
    canvas.circle(x, y, radius, mix(white, "#8a93a0", 0.5))
    canvas.circle(x, y, radius * 0.94, white)
    canvas.circle(x, y, radius * 0.64, mix(white, "#8a93a0", 0.34))
    canvas.circle(x, y + radius * 0.04, radius * 0.59, mix(white, "#8a93a0", 0.1))


def draw_item(canvas: Pen, item: Item, x: float, y: float, radius: float) -> None:
    """Anything a player can hold: an ingredient, a dish, or a dish of soup."""
    if item.kind in INGREDIENTS:
        draw_ingredient(canvas, item.kind, x, y, radius)
        return
    if item.kind not in ("dish", "soup"):
        raise ValueError(f"cannot draw an item of kind {item.kind!r}; expected 'dish', 'soup' or one of {INGREDIENTS}")
    draw_plate(canvas, x, y, radius * 1.12)
    if item.kind == "soup":
        colour = soup_colour(item.contents or ("onion",))
        canvas.circle(x, y, radius * 0.86, mix(colour, "#4a1d08", 0.45))
        canvas.circle(x, y + radius * 0.04, radius * 0.8, colour)
        draw_pieces(canvas, item.contents, x, y + radius * 0.02, radius * 0.78)


@lru_cache(maxsize=512)
def item_sprite(item: Item, size: int) -> Sprite:
    """An item lying on a counter, with its shadow, on a tile of ``size`` pixels."""
    canvas = Canvas(size)
    if item.kind in INGREDIENTS:
        canvas.ellipse(0.5, 0.6, 0.24, 0.1, PALETTE["shadow"], 0.3)
    draw_item(canvas, item, 0.5, 0.44, 0.24 if item.kind in INGREDIENTS else 0.28)
    return canvas.sprite()
