"""The parts of a kitchen as SVG symbols for pages, drawn by the very functions that draw its pictures."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

from legible_envs.drawing.svg_canvas import SvgCanvas
from legible_envs.overcooked.game.view import PotView
from legible_envs.overcooked.grid import EAST, NORTH, SOUTH, WEST
from legible_envs.overcooked.layout import INGREDIENTS, STATION_CODES, SYMBOLS
from legible_envs.overcooked.rendering.actors import (
    CHEF_RISE,
    GAUGE,
    draw_chef,
    draw_flames,
    draw_gauge,
    draw_hands,
    draw_pot,
    draw_ready,
    draw_steam,
    draw_tick,
    draw_wedge,
    held_at,
    held_radius,
)
from legible_envs.overcooked.rendering.food import draw_ingredient, draw_plate, places_of_pieces
from legible_envs.overcooked.rendering.palette import PALETTE, PLAYER_COLOURS
from legible_envs.overcooked.rendering.tiles import (
    COUNTER_TOP,
    draw_counter,
    draw_edges,
    draw_floor,
    draw_light,
    draw_station,
)

__all__ = ["PART_RADIUS", "game_measures", "game_symbols", "kitchen_symbols"]

PART_RADIUS: Final = 0.4
"""Of an ingredient or a plate on its symbol, whose side is 1."""

_SIDES = 4
_EDGES = 8
_FULLEST = 16
"""Ingredients of a soup that :func:`game_measures` arranges."""


@lru_cache(maxsize=1)
def kitchen_symbols() -> dict[str, str]:
    """Every part of a kitchen as a ``<symbol>``, by its id.

    Returns:
        ``k-floor-AO`` (``A`` 0 to 3: bit 0 a counter to the north, bit 1 to the west; ``O`` 1 on the darker squares),
        ``k-counter-FO`` (``F`` 1 where its front shows), ``k-light`` and ``k-edge-B`` for a virtual obstacle (``B`` the
        neighbour without one: N, E, S, W, NE, SE, SW, NW), and the stations by their letters, to be laid on a counter:
        ``k-T`` and so on; serving has one for each side that it hands out to, ``k-S-0`` (north) to ``k-S-3`` (west).
    """
    drawn: dict[str, SvgCanvas] = {}

    def sheet(name: str) -> SvgCanvas:
        return drawn.setdefault(f"k-{name}", SvgCanvas())

    for odd in (0, 1):
        for around in range(4):
            draw_floor(sheet(f"floor-{around}{odd}"), around, bool(odd))
        for front in (0, 1):
            draw_counter(sheet(f"counter-{front}{odd}"), bool(front), bool(odd))
    draw_light(sheet("light"))
    for bit in range(_EDGES):
        draw_edges(sheet(f"edge-{bit}"), 2**_EDGES - 1 - 2**bit)
    for kind, code in STATION_CODES.items():
        if kind == "serving":
            for out in range(_SIDES):
                draw_station(sheet(f"{SYMBOLS[code]}-{out}"), code, out)
        else:
            draw_station(sheet(SYMBOLS[code]), code, 0)
    draw_pot(sheet(SYMBOLS[STATION_CODES["pot"]]), PotView())
    return {name: canvas.symbol(name) for name, canvas in drawn.items()}


@lru_cache(maxsize=1)
def game_symbols() -> dict[str, str]:
    """What moves and changes in a kitchen as ``<symbol>``, by its id; :func:`game_measures` says where it goes.

    Returns:
        ``k-chef-F`` (``F`` the facing: 0 N, 1 S, 2 E, 3 W) without hands, with ``k-hands-F`` empty and ``k-grip-F``
        full hands, and ``k-wedge-F`` on the floor, all ``1 + CHEF_RISE`` tall; ``k-item-KIND`` for ingredients and the
        empty dish, each of radius :data:`PART_RADIUS`; of pots ``k-pot``, ``k-flames-0``, ``k-flames-1``,
        ``k-steam-0``, ``k-steam-1``, ``k-ready`` (a glow), ``k-gauge`` (empty) and ``k-gauge-full``; and ``k-tick``.
    """
    chefs: dict[str, SvgCanvas] = {}
    parts: dict[str, SvgCanvas] = {}

    def sheet(name: str, among: dict[str, SvgCanvas] = parts) -> SvgCanvas:
        return among.setdefault(f"k-{name}", SvgCanvas())

    for facing in (NORTH, SOUTH, EAST, WEST):
        draw_wedge(sheet(f"wedge-{facing}", chefs), PLAYER_COLOURS[0], facing)
        draw_chef(sheet(f"chef-{facing}", chefs), PLAYER_COLOURS[0], facing)
        draw_hands(sheet(f"hands-{facing}", chefs), facing, full=False)
        draw_hands(sheet(f"grip-{facing}", chefs), facing, full=True)
    for kind in INGREDIENTS:
        draw_ingredient(sheet(f"item-{kind}"), kind, 0.5, 0.5, PART_RADIUS)
    draw_plate(sheet("item-dish"), 0.5, 0.5, PART_RADIUS)
    for phase in (0, 1):
        draw_flames(sheet(f"flames-{phase}"), phase)
        draw_steam(sheet(f"steam-{phase}"), phase)
    draw_pot(sheet("pot"), PotView())
    draw_ready(sheet("ready"))
    draw_gauge(sheet("gauge"), 0.0, PALETTE["progress"])
    draw_gauge(sheet("gauge-full"), 1.0, PALETTE["ready"])
    draw_tick(sheet("tick"), 0.5, 0.5, 0.5)
    found = {name: canvas.symbol(name, 1 + CHEF_RISE) for name, canvas in chefs.items()}
    return found | {name: canvas.symbol(name) for name, canvas in parts.items()}


def game_measures() -> dict[str, Any]:
    """Where the parts of :func:`game_symbols` go, in tiles, as plain data.

    Returns:
        ``part`` (:data:`PART_RADIUS`), ``rise`` (of a chef's hat), ``held`` (by facing: where things are held),
        ``held_radius`` (of an ingredient, of a dish), ``top`` (height of a counter's top), ``gauge`` (left, top, width,
        height), ``progress`` (its colour), ``shadow``, ``colours`` (of ingredients), and ``pieces``: for each number of
        ingredients their ``[x, y, radius]`` in a circle of radius 1 round the origin.
    """
    return {
        "part": PART_RADIUS,
        "rise": CHEF_RISE,
        "held": [list(held_at(facing)) for facing in range(_SIDES)],
        "held_radius": [held_radius("onion"), held_radius("dish")],
        "top": COUNTER_TOP,
        "gauge": list(GAUGE),
        "progress": PALETTE["progress"],
        "shadow": PALETTE["shadow"],
        "colours": {kind: PALETTE[kind] for kind in INGREDIENTS},
        "pieces": {
            count: [[round(v, 4) for v in place] for place in places_of_pieces(count)]
            for count in range(1, _FULLEST + 1)
        },
    }
