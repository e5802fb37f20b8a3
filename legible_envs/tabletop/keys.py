"""Keys that move the hand, for ``gymnasium.utils.play``."""

from __future__ import annotations

import math
from itertools import product
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["HAND_SPEED", "keys_to_action"]

HAND_SPEED: Final = 0.5
"""How fast a key moves the hand, m/s: too fast to take anything, so that one takes by letting go."""

_SETS: Final = (
    {(0, 1): 1073741906, (0, -1): 1073741905, (1, 0): 1073741903, (-1, 0): 1073741904},  # arrows
    {(0, 1): ord("w"), (0, -1): ord("s"), (1, 0): ord("d"), (-1, 0): ord("a")},
)


def keys_to_action(max_speed: float) -> dict[tuple[int, ...], npt.NDArray[np.float32]]:
    """Arrows or W A S D, one or two at a time, and the action they stand for."""
    actions: dict[tuple[int, ...], npt.NDArray[np.float32]] = {}
    for keys in _SETS:
        for x, y in product((-1, 0, 1), repeat=2):
            pressed = [key for way, key in keys.items() if way in ((x, 0), (0, y)) and way != (0, 0)]
            if pressed:
                velocity = np.array([x, y]) / math.hypot(x, y) * min(HAND_SPEED / max_speed, 1.0)
                actions[tuple(sorted(pressed))] = velocity.astype(np.float32)
    return actions
