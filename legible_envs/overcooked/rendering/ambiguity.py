"""Where goals are confused: a value per cell laid over the kitchen as a colour."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.canvas import Canvas, Image, Sprite, heat_colour, paste, rgb, text_sprite
from legible_envs.drawing.sheets import banner, check_tile
from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.rendering.board import board_of
from legible_envs.overcooked.rendering.palette import PALETTE, PLAYER_COLOURS

__all__ = ["draw_ambiguity"]

_SHADES: Final = 64
_MOVES: Final = {step: direction for direction, step in enumerate(NEIGHBOURS)}


def draw_ambiguity(
    layout: OvercookedLayout,
    heat: npt.ArrayLike,
    *,
    tile: int = 48,
    paths: Mapping[str, Sequence[Cell]] | Iterable[Sequence[Cell]] | None = None,
    values: bool = False,
    legend: tuple[str, str] = ("clear", "confused"),
    title: str | None = None,
) -> Image:
    """Draw a kitchen with a value laid over its cells, such as how unsure an observer is of a person standing there.

    Args:
        layout: Any kitchen.
        heat: ``(H, W)`` values in [0, 1]; NaN leaves a cell as it is.
        tile: Pixels of a cell's side, 8 to 256.
        paths: Paths to draw on top, each the ``(row, col)`` cells it visits; as a mapping, with a name each.
        values: Whether to write the values (in hundredths) on the cells.
        legend: What 0 and what 1 mean.
        title: A line above the drawing.

    Returns:
        ``(h, W * tile, 3)`` uint8: the kitchen, a legend below it, and the title above it if there is one.

    Raises:
        ValueError: Heat of another shape or out of range, or a path that jumps or leaves the kitchen.
    """
    grid = np.array(heat, dtype=np.float64)
    if grid.shape != layout.shape:
        raise ValueError(f"heat must have the kitchen's shape {layout.shape}, got {grid.shape}")
    off = ~np.isnan(grid) & ~((grid >= 0) & (grid <= 1))
    if off.any():
        row, col = np.argwhere(off)[0]
        raise ValueError(f"heat must lie in [0, 1] or be NaN; row {row}, column {col} is {grid[row, col]}")
    image = board_of(layout, check_tile(tile))
    for row, col in np.argwhere(~np.isnan(grid)):
        paste(image, _heat_sprite(round(grid[row, col] * _SHADES), tile), row * tile, col * tile)
        if values:
            _write_value(image, (row, col), grid[row, col], tile)
    named = dict(paths) if isinstance(paths, Mapping) else {str(i): path for i, path in enumerate(paths or ())}
    for number, path in enumerate(named.values()):
        _draw_path(image, layout, path, number, len(named), tile)
    names = list(named) if isinstance(paths, Mapping) else []
    image = np.concatenate([image, _legend(image.shape[1], legend, names, tile)])
    return banner(image, title, tile) if title else image


@lru_cache(maxsize=256)
def _heat_sprite(shade: int, tile: int) -> Sprite:
    canvas, value = Canvas(tile), shade / _SHADES
    canvas.rectangle(0.06, 0.06, 0.88, 0.88, heat_colour(value), 0.86, radius=0.14)
    return canvas.sprite()


def _write_value(image: Image, cell: Cell, value: float, tile: int) -> None:
    ink = PALETTE["ink"] if value < 0.55 else "#ffffff"
    sprite = text_sprite(f"{100 * value:.0f}", max(9, round(tile * 0.42)), ink)
    rows, cols = sprite.colour.shape[:2]
    paste(image, sprite, cell[0] * tile + (tile - rows) // 2, cell[1] * tile + (tile - cols) // 2)


def _draw_path(
    image: Image, layout: OvercookedLayout, path: Sequence[Cell], number: int, count: int, tile: int
) -> None:
    """A line from cell to cell, beside those of the other paths, with a dot at its start and an arrow at its end."""
    cells = [cell for i, cell in enumerate(path) if i == 0 or tuple(cell) != tuple(path[i - 1])]
    for row, col in cells:
        if not (0 <= row < layout.shape[0] and 0 <= col < layout.shape[1]):
            raise ValueError(f"path {number} leaves the kitchen of shape {layout.shape} at row {row}, column {col}")
    moves = []
    for (r0, c0), (r1, c1) in itertools.pairwise(cells):
        if (r1 - r0, c1 - c0) not in _MOVES:
            raise ValueError(f"path {number} jumps from row {r0}, column {c0} to row {r1}, column {c1}")
        moves.append(_MOVES[r1 - r0, c1 - c0])
    aside = 0.0 if count == 1 else 0.34 * (number / (count - 1) - 0.5)
    colour = PLAYER_COLOURS[number % len(PLAYER_COLOURS)]
    for (row, col), came, goes in zip(cells, [None, *moves], [*moves, None], strict=True):
        paste(image, _path_sprite(came, goes, colour, aside, tile), row * tile, col * tile)


@lru_cache(maxsize=512)
def _path_sprite(came: int | None, goes: int | None, colour: str, aside: float, tile: int) -> Sprite:
    canvas, middle = Canvas(tile), 0.5 + aside
    ends = {0: (middle, -0.1), 1: (middle, 1.1), 2: (1.1, middle), 3: (-0.1, middle)}
    centre = (middle, middle)
    line = [centre]
    if came is not None:
        line.insert(0, ends[came ^ 1])
    if goes is not None:
        line.append(ends[goes])
    for width, ink in ((0.13, "#ffffff"), (0.08, colour)):
        if len(line) > 1:
            canvas.stroke(line, width, ink)
        if came is None:
            canvas.circle(*centre, width * 1.1, ink)
    if goes is None and came is not None:
        dy, dx = NEIGHBOURS[came]
        for size, ink in ((0.19, "#ffffff"), (0.14, colour)):
            tip = (middle + dx * size, middle + dy * size)
            canvas.polygon(
                [tip, (middle - dy * size, middle + dx * size), (middle + dy * size, middle - dx * size)], ink
            )
    return canvas.sprite()


def _legend(width: int, ends: tuple[str, str], names: Sequence[str], tile: int) -> Image:
    size = max(12, min(24, round(tile * 0.4)))
    height, pad = round(size * 1.6), max(4, size // 2)
    low, high = (text_sprite(text, size, PALETTE["ink"]) for text in ends)
    rows = np.empty((height * (1 + len(names)), width, 3), np.uint8)
    rows[...] = rgb(PALETTE["page"])
    left, right = 2 * pad + low.colour.shape[1], width - 2 * pad - high.colour.shape[1]
    if right - left >= 16:
        paste(rows, low, (height - len(low.colour)) // 2 + 1, pad)
        paste(rows, high, (height - len(high.colour)) // 2 + 1, right + pad)
    else:
        left, right = pad, max(pad + 1, width - pad)
    ramp = np.array([rgb(heat_colour(value)) for value in np.linspace(0, 1, right - left)], np.uint8)
    rows[height // 3 : height - height // 3, left:right] = ramp
    for number, name in enumerate(names):
        top = height * (number + 1)
        words = text_sprite(name, size, PLAYER_COLOURS[number % len(PLAYER_COLOURS)])
        rows[top + height // 2 - 2 : top + height // 2 + 2, pad : pad + 2 * size] = rgb(
            PLAYER_COLOURS[number % len(PLAYER_COLOURS)]
        )
        paste(rows, words, top + (height - len(words.colour)) // 2 + 1, 2 * pad + 2 * size)
    return rows
