"""Recorded two-player games as immutable arrays, whatever file they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.layout import OvercookedLayout

if TYPE_CHECKING:
    from legible_envs.overcooked.game.replay import GameArrays

__all__ = ["PER_STATE", "PER_TICK", "TICK_SECONDS", "Progress", "RecordedGame", "RecordingsError", "Rules"]

Progress = Callable[[str, int, int], None]
"""Told (what is being done, done, of how much)."""

Rules = Literal["overcooked-ai-2019", "overcooked-ai-2020"]

PER_STATE: Final = ("cells", "facing", "held", "counters", "pots", "seconds")
PER_TICK: Final = ("actions", "rewards")
TICK_SECONDS: Final = 0.15
"""Length of a tick in the published experiments."""


class RecordingsError(RuntimeError):
    """The recorded games cannot be found, downloaded, trusted or read."""


@dataclass(frozen=True, eq=False)
class RecordedGame:
    """One recorded two-player game of ``T`` ticks: ``T + 1`` states and the ``T`` joint actions between them.

    All arrays are read-only. How long a soup cooked before it was taken out is not kept: nothing depends on it.

    Attributes:
        layout_name: Name of the kitchen in the recordings, such as ``"cramped_room"``.
        layout: The kitchen, with ``K`` pots in reading order.
        pair: Who played: the session and the pair's number in it, ``"run-1/2"``; or the name of the trial.
        split: ``"train"`` or ``"test"``, as published; or empty.
        cells: ``(T+1, 2, 2)`` row and column of each player.
        facing: ``(T+1, 2)`` 0 N, 1 S, 2 E, 3 W.
        held: ``(T+1, 2)`` 0 nothing, 1 tomato, 2 onion, 3 cabbage, 4 fish, 5 dish, 6 soup.
        counters: ``(T+1, H, W)`` item on each counter, coded like ``held``.
        pots: ``(T+1, K, 5)`` number of tomatoes, onions, cabbages, fish; ticks cooked.
        actions: ``(T, 2)`` 0 N, 1 S, 2 E, 3 W, 4 STAY, 5 INTERACT.
        rewards: ``(T,)`` 20 per delivery in 2019; by recipe in 2020.
        seconds: ``(T+1,)`` time since the game began.
        rules: Which dynamics the file speaks of. In 2019 a pot takes three of one ingredient and cooks when it is full;
            in 2020 it takes up to three of any, and cooks when a player says so. See :func:`.check_replay`.
        cook_times: ``(T+1, K)`` ticks that the soup in each pot takes, -1 where the file does not say; None: 20.
        participants: Names of the players; empty: see :meth:`participant`.
        humans: For each player whether it is a person; empty: all are.
    """

    layout_name: str
    layout: OvercookedLayout
    pair: str
    split: str
    cells: npt.NDArray[np.int16]
    facing: npt.NDArray[np.int8]
    held: npt.NDArray[np.int8]
    counters: npt.NDArray[np.int8]
    pots: npt.NDArray[np.int16]
    actions: npt.NDArray[np.int8]
    rewards: npt.NDArray[np.float32]
    seconds: npt.NDArray[np.float32]
    rules: Rules = "overcooked-ai-2019"
    cook_times: npt.NDArray[np.int16] | None = None
    participants: tuple[str, ...] = ()
    humans: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        ticks = len(self.actions)
        for name in PER_STATE + PER_TICK:
            array = getattr(self, name)
            expected = ticks + (name in PER_STATE)
            if len(array) != expected:
                raise ValueError(f"`{name}` has {len(array)} rows; {ticks} ticks need {expected}")
            array = array.view()
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def num_ticks(self) -> int:
        """Number of ticks (transitions)."""
        return len(self.actions)

    @property
    def num_players(self) -> int:
        """Number of players."""
        return int(self.held.shape[1])

    def participant(self, player: int) -> str:
        """Name of a player: as in the file, or the pair and the player's place in it, ``"run-1/2/0"``."""
        if self.participants:
            return self.participants[player]
        return f"{self.pair}/{player}"

    @property
    def people(self) -> list[int]:
        """The players that are persons."""
        return [player for player in range(self.num_players) if not self.humans or self.humans[player]]

    def states(self) -> GameArrays:
        """All ``T + 1`` states in the form that :func:`.predict_transitions` takes."""
        from legible_envs.overcooked.game.replay import GameArrays

        return GameArrays(self.cells, self.facing, self.held, self.counters, self.pots)
