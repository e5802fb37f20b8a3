"""Objects that move and change: chefs, and pots with their contents."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

from legible_envs.drawing.canvas import Canvas, Sprite, mix
from legible_envs.drawing.svg_canvas import Pen
from legible_envs.overcooked.game.view import Item, PotView
from legible_envs.overcooked.grid import EAST, NORTH, SOUTH, WEST
from legible_envs.overcooked.rendering.food import draw_item, draw_pieces, soup_colour
from legible_envs.overcooked.rendering.palette import PALETTE, PLAYER_COLOURS
from legible_envs.overcooked.rendering.robots import draw_robot
from legible_envs.overcooked.rendering.tiles import COUNTER_TOP

__all__ = [
    "CHEF_RISE",
    "GAUGE",
    "chef_sprite",
    "draw_chef",
    "draw_flames",
    "draw_gauge",
    "draw_hands",
    "draw_pot",
    "draw_ready",
    "draw_steam",
    "draw_tick",
    "draw_wedge",
    "held_at",
    "held_radius",
    "pot_sprite",
]

CHEF_RISE: Final = 0.3
"""How far a chef's hat rises above the cell stood on, in tiles."""

_STEPS_OF_PROGRESS: Final = 40


def _body(canvas: Pen, colour: str, facing: int) -> None:
    cloth, shade = PALETTE["cloth"], PALETTE["cloth_shade"]
    canvas.ellipse(0.5, 1.16, 0.3, 0.09, PALETTE["shadow"], 0.32)
    for x in (0.41, 0.59) if facing in (NORTH, SOUTH) else (0.46, 0.55):
        canvas.ellipse(x, 1.145, 0.09, 0.05, PALETTE["ink"])
    canvas.rectangle(0.255, 0.72, 0.49, 0.4, mix(shade, PALETTE["ink_soft"], 0.35), radius=0.19)
    canvas.rectangle(0.27, 0.72, 0.46, 0.385, cloth, radius=0.18)
    if facing == SOUTH:
        canvas.rectangle(0.34, 0.86, 0.32, 0.23, colour, radius=0.07)
        canvas.rectangle(0.34, 0.86, 0.32, 0.05, mix(colour, "#ffffff", 0.25), radius=0.025)
    elif facing == NORTH:
        canvas.rectangle(0.29, 0.93, 0.42, 0.05, colour)
        canvas.stroke([(0.5, 0.955), (0.44, 1.03)], 0.045, colour)
        canvas.stroke([(0.5, 0.955), (0.56, 1.03)], 0.045, colour)
    else:
        left = 0.47 if facing == EAST else 0.29
        canvas.rectangle(left, 0.86, 0.24, 0.23, colour, radius=0.07)
        canvas.rectangle(0.29, 0.92, 0.42, 0.045, mix(colour, "#000000", 0.15))


def _head(canvas: Pen, colour: str, facing: int) -> None:
    skin, hair, ink = PALETTE["skin"], PALETTE["hair"], PALETTE["ink"]
    dx = {EAST: 0.03, WEST: -0.03}.get(facing, 0.0)
    x, y = 0.5 + dx, 0.57
    canvas.rectangle(0.36, 0.72, 0.28, 0.085, colour, radius=0.04)
    canvas.circle(x, y, 0.215, mix(skin, "#7a3f1c", 0.4))
    canvas.circle(x, y, 0.2, skin)
    if facing == NORTH:
        canvas.circle(x, y, 0.2, hair)
        canvas.rectangle(x - 0.13, y + 0.1, 0.26, 0.1, mix(hair, skin, 0.25), radius=0.05)
    elif facing == SOUTH:
        for side in (-1, 1):
            canvas.ellipse(x + side * 0.08, y + 0.03, 0.028, 0.038, ink)
            canvas.ellipse(x + side * 0.125, y + 0.1, 0.035, 0.024, "#e88a72", 0.6)
        canvas.arc(x, y + 0.075, 0.05, (0.36, 0.64), 0.022, mix(ink, "#a03020", 0.4))
    else:
        side = 1 if facing == EAST else -1
        canvas.polygon(
            [
                (x - side * 0.2, y - 0.1),
                (x - side * 0.06, y - 0.14),
                (x - side * 0.06, y + 0.06),
                (x - side * 0.13, y + 0.16),
            ],
            hair,
        )
        canvas.circle(x - side * 0.12, y, 0.085, hair)
        canvas.circle(x + side * 0.215, y + 0.055, 0.042, mix(skin, "#c46a3c", 0.25))
        canvas.ellipse(x + side * 0.11, y + 0.02, 0.027, 0.038, ink)
        smile = [(x + side * 0.08, y + 0.105), (x + side * 0.12, y + 0.125), (x + side * 0.16, y + 0.105)]
        canvas.stroke(smile, 0.022, mix(ink, "#a03020", 0.4))
    _hat(canvas, colour, 0.5 + dx * 0.6, y)


