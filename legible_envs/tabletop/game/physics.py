"""The objects on a table as rigid bodies that a hand can push, by pymunk, seen from above."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pymunk

from legible_envs.tabletop.game.contact_kernels import (
    AWAY,
    FIXED,
    LIFTED,
    LOOSE,
    MOVED,
    TOUCH,
    UP,
    find_room,
    keep_apart,
)
from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["TablePhysics"]

Floats = npt.NDArray[np.float64]

SUBSTEPS: Final = 4
MOST_SUBSTEPS: Final = 256
STRIDE: Final = 0.5
"""What nothing moves further in a substep, in half-widths of the narrowest object."""
FURTHEST: Final = 0.9
"""The same for what is put back where it moved further all the same."""
BIAS: Final = 0.5
"""The part of an overlap that the solver leaves in a substep."""
AREA_DENSITY: Final = 50.0  # kg/m^2: a cube of 4.5 cm weighs 100 g
TABLE_FRICTION: Final = 0.5 * 9.81 * AREA_DENSITY  # Coulomb friction with the table, in N per m^2 of the object
OBJECT_FRICTION: Final = 0.4
REST_SPEED: Final = 1e-3
RIM: Final = 0.2
LOG_LIMIT: Final = 2000

HAND_CATEGORY, LOOSE_CATEGORY, FIXED_CATEGORY = 1, 2, 4


class TablePhysics:
    """Objects that slide with dry friction when they are pushed, cannot leave the table, and do not feel obstacles.

    No loose object is ever off the table, nor overlaps with another that lies there by more than 0.2 mm: the solver
    takes as many substeps as the fastest speed asks for, and what it leaves wrong is put right after them (see
    :mod:`.contact_kernels`). A hand that runs into what cannot give way rises.

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
        self._halves = np.array([obj.size for obj in layout.objects]) / 2
        self._lengths = [max(obj.size) for obj in layout.objects]
        self._table = layout.table.size
        self._hand_radius = hand
        self._dt = dt
        self._stride = STRIDE * float(self._halves.min())
        self._furthest = FURTHEST * float(self._halves.min())
        self._kinds = np.where(loose, LOOSE, FIXED)
        self._log: list[tuple[Any, ...]] = []
        self._fastest = 0.0
        self._build()

    @property
    def is_resting(self) -> bool:
        """Whether all objects are at rest."""
        return self._fastest < REST_SPEED

    @property
    def solid(self) -> npt.NDArray[np.bool_]:
        """``(n,)`` bool: the objects that lie on the table, loose or fixed."""
        return self._kinds != AWAY

    @property
    def loose(self) -> npt.NDArray[np.bool_]:
        """``(n,)`` bool: the objects that lie on the table and can be moved."""
        return self._kinds == LOOSE

    # -- events --------------------------------------------------------------------------------------------------------

    def take(self, i: int) -> None:
        """Take an object off the table."""
        self._note("take", i)
        self._kinds[i] = AWAY
        self._remove(i)

    def put(self, i: int, at: tuple[float, float], angle: float, *, is_fixed: bool) -> bool:
        """Put an object on the table that was taken off it, for good or to be moved again.

        Loose objects that lie there are pushed aside, or moved to the nearest place with room. An object that is to be
        moved again is put down as near as there is room.

        Returns:
            False where there is no room on the whole table; then nothing has changed.
        """
        positions, angles, kinds = self.positions.copy(), self.angles.copy(), self._kinds.copy()
        positions[i], angles[i], kinds[i] = at, angle, FIXED if is_fixed else LOOSE
        if not find_room(positions, angles, self._halves, kinds, self._table, i):
            return False
        self._note("put", i, at, angle, is_fixed)
        moved = np.flatnonzero((positions != self.positions).any(axis=1)).tolist()
        self.positions[:], self.angles[:], self._kinds = positions, angles, kinds
        for j in moved:
            if j != i and j in self._bodies:
                self._place(j)
        self._add(i)
        self._fastest = max(self._fastest, REST_SPEED)  # not at rest: they touch anew
        return True

    def advance(self, hand: tuple[float, float], velocity: tuple[float, float], is_low: bool) -> bool:
        """Advance by ``dt``.

        Args:
            hand: Where the hand is at first.
            velocity: Its velocity in m/s, which no object changes.
            is_low: Whether the hand is at the height of the objects, and pushes them.

        Returns:
            Whether the hand is low in the end: it rises over what cannot give way.
        """
        self._note("advance", hand, velocity, is_low)
        top = MOST_SUBSTEPS * self._stride / self._dt
        speed = math.hypot(*velocity)
        self._hand.position = hand
        self._hand.velocity = velocity
        self._lower(is_low and speed <= top)
        self._slow_down(top)
        fastest = min(max(speed if self._is_low else 0.0, self._fastest), top) * self._dt
        substeps = max(SUBSTEPS, math.ceil(fastest / self._stride - 1e-9))
        every = max(1, min(substeps, int(self._stride * substeps / max(fastest, 1e-9))))
        dt = self._dt / substeps
        self._space.collision_bias = max(BIAS ** (1.0 / dt), 1e-300)
        for substep in range(1, substeps + 1):
            self._space.step(dt)
            if substep % every == 0 or substep == substeps:
                part = substep * dt
                self._correct((hand[0] + velocity[0] * part, hand[1] + velocity[1] * part))
        self._fastest = 0.0
        for i, body in self._bodies.items():
            speed = max(body.velocity.length, abs(body.angular_velocity) * self._lengths[i])
            self._fastest = max(self._fastest, speed)
        return self._is_low

    def settle(self) -> None:
        """Forget how objects came to rest, so that copies have little to repeat; only while they do rest."""
        if self.is_resting and len(self._log) > LOG_LIMIT:
            self._log.clear()
            self._build()

    # -- bodies --------------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        """A new space from the present positions."""
        self._origin = (self.positions.copy(), self.angles.copy(), self._kinds.copy())
        self._space = space = pymunk.Space()
        space.iterations = 15
        space.collision_slop = TOUCH
        self._stuck = np.zeros(len(self._kinds), dtype=np.bool_)
        self._bodies: dict[int, pymunk.Body] = {}
        self._parts: dict[int, tuple[Any, ...]] = {}
        self._hand = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self._hand_shape = pymunk.Circle(self._hand, self._hand_radius)
        self._hand_shape.friction = OBJECT_FRICTION
        self._is_low = True
        self._lower(False)
        space.add(self._hand, self._hand_shape)
        self._add_rim()
        for i in np.flatnonzero(self.solid).tolist():
            self._add(i)
        self._fastest = 0.0

    def _lower(self, is_low: bool) -> None:
        if is_low != self._is_low:
            self._is_low = is_low
            self._hand_shape.filter = pymunk.ShapeFilter(categories=HAND_CATEGORY, mask=LOOSE_CATEGORY if is_low else 0)

    def _add_rim(self) -> None:
        width, depth = self._table
        corners = [(-RIM, -RIM), (width + RIM, -RIM), (width + RIM, depth + RIM), (-RIM, depth + RIM)]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            side = pymunk.Segment(self._space.static_body, a, b, RIM)
            side.friction = OBJECT_FRICTION
            side.filter = pymunk.ShapeFilter(categories=FIXED_CATEGORY, mask=LOOSE_CATEGORY)
            self._space.add(side)

    def _add(self, i: int) -> None:
        length, width = (2.0 * self._halves[i]).tolist()
        is_loose = self._kinds[i] == LOOSE
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
        everything = HAND_CATEGORY | LOOSE_CATEGORY | FIXED_CATEGORY
        shape.filter = pymunk.ShapeFilter(
            categories=LOOSE_CATEGORY if is_loose else FIXED_CATEGORY, mask=everything if is_loose else LOOSE_CATEGORY
        )
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

    def _place(self, i: int) -> None:
        """Move a body to where its object has been moved."""
        body = self._bodies[i]
        body.position = (float(self.positions[i, 0]), float(self.positions[i, 1]))
        body.angle = float(self.angles[i])

    # -- what a solver leaves wrong ------------------------------------------------------------------------------------

    def _correct(self, hand: tuple[float, float]) -> None:
        """Take over the poses of the bodies, so that none overlaps with another and none leaves the table."""
        positions, angles = self.positions.copy(), self.angles.copy()
        poses = np.array([(*body.position, body.angle) for body in self._bodies.values()]).reshape(-1, 3)
        rows = list(self._bodies)
        positions[rows] = poses[:, :2]
        angles[rows] = poses[:, 2]
        radius = self._hand_radius if self._is_low else UP
        result = keep_apart(
            positions,
            angles,
            self._halves,
            self._kinds,
            self._table,
            hand,
            radius,
            self.positions,
            self.angles,
            self._furthest,
            self._stuck,
        )
        self.positions[:], self.angles[:] = positions, angles
        if result & MOVED:
            for i, body in self._bodies.items():
                self._place(i)
                if self._stuck[i]:
                    body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        if result & LIFTED:
            self._lower(False)

    def _slow_down(self, top: float) -> None:
        """No object is faster than substeps can follow."""
        if self._fastest > top:
            for i, body in self._bodies.items():
                speed = max(body.velocity.length, abs(body.angular_velocity) * self._lengths[i])
                if speed > top:
                    body.velocity *= top / speed
                    body.angular_velocity *= top / speed

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
        self.positions, self.angles, self._kinds = at.copy(), angles.copy(), kinds.copy()
        self._log = []
        self._build()
        for name, *arguments in log:
            if name == "put":
                self.put(*arguments[:3], is_fixed=arguments[3])
            else:
                getattr(self, name)(*arguments)
        away = ~self.solid
        self.positions[away] = positions[away]
