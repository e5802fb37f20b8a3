"""Velocity commands that bring a gripper to a point: smooth, at limited speed, and clear of a moving hand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from legible_envs.tabletop.objects import Point

__all__ = ["Steering"]

_LOOK_AHEAD: Final = 0.20  # metres; where a hand farther away will be is not known
_MARGIN: Final = 0.01  # metres beyond the clearance when going round


@dataclass
class Steering:
    """Velocity commands for a gripper.

    Attributes:
        max_speed: m/s.
        acceleration: Greatest change of velocity, m/s^2, unless the hand comes too near.
        clearance: Distance kept from the hand, m.
        rate: Commands per second.
        velocity: ``(x, y)`` of the last command, m/s.
    """

    max_speed: float
    acceleration: float
    clearance: float
    rate: float
    velocity: Point = (0.0, 0.0)

    def towards(self, there: Point, gripper: Point, hand: Point) -> Point:
        """The next velocity command towards a point."""
        x, y = self._wanted(there, gripper, hand)
        dx, dy = x - self.velocity[0], y - self.velocity[1]
        share = min(1.0, self.acceleration / self.rate / max(math.hypot(dx, dy), 1e-12))
        smooth = (self.velocity[0] + share * dx, self.velocity[1] + share * dy)
        self.velocity = self._kept_clear(smooth, gripper, hand)
        return self.velocity

    def _wanted(self, there: Point, gripper: Point, hand: Point) -> Point:
        """Straight there, slowing down before; round a near hand that blocks the path."""
        dx, dy = there[0] - gripper[0], there[1] - gripper[1]
        distance = math.hypot(dx, dy)
        if distance == 0.0:
            return 0.0, 0.0
        speed = min(self.max_speed, self._stopping_speed(distance), distance * self.rate)
        direction = math.atan2(dy, dx)
        radius = self.clearance + _MARGIN
        away = math.dist(gripper, hand)
        if (
            self.clearance > 0
            and 1e-9 < away < _LOOK_AHEAD
            and away < distance + radius < distance + math.dist(there, hand)
        ):
            to_hand = math.atan2(hand[1] - gripper[1], hand[0] - gripper[0])
            off = math.remainder(direction - to_hand, math.tau)
            aside = math.asin(min(1.0, radius / away))  # half the angle under which the kept distance appears
            if abs(off) < aside:
                direction = to_hand + math.copysign(aside, off)
        return speed * math.cos(direction), speed * math.sin(direction)

    def _kept_clear(self, velocity: Point, gripper: Point, hand: Point) -> Point:
        """The velocity without the part that brings the gripper too near to the hand, or with one that leads away."""
        rx, ry = gripper[0] - hand[0], gripper[1] - hand[1]
        away = math.hypot(rx, ry)
        # From right under it: away from where the person sits.
        outx, outy = (rx / away, ry / away) if away > 1e-9 else (0.0, 1.0)
        room = away - self.clearance
        if room >= 0:
            least = -min(room * self.rate, self._stopping_speed(room))
        else:
            least = min(self.max_speed, -room * self.rate)
        outward = velocity[0] * outx + velocity[1] * outy
        if outward >= least:
            return velocity
        along = -velocity[0] * outy + velocity[1] * outx
        most = math.sqrt(max(self.max_speed**2 - least**2, 0.0))
        along = min(max(along, -most), most)
        return least * outx - along * outy, least * outy + along * outx

    def _stopping_speed(self, distance: float) -> float:
        """The speed from which it comes to rest over a distance, if it is changed only once in ``1 / rate`` seconds."""
        half = 0.5 / self.rate
        return self.acceleration * (math.sqrt(half * half + 2 * distance / self.acceleration) - half)