def _hat(canvas: Pen, colour: str, x: float, y: float) -> None:
    cloth, shade = PALETTE["cloth"], PALETTE["cloth_shade"]
    rim = mix(shade, PALETTE["ink_soft"], 0.45)
    puffs = ((-0.14, -0.31, 0.125), (0.14, -0.31, 0.125), (0.0, -0.37, 0.15))
    for dx, dy, radius in puffs:
        canvas.circle(x + dx, y + dy, radius + 0.014, rim)
    canvas.rectangle(x - 0.19, y - 0.25, 0.38, 0.15, rim, radius=0.035)
    for dx, dy, radius in puffs:
        canvas.circle(x + dx, y + dy, radius, cloth)
    canvas.rectangle(x - 0.175, y - 0.26, 0.35, 0.15, cloth, radius=0.03)
    canvas.rectangle(x - 0.175, y - 0.175, 0.35, 0.065, colour, radius=0.025)
    for dx in (-0.07, 0.07):
        canvas.stroke([(x + dx, y - 0.28), (x + dx * 0.8, y - 0.2)], 0.018, shade)


def held_at(facing: int) -> tuple[float, float]:
    """Where a chef holds things, in tiles from the upper left of their sprite."""
    return {NORTH: (0.78, 0.86), SOUTH: (0.5, 1.0), EAST: (0.74, 0.92), WEST: (0.26, 0.92)}[facing]


def held_radius(kind: str) -> float:
    """How large things are in a chef's hands, in tiles."""
    return 0.185 if kind in ("dish", "soup") else 0.165


def draw_chef(canvas: Pen, colour: str, facing: int) -> None:
    """A chef without hands and without the wedge on the floor, on a sheet ``1 + CHEF_RISE`` tall."""
    _body(canvas, colour, facing)
    _head(canvas, colour, facing)


def draw_hands(canvas: Pen, facing: int, full: bool, skin: str = PALETTE["skin"]) -> None:
    """A chef's or robot's hands, empty or round what they hold."""
    x, y = held_at(facing)
    if full:
        hands = [(x - 0.19, y + 0.06), (x + 0.19, y + 0.06)]
    elif facing in (NORTH, SOUTH):
        hands = [(0.26, 0.95), (0.74, 0.95)]
    else:
        hands = [(x - (0.5 - x) * 0.12, 0.94)]
    for hand in hands:
        canvas.circle(*hand, 0.066, mix(skin, "#7a3f1c", 0.4))
        canvas.circle(*hand, 0.053, skin)


def draw_wedge(canvas: Pen, colour: str, facing: int) -> None:
    """A small wedge on the floor that says where the chef faces even on very small tiles."""
    shape = {
        NORTH: [(0.4, 0.37), (0.5, 0.31), (0.6, 0.37)],
        SOUTH: [(0.38, 1.205), (0.5, 1.285), (0.62, 1.205)],
        EAST: [(0.9, 0.75), (0.985, 0.85), (0.9, 0.95)],
        WEST: [(0.1, 0.75), (0.015, 0.85), (0.1, 0.95)],
    }[facing]
    canvas.polygon(shape, colour)


@lru_cache(maxsize=512)
def chef_sprite(player: int, facing: int, held: Item | None, size: int, is_robot: bool = False) -> Sprite:
    """A chef or a robot, one tile wide and ``1 + CHEF_RISE`` tall; the cell stood on is the lower part.

    Args:
        player: Index of the player, which sets the colour of scarf and apron.
        facing: 0 N, 1 S, 2 E, 3 W.
        held: What is in the hands.
        size: Pixels of a tile.
        is_robot: Whether it is a robot.
    """
    if facing not in (NORTH, SOUTH, EAST, WEST):
        raise ValueError(f"facing must be 0 N, 1 S, 2 E or 3 W, got {facing!r}")
    colour = PLAYER_COLOURS[player % len(PLAYER_COLOURS)]
    canvas = Canvas(size, tall=1 + CHEF_RISE)
    draw_wedge(canvas, colour, facing)
    draw_body = draw_robot if is_robot else draw_chef
    if facing != NORTH:
        draw_body(canvas, colour, facing)
    if held is not None:
        draw_item(canvas, held, *held_at(facing), held_radius(held.kind))
    draw_hands(canvas, facing, held is not None, PALETTE["steel_dark" if is_robot else "skin"])
    if facing == NORTH:
        draw_body(canvas, colour, facing)
    return canvas.sprite()


def draw_flames(canvas: Pen, phase: int) -> None:
    """The glow and the flames under a pot that cooks; they flicker between two phases."""
    canvas.circle(0.5, COUNTER_TOP, 0.37, PALETTE["flame"], 0.35)
    for number in range(9):
        angle = math.pi * (0.08 + 0.84 * number / 8)
        x, y = 0.5 + 0.33 * math.cos(angle), COUNTER_TOP + 0.33 * math.sin(angle)
        height = 0.085 + 0.03 * ((number + phase) % 2)
        for colour, share in ((PALETTE["flame"], 1.0), (PALETTE["flame_light"], 0.55)):
            wide = 0.05 * share
            canvas.polygon(
                [(x - wide, y + 0.03), (x + wide, y + 0.03), (x + 0.01, y + 0.03 - height * share * 1.6)], colour
            )
            canvas.circle(x, y + 0.03, wide, colour)


