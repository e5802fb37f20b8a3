"""A window that shows pictures; the only file that opens one."""

from __future__ import annotations

import os
import sys
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.canvas import load_pygame

__all__ = ["Window", "open_screen", "room_for_a_window", "scale_to_fit"]

_UNSEEN: Final = ("dummy", "offscreen", "evdev")
"""SDL's drivers without a window; it falls back to them in silence where there is no screen."""

_NO_SCREEN: Final = (
    "cannot open a window: there is no screen here. On a remote machine forward one (ssh -X) or use a virtual one; "
    "SDL_VIDEODRIVER=dummy draws where nobody sees it"
)

_SHARE: Final = 0.85
"""How much of the screen's width and height a window may take: the rest is for its frame and the system's bars."""


class Window:
    """A window for pictures, as large as the first one shown in it, or enlarged to be seen well on this screen.

    Args:
        title: Its title.
        fps: Pictures per second; :meth:`show` waits accordingly.
    """

    def __init__(self, title: str, fps: int) -> None:
        self.title = title
        self.fps = fps
        self._screen: Any = None
        self._clock: Any = None
        self._shown: tuple[int, int] | None = None

    def show(self, picture: npt.NDArray[np.uint8]) -> None:
        """Show a picture ``(H, W, 3)``.

        Raises:
            RuntimeError: There is no screen to open a window on.
        """
        size = (picture.shape[1], picture.shape[0])
        if self._screen is None or self._shown != size:
            pygame = open_screen()
            scale = scale_to_fit(size, room_for_a_window())
            pygame.display.set_caption(self.title)
            self._screen = pygame.display.set_mode((max(1, round(scale * size[0])), max(1, round(scale * size[1]))))
            self._clock = pygame.time.Clock()
            self._shown = size
        pygame = load_pygame()
        surface = pygame.surfarray.make_surface(np.transpose(picture, (1, 0, 2)))
        room = self._screen.get_size()
        if room != size:  # enlarged pixels stay squares, a picture that shrinks is averaged
            resize = pygame.transform.scale if room > size else pygame.transform.smoothscale
            surface = resize(surface, room)
        self._screen.blit(surface, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self.fps)

    def close(self) -> None:
        """Close the window."""
        if self._screen is not None:
            load_pygame().display.quit()
            self._screen = self._clock = self._shown = None

    def __getstate__(self) -> dict[str, Any]:
        # A copied or pickled environment opens its own window.
        return {"title": self.title, "fps": self.fps, "_screen": None, "_clock": None, "_shown": None}


def open_screen() -> Any:
    """Pygame with a screen that people can see, or with the driver that ``SDL_VIDEODRIVER`` names.

    Raises:
        RuntimeError: There is no screen, so that a window would be one that nobody can see or close.
    """
    asked = os.environ.get("SDL_VIDEODRIVER") or os.environ.get("SDL_VIDEO_DRIVER")
    if not asked and sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RuntimeError(_NO_SCREEN)  # SDL would look for one and complain on standard error
    pygame = load_pygame()
    try:
        pygame.display.init()
    except pygame.error as error:
        raise RuntimeError(f"cannot open a window: {error}") from error
    if not asked and pygame.display.get_driver() in _UNSEEN:
        pygame.display.quit()
        raise RuntimeError(_NO_SCREEN)
    return pygame


def room_for_a_window() -> tuple[int, int]:
    """Width and height, in pixels, that a window may take on the first screen; after :func:`open_screen`."""
    width, height = load_pygame().display.get_desktop_sizes()[0]
    return int(_SHARE * width), int(_SHARE * height)


def scale_to_fit(size: tuple[int, int], room: tuple[int, int]) -> float:
    """By how much to enlarge a picture: a whole number, so that its pixels stay alike; below 1 for what does not fit.

    Args:
        size: Width and height of the picture.
        room: Width and height of the place for it.

    Example:
        >>> [scale_to_fit(size, (1632, 918)) for size in ((240, 283), (960, 640), (3264, 1836))]
        [3, 1, 0.5]
    """
    fits = min(room[0] / size[0], room[1] / size[1])
    return int(fits) if fits >= 1 else fits
