"""What a robot partner is told and what it answers; any object that takes the one and returns the other can be one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

__all__ = ["Command", "Floats", "Senses", "State"]

Floats = npt.NDArray[np.float64]
State = Literal["wait", "approach", "grasp", "carry", "place"]


@dataclass(frozen=True, slots=True, eq=False)
class Senses:
    """What a robot knows when it is asked. Points are in metres, as in a layout; arrays are not to be written to.

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
        person_holding: What the person holds.
        gripper: ``(2,)`` the robot's gripper now.
        holding: What the robot holds.
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
    """What a robot does until it is asked again.

    Attributes:
        velocity: ``(2,)`` of the gripper in m/s.
        grasp: Object to close the gripper on now; it is within reach unless someone moved it. The next senses tell by
            ``holding`` whether it was caught.
        release: Whether to open the gripper now; what it held stays at its place in the configuration, if the gripper
            is there, else where it is dropped.
        target: Object the robot goes for or carries.
        belief: ``{goal: probability}`` of the person's present reach; None where there is nothing to believe.
        decided: Whether the robot is sure what the person goes for, or sees them hold it.
        predicted: What that is; None where it is not sure.
        state: What the robot is doing.
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