def draw_steam(canvas: Pen, phase: int) -> None:
    """Steam above a hot pot, in two phases."""
    for number, x in enumerate((0.36, 0.5, 0.64)):
        sway = 0.035 if (number + phase) % 2 else -0.035
        base = 0.26 - 0.03 * (number == 1)
        line = [(x, base), (x + sway, base - 0.07), (x - sway, base - 0.15), (x, base - 0.21)]
        canvas.stroke(line, 0.045, PALETTE["steam"], 0.75)


def draw_ready(canvas: Pen) -> None:
    """The glow under a pot whose soup can be taken."""
    canvas.circle(0.5, COUNTER_TOP, 0.4, PALETTE["ready"])


def draw_pot(canvas: Pen, pot: PotView) -> None:
    """A pot with what is in it, without flames, steam and gauge, on a tile."""
    iron, y = PALETTE["pot"], COUNTER_TOP
    for side in (-1, 1):
        canvas.rectangle(0.5 + side * 0.345 - 0.055, y - 0.05, 0.11, 0.1, mix(iron, "#20252c", 0.25), radius=0.04)
    canvas.circle(0.5, y + 0.035, 0.31, PALETTE["shadow"], 0.5)
    canvas.circle(0.5, y, 0.305, mix(iron, "#20252c", 0.45))
    canvas.circle(0.5, y - 0.008, 0.295, iron)
    canvas.circle(0.5, y, 0.25, mix(iron, "#20252c", 0.75))
    canvas.circle(0.5, y + 0.02, 0.228, mix(iron, "#20252c", 0.58))
    if pot.contents:
        colour = soup_colour(pot.contents) if pot.is_cooking or pot.is_ready else "#9cc4d6"
        canvas.circle(0.5, y + 0.012, 0.235, mix(colour, "#3a1606", 0.3))
        canvas.circle(0.5, y + 0.02, 0.222, colour)
        draw_pieces(canvas, pot.contents, 0.5, y + 0.015, 0.225)
    canvas.arc(0.5, y, 0.292, (0.66, 0.9), 0.022, "#ffffff", 0.7)


GAUGE: Final = (0.08, 0.855, 0.84, 0.105)
"""Left, top, width and height of a pot's gauge, in tiles."""


def draw_gauge(canvas: Pen, share: float, colour: str) -> None:
    """How far a soup has cooked, 0 to 1."""
    x, y, wide, tall = GAUGE
    canvas.rectangle(x - 0.02, y - 0.02, wide + 0.04, tall + 0.04, PALETTE["ink"], radius=0.07)
    canvas.rectangle(x, y, wide, tall, "#7a6a5c", radius=0.05)
    if share > 0:
        canvas.rectangle(x, y, max(tall, wide * share), tall, colour, radius=0.05)
        canvas.rectangle(x + 0.03, y + 0.02, max(tall, wide * share) - 0.06, 0.022, "#ffffff", 0.45, radius=0.01)


def draw_tick(canvas: Pen, x: float, y: float, radius: float) -> None:
    """The mark of something done."""
    canvas.circle(x, y, radius, "#ffffff")
    canvas.circle(x, y, radius * 0.86, PALETTE["ready"])
    points = [
        (x - 0.42 * radius, y + 0.02 * radius),
        (x - 0.1 * radius, y + 0.36 * radius),
        (x + 0.45 * radius, y - 0.34 * radius),
    ]
    canvas.stroke(points, 0.26 * radius, "#ffffff")


@lru_cache(maxsize=512)
def _cached_pot(pot: PotView, step: int, size: int) -> Sprite:
    canvas = Canvas(size)
    if pot.is_ready:
        draw_ready(canvas)
    elif pot.is_cooking:
        draw_flames(canvas, pot.ticks)
    draw_pot(canvas, pot)
    if pot.is_ready:
        draw_steam(canvas, 0)
        draw_gauge(canvas, 1.0, PALETTE["ready"])
        draw_tick(canvas, 0.83, 0.16, 0.15)
    elif pot.is_cooking:
        draw_steam(canvas, pot.ticks)
        draw_gauge(canvas, step / _STEPS_OF_PROGRESS, PALETTE["progress"])
    return canvas.sprite()


def pot_sprite(pot: PotView, size: int) -> Sprite:
    """A pot on its stove with what is in it and how far it has cooked, on a tile of ``size`` pixels."""
    if pot.is_ready or not pot.is_cooking:
        looks = PotView(pot.contents, 0, 1, False, pot.is_ready)
        return _cached_pot(looks, 0, size)
    share = min(1.0, pot.ticks / pot.cook_time) if pot.cook_time > 0 else 1.0
    return _cached_pot(PotView(pot.contents, pot.ticks % 2, 1, True, False), round(share * _STEPS_OF_PROGRESS), size)
