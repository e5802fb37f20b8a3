from .fitting import fit_reaches
from .model import Person, ReachModel
from .simulation import plan_reach, sample_person, simulate_participants, simulate_reach, simulate_task

__all__ = [
    "Person",
    "ReachModel",
    "fit_reaches",
    "plan_reach",
    "sample_person",
    "simulate_participants",
    "simulate_reach",
    "simulate_task",
]
