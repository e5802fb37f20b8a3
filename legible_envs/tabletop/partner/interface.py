"""The inputs and answers of partners: any object with these methods can take part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import numpy.typing as npt

from legible_envs.partner.interface import Floats

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["Command", "Partner", "Senses", "State", "gripper_home"]

State = Literal["wait", "approach", "grasp", "carry", "place"]


@dataclass(frozen=True, slots=True, eq=False)
class Senses:
    """All that a robot knows when it decides. Points are in metres, as in a layout; arrays must not be written to.

    A *reach* begins when the person sets out with an empty hand and ends when they hold an object. While they hold
    one, ``reach``, ``times`` and ``start`` stay those of the reach that ended.

    Attributes:
        time: Seconds since the episode began.
        hand: ``(2,)`` the person's hand now.
        reach: ``(k, 2)`` where the hand was since the reach began, oldest first; ``k = 0`` before the first.
        times: ``(k,)`` seconds since the episode began, of each of them.
        reach_number: How many reaches have begun; a change tells that ``reach`` is another one.
        start: ``(2,)`` where the hand was when the reach began.
        goals: Objects the person may validly take now; empty while they hold one or must wait.
        free: Objects that lie free and that the robot may validly take now.
        positions: ``(n, 2)`` where the objects are now, in the order of the layout.
        person_holding: Object in the person's hand.
        gripper: ``(2,)`` the robot's gripper now.
        holding: Object in the gripper.
    """

    time: float
    hand: Floats
    reach: Floats
    times: Floats
    reach_number: int
    start: Floats
    goals: tuple[str, ...]
    free: tuple[str, ...]
    positions: Floats
    person_holding: str | None
    gripper: Floats
    holding: str | None


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """A robot's command, which holds until the next one.

    Attributes:
        velocity: ``(2,)`` of the gripper in m/s.
        grasp: Object to close the gripper on now; it is within reach unless it was moved. The next senses tell by
            ``holding`` whether it was caught.
        release: Whether to open the gripper now; the object stays at its place in the configuration, if the gripper
            is there, else where it is dropped.
        target: Object the robot goes for or carries.
        belief: ``{goal: probability}`` of the person's present reach; None where there is no belief.
        decided: Whether the robot is sure of the person's goal, or sees them hold it.
        predicted: That goal; None where it is not sure.
        state: State of the robot.
        conflict: Whether the robot gave up its target just now because the person took it.
    """

    velocity: Floats
    grasp: str | None = None
    release: bool = False
    target: str | None = None
    belief: Mapping[str, float] | None = None
    decided: bool = False
    predicted: str | None = None
    state: State = "wait"
    conflict: bool = False


class Partner(Protocol):
    """A robot that shares the table."""

    def reset(self, layout: TabletopLayout, task: TabletopTask, rng: np.random.Generator) -> npt.ArrayLike | None:
        """Begin an episode; ``(2,)`` where the gripper is, or None for the middle of the table's far side."""

    def step(self, senses: Senses) -> Command:
        """The command until the next call."""
        ...


def gripper_home(layout: TabletopLayout) -> tuple[float, float]:
    """Where a gripper begins unless a robot says otherwise: the middle of the table's far side, 5 cm from the edge."""
    width, depth = layout.table.size
    return width / 2, depth - 0.05
