"""Scores of tables: legibility, distance and detours of layouts and of batches of genomes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.legibility import Ties
from legible_envs.tabletop.layout import MAX_OBSTACLES, TabletopLayout
from legible_envs.tabletop.objects import OBSTACLE_SIZE, numbers
from legible_envs.tabletop.scoring.exact_kernels import OUTPUTS, make_scratch, score_genomes, score_table
from legible_envs.tabletop.scoring.tables import make_tables, observed_fractions
from legible_envs.tabletop.task import TabletopTask

__all__ = ["TableScores", "TabletopScorer"]

Floats = npt.NDArray[np.float64]


class TableScores(NamedTuple):
    """Scores of ``n`` layouts; NaN where a start or an object is covered by a grown obstacle or cannot be reached.

    Attributes:
        legibility: ``(n,)`` Eq. 3 per valid sequence.
        distance: ``(n,)`` expected metres of one whole task, fetching and carrying.
        mean_detour: ``(n,)`` shortest path over straight line, the mean over all reaches of the task.
        max_detour: ``(n,)`` the greatest of them.
    """

    legibility: Floats
    distance: Floats
    mean_detour: Floats
    max_detour: Floats


class TabletopScorer:
    """How legible reaches on a table are (Tung et al., HRI 2024, Eq. 1 to 3), with shortest paths among obstacles.

    Only what makes a score undefined is checked here; overlapping objects and the other rules of a layout are for
    :meth:`~legible_envs.tabletop.layout.TabletopLayout.validate` and the workspace.

    Args:
        task: The task, or the name of one that comes with the package.
        beta: Rationality per metre.
        c: Cost per ``unit`` observed in doubt.
        unit: Metres.
        prefix: ``"mean"`` (ten arc-length midpoints of the reach), or observed fractions in (0, 1].
        ties: ``"expected"`` or ``"strict"``, see :func:`~legible_envs.legibility.env_legibility`.
        tie_tolerance: Excess costs up to this tie, in metres.
        max_obstacles: Places for obstacles in a genome.
        obstacle_size: Length and width of a genome's obstacles in metres.

    Attributes:
        genome_size: Numbers in a genome: ``2 M + 4 max_obstacles`` for ``M`` movable objects.
        best_possible: The score of reaches read from the start on: ``sum of w |V|``.

    Raises:
        TaskError: The task has more than 12 goals that are candidates together.
        ValueError: A parameter is out of range.
    """

    def __init__(
        self,
        task: TabletopTask | str = "columns",
        *,
        beta: float = 20.0,
        c: float = 1.0,
        unit: float = 0.05,
        prefix: str | float | Iterable[float] = "mean",
        ties: Ties = "expected",
        tie_tolerance: float = 1e-9,
        max_obstacles: int = MAX_OBSTACLES,
        obstacle_size: tuple[float, float] = OBSTACLE_SIZE,
    ) -> None:
        self.task = TabletopTask.named(task) if isinstance(task, str) else task
        for name, value, least in (("beta", beta, 0), ("c", c, 0), ("tie_tolerance", tie_tolerance, 0)):
            if not least <= value < np.inf:
                raise ValueError(f"{name} must be a finite number >= {least}, got {value!r}")
        if not 0 < unit < np.inf:
            raise ValueError(f"unit must be a positive number of metres, got {unit!r}")
        if ties not in ("expected", "strict"):
            raise ValueError(f"ties must be 'expected' or 'strict', got {ties!r}")
        if isinstance(max_obstacles, bool) or not isinstance(max_obstacles, int) or max_obstacles < 0:
            raise ValueError(f"max_obstacles must be an integer >= 0, got {max_obstacles!r}")
        length, width = numbers(obstacle_size, 2, "obstacle_size", positive=True)
        self.max_obstacles = max_obstacles
        self.obstacle_size = (length, width)
        layout = self.task.layout
        self._movable = np.flatnonzero([o.movable for o in layout.objects]).astype(np.int64)
        self._template = self._points(layout)
        self.genome_size = 2 * len(self._movable) + 4 * max_obstacles
        self.best_possible = sum(stage.weight * len(stage.goals) for stage in self.task.graph.stages())
        self.tables = make_tables(
            self.task.graph,
            (*layout.goals, *layout.table.starts),
            fractions=observed_fractions(prefix),
            beta=beta,
            c=c,
            unit=unit,
            ties=ties,
            tie_tolerance=tie_tolerance,
        )

    @staticmethod
    def _points(layout: TabletopLayout) -> Floats:
        return np.array([*(o.at for o in layout.objects), *layout.table.starts.values()])

    def genomes(self, genomes: Any) -> TableScores:
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

    def layout(self, layout: TabletopLayout) -> TableScores:
        """Scores of one layout, each of shape ``(1,)``; its objects and starts are named like the task's.

        Raises:
            LayoutError: The layout has other objects or starts than the task.
        """
        expected = (*self.task.layout.goals, *self.task.layout.table.starts)
        got = (*layout.goals, *layout.table.starts)
        if got != expected:
            raise LayoutError(
                f"task {self.task.name!r} is about {list(expected)}, the layout has {list(got)}", rule="object"
            )
        boxes = layout.paths.boxes
        scores = np.empty(OUTPUTS)
        scratch = make_scratch(len(boxes), self.tables)
        score_table(self._points(layout), boxes, layout.table.size, self.tables, scratch, scores)
        return TableScores(*scores[:, None])
