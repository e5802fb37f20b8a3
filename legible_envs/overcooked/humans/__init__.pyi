from .fitting import RationalityFit, RationalitySpread, fit_rationality, rationality_spread
from .simulation import BoltzmannWalker, PlannerWalker, simulate_participants
from .walker import Walker

__all__ = [
    "BoltzmannWalker",
    "PlannerWalker",
    "RationalityFit",
    "RationalitySpread",
    "Walker",
    "fit_rationality",
    "rationality_spread",
    "simulate_participants",
]
