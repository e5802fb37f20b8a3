from .analysis import sections
from .policy import TrainedPolicy, load_policy
from .run import reproduce
from .settings import TrainingSettings
from .sweep import FULL, QUICK, Settings
from .train import train

__all__ = [
    "FULL",
    "QUICK",
    "Settings",
    "TrainedPolicy",
    "TrainingSettings",
    "load_policy",
    "reproduce",
    "sections",
    "train",
]
