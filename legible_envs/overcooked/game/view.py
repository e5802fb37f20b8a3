"""A snapshot of a running game in words, for drawing and for users: the meaning of the arrays of the dynamics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.recipes import Recipe

__all__ = ["GameView", "Item", "PlayerView", "PotView"]


@dataclass(frozen=True, slots=True)
class Item:
    """Something to hold or put down.

    Attributes:
        kind: An ingredient, ``"dish"`` (empty) or ``"soup"`` (a dish of soup).
        contents: Ingredients of a soup.
    """

    kind: str
    contents: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlayerView:
    """One player.

    Attributes:
        cell: The cell stood on.
        facing: As an action: 0 N, 1 S, 2 E, 3 W.
        held: The item held.
        is_robot: Whether it is a robot.
    """

    cell: Cell
    facing: int
    held: Item | None = None
    is_robot: bool = False


@dataclass(frozen=True, slots=True)
class PotView:
    """One pot: ingredients so far, ticks cooked, ticks needed, and whether the soup can be taken."""

    contents: tuple[str, ...] = ()
    ticks: int = 0
    cook_time: int = 20
    is_cooking: bool = False
    is_ready: bool = False


@dataclass(frozen=True, slots=True)
class GameView:
    """Everything a drawing of the game shows; cells are ``(row, col)``."""

    layout: OvercookedLayout
    players: tuple[PlayerView, ...] = ()
    counters: Mapping[Cell, Item] = field(default_factory=dict)
    pots: Mapping[Cell, PotView] = field(default_factory=dict)
    delivered: tuple[Recipe, ...] = ()
    orders: tuple[Recipe, ...] = ()
    steps: int = 0
    crossings: int = 0
