"""The strip above a table in use: time, objects placed, crossings, and the robot's state."""

from __future__ import annotations

from legible_envs.drawing.canvas import Image, Sprite, mix, paste, rgb, text_sprite
from legible_envs.drawing.sheets import fit_text
from legible_envs.tabletop.game.view import TableView
from legible_envs.tabletop.rendering.palette import TABLE

__all__ = ["draw_hud", "hud_height", "robot_words"]


def hud_height(width: int) -> int:
    """Pixels of the strip above a table drawn this wide."""
    return max(20, round(width * 0.052))


def draw_hud(view: TableView, strip: Image) -> None:
    """Fill the ``(hud_height(width), width, 3)`` strip; words without room are left out."""
    height, width = strip.shape[:2]
    strip[...] = rgb(TABLE["hud"])
    strip[-max(1, height // 16) :] = rgb(mix(TABLE["hud"], "#000000", 0.35))
    size, pad = max(11, round(height * 0.52)), max(4, height // 3)
    done = sum(status == "placed" for status in view.status)
    groups = [
        (*f"{max(view.time, 0.0):.1f}", " s"),
        ("placed ", *f"{done}", " of ", *f"{len(view.task.configuration) or len(view.status)}"),
    ]
    colours = [TABLE["hud_text"]] * 2
    if view.crossings:
        groups.append(("crossed ", *f"{view.crossings}"))
        colours.append(TABLE["warning"])
    left = pad
    for parts, colour in zip(groups, colours, strict=True):
        # Digit by digit: every number would be another text to draw, and a jumpy one to look at.
        words = [text_sprite(part, size, colour) for part in parts]
        if left + _width_of(words) + pad > width:
            return
        for word in words:
            paste(strip, word, (height - word.colour.shape[0]) // 2 + 1, left)
            left += word.colour.shape[1]
        left += 2 * pad
    text = robot_words(view)
    if text and width - left - pad > 4 * size:
        word = fit_text(text, size, mix(TABLE["robot"], "#ffffff", 0.62), width - left - pad)
        paste(strip, word, (height - word.colour.shape[0]) // 2 + 1, width - pad - word.colour.shape[1])


def robot_words(view: TableView) -> str:
    """The robot's state in a few words; empty where there is none."""
    if view.robot is None:
        return ""
    if view.robot_holding is not None:
        return f"robot carries {view.robot_holding}"
    if view.robot_target is not None:
        return f"robot goes for {view.robot_target}"
    return "robot waits" + (f" until {view.threshold:.0%} sure" if view.threshold is not None else "")


def _width_of(words: list[Sprite]) -> int:
    return sum(word.colour.shape[1] for word in words)
