"""From trajectory files (JSON) of Overcooked-AI's agents and its demonstration server, to games.

Per episode ``ep_states`` (``ep_observations`` in 2019), ``ep_actions`` and ``ep_rewards``, as long as each other, and
``mdp_params`` with the ``layout_name`` and, in newer files, the grid as ``terrain``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from legible_envs.datasets.overcooked_ai.games import RecordedGame, RecordingsError
from legible_envs.datasets.overcooked_ai.tables_2020 import game_of_states
from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["convert_episodes", "is_trajectory_json"]

_STATES: Final = ("ep_states", "ep_observations")


def is_trajectory_json(value: object) -> bool:
    """Whether a JSON value has the entries of such a file."""
    return isinstance(value, Mapping) and "ep_actions" in value and any(name in value for name in _STATES)


def convert_episodes(content: Mapping[str, Any], layouts: Mapping[str, OvercookedLayout]) -> list[RecordedGame]:
    """The games of a file. Of each, the last state's action has no outcome and is lost.

    Args:
        content: The JSON value.
        layouts: Kitchens by their names, for files that hold no grid.

    Raises:
        RecordingsError: An entry is missing or of another length, or a state is none; which, and in which episode.
    """
    states = _list(content, next(name for name in _STATES if name in content))
    actions, rewards = _list(content, "ep_actions"), _list(content, "ep_rewards")
    params = _list(content, "mdp_params") if "mdp_params" in content else [{}] * len(states)
    counts = [len(each) for each in (states, actions, rewards, params)]
    if len(set(counts)) > 1:
        raise RecordingsError(f"{counts} entries of states, actions, rewards and mdp_params; expected the same number")
    games = []
    for number, episode in enumerate(zip(states, actions, rewards, params, strict=True)):
        games += _game(f"episode {number}", *episode, layouts)
    return games


def _list(content: Mapping[str, Any], name: str) -> Sequence[Any]:
    found = content.get(name)
    if not isinstance(found, list):
        raise RecordingsError(f"{name!r} is missing or no list")
    return found


def _game(
    place: str, states: Any, actions: Any, rewards: Any, params: Any, layouts: Mapping[str, OvercookedLayout]
) -> list[RecordedGame]:
    lists = (states, actions, rewards)
    if not all(isinstance(each, list) for each in lists) or len({len(each) for each in lists}) > 1:
        raise RecordingsError(f"{place}: expected lists of as many states, actions and rewards")
    if not isinstance(params, Mapping):
        raise RecordingsError(f"{place}: 'mdp_params' must be an object")
    if not all(type(reward) in (int, float) and abs(reward) < 1e6 for reward in rewards):
        raise RecordingsError(f"{place}: 'ep_rewards' must be numbers")
    if len(states) < 2:
        return []
    name = str(params.get("layout_name", ""))
    grid, start, cook_time = params.get("terrain"), states[0], params.get("cook_time", -1)
    if type(cook_time) is not int or not -1 <= cook_time <= 10_000:
        raise RecordingsError(f"{place}: 'cook_time' must be a whole number, got {str(cook_time)[:60]!r}")
    if grid is None:
        if name not in layouts:
            raise RecordingsError(
                f"{place} is in the kitchen {name!r}, and the file does not hold its grid; pass "
                f"`layouts={{{name!r}: …}}`"
            )
        grid, start = layouts[name].to_ascii(), None
    return [
        game_of_states(
            name,
            grid,
            [(f"{place}, tick {tick}", state) for tick, state in enumerate(states)],
            [(f"{place}, tick {tick}", action) for tick, action in enumerate(actions[:-1])],
            rewards[:-1],
            None,
            start,
            cook_time,
            pair=place.replace(" ", "-"),
        )
    ]
