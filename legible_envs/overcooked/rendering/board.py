"""Kitchens and running games as RGB arrays."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.canvas import Canvas, Image, Sprite, paste, rgb, text_sprite
from legible_envs.drawing.sheets import banner, check_tile
from legible_envs.overcooked.game.view import GameView, PotView
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import FLOOR, OBSTACLE, STATION_CODES, OvercookedLayout
from legible_envs.overcooked.rendering.actors import chef_sprite, pot_sprite
from legible_envs.overcooked.rendering.food import item_sprite
from legible_envs.overcooked.rendering.hud import draw_hud, hud_height
from legible_envs.overcooked.rendering.palette import PALETTE, PLAYER_COLOURS
from legible_envs.overcooked.rendering.tiles import tile_sprite

__all__ = ["RGB_TILE", "board_of", "draw_game", "draw_layout", "draw_small", "paste_label", "tile_pictures"]

RGB_TILE: Final = 12
"""Pixels per cell of an ``rgb`` observation."""

_POT: Final = STATION_CODES["pot"]
_SERVING: Final = STATION_CODES["serving"]
_EMPTY: Final = PotView()
_AROUND: Final = ((-1, 0), (0, 1), (1, 0), (0, -1), (-1, 1), (1, 1), (1, -1), (-1, -1))


def draw_layout(
    layout: OvercookedLayout,
    *,
    tile: int = 48,
    starts: bool = True,
    labels: Mapping[Cell, str] | None = None,
    title: str | None = None,
) -> Image:
    """Draw a kitchen without players.

    Args:
        layout: Any kitchen.
        tile: Pixels of a cell's side, 8 to 256.
        starts: Whether to mark where the players start.
        labels: Short texts to set on cells, by ``(row, col)``.
        title: A line above the drawing.

    Returns:
        ``(H * tile, W * tile, 3)`` uint8, higher by a line of text with a title; a new array each time.

    Raises:
        ValueError: A tile size out of range, or a label outside the kitchen.
    """
    image = board_of(layout, check_tile(tile))
    if starts:
        for player, (row, col) in enumerate(layout.starts):
            paste(image, _start_sprite(player, tile), row * tile, col * tile)
    for cell, text in (labels or {}).items():
        paste_label(image, layout, cell, text, tile)
    return banner(image, title, tile) if title else image


def draw_game(view: GameView, *, tile: int = 48, hud: bool = True) -> Image:
    """Draw a game as it stands: the kitchen, its pots, what lies on counters, the players and what they hold.

    Args:
        view: The game, for instance from ``env.unwrapped.view()``.
        tile: Pixels of a cell's side, 8 to 256.
        hud: Whether to put orders, steps and crossings in a strip above. Its height depends on ``tile`` alone, so the
            shape stays the same for a whole game.

    Returns:
        ``(H * tile, W * tile, 3)`` uint8, higher by the strip with ``hud``; a new array each time.

    Raises:
        ValueError: A tile size out of range, or an item, facing or cell that does not exist.
    """
    check_tile(tile)
    height, width = view.layout.shape
    above = hud_height(tile) if hud else 0
    image = np.empty((above + height * tile, width * tile, 3), np.uint8)
    board = image[above:]
    board[...] = _background(view.layout, tile)
    _paste_pots(board, view.layout, view.pots, tile)
    for (row, col), item in view.counters.items():
        paste(board, item_sprite(item, tile), row * tile, col * tile)
    for player in sorted(range(len(view.players)), key=lambda p: view.players[p].cell):  # nearer ones in front
        seen = view.players[player]
        sprite = chef_sprite(player, seen.facing, seen.held, tile, seen.is_robot)
        row, col = seen.cell
        paste(board, sprite, (row + 1) * tile - len(sprite.colour), col * tile)
    if hud:
        image[:above] = draw_hud(view, width * tile, tile)
    return image


def board_of(layout: OvercookedLayout, tile: int) -> Image:
    """The bare kitchen as a new array to draw on."""
    image = _background(layout, tile).copy()
    _paste_pots(image, layout, {}, tile)
    return image


def _paste_pots(image: Image, layout: OvercookedLayout, pots: Mapping[Cell, PotView], tile: int) -> None:
    for row, col in np.argwhere(layout.cells == _POT).tolist():
        paste(image, pot_sprite(pots.get((row, col), _EMPTY), tile), row * tile, col * tile)


def paste_label(image: Image, layout: OvercookedLayout, cell: Cell, text: str, tile: int) -> None:
    """Set a short text on a cell, on a strip of paper."""
    row, col = cell
    if not (0 <= row < layout.shape[0] and 0 <= col < layout.shape[1]):
        raise ValueError(f"label {text!r}: row {row}, column {col} is outside the kitchen of shape {layout.shape}")
    words = text_sprite(text, max(9, round(tile * 0.33)), PALETTE["ink"])
    tall, wide = words.colour.shape[:2]
    paper = _paper_sprite(wide + max(4, tile // 6), tall + max(2, tile // 16))
    middle = (row + 1) * tile - tile // 24 - len(paper.colour) // 2  # low, so that the station stays in sight
    for sprite in (paper, words):
        rows, cols = sprite.colour.shape[:2]
        paste(image, sprite, middle - rows // 2, col * tile + (tile - cols) // 2)


@lru_cache(maxsize=256)
def _paper_sprite(wide: int, tall: int) -> Sprite:
    canvas = Canvas(tall, wide=wide / tall)
    canvas.rectangle(0, 0, wide / tall, 1, PALETTE["ink"], 0.35, radius=0.3)
    canvas.rectangle(0.05, 0.05, wide / tall - 0.1, 0.9, PALETTE["paper"], radius=0.27)
    return canvas.sprite()


@lru_cache(maxsize=128)
def _start_sprite(player: int, tile: int) -> Sprite:
    """A ring on the floor with the player's number."""
    canvas, colour = Canvas(tile), PLAYER_COLOURS[player % len(PLAYER_COLOURS)]
    canvas.circle(0.5, 0.5, 0.33, colour, 0.22)
    canvas.arc(0.5, 0.5, 0.31, (0, 1), 0.055, colour)
    ring = canvas.sprite()
    if tile < 16:
        return ring
    sheet = np.zeros((tile, tile, 3), np.uint8)
    words = text_sprite(str(player + 1), round(tile * 0.5), colour)
    rows, cols = words.colour.shape[:2]
    top, left = (tile - rows) // 2 + round(tile * 0.02), (tile - cols) // 2
    inside = (slice(top, top + rows), slice(left, left + cols))
    sheet[...] = ring.colour
    paste(sheet, words, top, left)
    through = ring.through.copy()
    through[inside] = through[inside] * words.through >> 8
    return Sprite(sheet.astype(np.uint16), through)


