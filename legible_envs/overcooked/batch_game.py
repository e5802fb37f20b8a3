"""One game of a batch, looked at as if it were an environment of its own."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.game.snapshot import to_text
from legible_envs.overcooked.game.vectors import Kitchen, Vector
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["GameOfBatch", "Games"]


class Games(Protocol):
    """What a batch tells of each of its games; :class:`.OvercookedVectorEnv` is one."""

    single_action_space: Any
    single_observation_space: Any
    render_mode: str | None
    num_players: int

    def layout(self, index: int) -> OvercookedLayout:
        """The kitchen of a game."""

    def generator(self, index: int) -> tuple[np.random.Generator, int]:
        """The random generator of a game and its seed."""

    def goals(self, index: int) -> tuple[str, ...]:
        """Names of the first player's valid goals in a game."""

    def goals_of(self, index: int, player: int) -> tuple[str, ...]:
        """Names of a player's valid goals in a game."""

    def action_masks(self, index: int) -> npt.NDArray[np.bool_]:
        """``(6,)`` actions that do something in a game; with several players ``(num_players, 6)``."""

    def view(self, index: int) -> GameView:
        """A snapshot of a game."""

    def arrays(self, index: int) -> tuple[Vector, Kitchen, Vector]:
        """State, kitchen and rules of a game; not copies."""


class GameOfBatch:
    """One game of a batch, with the attributes of an :class:`~legible_envs.overcooked.env.OvercookedEnv`.

    Args:
        envs: The batch.
        index: Number of the game.
    """

    get_keys_to_action = staticmethod(OvercookedEnv.get_keys_to_action)

    def __init__(self, envs: Games, index: int) -> None:
        self._envs = envs
        self._index = index

    @property
    def layout(self) -> OvercookedLayout:
        """The kitchen: the one set for the next reset, else the one being played in."""
        return self._envs.layout(self._index)

    @property
    def np_random(self) -> np.random.Generator:
        """The game's random generator."""
        return self._envs.generator(self._index)[0]

    @property
    def np_random_seed(self) -> int:
        """The seed of the game's random generator."""
        return self._envs.generator(self._index)[1]

    @property
    def action_space(self) -> Any:
        """The space of its actions."""
        return self._envs.single_action_space

    @property
    def observation_space(self) -> Any:
        """The space of its observations."""
        return self._envs.single_observation_space

    @property
    def goals(self) -> tuple[str, ...]:
        """Names of the first player's valid goals, in reading order."""
        return self._envs.goals(self._index)

    def goals_of(self, player: int) -> tuple[str, ...]:
        """Names of a player's valid goals, in reading order."""
        return self._envs.goals_of(self._index, player)

    @property
    def num_players(self) -> int:
        """Number of players."""
        return self._envs.num_players

    @property
    def goal_names(self) -> npt.NDArray[np.str_]:
        """``(H, W)`` name of each cell as a goal; see :attr:`.OvercookedEnv.goal_names`."""
        layout = self._envs.view(self._index).layout
        return np.array(layout.goal_names).reshape(layout.shape)

    def action_masks(self) -> npt.NDArray[np.bool_]:
        """``(6,)`` actions that do something now, staying always; with several players ``(num_players, 6)``."""
        return self._envs.action_masks(self._index)

    def view(self) -> GameView:
        """A snapshot of the game in words, for drawing."""
        return self._envs.view(self._index)

    def arrays(self) -> tuple[Vector, Kitchen, Vector]:
        """The game's ``(state, kitchen, rules)`` as described in ``vectors``; not copies, to be read only."""
        return self._envs.arrays(self._index)

    def render(self) -> Any:
        """The game's picture or drawing, as ``render_mode`` says; None with ``"human"``, where one window shows all."""
        if self._envs.render_mode == "ansi":
            return to_text(self.view())
        if self._envs.render_mode != "rgb_array":
            return None
        from legible_envs.overcooked.rendering import draw_game

        return draw_game(self.view())

    def __getattr__(self, name: str) -> Any:
        if name in ("settings", "shape", "render_mode", "metadata", "spec"):
            return getattr(self._envs, name)
        raise AttributeError(f"the games of a batch have no attribute {name!r}")
