from .analysis import sections
from .run import reproduce
from .sweep import FULL, QUICK, Settings

__all__ = [
    "FULL",
    "QUICK",
    "Settings",
    "reproduce",
    "sections",
]
