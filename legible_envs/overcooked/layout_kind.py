"""How kitchens are written in trajectory files: as their drawings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from legible_envs.layout_kinds import LayoutKind
from legible_envs.overcooked.kitchen_file import ENTRIES, KitchenFile
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.support.literals import read_literal

__all__ = ["KITCHEN", "is_kitchen"]


def is_kitchen(text: str) -> bool:
    """Whether a text can be meant as a kitchen: no mapping, or one that holds a grid or JaxMARL's numbered cells.

    What is no mapping is taken for a drawing or its rows, whose errors name row and column.
    """
    if not text.lstrip().startswith("{"):
        return True
    try:
        data = read_literal(text)
    except ValueError:
        return any(quote + entry + quote in text for entry in ENTRIES for quote in "\"'")
    return isinstance(data, Mapping) and not ENTRIES.isdisjoint(data)


def _from_text(text: str) -> OvercookedLayout:
    return KitchenFile.from_text(text, orders=False).layout


def _to_line(layout: OvercookedLayout) -> str:
    return "/".join(layout.to_ascii().splitlines())


def _from_line(line: str) -> OvercookedLayout:
    return _from_text(line if line.lstrip().startswith(("{", "[")) else "\n".join(line.split("/")))


KITCHEN: Final = LayoutKind(
    name="overcooked",
    layout=OvercookedLayout,
    to_text=OvercookedLayout.to_ascii,
    from_text=_from_text,
    to_line=_to_line,
    from_line=_from_line,
    # Files that name no kind are as old as kitchens.
    recognises=is_kitchen,
    schema=1,
)
