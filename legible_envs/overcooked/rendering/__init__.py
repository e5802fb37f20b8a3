"""Pictures of kitchens and games: drawn off screen, the same pixels every time.

Nothing here opens a window or needs a display; pygame is imported when the first picture is drawn.

Example:
    >>> from legible_envs.overcooked import OvercookedLayout
    >>> kitchen = OvercookedLayout.from_ascii('''
    ... XPXXX
    ... O   T
    ... X V X
    ... D  1X
    ... XXSXX''')
    >>> draw_layout(kitchen, tile=32).shape
    (160, 160, 3)
"""

from legible_envs.drawing.canvas import load_pygame
from legible_envs.drawing.sheets import draw_side_by_side, save_png
from legible_envs.overcooked.rendering.ambiguity import draw_ambiguity
from legible_envs.overcooked.rendering.board import draw_game, draw_layout
from legible_envs.overcooked.rendering.hud import hud_height
from legible_envs.overcooked.rendering.palette import HEAT, PALETTE, PLAYER_COLOURS

__all__ = [
    "HEAT",
    "PALETTE",
    "PLAYER_COLOURS",
    "draw_ambiguity",
    "draw_game",
    "draw_layout",
    "draw_side_by_side",
    "hud_height",
    "load_pygame",
    "save_png",
]
