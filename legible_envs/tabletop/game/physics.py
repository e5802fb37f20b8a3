"""The objects on a table as rigid bodies that a hand can push, by pymunk, seen from above."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pymunk

from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["TablePhysics"]

Floats = npt.NDArray[np.float64]

SUBSTEPS: Final = 4
AREA_DENSITY: Final = 50.0  # kg/m^2: a cube of 4.5 cm weighs 100 g
TABLE_FRICTION: Final = 0.5 * 9.81 * AREA_DENSITY  # Coulomb friction with the table, in N per m^2 of the object
OBJECT_FRICTION: Final = 0.4
REST_SPEED: Final = 1e-3
RIM: Final = 0.2
LOG_LIMIT: Final = 2000

HAND, OBJECT, FIXED = 1, 2, 4
"""Collision categories."""


class TablePhysics:
    """Objects that slide with dry friction when they are pushed, cannot leave the table, and do not feel obstacles.

    The bodies are stepped only while one moves or the hand is among them; a table at rest costs no time. The result of
    a sequence of calls is exactly the same every time on one machine, and copies, pickled ones included, go on exactly
    as the original would: they repeat what has happened since all rested, because the solver keeps contacts between
    steps that cannot be read.

    Args:
        layout: Where the objects lie at first.
        hand: Radius of the hand that pushes, in metres.
        dt: Seconds that :meth:`advance` advances.
        loose: ``(n,)`` bool: objects that can be moved; the others are fixed to the table.

    Attributes:
        positions: ``(n, 2)`` centres; those of objects taken off the table are left to the owner of this array.
        angles: ``(n,)`` their angles.
    """

    def __init__(self, layout: TabletopLayout, hand: float, dt: float, loose: npt.NDArray[np.bool_]) -> None:
        self.positions = layout.centres.copy()
        self.angles = np.array([obj.angle for obj in layout.objects])
        self._sizes = tuple(obj.size for obj in layout.objects)
        self._table = layout.table.size
        self._hand_radius = hand
        self._dt = dt
        self._kinds = ["loose" if is_loose else "fixed" for is_loose in loose.tolist()]
        self._log: list[tuple[Any, ...]] = []
        self._is_low = False
        self._resting = True
        self._build()

    @property
    def is_resting(self) -> bool:
        """Whether all objects are at rest."""
        return self._resting

    # -- events --------------------------------------------------------------------------------------------------------

    def take(self, i: int) -> None:
        """Take an object off the table."""
        self._note("take", i)
        self._kinds[i] = "away"
        self._remove(i)

    def put(self, i: int, at: tuple[float, float], angle: float, *, is_fixed: bool) -> None:
        """Put an object on the table that was taken off it, for good or to be moved again."""
        self._note("put", i, at, angle, is_fixed)
        self._kinds[i] = "fixed" if is_fixed else "loose"
        self.positions[i] = at
        self.angles[i] = angle
        self._add(i)
        self._resting = False  # another object may lie there

    def advance(self, hand: tuple[float, float], velocity: tuple[float, float], is_low: bool) -> None:
        """Advance by ``dt``.

        Args:
            hand: Where the hand is at first.
            velocity: Its velocity in m/s, which no object changes.
            is_low: Whether the hand is at the height of the objects, and pushes them.
        """
        self._note("advance", hand, velocity, is_low)
        self._hand.position = hand
        self._hand.velocity = velocity
        if is_low != self._is_low:
            self._is_low = is_low
            self._hand_shape.filter = pymunk.ShapeFilter(categories=HAND, mask=OBJECT if is_low else 0)
        for _ in range(SUBSTEPS):
            self._space.step(self._dt / SUBSTEPS)
        fastest = 0.0
        for i, body in self._bodies.items():
            self.positions[i] = body.position
            self.angles[i] = body.angle
            fastest = max(fastest, body.velocity.length, abs(body.angular_velocity) * max(self._sizes[i]))
        self._resting = fastest < REST_SPEED

    def settle(self) -> None:
        """Forget how objects came to rest, so that copies have little to repeat; only while they do rest."""
        if self._resting and len(self._log) > LOG_LIMIT:
            self._log.clear()
            self._build()

    # -- bodies --------------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        """A new space from the present positions."""
        self._origin = (self.positions.copy(), self.angles.copy(), list(self._kinds))
        self._space = space = pymunk.Space()
        space.iterations = 15
        space.collision_slop = 1e-4
        self._bodies: dict[int, pymunk.Body] = {}
        self._parts: dict[int, tuple[Any, ...]] = {}
        self._hand = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._hand_shape = pymunk.Circle(self._hand, self._hand_radius)
        self._hand_shape.friction = OBJECT_FRICTION
        self._is_low = False
        self._hand_shape.filter = pymunk.ShapeFilter(categories=HAND, mask=0)
        space.add(self._hand, self._hand_shape)
        self._add_rim()
        for i, kind in enumerate(self._kinds):
            if kind != "away":
                self._add(i)
        self._resting = True

    def _add_rim(self) -> None:
        width, depth = self._table
        corners = [(-RIM, -RIM), (width + RIM, -RIM), (width + RIM, depth + RIM), (-RIM, depth + RIM)]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            side = pymunk.Segment(self._space.static_body, a, b, RIM)
            side.friction = OBJECT_FRICTION
            side.filter = pymunk.ShapeFilter(categories=FIXED, mask=OBJECT)
            self._space.add(side)

    def _add(self, i: int) -> None:
        length, width = self._sizes[i]
        is_loose = self._kinds[i] == "loose"
        mass = AREA_DENSITY * length * width
        body = (
            pymunk.Body(mass, pymunk.moment_for_box(mass, (length, width)))
            if is_loose
            else pymunk.Body(body_type=pymunk.Body.STATIC)
        )
        body.position = (float(self.positions[i, 0]), float(self.positions[i, 1]))
        body.angle = float(self.angles[i])
        shape = pymunk.Poly.create_box(body, (length, width))
        shape.friction = OBJECT_FRICTION
        category = OBJECT if is_loose else FIXED
        shape.filter = pymunk.ShapeFilter(categories=category, mask=HAND | OBJECT | FIXED if is_loose else OBJECT)
        parts: list[Any] = [body, shape]
        if is_loose:
            parts += self._friction(body, length, width)
            self._bodies[i] = body
        self._parts[i] = tuple(parts)
        self._space.add(*parts)

    def _friction(self, body: pymunk.Body, length: float, width: float) -> list[pymunk.Constraint]:
        """Dry friction with the table: a force and a torque up to a limit against every motion."""
        ground = self._space.static_body
        force = TABLE_FRICTION * length * width
        sliding = pymunk.PivotJoint(ground, body, (0.0, 0.0), (0.0, 0.0))
        turning = pymunk.GearJoint(ground, body, 0.0, 1.0)
        sliding.max_bias = turning.max_bias = 0.0
        sliding.max_force = force
        # The mean distance of a square's points from its centre is 0.38 of its side.
        turning.max_force = 0.38 * math.sqrt(length * width) * force
        return [sliding, turning]

    def _remove(self, i: int) -> None:
        self._space.remove(*self._parts.pop(i))
        self._bodies.pop(i, None)

    # -- copies --------------------------------------------------------------------------------------------------------

    def _note(self, *event: Any) -> None:
        self._log.append(event)

    def __getstate__(self) -> dict[str, Any]:
        gone = ("_space", "_bodies", "_parts", "_hand", "_hand_shape")
        return {key: value for key, value in self.__dict__.items() if key not in gone}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        log, positions = self._log, self.positions
        at, angles, kinds = self._origin
        self.positions, self.angles, self._kinds = at.copy(), angles.copy(), list(kinds)
        self._log = []
        self._build()
        for name, *arguments in log:
            if name == "put":
                self.put(*arguments[:3], is_fixed=arguments[3])
            else:
                getattr(self, name)(*arguments)
        away = [kind == "away" for kind in self._kinds]
        self.positions[away] = positions[away]
