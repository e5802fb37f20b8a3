from .design.workspace import OvercookedWorkspace
from .layout import OvercookedLayout
from .reach import Reach, reach_of
from .recipes import PAPER_SOUPS, soup_task
from .scoring.scorer import OvercookedScorer

__all__ = [
    "PAPER_SOUPS",
    "OvercookedLayout",
    "OvercookedScorer",
    "OvercookedWorkspace",
    "Reach",
    "reach_of",
    "soup_task",
]
