from .comparison import Comparison, compare_conditions
from .cross_validation import accuracy_at, evaluate, learning_curve
from .results import Evaluation, LearningCurve

__all__ = [
    "Comparison",
    "Evaluation",
    "LearningCurve",
    "accuracy_at",
    "compare_conditions",
    "evaluate",
    "learning_curve",
]
