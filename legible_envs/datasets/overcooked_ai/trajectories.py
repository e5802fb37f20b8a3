"""Trajectories and counts of recorded games."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import RecordedGame
from legible_envs.overcooked.trajectories import dispensers_in_reach, trajectories
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice

__all__ = ["all_trajectories", "statistics", "trajectories_of_games"]

_FULL = 3
_DISH = 5


def all_trajectories(games: Sequence[RecordedGame]) -> list[Trajectory]:
    """Every trajectory, however short, with all dispensers in reach as candidates."""
    return trajectories_of_games(games, "all", min_positions=1, min_candidates=1, round_trips=True)


def trajectories_of_games(
    games: Sequence[RecordedGame], candidate_set: Literal["game", "all"] = "all", **limits: Any
) -> list[Trajectory]:
    """The trajectories of the persons in games, not those of other agents.

    Args:
        games: Games of :func:`.read_recording` or :func:`.load_recorded_games`.
        candidate_set: ``"all"``: every dispenser in reach. ``"game"``: those among them that are of use when the
            trajectory begins; known for games by the rules of 2019 alone.
        **limits: ``min_positions``, ``min_candidates`` and ``round_trips``, as in
            :func:`legible_envs.datasets.overcooked_2019.recorded_trajectories`; by default all trajectories are kept.

    Raises:
        ValueError: Unknown candidates, or those of the game where its rules are others.
    """
    choice("candidate_set", candidate_set, ("game", "all"))
    other = [game for game in games if game.rules != "overcooked-ai-2019"] if candidate_set == "game" else []
    if other:
        raise ValueError(
            f"which goals are of use is known by the rules of 2019 alone; the game {other[0].pair} of "
            f'{other[0].layout_name} has other orders and pots: take `candidate_set="all"`'
        )
    return [
        found
        for game in games
        for found in trajectories(
            game.layout,
            game.cells[:, game.people],
            game.facing[:, game.people],
            game.held[:, game.people],
            game.seconds.astype(np.float64),
            participants=[game.participant(player) for player in game.people],
            valid_goals=_valid_goals(game) if candidate_set == "game" else None,
            condition="recorded",
            layout_name=game.layout_name,
            **limits,
        )
    ]


def _valid_goals(game: RecordedGame) -> Callable[[int, int], Collection[str]]:
    """Goals of use to empty hands in the 2019 game: the rule of ``legible_envs.overcooked.game.goals``."""
    full = game.pots[:, :, :4].sum(axis=2) >= _FULL

    def valid(tick: int, person: int) -> Collection[str]:
        player = game.people[person]
        reach = _pots_in_reach(game, game.cells[tick, player])
        soups = int((full[tick] & reach).sum()) - int((np.delete(game.held[tick], player) == _DISH).sum())
        wanted = {"onion"} if (reach & ~full[tick]).any() else set()
        wanted |= {"dish"} if soups > 0 else set()
        names = dispensers_in_reach(game.layout, game.cells[tick, player])
        return [name for name in names if name.partition("@")[0] in wanted]

    return valid


def _pots_in_reach(game: RecordedGame, cell: Sequence[int]) -> npt.NDArray[np.bool_]:
    away = game.layout.distances_from([cell])
    return np.array([any(away[c] >= 0 for c in game.layout.access(name)) for name in game.layout.named("pot")])


def statistics(games: Sequence[RecordedGame]) -> list[dict[str, Any]]:
    """See :func:`legible_envs.datasets.overcooked_2019.recording_stats`."""
    names = list(dict.fromkeys(game.layout_name for game in games))
    groups = [(name, [game for game in games if game.layout_name == name]) for name in names]
    return [_row(name, group) for name, group in [*groups, ("all", list(games))]]


def _row(name: str, games: list[RecordedGame]) -> dict[str, Any]:
    scored = trajectories_of_games(games, min_positions=3, min_candidates=2, round_trips=False)
    idle = [_idle(game) for game in games]
    return {
        "layout": name,
        "games": len(games),
        "pairs": len({game.pair for game in games}),
        "ticks": sum(game.num_ticks for game in games),
        "deliveries": int(sum(game.rewards.sum() for game in games)) // 20,
        "idle": float(np.concatenate(idle).mean()) if idle else float("nan"),
        "trajectories": len(all_trajectories(games)),
        "scored_trajectories": len(scored),
    }


def _idle(game: RecordedGame) -> npt.NDArray[np.bool_]:
    """``(2T,)`` whether a player's cell, facing and hands stayed as they were."""
    same = (np.diff(game.cells, axis=0) == 0).all(axis=2)
    return (same & (np.diff(game.facing, axis=0) == 0) & (np.diff(game.held, axis=0) == 0)).ravel()
