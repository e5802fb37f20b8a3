from .design.differentiable import DifferentiableTable
from .design.workspace import TabletopWorkspace
from .layout import TabletopLayout
from .learners import parallel_env
from .objects import Table, TableObject, VirtualObstacle
from .partner.belief import GoalBelief
from .partner.robot import RobotPartner
from .scoring.scorer import TabletopScorer
from .task import TabletopTask

__all__ = [
    "DifferentiableTable",
    "GoalBelief",
    "RobotPartner",
    "Table",
    "TableObject",
    "TabletopLayout",
    "TabletopScorer",
    "TabletopTask",
    "TabletopWorkspace",
    "VirtualObstacle",
    "parallel_env",
]
