from .design.workspace import OvercookedWorkspace
from .layout import OvercookedLayout
from .learners import as_sb3
from .recipes import PAPER_SOUPS, soup_task
from .scoring.scorer import OvercookedScorer

__all__ = [
    "PAPER_SOUPS",
    "OvercookedLayout",
    "OvercookedScorer",
    "OvercookedWorkspace",
    "as_sb3",
    "soup_task",
]
