from .analysis import accuracy_table, compare_with_reference
from .run import score_recorded_play
from .sweep import NEURAL, PREDICTORS, UNTRAINED, Experiment

__all__ = [
    "NEURAL",
    "PREDICTORS",
    "UNTRAINED",
    "Experiment",
    "accuracy_table",
    "compare_with_reference",
    "score_recorded_play",
]
