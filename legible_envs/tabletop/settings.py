"""The arguments of the table environment, checked once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from numbers import Number
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.support.validation import choice, integer, is_masked, real, shown, switched_weights
from legible_envs.tabletop.game.game import CONTACTS, GameRules
from legible_envs.tabletop.game.shaping import SHAPING
from legible_envs.tabletop.layout import MOST_OBSTACLES, TabletopLayout
from legible_envs.tabletop.objects import Point, point
from legible_envs.tabletop.task import TabletopTask, read_task

__all__ = [
    "ELSEWHERE",
    "HAND_SPEED",
    "Start",
    "TableSettings",
    "keys_to_action",
    "layout_entries",
    "read_action",
    "read_layout",
    "read_start",
]

HAND_SPEED: Final = 0.5
"""How fast a key moves the hand, m/s: too fast to take an object, so that players take by letting go."""

_SETS: Final = (
    {(0, 1): 1073741906, (0, -1): 1073741905, (1, 0): 1073741903, (-1, 0): 1073741904},  # arrows
    {(0, 1): ord("w"), (0, -1): ord("s"), (1, 0): ord("d"), (-1, 0): ord("a")},
)

ELSEWHERE: Final = "elsewhere"
"""Name of a start that is none of the table's."""


def read_layout(value: object, task: TabletopTask, max_obstacles: int) -> TabletopLayout:
    """A valid arrangement of a task's objects from any description of one.

    Args:
        value: A :class:`TabletopLayout`, JSON text or the path of a JSON file, a mapping as
            :meth:`TabletopLayout.from_dict` takes it, or a genome ``(2n + 4 max_obstacles,)`` of the task's table.
        task: The task.
        max_obstacles: Most obstacles it may have.

    Raises:
        LayoutError: Not a layout; not valid; or not of this task's table and objects (they may lie elsewhere and be
            painted otherwise).
        FileNotFoundError: No such file.
    """
    if isinstance(value, TabletopLayout):
        layout = value
    elif isinstance(value, str | Path):
        layout = TabletopLayout.from_json(value)
    elif isinstance(value, Mapping):
        layout = TabletopLayout.from_dict(value)
    elif isinstance(value, Sequence | np.ndarray) and not isinstance(value, bytes | bytearray):
        layout = task.layout.with_genome(_numbers(value), max_obstacles)
    else:
        raise LayoutError(
            "a `layout` must be a TabletopLayout, JSON, a mapping or a genome, got "
            f"{type(value).__name__}: {shown(value)}",
            rule="type",
        )
    _check_of_task(layout, task, max_obstacles)
    layout.validate()
    return layout


def layout_entries(value: object) -> list[Any] | None:
    """The layouts of a list or array with one for each environment; None where the value describes one layout.

    A genome is a flat list or array of numbers. So an array ``(n, d)``, and a list (tuple, array of objects) whose
    entries are no numbers, hold a layout for each environment.

    Args:
        value: What a user gave; the entries are not read.
    """
    if isinstance(value, np.ndarray):
        return list(value) if value.ndim == 2 or (value.ndim == 1 and value.dtype.kind in "OUT") else None
    if not isinstance(value, list | tuple) or not value or any(isinstance(entry, Number) for entry in value):
        return None
    return list(value)


def read_action(action: npt.ArrayLike) -> tuple[float, float]:
    """An action as two numbers.

    Args:
        action: ``(2,)`` finite numbers.

    Raises:
        ValueError: Anything else.
    """
    try:
        if type(action) is not np.ndarray:
            if isinstance(action, str | bytes | Mapping) or is_masked(action):
                raise ValueError
            action = np.asarray(action)
        if action.shape != (2,) or action.dtype.kind not in "biuf":
            raise ValueError
        x, y = action.tolist()
        if not (abs(x) < math.inf and abs(y) < math.inf):
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"expected an action of two finite numbers, got {shown(action)}") from None
    return x, y


def _numbers(value: object) -> npt.NDArray[np.float64]:
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "iuf":
            raise ValueError(f"entries of type {array.dtype}")
        return array.astype(np.float64)
    except (ValueError, OverflowError) as error:
        raise LayoutError(f"a genome must be a flat list of numbers: {error}", rule="genome") from error


