"""One round of a game: stepped by the server, drawn by the page, replayed by the analysis; the same object for all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Game"]


class Game(Protocol):
    """A round in play. Its state is a function of its settings, seed and actions alone.

    Attributes:
        env: The Gymnasium environment that plays it.
        steps: Steps taken.
        is_over: Whether the task is done, or ``max_steps`` are taken, or the reaches that are wanted are made.
    """

    env: Any
    steps: int

    @property
    def is_over(self) -> bool: ...  # noqa: D102  (see above)

    def read_action(self, value: object) -> Any:
        """An action as it is stored and given to :meth:`step`, from what the page sent.

        Kitchens: an int 0..5. Tables: ``[vx, vy]``, two float32 values as floats.

        Raises:
            ValueError: It is none.
        """

    def step(self, action: Any) -> None:
        """Take a step.

        Raises:
            ValueError: The round is over.
        """

    def digest(self) -> str:
        """16 hexadecimal digits that identify the present state (BLAKE2b of everything that decides what follows)."""

    def scene(self) -> dict[str, Any]:
        """What does not change in the round, for the page to draw: layout, task, soups; plain JSON data."""

    def state(self, belief: bool = False) -> dict[str, Any]:
        """What the page draws now, plain JSON data; see the domains' modules.

        Args:
            belief: Whether to tell what the predictor believes.
        """

    def outcome(self) -> dict[str, Any]:
        """What the round came to: ``steps, finished, done`` (soups or objects), ``crossings``, and the domain's own."""

    def trajectories(self, *, participant: str, condition: str, seconds: Any = None) -> list[Trajectory]:
        """The participant's trajectories so far."""

    def close(self) -> None:
        """Let go of the environment."""
