"""The table: layouts of boxes and virtual obstacles, tasks on them, and the shortest paths of a hand."""

from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.task import TabletopTask
from legible_envs.tabletop.things import Table, TableObject, VirtualObstacle

__all__ = ["Table", "TableObject", "TabletopLayout", "TabletopTask", "VirtualObstacle"]
