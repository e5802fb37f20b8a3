"""The design of tables: which are allowed, how they vary, and how they score."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.key_space import KeySpace
from legible_envs.observer import ObserverModel, Ties
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.subtasks import HUMAN
from legible_envs.support.random_bits import call_drawing
from legible_envs.support.validation import choice, entries, flag, real, shown
from legible_envs.tabletop.design import genome_kernels as kernels
from legible_envs.tabletop.design import measures
from legible_envs.tabletop.design import validity_kernels as validity
from legible_envs.tabletop.design.keys import TableKeys
from legible_envs.tabletop.design.rules import DesignRules
from legible_envs.tabletop.layout import MAX_OBSTACLES, TabletopLayout
from legible_envs.tabletop.objects import OBSTACLE_SIZE, numbers
from legible_envs.tabletop.scoring.explanation import summarise
from legible_envs.tabletop.scoring.scorer import TableScores, TabletopScorer
from legible_envs.tabletop.task import TabletopTask, read_task, task_names
from legible_envs.workspace import Array, ObjectiveName, Workspace, as_batch, as_single, check_draws, make_workspace

__all__ = ["DesignMode", "TabletopWorkspace"]

DesignMode = Literal["both", "placement", "obstacles"]
SecondMeasure = Literal["order", "mean x"]
MAX_SAMPLE_TRIES = 2_000_000
CELL = 0.01
WIDE_CELL = 0.02


class TabletopWorkspace(Workspace):
    """The design problem of a table: objects lie somewhere in a region, virtual obstacles between them.

    A design is valid if a person can work there (:meth:`~legible_envs.tabletop.layout.TabletopLayout.validate`) and it
    obeys the rules below. Without them a search puts cubes in touching pairs at the corners of the region, always uses
    every obstacle, and makes detours of 2.8 times the straight line.

    Genomes are ``float64[2 M + 4 m]`` in every condition: centres of the ``M`` movable objects, then
    ``(active, x, y, angle)`` of each of ``m`` obstacles (there where ``active > 0.5``; angles in [-pi/2, pi/2]). What a
    condition does not vary has equal bounds: obstacle genes are 0 under ``"placement"``, centres those of the sorted
    arrangement under ``"obstacles"``; so the genomes of either are genomes of ``"both"`` as well.

    Measures are the least distance between two objects (pairs that both stay are left out; cells of about 1 cm), and
    the lexicographic rank of the order of the ranked objects from left to right (ties by ``y``, nearer first, then by
    position). Under ``"obstacles"`` these are constant; there they are the number of obstacles and the mean detour.
    A rank has no slope: for searches that climb gradients (:meth:`gradients`) the second measure may be the mean ``x``
    of the ranked objects instead, in cells of 2 cm.

    Args:
        task: The task: the name of one that comes with the package, a :class:`~.TabletopTask`, its ``to_dict()``, or
            the path of a YAML file.
        condition: What is designed: ``"placement"`` of objects, ``"obstacles"`` on the sorted arrangement, or
            ``"both"``; a climb of the latter has two phases, objects first.
        max_obstacles: Places for obstacles in a genome, at most 64.
        obstacle_size: Length and width of an obstacle in metres.
        max_detour: Every reach of the task is at most this many times its straight line; None for no limit.
        start_clearance: Obstacles keep this many metres off the places reaches start from.
        object_clearance: Obstacles keep this many metres off centres of objects, as they lie and as they are built.
        object_spacing: Centres of objects lie at least this many metres apart (two that both stay are not compared).
        obstacles_on_table: Whether obstacles must lie wholly on the table.
        obstacles_apart: Whether obstacles may neither cross nor touch one another.
        obstacle_cost: What an objective loses for every obstacle.
        beta: Rationality per metre that the observer assumes (Eq. 1).
        c: Cost per ``unit`` observed while the predicted goal is wrong (Eq. 2).
        unit: Metres.
        prefix: ``"mean"`` (ten arc-length midpoints of the reach), or observed fractions in (0, 1].
        ties: ``"expected"`` (uniform tie-breaking) or ``"strict"`` (a tie counts as wrong).
        tie_tolerance: Excess costs up to this tie, in metres.
        ranked: Objects whose order is the second measure, or ``"all"`` movable ones. Default: movable goals of what can
            be done first (the first column).
        second_measure: ``"order"``, the rank; or ``"mean x"``, under ``"placement"`` only.
        step_sd: Standard deviation of a step along either axis, of an object or an obstacle, in metres. The paper
            says "variance 7 cm"; taken as a standard deviation of 7 cm.
        start_from: An existing table (a layout or its ``to_dict()``); it is the first of every sample, and where it
            has its objects they stay under ``"obstacles"``.

    Attributes:
        task: The task.
        scorer: The :class:`~legible_envs.tabletop.scoring.scorer.TabletopScorer`.
        rules: The :class:`~legible_envs.tabletop.design.rules.DesignRules`.

    Raises:
        LayoutError: ``start_from``, or the sorted arrangement under ``"obstacles"``, breaks a rule.
        TaskError: The task is unknown or malformed.
        ValueError: Any other argument out of range.

    Example:
        >>> ws = TabletopWorkspace(condition="placement")
        >>> genomes = ws.sample(100, np.random.default_rng(0))
        >>> genomes.shape, ws.valid(genomes).all(), ws.legibility(genomes).shape
        ((100, 32), np.True_, (100,))
    """

    name: ClassVar[str] = "tabletop"

    def __init__(
        self,
        task: TabletopTask | Mapping[str, Any] | str = "columns",
        condition: DesignMode = "both",
        *,
        max_obstacles: int = MAX_OBSTACLES,
        obstacle_size: Sequence[float] = OBSTACLE_SIZE,
        max_detour: float | None = 1.3,
        start_clearance: float = 0.10,
        object_clearance: float = 0.035,
        object_spacing: float = 0.08,
        obstacles_on_table: bool = True,
        obstacles_apart: bool = True,
        obstacle_cost: float = 0.3,
        beta: float = 20.0,
        c: float = 1.0,
        unit: float = 0.05,
        prefix: str | float | Iterable[float] = "mean",
        ties: Ties = "expected",
        tie_tolerance: float = 1e-9,
        ranked: Sequence[str] | str | None = None,
        second_measure: SecondMeasure = "order",
        step_sd: float = 0.07,
        start_from: TabletopLayout | Mapping[str, Any] | None = None,
    ) -> None:
        self.task = read_task(task)
        is_shipped = self.task.name in task_names() and TabletopTask.named(self.task.name) == self.task
        self._task_config = self.task.name if is_shipped else self.task.to_dict()
        self.condition: DesignMode = choice("condition", condition, get_args(DesignMode))
        self.scorer = TabletopScorer(
            self.task,
            observer=ObserverModel.in_metres(beta, c, prefix, ties, tie_tolerance, unit),
            max_obstacles=max_obstacles,
            obstacle_size=numbers(obstacle_size, 2, "`obstacle_size`", positive=True),  # type: ignore[arg-type]
        )
        if condition != "placement" and max_obstacles == 0:
            raise ValueError(f"condition {condition!r} needs max_obstacles >= 1, got 0")
        if max_detour is not None:
            real("max_detour", max_detour, 1, also="None")
        self.obstacle_cost = real("obstacle_cost", obstacle_cost, 0)
        self.step_sd = real("step_sd", step_sd, 0, closed="neither", unit="metres")
        self.start_from = TabletopLayout.from_dict(start_from) if isinstance(start_from, Mapping) else start_from
        if not isinstance(self.start_from, TabletopLayout | None):
            raise LayoutError(
                f"`start_from` must be a TabletopLayout or its to_dict(), got {shown(start_from)}", rule="type"
            )
        self.rules = DesignRules(
            self.task,
            self.baseline if self.start_from is None else self.start_from,
            moves_objects=condition != "obstacles",
            moves_obstacles=condition != "placement",
            max_obstacles=self.scorer.max_obstacles,
            obstacle_size=self.scorer.obstacle_size,
            max_detour=max_detour,
            start_clearance=real("start_clearance", start_clearance, 0),
            object_clearance=real("object_clearance", object_clearance, 0),
            object_spacing=real("object_spacing", object_spacing, 0),
            obstacles_on_table=flag("obstacles_on_table", obstacles_on_table),
            obstacles_apart=flag("obstacles_apart", obstacles_apart),
        )
        self.ranked = self._checked_ranked(ranked)
        self.phases = 2 if condition == "both" else 1
        self.second_measure: SecondMeasure = choice("second_measure", second_measure, get_args(SecondMeasure))
        if second_measure == "mean x" and condition != "placement":
            raise ValueError(f"second_measure 'mean x' is for condition 'placement', not {condition!r}")
        self.measure_names = (
            ("obstacles", "mean detour") if condition == "obstacles" else ("least distance", second_measure)
        )
        self._home: Array | None = None
        if self.start_from is not None:
            self._home = self.rules.encode(self.start_from)
        elif condition == "obstacles":
            self.rules.encode(self.baseline)

    def _checked_ranked(self, ranked: Sequence[str] | str | None) -> tuple[str, ...]:
        objects = self.task.layout.objects
        movable = [o.name for o in objects if o.movable]
        if ranked is None:
            persons = self.task.graph.subtasks_of(HUMAN)
            first = {goal for subtask in persons if not subtask.after for goal in subtask.goals}
            ranked = [name for name in movable if name in first] or movable
        names = tuple(movable if isinstance(ranked, str) and ranked == "all" else entries(ranked))
        are_objects = all(isinstance(name, str) and name in self.task.layout.goals for name in names)
        if not names or not are_objects or len(set(names)) != len(names):
            raise ValueError(
                f"`ranked` must be 'all' or different ones of {list(self.task.layout.goals)}, got {shown(ranked)}"
            )
        return names

    @property
    def observer(self) -> ObserverModel:
        """How the observer infers goals, which prefixes count, and what errors cost, in metres."""
        return self.scorer.observer

    @property
    def baseline(self) -> TabletopLayout:
        """The sorted, undesigned arrangement, without obstacles."""
        return self.task.layout

    # -- genomes -------------------------------------------------------------------------------------------------------

    @property
    def genome_dtype(self) -> np.dtype[Any]:
        """``float64``."""
        return np.dtype(np.float64)

    @property
    def lower_bounds(self) -> Array:
        """``(d,)`` least value of each gene."""
        return self.rules.lower_bounds

    @property
    def upper_bounds(self) -> Array:
        """``(d,)`` greatest value of each gene."""
        return self.rules.upper_bounds

    def decode(self, genome: npt.ArrayLike) -> TabletopLayout:
        """The layout of one ``(d,)`` genome; a :class:`LayoutError` names object, rule and numbers."""
        return self.rules.decode(as_single(genome, self.genome_size)[0])

    def encode(self, layout: TabletopLayout) -> Array:
        """The ``(d,)`` genome of a layout; a :class:`LayoutError` says why there is none."""
        return self.rules.encode(layout)

    def sample(self, n: int, rng: np.random.Generator) -> Array:
        """``(n, d)`` random valid genomes.

        Objects draw places uniformly in the region, whole arrangements being rejected until one is valid; there are no
        obstacles. Under ``"obstacles"`` the objects stay and any number of obstacles up to ``max_obstacles``, equally
        likely, is laid across lines between two objects (fewer where no more fit).

        Raises:
            LayoutError: Two million draws in a row broke a rule: the rules leave (almost) no room.
        """
        check_draws(rng, size=self.genome_size, n=n)
        genomes = np.zeros((n, self.genome_size))
        first = 0
        if self._home is not None and n:
            genomes[0], first = self._home, 1
        arrays = self.rules.arrays
        if self.condition == "obstacles":
            genomes[first:] = self.rules.lower_bounds * (np.arange(self.genome_size) < 2 * len(self.rules.movable))
            call_drawing(rng, kernels.sample_obstacles, genomes[first:], arrays, kernels.MAX_TRIES)
            return genomes
        found = call_drawing(rng, kernels.sample_objects, genomes[first:], arrays, MAX_SAMPLE_TRIES)
        if found < n - first:
            raise LayoutError(
                f"no valid layout among {MAX_SAMPLE_TRIES:,} random ones: {len(self.rules.movable)} movable objects "
                f"with object_spacing={self.rules.object_spacing:g} leave (almost) no room in the region",
                rule="room",
            )
        return genomes

    def perturb(self, genomes: npt.NDArray[Any], k: int, rng: np.random.Generator, phase: int = 0) -> Array:
        """``(n * k, d)`` valid children of ``(n, d)`` valid parents, grouped by parent.

        Objects vary in phase 0, obstacles in phase 1 (under ``"obstacles"`` in phase 0, the only one);
        :func:`.perturb_genomes` documents the changes. A parent that has no valid child repeats itself.
        """
        check_draws(rng, size=self.genome_size, parents=len(genomes), k=k)
        choice("phase", phase, range(self.phases))
        parents = self._as_float(genomes)
        is_valid = self.valid(parents)
        if not is_valid.all():
            self.decode(parents[int(np.argmin(is_valid))])
        children = np.empty((len(parents) * k, self.genome_size))
        what = kernels.OBSTACLES if self.condition == "obstacles" else (kernels.OBJECTS, kernels.OBSTACLES)[phase]
        call_drawing(rng, kernels.perturb_genomes, parents, k, what, self.rules.arrays, self.step_sd, children)
        return children

    def valid(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes obey every rule."""
        batch = self._as_float(genomes)
        valid = np.empty(len(batch), dtype=np.bool_)
        validity.valid_genomes(batch, self.rules.arrays, valid)
        return valid

    def simplifications(self, genome: npt.NDArray[Any]) -> Array:
        """``(m, d)`` the genome without one of its ``m`` obstacles."""
        genome = as_single(genome, self.genome_size)[0]
        first = 2 * len(self.rules.movable)
        rows = np.asarray(genome, dtype=np.float64)[first:].reshape(-1, 4)
        there = rows[rows[:, 0] > 0.5]
        simpler = np.zeros((len(there), self.genome_size))
        simpler[:, :first] = np.asarray(genome)[:first]
        for i in range(len(there)):
            simpler[i, first : first + 4 * (len(there) - 1)] = np.delete(there, i, axis=0).ravel()
        return simpler

    def continuous(self) -> KeySpace:
        """Tables as vectors of real numbers in [0, 1]; :class:`.TableKeys` documents what each key stands for."""
        return KeySpace(self, TableKeys(self, self.rules))

    def _as_float(self, genomes: npt.ArrayLike) -> Array:
        return np.ascontiguousarray(as_batch(genomes, self.genome_size), dtype=np.float64)

    # -- scores --------------------------------------------------------------------------------------------------------

    def table_scores(self, genomes: npt.NDArray[Any]) -> TableScores:
        """Legibility, distance and detours of ``(n, d)`` genomes; NaN where invalid."""
        batch = self._as_float(genomes)
        valid = self.valid(batch)
        if valid.all():
            return self.scorer.score_genomes(batch)
        scores = np.full((4, len(batch)), np.nan)
        scores[:, valid] = self.scorer.score_genomes(batch[valid])
        return TableScores(*scores)

    def scores(self, genomes: npt.NDArray[Any]) -> tuple[Array, Array]:
        """``(n,)`` legibility and ``(n,)`` expected metres of one whole task; NaN where invalid."""
        found = self.table_scores(genomes)
        return found.legibility, found.distance

    def num_obstacles(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """``(n,)`` number of obstacles."""
        batch = as_batch(genomes, self.genome_size)
        return np.asarray((batch[:, 2 * len(self.rules.movable) :: 4] > 0.5).sum(axis=1), dtype=np.int64)

    def penalty(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` ``obstacle_cost`` for every obstacle."""
        return np.asarray(self.obstacle_cost * self.num_obstacles(genomes), dtype=np.float64)

    def measures(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, 2)`` least distance of objects and rank of their order (or mean x), or obstacles and mean detour."""
        batch = self._as_float(genomes)
        if self.condition == "obstacles":
            mean = np.empty(len(batch))
            validity.batch_detours(batch, self.rules.arrays, mean)
            return np.column_stack([self.num_obstacles(batch), mean])
        centres = self._centres(batch)
        ranked = [self.task.layout.index(name) for name in self.ranked]
        second = measures.order_ranks if self.second_measure == "order" else measures.mean_x
        return np.column_stack([measures.least_distances(centres, self.rules.arrays.fixed), second(centres, ranked)])

    def gradients(self, genomes: npt.NDArray[Any], objective: ObjectiveName = "legibility") -> Array:
        """Gradients of an objective and of both measures, for search that climbs them (needs PyTorch).

        They are of the formulas, see :mod:`legible_envs.tabletop.design.differentiable`: rules are not looked at.

        Args:
            genomes: ``(n, d)``, valid or not.
            objective: As for :meth:`objective`.

        Returns:
            ``(n, 3, d)`` per genome: of the objective, of the least distance, of the mean x.

        Raises:
            ImportError: PyTorch is not installed.
            ValueError: The measures are not continuous: only those of ``second_measure="mean x"`` are.
        """
        from legible_envs.tabletop.design.differentiable import genome_gradients

        return genome_gradients(self, self._as_float(genomes), objective)

    def _centres(self, batch: Array) -> Array:
        """``(n, objects, 2)`` centres of all objects."""
        centres = np.repeat(self.task.layout.centres[None], len(batch), axis=0)
        centres[:, self.rules.movable] = batch[:, : 2 * len(self.rules.movable)].reshape(len(batch), -1, 2)
        return centres

    @property
    def order_names(self) -> tuple[str, ...]:
        """The ranked objects from left to right, by rank, in initials where these tell them apart."""
        if self.condition == "obstacles" or self.second_measure != "order":
            return ()
        initials = ["".join(part[:1] for part in name.split("-")) for name in self.ranked]
        names = initials if len(set(initials)) == len(initials) else list(self.ranked)
        return tuple(" ".join(p) for p in itertools.permutations(names))

    @property
    def archive_dims(self) -> tuple[int, int]:
        """About a cell for each centimetre, and one for each order; or for each number, and each .01 of detour."""
        (low, high), (start, end) = self.archive_ranges
        if self.condition == "obstacles":
            return self.rules.max_obstacles + 1, max(1, round((end - start) / 0.01))
        second = math.factorial(len(self.ranked))
        if self.second_measure == "mean x":
            second = max(1, math.ceil((end - start) / WIDE_CELL - 1e-6))
        return max(1, math.ceil((high - low) / CELL - 1e-6)), second

    @cached_property
    def archive_ranges(self) -> list[tuple[float, float]]:
        """From the least spacing to one that no arrangement exceeds, and ranks in the middle of their cells.

        Under ``"obstacles"``: numbers in the middle of theirs, and detours from 1 to ``max_detour`` (to 2 without a
        limit or beyond it; greater ones count in the last cell).
        """
        if self.condition == "obstacles":
            return [(-0.5, self.rules.max_obstacles + 0.5), (1.0, min(max(self.rules.max_detour, 1.01), 2.0))]
        high = measures.greatest_spacing(self.task.layout, ~self.rules.arrays.fixed)
        has_pairs = len(self.task.layout.objects) > 1
        low = self.rules.object_spacing if has_pairs else 0.0
        second = (-0.5, math.factorial(len(self.ranked)) - 0.5)
        if self.second_measure == "mean x":
            ends = self._centres(np.stack([self.rules.lower_bounds, self.rules.upper_bounds]))
            left, right = measures.mean_x(ends, [self.task.layout.index(name) for name in self.ranked]).tolist()
            second = (left, max(right, left + WIDE_CELL))
        return [(low, max(high, low + CELL)), second]

    # -- one layout ----------------------------------------------------------------------------------------------------

    def _one(self, genome: npt.ArrayLike | TabletopLayout) -> TabletopLayout:
        return self.decode(self.encode(genome) if isinstance(genome, TabletopLayout) else genome)

    def draw(self, genome: npt.ArrayLike | TabletopLayout) -> npt.NDArray[np.uint8]:
        """``(height, 640, 3)`` picture of one table, with the places to build at."""
        from legible_envs.tabletop.rendering.table import draw_table

        return draw_table(self._one(genome), task=self.task)

    def summary(self, genome: npt.ArrayLike | TabletopLayout) -> dict[str, Any]:
        """Score, distance and what belongs beside them.

        Returns:
            ``score`` (Eq. 3 per sequence); ``objective`` (score less the cost of obstacles); ``distance`` (metres per
            execution); ``normalised`` (score over the expected number of (stage, goal) pairs, at most 1);
            ``single_goal_score`` and ``single_goal_share`` (the part of the score from stages with one valid goal);
            ``mean_detour`` and ``max_detour`` (shortest path over straight line, over all reaches); ``num_obstacles``;
            ``least_distance`` (metres between two objects) and ``order`` (ranked objects from left to right);
            ``candidate_set`` (``"task"``: valid by precedence); ``num_sequences``; ``num_stages``; ``layout_id``;
            ``condition``.
        """
        layout = self._one(genome)
        row = layout.to_genome(self.rules.max_obstacles, self.rules.obstacle_size)[None]
        legibility, distance, mean_detour, max_detour = (float(x[0]) for x in self.table_scores(row))
        scores = summarise(
            layout,
            self.task.graph,
            score=legibility,
            distance=distance,
            mean_detour=mean_detour,
            max_detour=max_detour,
        )
        stays = np.array([not o.movable for o in layout.objects])
        x_order = sorted(self.ranked, key=lambda name: (*layout.place(name), self.ranked.index(name)))
        return {
            "score": legibility,
            "objective": legibility - float(self.penalty(row)[0]),
            **scores,
            "least_distance": float(measures.least_distances(layout.centres[None], stays)[0]),
            "order": x_order,
            "condition": self.condition,
        }

    def explain(self, genome: npt.ArrayLike | TabletopLayout) -> list[dict[str, Any]]:
        """Where the table wins and loses its score: a row per stage and goal, the greatest loss first.

        See :func:`~legible_envs.tabletop.scoring.explanation.explain_layout` for what a row holds.
        """
        return self.scorer.explain_layout(self._one(genome))

    def simulate(
        self,
        genome: npt.ArrayLike | TabletopLayout,
        participants: int,
        rng: np.random.Generator,
        **settings: Any,
    ) -> list[Trajectory]:
        """Trajectories of simulated participants who each do the task at one table.

        Args:
            genome: ``(d,)``, or the table.
            participants: Number of participants.
            rng: Source of all randomness.
            **settings: See :func:`legible_envs.tabletop.humans.simulate_participants`.
        """
        from legible_envs.tabletop.humans.simulation import simulate_participants

        return simulate_participants(self._one(genome), participants, rng, task=self.task, **settings)

    # -- configuration -------------------------------------------------------------------------------------------------

    def to_config(self) -> dict[str, Any]:
        """Settings as JSON-ready data; ``make_workspace`` and the constructor read them back."""
        observer = self.observer
        return {
            "workspace": self.name,
            "task": self._task_config,
            "condition": self.condition,
            **self.rules.settings(),
            "obstacle_cost": self.obstacle_cost,
            "beta": observer.beta,
            "c": observer.c,
            "unit": observer.unit,
            "prefix": observer.prefix if isinstance(observer.prefix, str) else sorted(observer.prefix),
            "ties": observer.ties,
            "tie_tolerance": observer.tie_tolerance,
            "ranked": list(self.ranked),
            "second_measure": self.second_measure,
            "step_sd": self.step_sd,
            "start_from": None if self.start_from is None else self.start_from.to_dict(),
        }

    def __reduce__(self) -> tuple[object, ...]:
        return make_workspace, (self.to_config(),)