class _Backgrounds:
    """The last few kitchens drawn, stoves without pots, up to a number of bytes; a game draws one many times."""

    def __init__(self, room: int) -> None:
        self._room, self._held = room, 0
        self._images: OrderedDict[tuple[OvercookedLayout, int], Image] = OrderedDict()
        self._lock = threading.Lock()

    def __call__(self, layout: OvercookedLayout, tile: int) -> Image:
        key = (layout, tile)
        with self._lock:
            if key in self._images:
                self._images.move_to_end(key)
                return self._images[key]
        image = _draw_background(layout, tile)
        image.setflags(write=False)
        with self._lock:
            if key not in self._images:
                self._images[key] = image
                self._held += image.nbytes
            while self._held > self._room and len(self._images) > 1:
                self._held -= self._images.popitem(last=False)[1].nbytes
        return image


_background: Final = _Backgrounds(room=64 * 2**20)


def _draw_background(layout: OvercookedLayout, tile: int) -> Image:
    height, width = layout.shape
    image = np.empty((height * tile, width * tile, 3), np.uint8)
    image[...] = rgb(PALETTE["floor"])
    for row in range(height):
        for col in range(width):
            for sprite in _cell_sprites(layout, (row, col), tile):
                paste(image, sprite, row * tile, col * tile)
    return image


def _cell_sprites(layout: OvercookedLayout, cell: Cell, tile: int) -> Sequence[Sprite]:
    row, col = cell
    code, odd = int(layout.cells[cell]), bool((row + col) % 2)
    if code in (FLOOR, OBSTACLE):
        shade = _is_solid(layout, (row - 1, col)) + 2 * _is_solid(layout, (row, col - 1))
        floor = tile_sprite(FLOOR, shade, odd, 0, tile)
        if code == FLOOR:
            return (floor,)
        near = sum(_code(layout, (row + dr, col + dc)) == OBSTACLE and 1 << bit for bit, (dr, dc) in enumerate(_AROUND))
        return floor, tile_sprite(OBSTACLE, int(near), False, 0, tile)
    front = int(not _is_solid(layout, (row + 1, col)))
    away = _away(layout, cell) if code == _SERVING else 0
    return (tile_sprite(code, front, odd, away, tile),)


def _code(layout: OvercookedLayout, cell: Cell) -> int:
    row, col = cell
    inside = 0 <= row < layout.shape[0] and 0 <= col < layout.shape[1]
    return int(layout.cells[cell]) if inside else -1


def _is_solid(layout: OvercookedLayout, cell: Cell) -> bool:
    return _code(layout, cell) not in (-1, FLOOR, OBSTACLE)


def _away(layout: OvercookedLayout, cell: Cell) -> int:
    """The side (0 N, 1 S, 2 E, 3 W) opposite the floor from which a station is used."""
    row, col = cell
    for side, (dr, dc) in enumerate(((1, 0), (-1, 0), (0, -1), (0, 1))):
        if layout.is_floor((row + dr, col + dc)):
            return side
    return 0


def draw_small(view: GameView) -> npt.NDArray[np.uint8]:
    """The picture of an ``rgb`` observation, ``(H * RGB_TILE, W * RGB_TILE, 3)``."""
    return np.array(draw_game(view, tile=RGB_TILE, hud=False), dtype=np.uint8)


def tile_pictures(views: Sequence[GameView], side: int = 1200) -> npt.NDArray[np.uint8]:
    """All games in one picture of about ``side`` pixels, row by row."""
    columns = math.ceil(math.sqrt(len(views)))
    height, width = views[0].layout.shape
    tile = max(8, min(48, side // (columns * max(height, width))))
    pictures = [np.asarray(draw_game(view, tile=tile, hud=False), dtype=np.uint8) for view in views]
    pictures += [np.full_like(pictures[0], 255)] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[i : i + columns], axis=1) for i in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)
