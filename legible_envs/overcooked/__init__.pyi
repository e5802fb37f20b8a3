from .design.workspace import OvercookedWorkspace
from .kitchen_file import KitchenFile
from .layout import OvercookedLayout
from .learners import as_sb3, parallel_env
from .reach import Reach, reach_of
from .recipes import PAPER_SOUPS, soup_task
from .scoring.scorer import OvercookedScorer

__all__ = [
    "PAPER_SOUPS",
    "KitchenFile",
    "OvercookedLayout",
    "OvercookedScorer",
    "OvercookedWorkspace",
    "Reach",
    "as_sb3",
    "parallel_env",
    "reach_of",
    "soup_task",
]
