"""The score of tables: one task and one observer, for layouts and for batches of genomes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.observer import ObserverModel
from legible_envs.support.validation import integer
from legible_envs.tabletop.layout import MAX_OBSTACLES, MOST_OBSTACLES, TabletopLayout
from legible_envs.tabletop.objects import OBSTACLE_SIZE, numbers
from legible_envs.tabletop.scoring import explanation
from legible_envs.tabletop.scoring.exact_kernels import OUTPUTS, make_scratch, score_genomes, score_table
from legible_envs.tabletop.scoring.tables import make_tables
from legible_envs.tabletop.task import TabletopTask

__all__ = ["TableScores", "TabletopScorer"]

Floats = npt.NDArray[np.float64]


class TableScores(NamedTuple):
    """Scores of ``n`` layouts; NaN where a start or an object is covered by a grown obstacle or cannot be reached.

    Attributes:
        legibility: ``(n,)`` Eq. 3 per valid sequence.
        distance: ``(n,)`` expected metres of one whole task, fetching and carrying.
        mean_detour: ``(n,)`` shortest path over straight line, the mean over all trajectories to goals.
        max_detour: ``(n,)`` the greatest of them.
    """

    legibility: Floats
    distance: Floats
    mean_detour: Floats
    max_detour: Floats


class TabletopScorer:
    """How legible people's motion is on tables (Tung et al., HRI 2024, Eq. 1 to 3): shortest paths among obstacles.

    Only what makes a score undefined is checked here; overlapping objects and the other rules of a layout are for
    :meth:`~legible_envs.tabletop.layout.TabletopLayout.validate` and the workspace.

    Args:
        task: The task, or the name of one that comes with the package.
        observer: How the observer infers goals, which prefixes count, and what errors cost, in metres;
            :meth:`~legible_envs.observer.ObserverModel.in_metres` has the defaults of a table.
        max_obstacles: Places for obstacles in a genome.
        obstacle_size: Length and width of a genome's obstacles in metres.

    Attributes:
        task: The task.
        observer: The observer.
        genome_size: Numbers in a genome: ``2 M + 4 max_obstacles`` for ``M`` movable objects.
        best_possible: The score if every goal were certain from the start on: ``sum of w |V|``.

    Raises:
        TaskError: The task has more than 12 goals that are candidates together.
        ValueError: A parameter is out of range, or the observer's ``prefix`` is ``"sum"``.

    Example:
        >>> scorer = TabletopScorer("tea", observer=ObserverModel.in_metres(beta=10))
        >>> scores = scorer.score_layout(scorer.task.layout)
        >>> 0 < scores["normalised"] < 1, scores["num_sequences"]
        (True, 12)
    """

    def __init__(
        self,
        task: TabletopTask | str = "columns",
        *,
        observer: ObserverModel = ObserverModel.in_metres(),
        max_obstacles: int = MAX_OBSTACLES,
        obstacle_size: tuple[float, float] = OBSTACLE_SIZE,
    ) -> None:
        self.task = explanation.as_task(task)
        self.observer = observer
        max_obstacles = integer("max_obstacles", max_obstacles, 0, MOST_OBSTACLES)
        length, width = numbers(obstacle_size, 2, "`obstacle_size`", positive=True)
        self.max_obstacles = max_obstacles
        self.obstacle_size = (length, width)
        layout = self.task.layout
        self._movable = np.flatnonzero([o.movable for o in layout.objects]).astype(np.int64)
        self._template = layout.points
        self.genome_size = 2 * len(self._movable) + 4 * max_obstacles
        self.best_possible = sum(stage.weight * len(stage.goals) for stage in self.task.graph.stages())
        self.tables = make_tables(self.task.graph, layout.place_names, observer)

    def score_genomes(self, genomes: Any) -> TableScores:
        """Scores of ``(n, d)`` genomes; rows that are not finite score NaN.

        Raises:
            LayoutError: Another shape.
        """
        array = np.ascontiguousarray(genomes, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != self.genome_size:
            raise LayoutError(
                f"expected genomes of shape (n, {self.genome_size}): {len(self._movable)} movable objects and "
                f"{self.max_obstacles} obstacles; got {array.shape}",
                rule="genome",
            )
        table = self.task.layout.table
        scores = np.full((len(array), OUTPUTS), np.nan)
        finite = np.isfinite(array).all(axis=1)
        kept = array if finite.all() else array[finite]
        found = np.empty((len(kept), OUTPUTS))
        score_genomes(
            kept, self._template, self._movable, self.obstacle_size, table.hand, table.size, self.tables, found
        )
        scores[finite] = found
        return TableScores(*scores.T)

    def score_layouts(self, layouts: Iterable[TabletopLayout]) -> TableScores:
        """Scores of ``n`` layouts, whose objects and starts are named like the task's; NaN where undefined.

        Raises:
            LayoutError: A layout has other objects or starts than the task.
        """
        layouts = list(layouts)
        scores = np.empty((len(layouts), OUTPUTS))
        for layout, row in zip(layouts, scores, strict=True):
            explanation.check_points(layout, self.task)
            boxes = layout.paths.boxes
            scratch = make_scratch(len(boxes), self.tables)
            score_table(layout.points, boxes, layout.table.size, self.tables, scratch, row)
        return TableScores(*scores.T)

    def score_layout(self, layout: TabletopLayout) -> dict[str, Any]:
        """Score, distance and what belongs beside them.

        See :func:`~legible_envs.tabletop.scoring.explanation.score_layout` for what is returned.

        Raises:
            LayoutError: The layout has other objects than the task, or a place the task needs cannot be reached.
        """
        score, distance, mean_detour, max_detour = (float(values[0]) for values in self.score_layouts([layout]))
        if np.isnan(score):
            explanation.path_lengths(layout, list(self.task.graph.legs()))
            raise LayoutError("the task cannot be done on this table: an obstacle covers a place", rule="reachable")
        return explanation.summarise(
            layout, self.task.graph, score=score, distance=distance, mean_detour=mean_detour, max_detour=max_detour
        )

    def explain_layout(self, layout: TabletopLayout) -> list[dict[str, Any]]:
        """A row for every stage and goal, the greatest loss first.

        See :func:`~legible_envs.tabletop.scoring.explanation.explain_layout` for what is returned.

        Raises:
            LayoutError: The layout has other objects than the task, or a goal cannot be reached.
        """
        return explanation.explain_layout(layout, self.task, observer=self.observer)
