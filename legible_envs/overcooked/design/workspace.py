"""The design of kitchens: which are allowed, how they vary, and how they score."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from math import factorial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError, TaskError
from legible_envs.observer import ObserverModel, Ties, check_prefix
from legible_envs.overcooked.design import genome_kernels as kernels
from legible_envs.overcooked.design.keys import KitchenKeys
from legible_envs.overcooked.design.rules import DesignRules, Genomes
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.kitchen_file import KitchenFile
from legible_envs.overcooked.layout import INGREDIENTS, STATION_TYPES, SYMBOLS, OvercookedLayout
from legible_envs.overcooked.recipes import PAPER_SOUPS, check_recipes, soup_task
from legible_envs.overcooked.scoring.boltzmann import HumanModel, HumanName
from legible_envs.overcooked.scoring.genome_kernels import score_genomes, valid_genomes
from legible_envs.overcooked.scoring.scorer import OvercookedScorer
from legible_envs.overcooked.scoring.tables import check_task, make_tables
from legible_envs.support.random_bits import call_drawing
from legible_envs.support.validation import choice, entries, integer, real, shown
from legible_envs.tasks import TaskGraph
from legible_envs.workspace import Array, Workspace, as_batch, as_single, check_draws, make_workspace

if TYPE_CHECKING:
    from legible_envs.overcooked.scoring.exact_kernels import ScoreTables
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["OvercookedWorkspace"]

MAX_SAMPLE_TRIES = 2_000_000
SYMBOL_OF = dict(zip(STATION_TYPES, "TOCFDPS", strict=True))


class OvercookedWorkspace(Workspace):
    """The design problem of a kitchen: stations on the border, virtual obstacles inside.

    A kitchen is ``H x W`` cells with counters on the border and one station of each type on border cells that are not
    corners; any inner cell may be a virtual obstacle. It is valid if stations stand at Manhattan distance >= 2 of one
    another, the cell in front of each is free, and all are mutually reachable.

    Genomes are ``int8[len(stations) + (H-2)(W-2)]`` (``int16`` beyond 33 x 33): the slot of each station (clockwise
    from the top-left, corners left out), then a bit for each inner cell, row by row. Measures are the number of
    obstacles and the lexicographic rank of the order in which the ranked stations are met when the kitchen is read row
    by row.

    Args:
        shape: Rows and columns, 3 to 64 each.
        prefix: Which prefixes of a trajectory count: ``"mean"`` over all, their ``"sum"``, or a tuple of fractions.
        c: Cost per step observed while the predicted goal is wrong (Eq. 2).
        beta: Rationality per unit of path cost that the observer assumes (Eq. 1).
        ties: ``"expected"`` (uniform tie-breaking) or ``"strict"`` (a tie counts as wrong).
        tie_tolerance: Excess costs this close to the least tie with it.
        human: How people move: ``"shortest"``, uniformly over all shortest paths, or ``"boltzmann"``, noisily rational
            (:mod:`legible_envs.overcooked.scoring.boltzmann`). Distances are those of shortest paths in either case.
        rationality: Of ``human="boltzmann"``, per unit of path cost; 1.3 if None, the mean of recorded participants.
        horizon: Of ``human="boltzmann"``: steps after which a trajectory is truncated; scores are those of trajectories
            that arrive. Twice the length of the longest conceivable shortest path if None.
        recipes: Soups of the default task.
        pots: How many soups may be in progress at once; None means precedence only, as in the paper's appendix.
        task: A :class:`~legible_envs.tasks.TaskGraph` over station types (or its ``to_dict()``), in place of
            recipes and pots.
        ranked: Stations whose reading order is the second measure (default: the ingredients), or ``"all"``.
        stations: Station types of the kitchen.
        locked: Stations that stay: ``{type: (row, col)}``, or type names whose cells ``start_from`` gives.
        forbidden: Border cells that take no station, inner cells that take no obstacle.
        distinct_access: Whether two stations may not share the cell they are used from.
        start_from: An existing kitchen (layout, or the text of one); it is the first layout of every sample.
        relocation_cost: What an objective loses for every station that stands elsewhere than in ``start_from``.
        cell_costs: ``(H, W)`` cost of stepping on each cell (> 0), for people and observer alike; None means 1 each.

    Attributes:
        task: The :class:`~legible_envs.tasks.TaskGraph`.
        scorer: The :class:`~legible_envs.overcooked.scoring.scorer.OvercookedScorer` of single layouts.
        rules: The :class:`~legible_envs.overcooked.design.rules.DesignRules`.
        human: Name of the model of how people move; ``rationality`` and ``horizon`` are its settings.

    Raises:
        LayoutError: Shape, stations, locked or forbidden cells, or ``start_from`` break a rule.
        TaskError: The task needs a station the kitchen lacks, or recipes are malformed.
        ValueError: Any other argument out of range.

    Example:
        >>> import numpy as np
        >>> ws = OvercookedWorkspace(shape=(7, 7))
        >>> genomes = ws.sample(100, np.random.default_rng(0))
        >>> genomes.shape, ws.valid(genomes).all(), ws.legibility(genomes).shape
        ((100, 32), np.True_, (100,))
    """

    name: ClassVar[str] = "overcooked"
    measure_names = ("obstacles", "order")

    def __init__(
        self,
        shape: Sequence[int] = (7, 7),
        *,
        prefix: str | float | Iterable[float] = "mean",
        c: float = 1.0,
        beta: float = 1.0,
        ties: Ties = "expected",
        tie_tolerance: float = 1e-9,
        human: HumanName = "shortest",
        rationality: float | None = None,
        horizon: int | None = None,
        recipes: Sequence[Sequence[str]] = PAPER_SOUPS,
        pots: int | None = None,
        task: TaskGraph | Mapping[str, Any] | None = None,
        ranked: Sequence[str] | str | None = None,
        stations: Sequence[str] = STATION_TYPES,
        locked: Mapping[str, Cell] | Sequence[str] | None = None,
        forbidden: Iterable[Cell] = (),
        distinct_access: bool = False,
        start_from: OvercookedLayout | str | None = None,
        relocation_cost: float = 0.0,
        cell_costs: npt.ArrayLike | None = None,
    ) -> None:
        observer = ObserverModel(beta, c, check_prefix(prefix), ties, tie_tolerance)
        self.relocation_cost = real("relocation_cost", relocation_cost, 0)
        self.recipes = check_recipes(recipes)
        self.pots = None if pots is None else integer("pots", pots, 1, also="None", error=TaskError)
        self._custom_task = TaskGraph.from_dict(task) if isinstance(task, Mapping) else task
        if not isinstance(self._custom_task, TaskGraph | None):
            raise TaskError(f"`task` must be None, a TaskGraph or its to_dict(), got {shown(task)}")
        self.task = self._custom_task or soup_task(self.recipes, pots)
        self.start_from = _read(start_from) if isinstance(start_from, str) else start_from
        if not isinstance(self.start_from, OvercookedLayout | None):
            raise LayoutError(
                f"`start_from` must be None, an OvercookedLayout or a drawing, got {shown(start_from)}", rule="type"
            )
        self.rules = DesignRules(
            shape,
            stations,
            locked=self._locked_cells(locked),
            forbidden=forbidden,
            distinct_access=distinct_access,
        )
        self.shape, self.stations = self.rules.shape, self.rules.stations
        self.ranked = self._checked_ranked(ranked)
        people = HumanModel(human, rationality, horizon).within(len(self.rules.inner))
        self.human, self.rationality, self.horizon = people.name, people.rationality, people.horizon
        check_task(self.task, self.stations)
        self.cell_costs = _checked_costs(cell_costs, self.shape, observer.tie_tolerance)
        self.scorer = OvercookedScorer(self.task, observer=observer, human=people, cell_costs=self.cell_costs)
        self._home = None if self.start_from is None else self.rules.encode(self.start_from)

    def _locked_cells(self, locked: Mapping[str, Cell] | Sequence[str] | None) -> dict[str, Cell]:
        if locked is None or isinstance(locked, Mapping):
            return dict(locked or {})
        if isinstance(locked, str) or not isinstance(locked, Iterable) or self.start_from is None:
            raise LayoutError(
                f"`locked` must be {{station: (row, col)}}, or a list of names together with start_from, got "
                f"{shown(locked)}",
                rule="locked",
            )
        missing = [name for name in locked if name not in self.start_from.stations]
        if missing:
            raise LayoutError(f"cannot lock {missing}: start_from has {list(self.start_from.stations)}", rule="locked")
        return {name: self.start_from.stations[name] for name in locked}

    def _checked_ranked(self, ranked: Sequence[str] | str | None) -> tuple[str, ...]:
        if ranked is None:
            ranked = [name for name in self.stations if name in INGREDIENTS] or self.stations
        names = self.stations if isinstance(ranked, str) and ranked == "all" else tuple(entries(ranked))
        are_stations = all(isinstance(name, str) and name in self.stations for name in names)
        if not names or not are_stations or len(set(names)) != len(names):
            raise ValueError(f"`ranked` must be 'all' or different ones of {list(self.stations)}, got {shown(ranked)}")
        return names

    # -- genomes ---------------------------------------------------------------------------------------------------

    @property
    def genome_dtype(self) -> np.dtype[Any]:
        """``int8`` where that holds every slot, as up to 33 x 33 cells; else ``int16``."""
        return self.rules.dtype

    @property
    def lower_bounds(self) -> Genomes:
        """``(d,)`` zeros."""
        return np.zeros_like(self.rules.upper_bounds)

    @property
    def upper_bounds(self) -> Genomes:
        """``(d,)`` last slot for stations, 1 for obstacle bits."""
        return self.rules.upper_bounds

    def decode(self, genome: npt.ArrayLike) -> OvercookedLayout:
        """The layout of one ``(d,)`` genome; a :class:`LayoutError` names the cell and the rule it breaks."""
        return self.rules.decode(as_single(genome, self.genome_size)[0])

    def encode(self, layout: OvercookedLayout | str) -> Genomes:
        """The ``(d,)`` genome of a layout or the text of one; a :class:`LayoutError` says why there is none."""
        return self.rules.encode(_read(layout) if isinstance(layout, str) else layout)

    def sample(self, n: int, rng: np.random.Generator, *, obstacle_rate: float = 0.2) -> Genomes:
        """``(n, d)`` random valid genomes, by rejecting whole layouts.

        Args:
            n: How many, at most a million, and 2**27 numbers in all.
            rng: Source of randomness.
            obstacle_rate: Probability of each inner cell to be an obstacle before rejection (the paper's 20 %).

        Raises:
            LayoutError: The shape has no room for the stations; or two million draws in a row broke a rule: the rules
                leave (almost) no room.
        """
        check_draws(rng, size=self.genome_size, n=n)
        obstacle_rate = real("obstacle_rate", obstacle_rate, 0, 1)
        if n and len(self.stations) > self.rules.most_stations:
            raise LayoutError(
                f"no valid layout: a {self.shape[0]}x{self.shape[1]} kitchen has room for {self.rules.most_stations} "
                f"stations at least 2 apart, not for {len(self.stations)}; take a larger shape or fewer `stations`",
                rule="room",
            )
        genomes = np.zeros((n, self.genome_size), dtype=self.genome_dtype)
        first = 0
        if self._home is not None and n:
            genomes[0], first = self._home, 1
        found = call_drawing(
            rng, kernels.sample_genomes, genomes[first:], self.rules.geometry, obstacle_rate, MAX_SAMPLE_TRIES
        )
        if found < n - first:
            raise LayoutError(
                f"no valid layout among {MAX_SAMPLE_TRIES:,} random ones: a {self.shape[0]}x{self.shape[1]} kitchen "
                f"with {len(self.stations)} stations and obstacle_rate={obstacle_rate:g} leaves (almost) no room",
                rule="room",
            )
        return genomes

    def perturb(self, genomes: npt.NDArray[Any], k: int, rng: np.random.Generator, phase: int = 0) -> Genomes:
        """``(n * k, d)`` valid children of ``(n, d)`` valid parents, grouped by parent.

        Each child differs by one change: a station moved to a free counter, two stations swapped, an obstacle added,
        or one removed. A parent that has no valid child repeats itself.
        """
        check_draws(rng, size=self.genome_size, parents=len(genomes), k=k)
        choice("phase", phase, range(self.phases))
        parents, valid = self._as_genomes(genomes)
        if not (valid & self.valid(parents)).all():
            self.decode(np.asarray(genomes)[int(np.argmin(valid & self.valid(parents)))])
        children = np.empty((len(parents) * k, self.genome_size), dtype=self.genome_dtype)
        call_drawing(rng, kernels.perturb_genomes, parents, k, self.rules.geometry, children)
        return children

    def valid(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes obey every rule."""
        batch, in_range = self._as_genomes(genomes)
        valid = np.empty(len(batch), dtype=np.bool_)
        valid_genomes(batch, self.rules.geometry, valid)
        return valid & in_range

    def simplifications(self, genome: npt.NDArray[Any]) -> Genomes:
        """``(m, d)`` the genome without one of its ``m`` obstacles."""
        genome = as_single(genome, self.genome_size)[0]
        bits = np.flatnonzero(genome[len(self.stations) :]) + len(self.stations)
        simpler = np.repeat(np.asarray(genome, dtype=self.genome_dtype)[None], len(bits), axis=0)
        simpler[np.arange(len(bits)), bits] = 0
        return simpler

    def key_decoder(self) -> KitchenKeys:
        """How vectors of real numbers in [0, 1] stand for kitchens."""
        return KitchenKeys(self.rules)

    def _as_genomes(self, genomes: npt.ArrayLike) -> tuple[Genomes, npt.NDArray[np.bool_]]:
        """Genomes in their type, and which rows lost nothing by that (NaN, fractions, large numbers are no genes)."""
        batch = as_batch(genomes, self.genome_size)
        if batch.dtype == self.genome_dtype:
            return np.ascontiguousarray(batch), np.ones(len(batch), dtype=np.bool_)
        with np.errstate(invalid="ignore"):
            small = np.ascontiguousarray(batch.astype(self.genome_dtype))
            return small, (small == batch).all(axis=1)

    # -- scores ----------------------------------------------------------------------------------------------------

    @cached_property
    def _tables(self) -> ScoreTables:
        """Made when a score is asked for: those of the largest kitchens take seconds, and 120 MB."""
        longest = max(len(self.rules.inner), self.horizon or 0)
        return make_tables(self.task, self.stations, self.observer, num_floor=longest)

    @property
    def observer(self) -> ObserverModel:
        """How the observer infers goals, which prefixes count, and what errors cost."""
        return self.scorer.observer

    def scores(self, genomes: npt.NDArray[Any]) -> tuple[Array, Array]:
        """``(n,)`` legibility and ``(n,)`` expected floor moves per task execution; NaN where invalid."""
        batch, in_range = self._as_genomes(genomes)
        legibility, distance = np.empty(len(batch)), np.empty(len(batch))
        score_genomes(batch, self.rules.geometry, self._tables, legibility, distance)
        costs = np.ones(self.rules.geometry.num_cells) if self.cell_costs is None else self.cell_costs.ravel()
        strict = self.observer.ties == "strict"
        if self.rationality is not None and self.horizon is not None:
            from legible_envs.overcooked.scoring.boltzmann_kernels import score_genomes_boltzmann

            people = strict, self.rationality, self.horizon
            score_genomes_boltzmann(batch, self.rules.geometry, self._tables, costs, *people, legibility)
        elif self.cell_costs is not None:
            from legible_envs.overcooked.scoring.weighted_kernels import score_genomes_weighted

            score_genomes_weighted(batch, self.rules.geometry, self._tables, costs, strict, legibility)
        legibility[~in_range] = np.nan
        distance[~in_range] = np.nan
        return legibility, distance

    def measures(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, 2)`` number of obstacles, and rank of the reading order of the ranked stations."""
        batch = as_batch(genomes, self.genome_size)
        n = len(self.stations)
        rank = np.zeros(len(batch))
        with np.errstate(invalid="ignore"):
            slots = np.clip(np.nan_to_num(batch[:, :n]), 0, len(self.rules.slots) - 1).astype(np.intp)
        position = self._reading_position[slots[:, [self.stations.index(name) for name in self.ranked]]]
        # The Lehmer code of the permutation that reading yields: how many later stations should come before each.
        order = np.argsort(position, axis=1)
        for i in range(len(self.ranked)):
            smaller = (order[:, i + 1 :] < order[:, i : i + 1]).sum(axis=1)
            rank += smaller * factorial(len(self.ranked) - 1 - i)
        return np.column_stack([batch[:, n:].sum(axis=1, dtype=np.float64), rank])

    @cached_property
    def _reading_position(self) -> npt.NDArray[np.int64]:
        return np.array([r * self.shape[1] + c for r, c in self.rules.slots], dtype=np.int64)

    @property
    def order_names(self) -> tuple[str, ...]:
        """Symbols of the ranked stations in reading order, by rank: ``("TOCF", "TOFC", …)``."""
        return tuple("".join(SYMBOL_OF[name] for name in p) for p in itertools.permutations(self.ranked))

    @property
    def archive_dims(self) -> tuple[int, int]:
        """One cell for each number of obstacles and each order."""
        return len(self.rules.inner) + 1, factorial(len(self.ranked))

    @property
    def archive_ranges(self) -> list[tuple[float, float]]:
        """Ranges that put every integer measure in the middle of its cell."""
        return [(-0.5, n - 0.5) for n in self.archive_dims]

    def relocations(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """``(n,)`` number of stations that stand elsewhere than in ``start_from`` (zeros without one)."""
        batch = as_batch(genomes, self.genome_size)
        if self._home is None:
            return np.zeros(len(batch), dtype=np.int64)
        n = len(self.stations)
        return (batch[:, :n] != self._home[:n]).sum(axis=1)

    def penalty(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` relocation cost; virtual obstacles are light and cost nothing to move."""
        return np.asarray(self.relocation_cost * self.relocations(genomes), dtype=np.float64)

    # -- one layout ------------------------------------------------------------------------------------------------

    def _one(self, genome: npt.ArrayLike | OvercookedLayout) -> OvercookedLayout:
        """The layout of a genome; a layout that has a genome stays as it is, players' starts and all."""
        if isinstance(genome, OvercookedLayout):
            self.encode(genome)
            return genome
        return self.decode(genome)

    def summary(self, genome: npt.ArrayLike | OvercookedLayout, *, player: int = 1) -> dict[str, Any]:
        """Score, distance and what belongs beside them, as plain data.

        See :func:`~legible_envs.overcooked.scoring.explanation.score_layout` for the keys. Workspaces that start
        from an existing kitchen add ``relocations``.

        Args:
            genome: ``(d,)``, whose person starts at serving, or the kitchen.
            player: Whose score it is, by the number of their start in the kitchen.
        """
        layout = self._one(genome)
        result = self.scorer.score_layout(layout, player=player)
        if self._home is not None:
            result["relocations"] = int(self.relocations(self.encode(layout)[None])[0])
        return result

    def explain(self, genome: npt.ArrayLike | OvercookedLayout, *, player: int = 1) -> list[dict[str, Any]]:
        """Where the layout wins and loses its score: a row per stage and goal, the greatest loss first.

        See :func:`~legible_envs.overcooked.scoring.explanation.explain_layout` for what a row holds, and
        :meth:`summary` for the arguments.
        """
        return self.scorer.explain_layout(self._one(genome), player=player)

    def ambiguity(self, genome: npt.ArrayLike | OvercookedLayout, *, player: int = 1) -> Array:
        """``(H, W)`` how often an observer would predict a wrong goal at each cell; NaN off all trajectories.

        See :meth:`summary` for the arguments.
        """
        return self.scorer.ambiguity(self._one(genome), player=player)

    def draw(self, genome: npt.ArrayLike | OvercookedLayout) -> npt.NDArray[np.uint8]:
        """``(48 H, 48 W, 3)`` picture of one kitchen."""
        from legible_envs.overcooked.rendering.board import draw_layout

        return draw_layout(self._one(genome), starts=False)

    def cells(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.int8]:
        """``(n, H, W)`` cell codes of :mod:`legible_envs.overcooked.layout`, of ``(n, d)`` valid genomes."""
        return self.rules.cells(as_batch(genomes, self.genome_size))

    @property
    def num_cell_codes(self) -> int:
        """How many cell codes there are: floor, counter, virtual obstacle, and each type of station."""
        return len(SYMBOLS)

    # -- configuration ---------------------------------------------------------------------------------------------

    def simulate(
        self,
        genome: npt.ArrayLike | OvercookedLayout,
        participants: int,
        rng: np.random.Generator,
        **settings: Any,
    ) -> list[Trajectory]:
        """Trajectories of simulated participants who cook in one kitchen.

        Args:
            genome: ``(d,)``, or the kitchen.
            participants: Number of participants.
            rng: Source of all randomness.
            **settings: See :func:`legible_envs.overcooked.humans.simulate_participants`.
        """
        from legible_envs.overcooked.humans.simulation import simulate_participants

        return simulate_participants(self._one(genome), participants, rng, task=self.task, **settings)

    def to_config(self) -> dict[str, Any]:
        """Settings as JSON-ready data; ``make_workspace`` and the constructor read them back."""
        observer = self.observer
        return {
            "workspace": self.name,
            "shape": list(self.shape),
            "prefix": observer.prefix if isinstance(observer.prefix, str) else list(observer.prefix),
            "c": observer.c,
            "beta": observer.beta,
            "ties": observer.ties,
            "tie_tolerance": observer.tie_tolerance,
            "human": self.human,
            **({} if self.human == "shortest" else {"rationality": self.rationality, "horizon": self.horizon}),
            "recipes": [list(recipe) for recipe in self.recipes],
            "pots": self.pots,
            "task": None if self._custom_task is None else self._custom_task.to_dict(),
            "ranked": list(self.ranked),
            "stations": list(self.stations),
            "locked": {name: list(cell) for name, cell in self.rules.locked.items()},
            "forbidden": [list(cell) for cell in self.rules.forbidden],
            "distinct_access": self.rules.distinct_access,
            "start_from": None if self.start_from is None else self.start_from.to_ascii(),
            "relocation_cost": self.relocation_cost,
            "cell_costs": None if self.cell_costs is None else self.cell_costs.tolist(),
        }

    def __reduce__(self) -> tuple[object, ...]:
        return make_workspace, (self.to_config(),)


def _read(text: str) -> OvercookedLayout:
    return KitchenFile.from_text(text, orders=False).layout


def _checked_costs(
    cell_costs: npt.ArrayLike | None, shape: tuple[int, int], tie_tolerance: float
) -> npt.NDArray[np.float64] | None:
    """A read-only ``(H, W)`` copy of the costs of stepping on each cell, or None.

    Raises:
        ValueError: No numbers, another shape, or inner cells whose costs are not finite, not positive, or lost in the
            tolerance.
    """
    if cell_costs is None:
        return None
    try:
        costs = np.array(cell_costs, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"`cell_costs` must be an array of numbers of shape {shape}: {error}") from error
    if costs.shape != shape:
        raise ValueError(f"`cell_costs` must have shape {shape}, got {costs.shape}")
    inner = costs[1:-1, 1:-1]
    least = max(1e-6, 2 * tie_tolerance)
    if not np.isfinite(inner).all() or inner.min() < least:
        raise ValueError(f"`cell_costs` of inner cells must be finite and at least {least:g}, got {inner.min():g}")
    costs.setflags(write=False)
    return costs
