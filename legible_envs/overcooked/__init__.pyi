from .design.workspace import OvercookedWorkspace
from .layout import OvercookedLayout
from .recipes import PAPER_SOUPS, soup_task

__all__ = [
    "PAPER_SOUPS",
    "OvercookedLayout",
    "OvercookedWorkspace",
    "soup_task",
]
