"""The strip above a game: orders as recipe tickets, steps taken, and obstacles crossed."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from typing import Final

import numpy as np

from legible_envs.drawing.canvas import Canvas, Image, Sprite, mix, paste, rgb, text_sprite
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.layout import INGREDIENTS
from legible_envs.overcooked.recipes import Recipe
from legible_envs.overcooked.rendering.actors import draw_tick
from legible_envs.overcooked.rendering.food import draw_pieces
from legible_envs.overcooked.rendering.palette import PALETTE

__all__ = ["draw_hud", "hud_height"]

_TICKET: Final = 0.9  # width of a ticket, in strip heights


def hud_height(tile: int) -> int:
    """Pixels of the strip above a game drawn with this tile size."""
    return max(22, round(tile * 0.9))


def draw_hud(view: GameView, width: int, tile: int) -> Image:
    """The strip for a game, ``(hud_height(tile), width, 3)`` uint8; what has no room is shortened, then left out."""
    height = hud_height(tile)
    strip = np.empty((height, width, 3), np.uint8)
    strip[...] = rgb(PALETTE["hud"])
    strip[-max(1, height // 16) :] = rgb(mix(PALETTE["hud"], "#000000", 0.35))
    pad = max(2, height // 8)
    size = max(11, round(height * 0.5))
    right = width - pad
    counts = [("step ", view.steps, PALETTE["hud_text"])]
    if view.crossings:
        counts.append(("crossed ", view.crossings, PALETTE["warning"]))
    tickets = tickets_of(view)
    needed = pad + len(tickets) * (round(_TICKET * height) + pad)
    for word, count, colour in counts:
        # Digit by digit: every number would be another text to draw, and a jumpy one to look at.
        parts = [text_sprite(part, size, colour) for part in (word, *str(count))]
        if right - _width_of(parts) - 2 * pad < needed:
            del parts[0]
        if right - _width_of(parts) < pad:
            break
        right -= _width_of(parts)
        left = right
        for part in parts:
            paste(strip, part, (height - part.colour.shape[0]) // 2 + 1, left)
            left += part.colour.shape[1]
        right -= 2 * pad
    _lay_tickets(strip, tickets, pad, right, size)
    return strip


def _width_of(parts: list[Sprite]) -> int:
    return sum(part.colour.shape[1] for part in parts)


def tickets_of(view: GameView) -> list[tuple[Recipe, bool]]:
    """All orders with whether they were delivered, in an order that does not change as the game goes on."""
    done = Counter(view.delivered)
    everything = sorted((*view.delivered, *view.orders), key=lambda recipe: [INGREDIENTS.index(i) for i in recipe])
    tickets = []
    for recipe in everything:
        tickets.append((recipe, done[recipe] > 0))
        done[recipe] -= 1
    return tickets


def _lay_tickets(strip: Image, tickets: list[tuple[Recipe, bool]], left: int, right: int, size: int) -> None:
    height = len(strip)
    step = round(_TICKET * height) + left
    done = sum(delivered for _, delivered in tickets)
    if done and left + step * len(tickets) > right + left:  # too many: delivered ones become a number
        sprite = text_sprite(f"{done}/{len(tickets)}", size, mix(PALETTE["ready"], "#ffffff", 0.45))
        tickets = [ticket for ticket in tickets if not ticket[1]]
        if left + sprite.colour.shape[1] <= right:
            paste(strip, sprite, (height - sprite.colour.shape[0]) // 2 + 1, left)
        left += sprite.colour.shape[1] + step - round(_TICKET * height)
    for recipe, delivered in tickets:
        if left + round(_TICKET * height) > right:
            break
        paste(strip, _ticket_sprite(recipe, delivered, height), 0, left)
        left += step


@lru_cache(maxsize=256)
def _ticket_sprite(recipe: Recipe, delivered: bool, height: int) -> Sprite:
    canvas = Canvas(height, wide=_TICKET)
    paper = PALETTE["paper"] if not delivered else mix(PALETTE["paper"], PALETTE["ready"], 0.42)
    canvas.rectangle(0.03, 0.1, 0.84, 0.84, "#000000", 0.3, radius=0.08)
    canvas.rectangle(0.03, 0.07, 0.84, 0.84, paper, radius=0.08)
    canvas.rectangle(0.33, 0.02, 0.24, 0.1, PALETTE["steel_dark"], radius=0.03)
    canvas.rectangle(0.35, 0.02, 0.2, 0.04, PALETTE["steel"], radius=0.02)
    draw_pieces(canvas, recipe, 0.45, 0.52, 0.36)
    if delivered:
        canvas.rectangle(0.03, 0.07, 0.84, 0.84, paper, 0.45, radius=0.08)
        draw_tick(canvas, 0.66, 0.7, 0.23)
    return canvas.sprite()
