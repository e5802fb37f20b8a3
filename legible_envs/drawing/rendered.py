"""Pictures of every environment here: handed out, or shown in a window."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import choice

__all__ = ["Rendered", "Windowed"]


class Windowed:
    """Opens a window with the first picture shown."""

    metadata: dict[str, Any]
    render_mode: str | None
    _window_title = ""
    _window: Any = None

    def _set_render_mode(self, mode: str | None) -> None:
        """Take the render mode.

        Raises:
            ValueError: The environment has no such mode.
        """
        self.render_mode = (
            None if mode is None else choice("render_mode", mode, self.metadata["render_modes"], also="None")
        )

    def _show(self, picture: npt.NDArray[np.uint8]) -> None:
        if self._window is None:
            from legible_envs.drawing.window import Window

            self._window = Window(self._window_title, fps=self.metadata["render_fps"])
        self._window.show(picture)

    def _close_window(self) -> None:
        if self._window is not None:
            self._window.close()
            self._window = None


class Rendered(Windowed, ABC):
    """``render`` and ``close`` of an environment that can draw itself."""

    def render(self) -> Any:
        """Show the scene, as ``render_mode`` says.

        Returns:
            A picture ``(H, W, 3)`` uint8 (``"rgb_array"``), or None: ``"human"`` shows it in a window.
        """
        if self.render_mode is None:
            spec = self.spec  # type: ignore[attr-defined]
            name = spec.id if spec is not None else type(self).__name__
            gym.logger.warn(
                "You are calling render method without specifying any render mode. You can specify the render_mode at "
                f'initialization, e.g. gym.make("{name}", render_mode="rgb_array")'
            )
            return None
        picture = self._picture()
        return picture if self.render_mode == "rgb_array" else self._show(picture)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._close_window()

    @abstractmethod
    def _picture(self) -> npt.NDArray[np.uint8]:
        """``(H, W, 3)`` the scene."""
