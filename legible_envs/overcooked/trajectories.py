"""Trajectories in an episode: empty-handed from a pot or serving station to an ingredient or dish station."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.snapshot import name_goals
from legible_envs.overcooked.game.vectors import AT_PLAYERS
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout
from legible_envs.overcooked.reach import reach_from
from legible_envs.rollouts.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Collection


__all__ = [
    "ValidGoals",
    "Walk",
    "dispensers_in_reach",
    "find_walks",
    "trajectories",
    "trajectories_from_states",
    "trajectories_from_views",
]

ValidGoals = Callable[[int, int], "Collection[str]"]
"""Goals that are valid in the running game, called with (tick, player)."""

_STARTS: Final = ("pot", "serving")
_GOALS: Final = (*INGREDIENTS, "dish")
_KINDS: Final = {kind: code for code, kind in enumerate((*INGREDIENTS, "dish", "soup"), 1)}


class Walk(NamedTuple):
    """One trajectory of one player, as cells and ticks.

    Attributes:
        start: Station whose use emptied the hands.
        goal: Station where they were filled again.
        cells: Floor cells in order, consecutive repeats dropped; never empty.
        ticks: First tick on each of these cells, and the first tick with full hands.
    """

    start: str
    goal: str
    cells: tuple[Cell, ...]
    ticks: tuple[int, ...]


def find_walks(
    layout: OvercookedLayout,
    cells: npt.NDArray[np.integer],
    facing: npt.NDArray[np.integer],
    held: npt.NDArray[np.integer],
    start: str | None = None,
) -> Iterator[Walk]:
    """The trajectories of one player through one episode.

    A trajectory begins when using a pot or serving station empties the hands, ends when an ingredient or dish station
    fills them, and is dropped where anything else fills them in between.

    Args:
        layout: The kitchen.
        cells: ``(T, 2)`` row and column, one state a tick.
        facing: ``(T,)`` 0 N, 1 S, 2 E, 3 W.
        held: ``(T,)`` item held, 0 for nothing.
        start: Station where the player counts as standing at first; None drops a first trajectory without a start.
    """
    origin: tuple[str, int] | None = (start, 0) if start is not None and held[0] == 0 else None
    for tick in np.flatnonzero(np.diff(held.astype(np.int64))).tolist():
        used = _faced(layout, cells[tick], int(facing[tick]))
        kind = (used or "").partition("@")[0]
        if held[tick + 1] == 0:
            origin = (used, tick + 1) if used is not None and kind in _STARTS else None
        elif held[tick] == 0:
            if origin is not None and used is not None and kind in _GOALS:
                path, ticks = _without_repeats(cells[origin[1] : tick + 1], origin[1])
                yield Walk(origin[0], used, path, (*ticks, tick + 1))
            origin = None


def _faced(layout: OvercookedLayout, cell: Sequence[int], facing: int) -> str | None:
    step = NEIGHBOURS[facing]
    return layout.station_at((int(cell[0]) + step[0], int(cell[1]) + step[1]))


def _without_repeats(cells: npt.NDArray[np.integer], first: int) -> tuple[tuple[Cell, ...], list[int]]:
    kept = np.flatnonzero(np.append(True, (np.diff(cells, axis=0) != 0).any(axis=1)))
    return tuple((int(row), int(col)) for row, col in cells[kept]), (kept + first).tolist()


def dispensers_in_reach(layout: OvercookedLayout, cell: Sequence[int]) -> tuple[str, ...]:
    """Ingredient and dish stations within reach of a floor cell, in reading order: candidates ``all``."""
    return tuple(name for name in reach_from(layout, cell).stations if name.partition("@")[0] in _GOALS)


def trajectories(
    layout: OvercookedLayout,
    cells: npt.NDArray[np.integer],
    facing: npt.NDArray[np.integer],
    held: npt.NDArray[np.integer],
    seconds: npt.NDArray[np.floating],
    *,
    participants: Sequence[str],
    starts: Sequence[str | None] | None = None,
    valid_goals: ValidGoals | None = None,
    min_positions: int = 1,
    min_candidates: int = 1,
    round_trips: bool = True,
    **labels: Any,
) -> list[Trajectory]:
    """The trajectories of all players; arrays as in ``find_walks`` with a player axis after the first.

    The candidates of each trajectory are those in reach of its own person, who stands on its first cell: two players
    of a divided kitchen have different ones.

    Args:
        layout: The kitchen.
        cells: ``(T, n, 2)``.
        facing: ``(T, n)``.
        held: ``(T, n)``.
        seconds: ``(T,)`` time of each state.
        participants: ``n`` names.
        starts: ``n`` stations where players count as standing at first.
        valid_goals: Goals of the running game; the candidates are then those in reach among them when it begins
            (candidate set ``game``), and trajectories to other goals are left out. None: all in reach (``all``).
        min_positions: Fewest floor cells of a trajectory.
        min_candidates: Fewest candidates of a trajectory.
        round_trips: Whether to keep trajectories that end on the cell they began on, because start and goal share it.
        labels: Further attributes of :class:`~legible_envs.rollouts.Trajectory`.
    """
    found = []
    for player, participant in enumerate(participants):
        first = starts[player] if starts is not None else None
        for walk in find_walks(layout, cells[:, player], facing[:, player], held[:, player], first):
            if len(walk.cells) < min_positions or (not round_trips and walk.cells[0] == walk.cells[-1]):
                continue
            candidates = dispensers_in_reach(layout, walk.cells[0])
            if valid_goals is not None:
                valid = valid_goals(walk.ticks[0], player)
                candidates = tuple(name for name in candidates if name in valid)
            if len(candidates) < min_candidates or walk.goal not in candidates:
                continue
            found.append(
                Trajectory(
                    states=np.array([*walk.cells, layout.stations[walk.goal]]),
                    times=np.asarray(seconds, dtype=np.float64)[list(walk.ticks)],
                    start=walk.start,
                    goal=walk.goal,
                    candidates=candidates,
                    participant=participant,
                    layout=layout,
                    candidate_set="all" if valid_goals is None else "game",
                    **labels,
                )
            )
    return found


def trajectories_from_states(
    layout: OvercookedLayout,
    states: npt.NDArray[np.int32],
    goals: npt.NDArray[np.bool_] | None,
    *,
    player: int = 0,
    participant: str = "",
    condition: str = "",
    layout_name: str = "",
    seconds_per_tick: float = 0.15,
    min_positions: int = 1,
    min_candidates: int = 1,
) -> list[Trajectory]:
    """The trajectories in one player's episode, from the state vectors of the dynamics.

    Args:
        layout: The kitchen.
        states: ``(T, state_size)`` as described in :mod:`legible_envs.overcooked.game.vectors`.
        goals: ``(T, H*W)`` valid goals in each state; the candidates are then those of the game. None: all in reach.
        player: Number of the player.
        participant: Who played.
        condition: Under which condition.
        layout_name: The kitchen's name, if it has one.
        seconds_per_tick: Length of a tick.
        min_positions: Fewest floor cells of a trajectory.
        min_candidates: Fewest candidates of a trajectory.
    """
    at = AT_PLAYERS + 3 * player
    cells = np.stack(np.divmod(states[:, at], layout.shape[1]), axis=-1)
    return trajectories(
        layout,
        cells[:, None],
        states[:, at + 1, None],
        states[:, at + 2, None],
        np.arange(len(states)) * seconds_per_tick,
        participants=[participant],
        starts=[station_beside(layout, cells[0])],
        valid_goals=None if goals is None else lambda tick, _: name_goals(layout, goals[tick]),
        min_positions=min_positions,
        min_candidates=min_candidates,
        condition=condition,
        layout_name=layout_name,
    )


def trajectories_from_views(
    views: Sequence[GameView],
    *,
    valid_goals: Sequence[Sequence[str]] | None = None,
    participant: str = "",
    condition: str = "",
    layout_name: str = "",
    seconds_per_tick: float = 0.15,
    min_positions: int = 1,
    min_candidates: int = 1,
) -> list[Trajectory]:
    """The trajectories in an episode, from the views of all its states in order.

    A player whose first cell is beside a serving station counts as standing at serving, where the task begins.

    Args:
        views: The states, beginning with the one after ``reset``.
        valid_goals: For each state the valid goals of a single player's game (``env.unwrapped.goals``);
            given them, the candidates are those of the game.
        participant: Who played; several players are told apart as ``NAME/0``, ``NAME/1``, ….
        condition: Under which condition.
        layout_name: The kitchen's name, if it has one.
        seconds_per_tick: Length of a tick.
        min_positions: Fewest floor cells of a trajectory.
        min_candidates: Fewest candidates of a trajectory.

    Raises:
        ValueError: No view, views of different kitchens, or another number of goal lists than of views.
    """
    if not views:
        raise ValueError("an episode has at least one state; got no views")
    layout, count = views[0].layout, len(views[0].players)
    if any(view.layout != layout or len(view.players) != count for view in views):
        raise ValueError("the views are of different kitchens; give one episode at a time")
    if valid_goals is not None and (len(valid_goals) != len(views) or count != 1):
        raise ValueError(f"`valid_goals` needs one list per state of a single player's game: {len(views)} states")
    players = [view.players for view in views]
    cells = np.array([[player.cell for player in row] for row in players])
    held = np.array([[0 if p.held is None else _KINDS[p.held.kind] for p in row] for row in players])
    return trajectories(
        layout,
        cells,
        np.array([[player.facing for player in row] for row in players]),
        held,
        np.arange(len(views)) * seconds_per_tick,
        participants=[participant] if count == 1 else [f"{participant}/{n}" for n in range(count)],
        starts=[station_beside(layout, cell) for cell in cells[0]],
        valid_goals=None if valid_goals is None else lambda tick, _: valid_goals[tick],
        min_positions=min_positions,
        min_candidates=min_candidates,
        condition=condition,
        layout_name=layout_name,
    )


def station_beside(layout: OvercookedLayout, cell: Sequence[int]) -> str | None:
    return next((n for n in layout.named("serving") if (int(cell[0]), int(cell[1])) in layout.access(n)), None)
