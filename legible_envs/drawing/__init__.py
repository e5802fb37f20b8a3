"""Shared by drawings of kitchens and of tables: paper, titles, sheets of pictures, and a window to show them in."""

from legible_envs.drawing.canvas import Image, load_pygame
from legible_envs.drawing.palette import HEAT, PAGE
from legible_envs.drawing.sheets import draw_side_by_side, save_png
from legible_envs.drawing.window import Window

__all__ = ["HEAT", "PAGE", "Image", "Window", "draw_side_by_side", "load_pygame", "save_png"]
