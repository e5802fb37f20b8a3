"""What files of tables and of their tasks may hold: keys, types and bounds."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Field

from legible_envs.support.models import Choice, FileModel, Flag, Length, Real, Text, YamlModel
from legible_envs.tabletop.objects import (
    CUBE,
    FARTHEST,
    LONGEST,
    MAX_STARTS,
    MOST_OBJECTS,
    MOST_OBSTACLES,
    OBSTACLE_SIZE,
)

__all__ = ["LayoutContent", "ObjectEntry", "ObstacleEntry", "TableEntry", "TaskFileContent"]

SCHEMA: Final = 1

_FINE: Final = 1e-6  # metres
_LARGEST_ANGLE: Final = 1e6

Coordinate = Annotated[float, Real(-FARTHEST, FARTHEST)]
Point = Annotated[list[Coordinate], Length(2, 2)]
Rectangle = Annotated[list[Coordinate], Length(4, 4)]
Size = Annotated[list[Annotated[float, Real(_FINE, LONGEST)]], Length(2, 2)]
Angle = Annotated[float, Real(-_LARGEST_ANGLE, _LARGEST_ANGLE)]
Points = Annotated[dict[str, Point], Length(1, MAX_STARTS)]


class ObjectEntry(FileModel):
    """One entry of ``objects``; see :class:`~legible_envs.tabletop.objects.TableObject`."""

    name: Annotated[str, Text()]
    at: Point
    colour: Annotated[str, Text()] = "grey"
    shape: Annotated[str, Text()] = "square"
    size: Size = [CUBE, CUBE]
    angle: Angle = 0.0
    movable: Annotated[bool, Flag()] = True


class ObstacleEntry(FileModel):
    """One entry of ``obstacles``; see :class:`~legible_envs.tabletop.objects.VirtualObstacle`."""

    at: Point
    angle: Angle = 0.0
    size: Size = list(OBSTACLE_SIZE)


class TableEntry(FileModel):
    """The table; see :class:`~legible_envs.tabletop.objects.Table`. What is left out is as there."""

    size: Size | None = None
    region: Rectangle | None = None
    assembly: Rectangle | None = None
    starts: Points | None = None
    hand: Annotated[float, Real(0, LONGEST)] | None = None


Objects = Annotated[list[ObjectEntry], Length(1, MOST_OBJECTS)]
Obstacles = Annotated[list[ObstacleEntry], Length(0, MOST_OBSTACLES)]


class LayoutContent(FileModel):
    """A table; see :meth:`~legible_envs.tabletop.layout.TabletopLayout.from_dict`."""

    version: Annotated[int, Choice(SCHEMA), Field(alias="schema")]
    objects: Objects
    obstacles: Obstacles = []
    table: TableEntry = TableEntry()


class TaskFileContent(YamlModel):
    """A task on a table; see :meth:`~legible_envs.tabletop.task.TabletopTask.from_dict`."""

    version: Annotated[int, Choice(SCHEMA)] = Field(SCHEMA, alias="schema")
    name: Annotated[str, Text()]
    objects: Objects
    obstacles: Obstacles = []
    table: TableEntry = TableEntry()
    configuration: Annotated[dict[str, Point], Length(0, MOST_OBJECTS)] = {}
    task: dict[str, Any]
