"""Simulated participants in kitchens: everything but how they decide their steps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.humans.fitting import goal_field
from legible_envs.overcooked.humans.kernels import GoalField, sample_times, sample_walk
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.reach import Reach, reach_from
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.random_bits import call_drawing
from legible_envs.support.validation import entries, real, shown

__all__ = ["Walker", "draw_one", "draw_preferences", "nearest_first"]

Floats = npt.NDArray[np.float64]

LONGEST: Final = 100_000
"""Steps after which a path counts as lost: the walker cannot find the goal."""


class Walker(ABC):
    """A person who walks in kitchens.

    Args:
        preferences: ``(H, W)`` cost of stepping on each cell (> 0), for kitchens of that shape; None means 1 each.
        idle: Probability of each tick to be spent standing; about half in recorded play.
        turn: Probability of each tick to be spent turning to a cell that is no floor.
        tick: Seconds per tick.

    Raises:
        ValueError: An argument is out of range.
    """

    kind: ClassVar[int]

    def __init__(
        self,
        *,
        preferences: npt.ArrayLike | None = None,
        idle: float = 0.5,
        turn: float = 0.05,
        tick: float = 0.15,
    ) -> None:
        self.idle = real("idle", idle, 0)
        self.turn = real("turn", turn, 0)
        self.tick = real("tick", tick, 0)
        if self.idle + self.turn >= 1:
            raise ValueError(f"idle + turn must be less than 1, got {idle!r} + {turn!r}: the person would never move")
        try:
            self.preferences = None if preferences is None else np.array(preferences, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ValueError(f"`preferences` must be an (H, W) array of costs, got {shown(preferences)}") from error
        if self.preferences is not None and not ((self.preferences > 0) & (self.preferences < np.inf)).all():
            raise ValueError("preferences are costs of stepping on cells: they must be finite and greater than 0")
        self._fields = lru_cache(maxsize=256)(self._make_field)

    @property
    @abstractmethod
    def params(self) -> Floats:
        """``(k,)`` parameters of this person for the kernels; see :mod:`legible_envs.overcooked.humans.kernels`."""

    def costs(self, shape: tuple[int, int]) -> Floats:
        """``(H, W)`` cost of stepping on each cell.

        Raises:
            ValueError: The preferences are for kitchens of another shape.
        """
        if self.preferences is None:
            return np.ones(shape)
        if self.preferences.shape != shape:
            raise ValueError(f"this person has preferences for cells of {self.preferences.shape}, not of {shape}")
        return self.preferences

    def walk(self, layout: OvercookedLayout, start: str | Cell, goal: str, rng: np.random.Generator) -> list[Cell]:
        """The cells of one path: floor cells, then the goal's own.

        Args:
            layout: The kitchen.
            start: A floor cell, or a station: the person then leaves from one of its access cells.
            goal: Name of the goal station.
            rng: Source of randomness.

        Raises:
            LayoutError: No such station, a start that is neither a station nor a floor cell, or no path.
            RuntimeError: The person did not find the goal in 100,000 steps.
        """
        cell = self._start_cell(layout, start, goal, rng)
        path = self._walk(self._field(layout, goal), cell, rng)
        return [divmod(int(index), layout.shape[1]) for index in path]

    def sample(
        self,
        layout: OvercookedLayout,
        start: str,
        goals: str | Sequence[str],
        n: int,
        rng: np.random.Generator,
        *,
        candidates: Sequence[str] | None = None,
        **labels: Any,
    ) -> list[Trajectory]:
        """Trajectories from a station to goals.

        Args:
            layout: The kitchen.
            start: Name of the station left; each trajectory begins at one of its access cells.
            goals: The goal, or goals of which one is drawn for each trajectory.
            n: How many trajectories.
            rng: Source of randomness.
            candidates: Goals that an observer takes for possible, ``goals`` if None; those that cannot be reached from
                where a trajectory begins are left out of it.
            **labels: Further attributes of :class:`~legible_envs.rollouts.Trajectory`, such as ``participant``.

        Raises:
            LayoutError: No such station, or no path from the start to a goal.
            RuntimeError: The person did not find the goal in 100,000 steps.
        """
        names = (goals,) if isinstance(goals, str) else tuple(entries(goals))
        if not names:
            raise LayoutError(f"`goals` must name at least one station, got {shown(goals)}", rule="station")
        labels = {"condition": "simulated", **labels}
        found = []
        for _ in range(n):
            goal = names[int(rng.integers(len(names)))]
            cell = self._start_cell(layout, start, goal, rng)
            states, ticks = self.leg(layout, cell, start, goal, rng)
            out_of_reach = reach_from(layout, cell).out_of_reach
            found.append(
                Trajectory(
                    states=states,
                    times=self.seconds(ticks),
                    start=start,
                    goal=goal,
                    candidates=tuple(name for name in candidates or names if name not in out_of_reach),
                    layout=layout,
                    **labels,
                )
            )
        return found

    def seconds(self, ticks: npt.NDArray[np.int64]) -> Floats:
        """When ticks end."""
        return np.asarray(ticks * self.tick, dtype=np.float64)

    def leg(
        self, layout: OvercookedLayout, cell: Cell, start: str, goal: str, rng: np.random.Generator
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """``(T, 2)`` cells from a floor cell into a station, and ``(T,)`` ticks, from a person who faces ``start``."""
        field = self._field(layout, goal)
        path = self._walk(field, cell, rng)
        row, col = layout.stations[start]
        around = [neighbour(int(path[0]), direction, field.height, field.width) for direction in range(4)]
        facing = around.index(row * field.width + col)
        ticks = np.empty(len(path), dtype=np.int64)
        call_drawing(rng, sample_times, path, facing, field, self.idle, self.turn, ticks)
        return np.column_stack(np.divmod(path, field.width)), ticks

    def _field(self, layout: OvercookedLayout, goal: str) -> GoalField:
        if goal not in layout.stations:
            raise LayoutError(f"no station {goal!r}; this kitchen has {list(layout.stations)}", rule="station")
        field: GoalField = self._fields(layout, goal)
        return field

    def _start_cell(self, layout: OvercookedLayout, start: str | Cell, goal: str, rng: np.random.Generator) -> Cell:
        """The cell of a start, from which the goal can be reached; one of several at random."""
        if not isinstance(start, str) and len(entries(start)) != 2:
            raise LayoutError(
                f"`start` must be a station's name or a cell (row, column), got {shown(start)}", rule="start"
            )
        if not isinstance(start, str) and not layout.is_floor(start):
            raise LayoutError(
                f"row {start[0]}, column {start[1]} is no floor cell", rule="start", cell=(start[0], start[1])
            )
        cells = layout.access(start) if isinstance(start, str) else ((int(start[0]), int(start[1])),)
        field = self._field(layout, goal)
        near = [cell for cell in cells if field.cost_to_go[cell[0] * field.width + cell[1]] < np.inf]
        where = repr(start) if isinstance(start, str) else f"row {start[0]}, column {start[1]}"
        return draw_one(near, f"no path to {goal!r} from {where}", rng)

    def _make_field(self, layout: OvercookedLayout, goal: str) -> GoalField:
        return goal_field(layout, layout.stations[goal], self.costs(layout.shape))

    def _walk(self, field: GoalField, cell: Cell, rng: np.random.Generator) -> npt.NDArray[np.int64]:
        start = cell[0] * field.width + cell[1]
        path = np.empty(LONGEST, dtype=np.int64)
        length = call_drawing(rng, sample_walk, self.kind, self.params, start, field, path)
        if length == 0:
            row, col = divmod(field.station, field.width)
            raise RuntimeError(f"{self} did not find the goal at row {row}, column {col} within {LONGEST:,} steps")
        return path[:length].copy()

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild, (type(self), {key: getattr(self, key) for key in self._parameters()})

    def _parameters(self) -> tuple[str, ...]:
        return ("preferences", "idle", "turn", "tick")

    def __repr__(self) -> str:
        shown = [f"{key}={getattr(self, key):g}" for key in self._parameters() if key != "preferences"]
        return f"{type(self).__name__}({', '.join(shown)})"


def draw_one(cells: Sequence[Cell], what: str, rng: np.random.Generator) -> Cell:
    """One of the cells, each equally likely; a :class:`LayoutError` about ``what`` where there is none."""
    if not cells:
        raise LayoutError(f"{what}: no person can walk there", rule="reachable")
    return cells[int(rng.integers(len(cells)))]


@lru_cache(maxsize=512)
def _shortest_field(layout: OvercookedLayout, name: str) -> GoalField:
    """The costs to go of a person without preferences: numbers of steps."""
    return goal_field(layout, layout.stations[name])


def nearest_first(reach: Reach, cell: Cell, place: str) -> list[str]:
    """The stations in reach that a task means by a place, those nearest to a floor cell first.

    Args:
        reach: What the person can get to.
        cell: A cell where the person can stand.
        place: A station's name, or a type.
    """
    at = cell[0] * reach.layout.shape[1] + cell[1]
    return sorted(reach.named(place), key=lambda name: float(_shortest_field(reach.layout, name).cost_to_go[at]))


def draw_preferences(shape: tuple[int, int], rng: np.random.Generator, preference: float) -> Floats | None:
    """``(H, W)`` lognormal costs around 1, None for a person without preferences."""
    sd = real("preference", preference, 0)
    return None if sd == 0 else np.exp(sd * rng.normal(size=shape))


def _rebuild(cls: type[Walker], parameters: dict[str, Any]) -> Walker:
    return cls(**parameters)
