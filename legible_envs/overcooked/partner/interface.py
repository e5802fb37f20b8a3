"""The inputs and answers of partners in the kitchen: any object with these methods can take part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import AT_PLAYERS, Kitchen, Vector

if TYPE_CHECKING:
    from legible_envs.overcooked.game.rules import GameRules
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["PARTNER", "PERSON", "TICK", "Command", "Partner", "Senses"]

PERSON: Final = 0
"""Number of the player that the agent of the environment is."""
PARTNER: Final = 1
"""Number of the player that the partner is."""
TICK: Final = 0.15
"""Seconds that a step counts as in measures, as in ``env.unwrapped.trajectories()``."""


@dataclass(frozen=True, slots=True, eq=False)
class Senses:
    """All that a partner knows when it decides. Arrays are copies; cells in ``state`` are flat, ``row * width + col``.

    A *reach* is a trajectory as :mod:`legible_envs.overcooked.trajectories` defines it: it begins when the person
    empties the hands at a pot or serving station, and ends when an ingredient or dish station fills them.

    Attributes:
        time: Seconds since the episode began.
        layout: The kitchen.
        state: The game; see :mod:`legible_envs.overcooked.game.vectors`.
        kitchen: See there.
        rules: See there.
        reach: ``(k, 2)`` row and column of the person since the reach began, oldest first, consecutive repeats left
            out; ``k = 0`` where there is no reach.
        times: ``(k,)`` seconds since the episode began when the person came to each of them.
        reach_number: How many reaches have begun; a change tells that ``reach`` is another one.
        start: Station where the reach began, None where there is no reach.
        goals: Ingredient and dish stations that the person may validly go for now and can get to; empty where there is
            no reach.
        person_goals: ``(H*W,)`` all cells that the person may validly go for, with empty hands or full ones.
        partner_goals: ``(H*W,)`` all cells that the partner may validly go for.
        person_action: The person's last action; None before the first.
        look: Makes the partner's own ``(observation, info)``, as an agent in its place would get them.
    """

    time: float
    layout: OvercookedLayout
    state: Vector
    kitchen: Kitchen
    rules: Vector
    reach: npt.NDArray[np.int64]
    times: npt.NDArray[np.float64]
    reach_number: int
    start: str | None
    goals: tuple[str, ...]
    person_goals: npt.NDArray[np.bool_]
    partner_goals: npt.NDArray[np.bool_]
    person_action: int | None
    look: Callable[[], tuple[Any, dict[str, Any]]]

    def player(self, number: int) -> tuple[int, int, int]:
        """A player's cell, facing and item held; :data:`PERSON` or :data:`PARTNER`."""
        at = AT_PLAYERS + 3 * number
        cell, facing, held = self.state[at : at + 3].tolist()
        return cell, facing, held


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """A partner's answer for one tick.

    Attributes:
        action: 0 N, 1 S, 2 E, 3 W, 4 STAY, 5 INTERACT.
        target: Name of the station or counter that it goes for; None while it is idle.
        belief: ``{station: probability}`` of the person's present reach; None where there is no belief.
        predicted: The station it is sure the person goes for; None where it is not sure.
        state: What it is doing, in a word.
    """

    action: int
    target: str | None = None
    belief: Mapping[str, float] | None = None
    predicted: str | None = None
    state: str = "play"


class Partner(Protocol):
    """A second player."""

    def reset(self, layout: OvercookedLayout, rules: GameRules, rng: np.random.Generator) -> None:
        """Begin an episode in a kitchen; all randomness comes from ``rng``."""

    def step(self, senses: Senses) -> Command | int:
        """What to do in this tick; a plain action says nothing else."""
        ...
