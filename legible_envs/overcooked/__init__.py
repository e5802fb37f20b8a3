"""The kitchen: layouts, the workspace of their design, the playable game, and people in it."""

from typing import TYPE_CHECKING

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.recipes import PAPER_SOUPS, soup_task

if TYPE_CHECKING:
    from legible_envs.overcooked.workspace import OvercookedWorkspace

__all__ = ["PAPER_SOUPS", "OvercookedLayout", "OvercookedWorkspace", "soup_task"]


def __getattr__(name: str) -> object:
    # The workspace needs numba; the package must import without it.
    if name == "OvercookedWorkspace":
        from legible_envs.overcooked.workspace import OvercookedWorkspace

        return OvercookedWorkspace
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
