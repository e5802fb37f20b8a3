"""A table in use: the hand, the robot's gripper, the objects they carry, and the robot's belief."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from legible_envs.drawing.canvas import Image, rgb
from legible_envs.tabletop.game.view import STATUSES, TableView
from legible_envs.tabletop.rendering.actors import dot_sprite, gripper_sprite, hand_sprite, ring_sprite
from legible_envs.tabletop.rendering.frame import Frame, check_width
from legible_envs.tabletop.rendering.hud import draw_hud, hud_height
from legible_envs.tabletop.rendering.objects import paste_centred, paste_object
from legible_envs.tabletop.rendering.palette import TABLE
from legible_envs.tabletop.rendering.surface import surface_of

__all__ = ["draw_scene", "scene_shape"]

_MOST_DOTS: Final = 90
_BAR: Final = (0.058, 0.012)
"""Width and height of a bar of belief, in metres."""


def scene_shape(view: TableView, *, width: int = 640, hud: bool = True) -> tuple[int, int, int]:
    """The shape of the picture that :func:`draw_scene` returns."""
    frame = Frame.of(view.layout.table, check_width(width))
    return frame.height + (hud_height(frame.width) if hud else 0), frame.width, 3


def draw_scene(view: TableView, *, width: int = 640, hud: bool = True) -> Image:
    """Draw a table in use.

    Objects that the person may take now stand out from the others; a ring marks the object they are going for, where
    that is known, and another the robot's target. A bar over each object shows its probability as the robot sees it,
    with a mark at the threshold; above the threshold it turns from amber to green and gets a dark frame.

    Args:
        view: The table, for instance from ``env.unwrapped.view()``.
        width: Pixels, 120 to 4096.
        hud: Whether to put time, progress, crossings and the robot's doings in a strip above. Its height depends on
            ``width`` alone, so the shape stays the same for a whole game.

    Returns:
        ``(height, width, 3)`` uint8; a new array each time.

    Raises:
        ValueError: A width out of range, or a view whose parts do not fit together.
    """
    _check(view)
    frame = Frame.of(view.layout.table, check_width(width))
    above = hud_height(frame.width) if hud else 0
    image = np.empty((above + frame.height, frame.width, 3), np.uint8)
    board = image[above:]
    board[...] = surface_of(view.layout, view.task, frame.width)
    _draw_trail(board, frame, view)
    _draw_lying(board, frame, view)
    _draw_marks(board, frame, view)
    _draw_robot(board, frame, view)
    _draw_hand(board, frame, view)
    _draw_belief(board, frame, view)
    if hud:
        draw_hud(view, image[:above])
    return image


def _check(view: TableView) -> None:
    count = len(view.layout.objects)
    if np.shape(view.positions) != (count, 2) or len(view.angles) != count or len(view.status) != count:
        raise ValueError(
            f"a view of {count} objects needs positions of shape ({count}, 2), {count} angles and {count} statuses; "
            f"got {np.shape(view.positions)}, {len(view.angles)} and {len(view.status)}"
        )
    unknown = sorted(set(view.status) - set(STATUSES))
    if unknown:
        raise ValueError(f"unknown status {unknown}; expected one of {list(STATUSES)}")
    places = [("positions", view.positions), ("hand", view.hand)]
    for name, points in places if view.robot is None else [*places, ("robot", view.robot)]:
        if not np.isfinite(points).all():
            raise ValueError(f"`{name}` of the view is not finite: {np.asarray(points).tolist()}")


def _draw_trail(image: Image, frame: Frame, view: TableView) -> None:
    """Dots at equal distances along the path of the hand, the older the paler."""
    trail = np.asarray(view.trail, dtype=np.float64).reshape(-1, 2)
    trail = trail[np.isfinite(trail).all(axis=1)]
    if len(trail) < 2:
        return
    steps = np.hypot(*np.diff(trail, axis=0).T)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    apart = 6.5 * max(1.0, frame.width / 640) / frame.scale
    count = min(_MOST_DOTS, int(lengths[-1] / apart))
    size = max(4, round(7 * frame.width / 640))
    for i in range(count):
        at = lengths[-1] - i * apart
        x, y = (float(np.interp(at, lengths, trail[:, axis])) for axis in (0, 1))
        share = max(2, round(8 * (1 - i / max(count, 25))))
        paste_centred(image, dot_sprite(size, TABLE["trail"], share), *frame.pixel(x, y))


def _draw_lying(image: Image, frame: Frame, view: TableView) -> None:
    """Objects on the table; those that the person may not take now are paler."""
    for i, obj in enumerate(view.layout.objects):
        if view.status[i] in ("free", "placed"):
            faded = view.status[i] == "free" and bool(view.goals) and obj.name not in view.goals
            x, y = view.positions[i]
            paste_object(image, frame, obj, x, y, view.angles[i], faded=faded)


def _draw_marks(image: Image, frame: Frame, view: TableView) -> None:
    """Rings round the person's goal and the robot's target."""
    thick = max(2, round(0.0045 * frame.scale))
    for name, colour, grow in ((view.goal, TABLE["skin_line"], 0.008), (view.robot_target, TABLE["robot"], 0.015)):
        if name is None or name not in view.layout.goals:
            continue
        i = view.layout.index(name)
        if view.status[i] != "free":
            continue
        radius = math.hypot(*view.layout.objects[i].size) / 2 + grow
        sprite = ring_sprite(max(3, round(radius * frame.scale)), thick, colour)
        paste_centred(image, sprite, *frame.pixel(*map(float, view.positions[i])))


def _draw_robot(image: Image, frame: Frame, view: TableView) -> None:
    if view.robot is None:
        return
    x, y = map(float, view.robot)
    opening = 0.066
    if view.robot_holding is not None:
        i = view.layout.index(view.robot_holding)
        obj = view.layout.objects[i]
        paste_object(image, frame, obj, x, y, view.angles[i], lifted=True)
        opening = min(obj.size) + 0.004
    sprite = gripper_sprite(round(opening, 3), round(frame.scale * 64))
    paste_centred(image, sprite, *frame.pixel(x, y))


def _draw_hand(image: Image, frame: Frame, view: TableView) -> None:
    x, y = map(float, view.hand)
    half = max(view.layout.table.hand, 0.012)
    sprite = hand_sprite(half, round(frame.scale * 64), view.holding is not None)
    paste_centred(image, sprite, *frame.pixel(x, y))
    if view.holding is not None:
        i = view.layout.index(view.holding)
        paste_object(image, frame, view.layout.objects[i], x, y, view.angles[i], lifted=True)


def _draw_belief(image: Image, frame: Frame, view: TableView) -> None:
    if view.belief is None:
        return
    wide, tall = max(14, round(_BAR[0] * frame.scale)), max(4, round(_BAR[1] * frame.scale))
    for name, value in view.belief.items():
        if name not in view.layout.goals:
            continue
        i = view.layout.index(name)
        if view.status[i] != "free" or not math.isfinite(value):
            continue
        column, row = frame.pixel(*map(float, view.positions[i]))
        above = row - (max(view.layout.objects[i].size) / 2 + 0.012) * frame.scale
        _draw_bar(image, round(column - wide / 2), round(above - tall), wide, tall, value, view.threshold)


def _draw_bar(image: Image, left: int, top: int, wide: int, tall: int, value: float, threshold: float | None) -> None:
    sure = threshold is not None and value >= threshold
    frame = TABLE["ink"] if sure else TABLE["rim"]
    fill = round(min(max(value, 0.0), 1.0) * wide)
    _fill(image, left - 1, top - 1, wide + 2, tall + 2, frame)
    _fill(image, left, top, wide, tall, TABLE["track"])
    _fill(image, left, top, fill, tall, TABLE["sure" if sure else "unsure"])
    if threshold is not None and 0 <= threshold <= 1:
        thick = max(1, tall // 5)
        at = left + min(round(threshold * wide), wide - thick)
        _fill(image, at, top - max(2, tall // 3), thick, tall + 2 * max(2, tall // 3), TABLE["ink"])


def _fill(image: Image, left: int, top: int, wide: int, tall: int, colour: str) -> None:
    """A filled rectangle, cut off at the edges of the image."""
    right, bottom = max(left + wide, 0), max(top + tall, 0)
    image[max(top, 0) : bottom, max(left, 0) : right] = rgb(colour)
