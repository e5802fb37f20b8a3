from .fitting import fit_reaches
from .model import Person, ReachModel
from .simulation import (
    ReachPlan,
    SimulatedReach,
    plan_reach,
    sample_person,
    simulate_participants,
    simulate_reach,
    simulate_task,
)

__all__ = [
    "Person",
    "ReachModel",
    "ReachPlan",
    "SimulatedReach",
    "fit_reaches",
    "plan_reach",
    "sample_person",
    "simulate_participants",
    "simulate_reach",
    "simulate_task",
]
