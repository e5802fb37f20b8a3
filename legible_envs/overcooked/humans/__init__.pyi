from .cloning import ClonedWalker, PolicyFit, fit_policy
from .fitting import RationalityFit, RationalitySpread, fit_rationality, rationality_spread
from .simulation import BoltzmannWalker, PlannerWalker, simulate_participants
from .walker import Walker

__all__ = [
    "BoltzmannWalker",
    "ClonedWalker",
    "PlannerWalker",
    "PolicyFit",
    "RationalityFit",
    "RationalitySpread",
    "Walker",
    "fit_policy",
    "fit_rationality",
    "rationality_spread",
    "simulate_participants",
]
