from .cross_validation import accuracy_at, evaluate, learning_curve
from .results import Evaluation, LearningCurve
from .statistics import Comparison, compare_conditions

__all__ = [
    "Comparison",
    "Evaluation",
    "LearningCurve",
    "accuracy_at",
    "compare_conditions",
    "evaluate",
    "learning_curve",
]
