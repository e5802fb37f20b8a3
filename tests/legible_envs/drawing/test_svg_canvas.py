"""Vectors show what pictures show: every part of a kitchen, rasterised from its SVG by other code, is its sprite."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image, ImageDraw

from legible_envs.drawing.canvas import Sprite, paste
from legible_envs.drawing.svg_canvas import UNIT, SvgCanvas
from legible_envs.overcooked.game.view import PotView
from legible_envs.overcooked.layout import COUNTER, FLOOR, OBSTACLE, STATION_CODES, SYMBOLS
from legible_envs.overcooked.rendering.actors import pot_sprite
from legible_envs.overcooked.rendering.symbols import kitchen_symbols
from legible_envs.overcooked.rendering.tiles import tile_sprite

SIDE, FINE = 50, 500


def rgba(element: ElementTree.Element, name: str) -> tuple[int, int, int, int]:
    colour = element.get(name, "")
    if len(colour) == 4:
        colour = "#" + "".join(2 * c for c in colour[1:])
    alpha = round(255 * float(element.get("opacity", "1")))
    return (*(int(colour[i : i + 2], 16) for i in (1, 3, 5)), alpha)  # type: ignore[return-value]


def points_of(path: str) -> list[tuple[float, float]]:
    """The corners of ``Mx yldx dy…Z``."""
    numbers = [float(n) for n in re.findall(r"-?\d+", path)]
    at = np.cumsum(np.reshape(numbers, (-1, 2)), axis=0) * FINE / UNIT
    return [(float(x), float(y)) for x, y in at]


def rasterised(symbols: list[str]) -> np.ndarray:
    """``(SIDE, SIDE, 3)`` of symbols laid over one another on black, by Pillow."""
    image = Image.new("RGBA", (FINE, FINE), "black")
    for symbol in symbols:
        for element in ElementTree.fromstring(symbol):
            layer = Image.new("RGBA", image.size)
            draw_element(ImageDraw.Draw(layer), element)
            image = Image.alpha_composite(image, layer)
    fine = np.asarray(image.convert("RGB"), np.float64)
    return fine.reshape(SIDE, FINE // SIDE, SIDE, FINE // SIDE, 3).mean(axis=(1, 3))


def draw_element(pen: ImageDraw.ImageDraw, element: ElementTree.Element) -> None:
    size = {name: float(value) * FINE / UNIT for name, value in element.attrib.items() if re.fullmatch(r"-?\d+", value)}
    if element.tag in ("circle", "ellipse"):
        rx, ry = size.get("rx", size.get("r", 0)), size.get("ry", size.get("r", 0))
        x, y = size["cx"], size["cy"]
        pen.ellipse((x - rx, y - ry, x + rx, y + ry), rgba(element, "fill"))
    elif element.tag == "rect":
        box = (size["x"], size["y"], size["x"] + size["width"] - 1, size["y"] + size["height"] - 1)
        pen.rounded_rectangle(box, size.get("rx", 0), rgba(element, "fill"))
    elif element.get("fill") == "none":
        points, ink, wide = points_of(element.attrib["d"]), rgba(element, "stroke"), size["stroke-width"]
        pen.line(points, ink, round(wide))
        for x, y in points:
            pen.ellipse((x - wide / 2, y - wide / 2, x + wide / 2, y + wide / 2), ink)
    else:
        pen.polygon(points_of(element.attrib["d"]), rgba(element, "fill"))


def painted(sprites: list[Sprite]) -> np.ndarray:
    image = np.zeros((SIDE, SIDE, 3), np.uint8)
    for sprite in sprites:
        paste(image, sprite, 0, 0)
    return image.astype(np.float64)


def cases() -> dict[str, tuple[list[str], list[Sprite]]]:
    found: dict[str, tuple[list[str], list[Sprite]]] = {}
    for odd in (0, 1):
        for around in range(4):
            sprite = tile_sprite(FLOOR, around, bool(odd), 0, SIDE)
            found[f"floor {around} {odd}"] = [f"floor-{around}{odd}"], [sprite]
        for front in (0, 1):
            found[f"counter {front} {odd}"] = (
                [f"counter-{front}{odd}"],
                [tile_sprite(COUNTER, front, bool(odd), 0, SIDE)],
            )
    for around in (0, 255, 0b10100101, 0b00011011):
        edges = [f"edge-{bit}" for bit in range(8) if not around >> bit & 1]
        under = tile_sprite(FLOOR, 0, False, 0, SIDE)
        sprites = [under, tile_sprite(OBSTACLE, around, False, 0, SIDE)]
        found[f"obstacle {around}"] = ["floor-00", "light", *edges], sprites
    for kind, code in STATION_CODES.items():
        for out in range(4 if kind == "serving" else 1):
            name = f"{SYMBOLS[code]}-{out}" if kind == "serving" else SYMBOLS[code]
            sprites = [tile_sprite(code, 1, False, out, SIDE)]
            if kind == "pot":
                sprites.append(pot_sprite(PotView(), SIDE))
            found[f"{kind} {out}"] = ["counter-10", name], sprites
    return found


@pytest.mark.parametrize("case", cases())
def test_a_symbol_is_the_sprite(case: str) -> None:
    names, sprites = cases()[case]
    symbols = kitchen_symbols()
    apart = np.abs(rasterised([symbols[f"k-{name}"] for name in names]) - painted(sprites))
    assert apart.mean() < 2.5, "of 255, over the whole tile"
    assert np.percentile(apart, 95) < 16


def test_another_symbol_is_not_the_sprite() -> None:
    symbols = kitchen_symbols()
    tomato = painted([tile_sprite(STATION_CODES["tomato"], 1, False, 0, SIDE)])
    assert np.abs(rasterised([symbols["k-counter-10"], symbols["k-O"]]) - tomato).mean() > 8


def test_every_part_has_a_symbol_of_its_own() -> None:
    symbols = kitchen_symbols()
    assert len(set(symbols.values())) == len(symbols)
    for name, text in symbols.items():
        assert ElementTree.fromstring(text).get("id") == name
    assert sum(map(len, symbols.values())) < 40_000, "they travel in every page"


def test_shapes_are_written_short() -> None:
    canvas = SvgCanvas()
    canvas.rectangle(0.1, 0.2, 0.4, 0.1, "#aabbcc", 0.25, radius=0.3)
    canvas.polygon([(0, 0), (0.5, -0.25), (1, 1)], "#123456")
    canvas.stroke([(0, 0), (0.5, 0.5)], 0.02, "#ffffff")
    assert canvas.elements == [
        '<rect x="100" y="200" width="400" height="100" rx="50" fill="#abc" opacity=".25"/>',
        '<path d="M0 0l500-250 500 1250Z" fill="#123456"/>',
        '<path d="M0 0l500 500" fill="none" stroke="#fff" stroke-width="20" stroke-linecap="round"'
        ' stroke-linejoin="round"/>',
    ]
