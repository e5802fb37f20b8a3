"""A snapshot of a table in use, for drawing: objects, hand, robot, and what the robot believes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.task import TabletopTask

__all__ = ["STATUSES", "Status", "TableView"]

Status = Literal["free", "hand", "robot", "placed"]
STATUSES: Final[tuple[Status, ...]] = ("free", "hand", "robot", "placed")


def _no_points() -> npt.NDArray[np.float64]:
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class TableView:
    """All that a drawing of a table in use shows. Points are ``(x, y)`` in metres, angles in radians.

    Attributes:
        layout: The layout that the episode began with: its obstacles, colours, shapes and sizes.
        task: The task.
        positions: ``(n, 2)`` centres of the objects now, in the order of ``layout.objects``.
        angles: ``(n,)`` their angles now.
        status: For each object ``"free"`` (lies on the table), ``"hand"`` or ``"robot"`` (is carried), or ``"placed"``
            (lies in its slot for good).
        hand: ``(2,)`` centre of the person's hand.
        holding: Object in the hand.
        robot: ``(2,)`` centre of the robot's gripper, or None where there is no robot.
        robot_holding: Object in the gripper.
        robot_target: Object that the robot is going for.
        belief: Probability of each goal as the robot sees it, or None where there is neither robot nor predictor.
        threshold: Above which the robot takes a goal for certain.
        goals: Objects that the person may validly take now.
        goal: The person's goal, where it is known.
        trail: ``(k, 2)`` where the hand has been in the current reach, oldest first.
        time: Seconds since the episode began.
        crossings: How often the hand has crossed a virtual obstacle.
        virtual_obstacles: ``"hard"`` (the hand is stopped) or ``"soft"`` (crossings are counted).
    """

    layout: TabletopLayout
    task: TabletopTask
    positions: npt.NDArray[np.float64]
    angles: npt.NDArray[np.float64]
    status: tuple[str, ...]
    hand: npt.NDArray[np.float64]
    holding: str | None = None
    robot: npt.NDArray[np.float64] | None = None
    robot_holding: str | None = None
    robot_target: str | None = None
    belief: Mapping[str, float] | None = None
    threshold: float | None = None
    goals: tuple[str, ...] = ()
    goal: str | None = None
    trail: npt.NDArray[np.float64] = field(default_factory=_no_points)
    time: float = 0.0
    crossings: int = 0
    virtual_obstacles: Literal["hard", "soft"] = "hard"

    @classmethod
    def at_rest(cls, layout: TabletopLayout, task: TabletopTask) -> TableView:
        """The table before the first move: the hand at the task's first start, objects where the layout has them."""
        return cls(
            layout=layout,
            task=task,
            positions=layout.centres.copy(),
            angles=np.array([obj.angle for obj in layout.objects]),
            status=("free",) * len(layout.objects),
            hand=np.array(layout.place(task.graph.start)),
        )
