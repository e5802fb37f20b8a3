"""Who plays the episodes of a data set: scripted players, simulated participants, and policies of users.

A policy is called with ``(observation, info)`` and returns an action, as everywhere in this project.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from legible_envs.support.plugins import import_target, target_of
from legible_envs.support.validation import shown

__all__ = ["ENVIRONMENTS", "PLAYERS", "Player", "Policy", "find_player", "make_policy"]

Policy = Callable[[Any, dict[str, Any]], Any]
"""Called with ``(observation, info)``, returns an action."""
Maker = Callable[[Any, np.random.Generator], Policy]

ENVIRONMENTS: Final[Mapping[str, str]] = {"overcooked": "LegibleOvercooked-v0", "tabletop": "LegibleTabletop-v0"}
"""Names of domains and of their environments."""


@dataclass(frozen=True)
class Player:
    """A kind of player.

    Attributes:
        name: What it is called.
        make: Called with the environment and a generator, makes one participant's policy.
        about: Who that is, for descriptions of data sets.
        differs: Whether participants differ: each is drawn anew.
    """

    name: str
    make: Maker
    about: str
    differs: bool = False


def _scripted_cook(env: Any, rng: np.random.Generator) -> Policy:
    from legible_envs.overcooked.policies import ScriptedPlayer

    return ScriptedPlayer(env, rng)


def _walking(model: str) -> Maker:
    """A simulated participant who is drawn from a population, and walks so in all kitchens of the environment."""

    def make(env: Any, rng: np.random.Generator) -> Policy:
        from legible_envs.overcooked import humans
        from legible_envs.overcooked.policies import WalkingPlayer

        return WalkingPlayer(env, getattr(humans, model).draw(env.unwrapped.shape, rng), rng)

    return make


def _scripted_hand(env: Any, rng: np.random.Generator) -> Policy:
    from legible_envs.tabletop.humans import Person
    from legible_envs.tabletop.policies import ReachingPlayer

    steady = Person(
        skew=1.0, skew_trial=0.0, bow=0.0, bow_trial=0.0, aim=0.0, duration_trial=0.0, endpoint_sd=0.0, start_sd=0.0,
        signal_sd=0.0,
    )  # fmt: skip
    return ReachingPlayer(env, steady, rng)


def _reaching(env: Any, rng: np.random.Generator) -> Policy:
    from legible_envs.tabletop.humans import sample_person
    from legible_envs.tabletop.policies import ReachingPlayer

    return ReachingPlayer(env, sample_person(rng), rng)


_KITCHEN: Final = (
    Player("scripted", _scripted_cook, "a scripted player who takes shortest paths to goals drawn uniformly"),
    Player(
        "boltzmann", _walking("BoltzmannWalker"), "simulated participants, noisily rational (BoltzmannWalker)", True
    ),
    Player("planner", _walking("PlannerWalker"), "simulated participants who plan a few steps (PlannerWalker)", True),
    Player("cloned", _walking("ClonedWalker"), "simulated participants cloned from recorded play (ClonedWalker)", True),
)
_TABLE: Final = (
    Player("scripted", _scripted_hand, "a scripted hand: plain minimum jerk on shortest paths, without noise"),
    Player("reach", _reaching, "simulated participants with bows, noise and differences (ReachModel)", True),
)

PLAYERS: Final[Mapping[str, Mapping[str, Player]]] = {
    "overcooked": {player.name: player for player in _KITCHEN},
    "tabletop": {player.name: player for player in _TABLE},
}
"""The players of each domain by name."""


def find_player(domain: str, player: str | Policy | type) -> Player:
    """The player that a name or an object means.

    Args:
        domain: A key of :data:`ENVIRONMENTS`.
        player: A name of :data:`PLAYERS`; ``"module:Name"``; a policy, which plays all episodes; or a class (or the
            name of one), which is called with ``(env, rng)`` for each participant and makes a policy.

    Raises:
        ValueError: No such player, or it cannot be imported.
        TypeError: Something that cannot be called.
    """
    known = PLAYERS[domain]
    if isinstance(player, str):
        if player in known:
            return known[player]
        if ":" not in player:
            raise ValueError(
                f"no player {player!r} in {domain}; there are {', '.join(known)}, or a policy as 'module:Name'"
            )
        name, found = player, _imported(player)
    else:
        found, name = player, target_of(player)
    if not callable(found):
        raise TypeError(
            "a player is a name, 'module:Name', a policy called with (observation, info), or a class made with (env, "
            f"rng); got {shown(found)}"
        )
    if isinstance(found, type):
        return Player(name, found, f"the policy {name}")
    return Player(name, lambda env, rng: found, f"the policy {name}")


def _imported(target: str) -> Any:
    try:
        return import_target(target)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"player {target!r} cannot be imported: {error}") from error


def make_policy(player: Player, env: Any, rng: np.random.Generator) -> Policy:
    """One participant's policy.

    Raises:
        RuntimeError: A class that cannot be made with ``(env, rng)``.
        TypeError: What it makes cannot be called.
    """
    try:
        policy = player.make(env, rng)
    except Exception as error:  # users' code may raise anything
        raise RuntimeError(
            f"player {player.name!r} cannot be made with (env, rng): {type(error).__name__}: {error}"
        ) from error
    if not callable(policy):
        raise TypeError(f"player {player.name!r} must make a policy that can be called, got {shown(policy)}")
    return policy
