"""Tasks on a table: which objects to put where, in which order, read from a YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError, TaskError
from legible_envs.support.names import is_whole
from legible_envs.support.text import dump_yaml, read_source
from legible_envs.support.validation import shown
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import Point, point, rectangle, rectangles_overlap
from legible_envs.tasks import TaskGraph

__all__ = ["TabletopTask", "read_task", "task_names"]

_SCHEMA = 1


def task_names() -> tuple[str, ...]:
    """Names of the tasks that come with the package."""
    folder = resources.files("legible_envs.tabletop") / "tasks"
    return tuple(sorted(entry.name.removesuffix(".yaml") for entry in folder.iterdir() if entry.name.endswith(".yaml")))


class _Placed(NamedTuple):
    """An object in the configuration and its ``(4, 2)`` corners there."""

    name: str
    corners: npt.NDArray[np.float64]


@dataclass(frozen=True)
class TabletopTask:
    """A task on a table.

    Attributes:
        name: Its name.
        layout: The table with all objects where a sorted, undesigned arrangement puts them.
        graph: The precedence of the reaches: goals are objects, places are objects and the table's starts.
        configuration: Where each object belongs in the end, ``(x, y)`` of its centre; objects left out stay anywhere.

    Raises:
        TaskError: The graph names places the table lacks, the configuration names unknown objects, objects that must
            stay where they are, or places that lie off the table or overlap.
        LayoutError: The arrangement is not a valid layout.

    Example:
        >>> task = TabletopTask.named("tea")
        >>> [o.name for o in task.layout.objects], task.graph.num_sequences
        (['cup', 'teabag', 'kettle', 'milk', 'sugar'], 12)
    """

    name: str
    layout: TabletopLayout
    graph: TaskGraph
    configuration: Mapping[str, Point] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name or not is_whole(self.name):
            raise TaskError(f"a task needs a non-empty name of whole characters, got {self.name!r}")
        known = self.layout.place_names
        unknown = [place for place in self.graph.places if place not in known]
        if unknown:
            raise TaskError(f"task {self.name!r} needs {unknown}, which the table lacks; it has {sorted(known)}")
        starts = [goal for goal in self.graph.goals if goal in self.layout.table.starts]
        if starts:
            raise TaskError(f"task {self.name!r} has the goals {starts}, which are no objects")
        self.layout.validate()
        self._check_configuration()

    def _check_configuration(self) -> None:
        if not isinstance(self.configuration, Mapping):
            raise TaskError(f"`configuration` must map objects to (x, y), got {type(self.configuration).__name__}")
        object.__setattr__(
            self,
            "configuration",
            {name: point(at, f"the place of {name!r}") for name, at in self.configuration.items()},
        )
        width, depth = self.layout.table.size
        placed: list[_Placed] = []
        for name, at in self.configuration.items():
            if name not in self.layout.goals:
                raise TaskError(f"the configuration places {name!r}; the objects are {list(self.layout.goals)}")
            obj = self.layout.objects[self.layout.index(name)]
            if not obj.movable:
                raise TaskError(f"the configuration places {name!r}, which is not movable")
            corners = rectangle(*at, obj.angle, *obj.size)
            if (corners < -1e-9).any() or (corners > np.array([width, depth]) + 1e-9).any():
                raise TaskError(f"the configuration places {name!r} at {at}, off the table of {width:g} x {depth:g} m")
            for other in placed:
                if rectangles_overlap(corners, other.corners):
                    raise TaskError(f"the configuration places {other.name!r} and {name!r} over each other")
            placed.append(_Placed(name, corners))

    def __hash__(self) -> int:
        return hash((self.name, self.layout, self.graph, tuple(self.configuration.items())))

    # -- in and out ----------------------------------------------------------------------------------------------------

    @classmethod
    def named(cls, name: str) -> TabletopTask:
        """One of the tasks that come with the package, whose names :func:`task_names` lists.

        Raises:
            TaskError: There is none of this name.
        """
        if name not in task_names():
            raise TaskError(f"no task {name!r}; there are {list(task_names())}, or give the path of a YAML file")
        return _packaged(name)

    @classmethod
    def for_layout(cls, layout: TabletopLayout) -> TabletopTask:
        """The task of the package that has a layout's objects and starts, by their names.

        Raises:
            LayoutError: There is none.
        """
        for name in task_names():
            task = cls.named(name)
            if (task.layout.goals, tuple(task.layout.table.starts)) == (layout.goals, tuple(layout.table.starts)):
                return task
        raise LayoutError(
            f"no task of the package ({', '.join(task_names())}) has the objects {list(layout.goals)} and the starts "
            f"{list(layout.table.starts)}: name the task",
            rule="object",
        )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TabletopTask:
        """Build a task from plain data.

        Args:
            data: ``name``, ``objects``, ``task`` (see :meth:`~legible_envs.tasks.TaskGraph.from_dict`), and optionally
                ``table``, ``obstacles``, ``configuration`` and ``schema`` (1).

        Raises:
            TaskError: A missing or unknown key, or data that this class or the graph rejects.
            LayoutError: Data that the layout rejects.
        """
        from legible_envs.support.models import as_plain, validated
        from legible_envs.tabletop.layout_files import TaskFileContent

        try:
            content = validated(TaskFileContent, as_plain(data), "the task")
        except ValueError as error:
            raise TaskError(str(error)) from error
        graph = TaskGraph.from_dict(content.task)
        places = {name: (x, y) for name, (x, y) in content.configuration.items()}
        return cls(content.name, TabletopLayout.from_content(content), graph, places)

    def to_dict(self) -> dict[str, Any]:
        """Plain data that :meth:`from_dict` reads back to an equal task."""
        layout = self.layout.to_dict()
        return {
            "schema": _SCHEMA,
            "name": self.name,
            "table": layout["table"],
            "objects": layout["objects"],
            **({"obstacles": layout["obstacles"]} if layout["obstacles"] else {}),
            "configuration": {name: list(at) for name, at in self.configuration.items()},
            "task": self.graph.to_dict(),
        }

    @classmethod
    def from_yaml(cls, source: str | Path) -> TabletopTask:
        """Read a YAML file (a ``Path``, or a string naming a ``.yaml``/``.yml`` file) or YAML text.

        Raises:
            TaskError: Not YAML, or not a task.
            LayoutError: Not a valid arrangement.
            FileNotFoundError: The file does not exist.
        """
        from legible_envs.support.plain_data import parse_yaml

        where = ""
        try:
            text, where = read_source(source, (".yaml", ".yml"))
            return cls.from_dict(parse_yaml(text))
        except LayoutError as error:
            raise LayoutError(f"{where}{error}", rule=error.rule) from error
        except ValueError as error:
            raise TaskError(f"{where}{error}") from error

    def to_yaml(self, path: str | Path | None = None) -> str:
        """Return the task as YAML text, and write it to ``path`` if given."""
        text = dump_yaml(self.to_dict())
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text


def read_task(value: object) -> TabletopTask:
    """A task from any description of one.

    Args:
        value: A :class:`TabletopTask`, the name of one that comes with the package, the path of a YAML file, or a
            mapping as :meth:`TabletopTask.from_dict` takes it.

    Raises:
        TaskError: Not a task.
        FileNotFoundError: No such file.
    """
    if isinstance(value, TabletopTask):
        return value
    if isinstance(value, Mapping):
        return TabletopTask.from_dict(value)
    if isinstance(value, Path) or (isinstance(value, str) and value.endswith((".yaml", ".yml"))):
        return TabletopTask.from_yaml(value)
    if isinstance(value, str):
        return TabletopTask.named(value)
    raise TaskError(
        f"`task` must be a TabletopTask, a name, a path or a mapping, got {type(value).__name__}: {shown(value)}"
    )


@cache
def _packaged(name: str) -> TabletopTask:
    # A task is immutable, and counting its states takes long where there are many.
    text = (resources.files("legible_envs.tabletop") / "tasks" / f"{name}.yaml").read_text(encoding="utf-8")
    return TabletopTask.from_yaml(text)
