"""The parts of a kitchen as SVG symbols for pages, drawn by the very functions that draw its pictures."""

from __future__ import annotations

from functools import lru_cache

from legible_envs.drawing.svg_canvas import SvgCanvas
from legible_envs.overcooked.game.view import PotView
from legible_envs.overcooked.layout import STATION_CODES, SYMBOLS
from legible_envs.overcooked.rendering.actors import draw_pot
from legible_envs.overcooked.rendering.tiles import draw_counter, draw_edges, draw_floor, draw_light, draw_station

__all__ = ["kitchen_symbols"]

_SIDES = 4
_EDGES = 8


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
