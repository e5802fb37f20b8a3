"""A round in play: what keys and the pointer do to the game, and the rows that come of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.games.pointer import PointerTrack
from benchmarks.study.games.tabletop import RATE, TableGame
from benchmarks.study.server.refusal import Refused

if TYPE_CHECKING:
    from benchmarks.study.games.base import Game
    from benchmarks.study.server import protocol as p

__all__ = ["Play"]

_AHEAD: Final = 10.0
"""Seconds that the page's clock may be ahead of the server's before samples are left out."""
_SAMPLES: Final = 1000
"""Samples of the pointer that are kept of a second of play; no mouse reports more often."""


class Play:
    """A game, and how far the page has played it.

    Args:
        game: Where the database has it.
        visit: Number of the visit it belongs to.
        samples: Of the pointer, that the visit has so far.
        now: Seconds since 1970.
        belief: Whether participants see the predictor's belief.

    Attributes:
        track: The pointer's way; None in kitchens.
    """

    def __init__(self, game: Game, visit: int, *, samples: int, now: float, belief: bool = False) -> None:
        self.game = game
        self.visit = visit
        self.samples = samples
        self.belief = belief
        self.track: PointerTrack | None = None
        self._begun = now
        self.start_clock(now)

    def start_clock(self, now: float) -> None:
        """The page's clock goes on from where the table has been played: after a reload or a lost connection."""
        if isinstance(self.game, TableGame):
            self.track = PointerTrack(self.game.env.game.hand, self.game.steps)
            self._begun = now - self.track.time / 1000.0

    def step(self, message: p.Step, now: float) -> list[tuple[Any, ...]]:
        """Take a step by a key.

        Returns:
            The row of the step, as :func:`~benchmarks.study.store.rows.step_rows` takes it.

        Raises:
            Refused: It does not follow on the present state, or is no action.
        """
        if self.track is not None:
            raise Refused("a table is played by the pointer")
        if self.game.is_over:
            raise Refused("the round is over")
        if message.n != self.game.steps:
            raise Refused("the game is at another step", state=self.game.state(self.belief))
        try:
            action = self.game.read_action(message.action)
        except ValueError as error:
            raise Refused(str(error)) from error
        row = (self.game.steps, action, self.game.digest(), message.down, message.shown, now)
        self.game.step(action)
        return [row]

    def move(
        self, message: p.Pointer, now: float, speed: float
    ) -> tuple[list[tuple[Any, ...]], list[tuple[float, float, float]]]:
        """Move the hand along samples of the pointer, no faster than time passes.

        Args:
            message: The samples.
            now: Seconds since 1970.
            speed: How much faster than real time the pointer's clock may go.

        Returns:
            Rows of steps, and the samples that count.

        Raises:
            Refused: A kitchen is not played by the pointer.
        """
        if self.track is None:
            raise Refused("a kitchen is played by keys")
        if self.game.is_over:
            raise Refused("the round is over")
        passed = max(0.0, now - self._begun) * speed
        horizon = 1000.0 * (passed + _AHEAD)
        room = max(0, int((passed + _AHEAD) * _SAMPLES) - self.samples)
        samples = self.track.add([sample for sample in message.samples if 0 <= sample[0] <= horizon][:room])
        allowed = int(passed * RATE) + RATE - self.game.steps
        taken = []
        for _ in range(min(self.track.ready(), max(0, allowed))):
            action = self.game.action_to(*self.track.take())  # type: ignore[attr-defined]
            taken.append((self.game.steps, action, self.game.digest(), self.track.time, message.shown, now))
            self.game.step(action)
            if self.game.is_over:
                break
        return taken, samples

    def state(self) -> dict[str, Any]:
        """The message ``state``."""
        found: dict[str, Any] = {"type": "state", "state": self.game.state(self.belief)}
        if self.track is not None:
            found["t"] = self.track.time
        return found
