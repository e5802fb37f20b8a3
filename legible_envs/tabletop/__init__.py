"""The table: layouts of boxes and virtual obstacles, tasks on them, their design, and the shortest paths of a hand."""

from typing import TYPE_CHECKING

from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.task import TabletopTask
from legible_envs.tabletop.things import Table, TableObject, VirtualObstacle

if TYPE_CHECKING:
    from legible_envs.tabletop.belief import EqOneBelief
    from legible_envs.tabletop.differentiable import DifferentiableTable
    from legible_envs.tabletop.robot import RobotPartner
    from legible_envs.tabletop.scoring import TabletopScorer
    from legible_envs.tabletop.workspace import TabletopWorkspace

__all__ = [
    "DifferentiableTable",
    "EqOneBelief",
    "RobotPartner",
    "Table",
    "TableObject",
    "TabletopLayout",
    "TabletopScorer",
    "TabletopTask",
    "TabletopWorkspace",
    "VirtualObstacle",
]

# Kernels need numba; the package must import without it.
_LATE = {
    "DifferentiableTable": "differentiable",
    "EqOneBelief": "belief",
    "RobotPartner": "robot",
    "TabletopScorer": "scoring",
    "TabletopWorkspace": "workspace",
}


def __getattr__(name: str) -> object:
    if name in _LATE:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{_LATE[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
