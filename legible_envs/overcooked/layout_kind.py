"""How kitchens are written in trajectory files: as their drawings."""

from __future__ import annotations

from typing import Final

from legible_envs.layout_kinds import LayoutKind
from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["KITCHEN"]


def _to_line(layout: OvercookedLayout) -> str:
    return "/".join(layout.to_ascii().splitlines())


def _from_line(line: str) -> OvercookedLayout:
    return OvercookedLayout.from_ascii("\n".join(line.split("/")))


KITCHEN: Final = LayoutKind(
    name="overcooked",
    layout=OvercookedLayout,
    to_text=OvercookedLayout.to_ascii,
    from_text=OvercookedLayout.from_ascii,
    to_line=_to_line,
    from_line=_from_line,
    # Files that name no kind are as old as kitchens: what is not JSON is a drawing, and its errors name row and column.
    recognises=lambda line: not line.startswith("{"),
    schema=1,
)
