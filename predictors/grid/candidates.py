"""Which candidates of a trajectory in a kitchen are goals: those that its person can reach."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from legible_envs.overcooked.layout import FLOOR, OvercookedLayout
from legible_envs.overcooked.reach import reach_from
from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["within_reach"]


def within_reach(trajectory: Trajectory) -> Trajectory:
    """The same trajectory without the candidates that cannot be reached from its first cell.

    Two players of a divided kitchen share its layout, and each has goals of their own
    (:mod:`legible_envs.overcooked.reach`). A trajectory of which nothing is observed, that fits no kitchen, or none of
    whose candidates is in reach is returned as it is.
    """
    layout = trajectory.layout
    if not isinstance(layout, OvercookedLayout) or not _is_divided(layout):
        return trajectory
    if not trajectory.num_states or not trajectory.is_grid:
        return trajectory
    first = tuple(trajectory.states[0].tolist())
    out_of_reach = _out_of_reach(layout, trajectory.candidates, first)
    if not out_of_reach:
        return trajectory
    kept = [number for number, name in enumerate(trajectory.candidates) if name not in out_of_reach]
    places = trajectory.goal_positions
    goal = None if trajectory.goal in out_of_reach else trajectory.goal
    return replace(
        trajectory,
        goal=goal,
        candidates=tuple(trajectory.candidates[number] for number in kept),
        goal_positions=None if places is None else tuple(places[number] for number in kept),
    )


@lru_cache(maxsize=256)
def _is_divided(layout: OvercookedLayout) -> bool:
    """Whether some station is out of reach from some floor cell; most kitchens are whole, and need no further look."""
    floor = layout.cells == FLOOR
    while floor.any():
        row, col = np.argwhere(floor)[0]
        reach = reach_from(layout, (row, col))
        if reach.out_of_reach:
            return True
        floor &= ~reach.floor
    return False


@lru_cache(maxsize=4096)
def _out_of_reach(layout: OvercookedLayout, candidates: tuple[str, ...], cell: tuple[int, ...]) -> frozenset[str]:
    """Which candidates are stations out of reach from a cell; none where no candidate is in reach."""
    reach = reach_from(layout, cell)
    found = frozenset(candidates).intersection(reach.out_of_reach)
    return found if reach.stations and len(found) < len(candidates) else frozenset()
