"""Other partners than the robot: scripted and simulated players, a recorded one, and policies."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import STAY, Kitchen, Vector
from legible_envs.overcooked.humans.simulation import BoltzmannWalker, PlannerWalker
from legible_envs.overcooked.partner.interface import PARTNER, Command, Senses
from legible_envs.overcooked.policies import ScriptedPlayer, WalkingPlayer
from legible_envs.support.validation import as_array, shown

if TYPE_CHECKING:
    from legible_envs.overcooked.game.rules import GameRules
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["BoltzmannPartner", "PlannerPartner", "PolicyPartner", "RecordedPartner", "ScriptedPartner"]

Policy = Callable[[Any, dict[str, Any]], Any]


class _Seat:
    """What players read of an environment: the arrays of the game that the partner senses."""

    def __init__(self) -> None:
        self.senses: Senses | None = None

    @property
    def unwrapped(self) -> _Seat:
        return self

    def arrays(self) -> tuple[Vector, Kitchen, Vector]:
        assert self.senses is not None
        return self.senses.state, self.senses.kitchen, self.senses.rules


class ScriptedPartner:
    """A partner that plays as :class:`~legible_envs.overcooked.policies.ScriptedPlayer` does.

    Args:
        avoid_obstacles: Whether to walk round soft virtual obstacles.
    """

    def __init__(self, *, avoid_obstacles: bool = True) -> None:
        self.avoid_obstacles = avoid_obstacles
        self._seat = _Seat()
        self._player: ScriptedPlayer | None = None

    def reset(self, layout: OvercookedLayout, rules: GameRules, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._layout = layout
        self._player = self._sit_down(layout, rng)

    def _sit_down(self, layout: OvercookedLayout, rng: np.random.Generator) -> ScriptedPlayer:
        return ScriptedPlayer(self._seat, rng, avoid_obstacles=self.avoid_obstacles, player=PARTNER)

    def step(self, senses: Senses) -> Command:
        """The player's next action."""
        assert self._player is not None
        self._seat.senses = senses
        observation, info = senses.look()
        action = self._player(observation, info)
        goal = self._player.goal()
        target = None if goal is None else self._layout.goal_names[goal[0] * self._layout.shape[1] + goal[1]]
        return Command(action, target=target)


class BoltzmannPartner(ScriptedPartner):
    """A partner that walks as a noisily rational person, drawn anew for every episode.

    Args:
        **settings: Of :meth:`~legible_envs.overcooked.humans.simulation.BoltzmannWalker.draw`, such as
            ``rationality``, ``spread``, ``preference``, ``idle``.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__()
        self.settings = settings
        self._draw((3, 3), np.random.default_rng(0))  # settings that are wrong are refused at once

    def _draw(self, shape: tuple[int, int], rng: np.random.Generator) -> BoltzmannWalker | PlannerWalker:
        return BoltzmannWalker.draw(shape, rng, **self.settings)

    def _sit_down(self, layout: OvercookedLayout, rng: np.random.Generator) -> ScriptedPlayer:
        return WalkingPlayer(self._seat, self._draw(layout.shape, rng), rng, player=PARTNER)


class PlannerPartner(BoltzmannPartner):
    """A partner that walks as a person who looks only a few steps ahead, drawn anew for every episode.

    Args:
        **settings: Of :meth:`~legible_envs.overcooked.humans.simulation.PlannerWalker.draw`.
    """

    def _draw(self, shape: tuple[int, int], rng: np.random.Generator) -> BoltzmannWalker | PlannerWalker:
        return PlannerWalker.draw(shape, rng, **self.settings)


class RecordedPartner:
    """A partner that does what a recorded player did, tick by tick, whatever the person does; then it stays.

    Args:
        actions: ``(T,)`` actions 0..5, such as ``game.actions[:, 1]`` of a recorded game.

    Raises:
        ValueError: They are anything else.
    """

    def __init__(self, actions: npt.ArrayLike) -> None:
        listed = as_array(actions)
        whole = listed.ndim == 1 and listed.dtype.kind in "iuf" and bool((listed == np.floor(listed)).all())
        if not whole or (listed.size and not 0 <= listed.min() <= listed.max() <= 5):
            raise ValueError(f"`actions` of a recorded partner must be a list of actions 0..5, got {shown(actions)}")
        self.actions: list[int] = listed.astype(np.int64).tolist()
        self._tick = 0

    def reset(self, layout: OvercookedLayout, rules: GameRules, rng: np.random.Generator) -> None:
        """Begin the recording anew."""
        self._tick = 0

    def step(self, senses: Senses) -> int:
        """The next recorded action."""
        self._tick += 1
        return self.actions[self._tick - 1] if self._tick <= len(self.actions) else STAY


class PolicyPartner:
    """A partner that a policy plays: it is asked with the partner's own observation and info.

    Args:
        policy: Called with ``(observation, info)``, returns an action 0..5.
    """

    def __init__(self, policy: Policy) -> None:
        self.policy = policy

    def reset(self, layout: OvercookedLayout, rules: GameRules, rng: np.random.Generator) -> None:
        """Begin an episode; a policy that remembers something may have a method ``reset()``."""
        if callable(reset := getattr(self.policy, "reset", None)):
            reset()

    def step(self, senses: Senses) -> Any:
        """The policy's action."""
        return self.policy(*senses.look())