def _check_of_task(layout: TabletopLayout, task: TabletopTask, max_obstacles: int) -> None:
    ours = task.layout
    if layout.goals != ours.goals:
        raise LayoutError(
            f"this environment plays task {task.name!r} with the objects {list(ours.goals)}, in this order; the layout "
            f"has {list(layout.goals)}",
            rule="task",
        )
    if layout.table != ours.table:
        raise LayoutError(
            f"the layout's table {layout.table} is not that of task {task.name!r}, {ours.table}", rule="task"
        )
    for obj, known in zip(layout.objects, ours.objects, strict=True):
        if obj.size != known.size:
            raise LayoutError(
                f"{obj.name} measures {obj.size} m in the layout and {known.size} m in task {task.name!r}",
                rule="task",
            )
    if len(layout.obstacles) > max_obstacles:
        raise LayoutError(
            f"the layout has {len(layout.obstacles)} obstacles; this environment was made for at most {max_obstacles}, "
            "make another with `max_obstacles=`",
            rule="obstacles",
        )


class Start(NamedTuple):
    """Where the hand starts: a name and a point."""

    name: str
    at: Point


def read_start(value: object, layout: TabletopLayout) -> Start:
    """Name and point of where the hand starts.

    Args:
        value: The name of one of the table's starts or objects, or ``(x, y)`` in metres.
        layout: The table.

    Raises:
        LayoutError: There is none of this name; or the point is off the table, or inside a grown obstacle.
    """
    if isinstance(value, str):
        if value not in layout.place_names:
            raise LayoutError(
                f"no start {value!r}; this table has {[*layout.table.starts, *layout.goals]}", rule="start"
            )
        name, at = value, layout.place(value)
    else:
        name, at = ELSEWHERE, point(value, "the start")
    width, depth = layout.table.size
    if not (0 <= at[0] <= width and 0 <= at[1] <= depth):
        raise LayoutError(f"the start at {at} is off the table of {width:g} x {depth:g} m", rule="start")
    if not layout.paths.is_free([at])[0]:
        raise LayoutError(
            f"the start at {at} lies inside an obstacle grown by the hand's half-width of {layout.table.hand:g} m",
            rule="start",
        )
    return Start(name, at)


class TableSettings:
    """The checked arguments of :class:`~legible_envs.tabletop.env.TabletopEnv`, which documents them."""

    def __init__(
        self,
        *,
        task: object,
        layout: object,
        virtual_obstacles: str,
        contact: str,
        max_obstacles: int,
        max_speed: float,
        slow_speed: float,
        grasp_distance: float,
        release_distance: float,
        done_reward: float,
        time_cost: float,
        crossing_cost: float,
        shaping: bool | Mapping[str, float],
        threshold: float,
    ) -> None:
        self.task = read_task(task)
        self.max_obstacles = integer("max_obstacles", max_obstacles, 0, MOST_OBSTACLES)
        self.rules = GameRules(
            virtual_obstacles=choice("virtual_obstacles", virtual_obstacles, ("hard", "soft")),  # type: ignore[arg-type]
            contact=choice("contact", contact, CONTACTS),
            max_speed=real("max_speed", max_speed, 1e-3),
            slow_speed=real("slow_speed", slow_speed, 1e-3),
            grasp_distance=real("grasp_distance", grasp_distance, 0),
            release_distance=real("release_distance", release_distance, 0),
        )
        self.done_reward = real("done_reward", done_reward)
        self.time_cost = real("time_cost", time_cost, 0)
        self.crossing_cost = real("crossing_cost", crossing_cost, 0)
        self.shaping = switched_weights("shaping", shaping, SHAPING)
        if self.shaping is not None:
            real("weight 'discount' of `shaping`", self.shaping["discount"], 0, 1)
        self.threshold = real("threshold", threshold, 0, 1)
        self.layout = self.task.layout if layout is None else self.read(layout)

    def read(self, layout: object) -> TabletopLayout:
        """A layout that this environment can play, from any form that :func:`read_layout` takes."""
        return read_layout(layout, self.task, self.max_obstacles)


def keys_to_action(max_speed: float) -> dict[tuple[int, ...], npt.NDArray[np.float32]]:
    """Arrows or W A S D, one or two at a time, and the action they stand for."""
    actions: dict[tuple[int, ...], npt.NDArray[np.float32]] = {}
    for keys in _SETS:
        for x, y in product((-1, 0, 1), repeat=2):
            pressed = [key for direction, key in keys.items() if direction in ((x, 0), (0, y))]
            if pressed:
                velocity = np.array([x, y]) / math.hypot(x, y) * min(HAND_SPEED / max_speed, 1.0)
                actions[tuple(sorted(pressed))] = velocity.astype(np.float32)
    return actions
