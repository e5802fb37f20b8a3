"""The design problem: which layouts are allowed, how they vary, and what they score.

A search only ever talks to a :class:`Workspace`; it does not know whether it arranges a kitchen or a table. Third-party
workspaces subclass it and register under the entry point group ``legible.workspaces``.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.key_space import KeySpace
from legible_envs.layout_kinds import kind_named, list_layout_kinds
from legible_envs.random_keys import BoundedKeys, KeyDecoder
from legible_envs.support.arrays import number_rows
from legible_envs.support.plugins import Plugin, Registry
from legible_envs.support.validation import integer, real, shown

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = [
    "Objective",
    "ObjectiveName",
    "Workspace",
    "list_workspaces",
    "make_workspace",
    "register_workspace",
    "workspace_class",
]

ObjectiveName = Literal["legibility", "efficiency", "legible-efficient"]
Array = npt.NDArray[np.float64]

CALIBRATION_SEED: Final = 20240311
CALIBRATION_SIZE: Final = 1000


class Workspace(ABC):
    """Which layouts are allowed, how they vary, and how they score.

    ``d`` is :attr:`genome_size`, ``n`` a batch size. All methods on genomes take ``(n, d)`` arrays of any numeric type
    (whole-valued floats are as good as integers); rows that are not valid layouts, among them those with fractions
    where genes are whole numbers and those with NaN, score NaN. Optimisers that move points in a box of real numbers
    search :meth:`continuous` instead, where no row is invalid.

    Attributes:
        name: Short name used in configurations, such as ``"overcooked"``.
        phases: Number of phases of a climb; :meth:`perturb` varies another part of the layout in each.
        measure_names: Names of the two measures an archive is laid out by.
    """

    name: ClassVar[str]
    phases: int = 1
    measure_names: tuple[str, str]

    # -- genomes ---------------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def genome_dtype(self) -> np.dtype[Any]:
        """Data type of genomes."""

    @property
    @abstractmethod
    def lower_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` least value of each gene."""

    @property
    @abstractmethod
    def upper_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` greatest value of each gene, inclusive."""

    @property
    def genome_size(self) -> int:
        """Number of genes, ``d``."""
        return len(self.lower_bounds)

    @abstractmethod
    def decode(self, genome: npt.ArrayLike) -> Any:
        """The layout of one ``(d,)`` genome.

        Raises:
            LayoutError: The genome breaks a rule, which the message names.
        """

    @abstractmethod
    def encode(self, layout: Any) -> npt.NDArray[Any]:
        """The ``(d,)`` genome of a layout.

        Raises:
            LayoutError: The layout cannot be expressed under the rules of this workspace.
        """

    @abstractmethod
    def sample(self, n: int, rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` random valid genomes."""

    @abstractmethod
    def perturb(self, genomes: npt.NDArray[Any], k: int, rng: np.random.Generator, phase: int = 0) -> npt.NDArray[Any]:
        """``(n * k, d)`` valid children, ``k`` of each of the ``(n, d)`` parents, grouped by parent."""

    @abstractmethod
    def valid(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes are valid layouts."""

    def key_decoder(self) -> KeyDecoder:
        """How vectors of real numbers in [0, 1] stand for layouts (random keys); by default each key is one gene.

        Emitters of :mod:`optimizers` that move in keys use it, repairing with the layouts they come from. A workspace
        where :class:`~legible_envs.random_keys.BoundedKeys` must repair many layouts overrides this.
        """
        return BoundedKeys(self)

    def continuous(self) -> KeySpace:
        """The same design problem as vectors of real numbers in [0, 1], each of them a valid layout.

        For optimisers that move points in a box, such as pyribs' own emitters: see :class:`~.KeySpace`. It decodes by
        :meth:`key_decoder` unless a workspace gives it another.
        """
        return KeySpace(self)

    # -- what they score -------------------------------------------------------------------------------------------

    @abstractmethod
    def scores(self, genomes: npt.NDArray[Any]) -> tuple[Array, Array]:
        """``(n,)`` legibility and ``(n,)`` distance; NaN where invalid."""

    @abstractmethod
    def measures(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, 2)`` what an archive is laid out by."""

    @property
    @abstractmethod
    def archive_dims(self) -> tuple[int, int]:
        """Number of archive cells along each measure."""

    @property
    @abstractmethod
    def archive_ranges(self) -> list[tuple[float, float]]:
        """Lower and upper end of each measure."""

    def legibility(self, genomes: npt.NDArray[Any]) -> Any:
        """``(n,)`` legibility per task execution (Eq. 3 of Tung et al., 2024); NaN where invalid.

        One ``(d,)`` genome gives one number, and raises :class:`~legible_envs.errors.LayoutError` if it is invalid.
        """
        return self._score(genomes, 0)

    def distance(self, genomes: npt.NDArray[Any]) -> Any:
        """``(n,)`` expected distance of one whole task execution; NaN where invalid; one number for one genome."""
        return self._score(genomes, 1)

    def _score(self, genomes: npt.NDArray[Any], which: int) -> Any:
        array = number_rows("genomes", genomes, self.genome_size, or_one=True)
        if array.ndim == 2:
            return self.scores(array)[which]
        self.decode(array)
        return float(self.scores(array[None])[which][0])

    def penalty(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` penalty that an objective subtracts from the score; zero unless a workspace overrides this."""
        return np.zeros(len(genomes))

    @cached_property
    def calibration(self) -> dict[str, float]:
        """Mean and standard deviation of legibility and distance over 1,000 random layouts with a fixed seed."""
        genomes = self.sample(CALIBRATION_SIZE, np.random.default_rng(CALIBRATION_SEED))
        legibility, distance = self.scores(genomes)
        return {
            "legibility_mean": float(np.nanmean(legibility)),
            "legibility_sd": float(np.nanstd(legibility)),
            "distance_mean": float(np.nanmean(distance)),
            "distance_sd": float(np.nanstd(distance)),
        }

    def objective(self, name: ObjectiveName = "legibility", max_distance: float | None = None) -> Objective:
        """What a search maximises, as a callable ``(n, d) -> (n,)``; see :class:`Objective`."""
        return Objective(self, name, max_distance)

    @property
    def score_floor(self) -> float:
        """Floor of the ``legibility`` objective; see :attr:`Objective.floor`."""
        return self.objective("legibility").floor

    # -- finished layouts ------------------------------------------------------------------------------------------

    @abstractmethod
    def simplifications(self, genome: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """``(m, d)`` genomes that each lack one obstacle of the given ``(d,)`` one."""

    def prune(
        self, genome: npt.NDArray[Any], objective: Callable[[npt.NDArray[Any]], Array] | None = None
    ) -> npt.NDArray[Any]:
        """Remove obstacles one by one as long as that does not lower the objective.

        Args:
            genome: ``(d,)`` a valid genome.
            objective: What must not fall; legibility if None.

        Raises:
            LayoutError: The genome is not valid.
        """
        objective = objective or self.objective("legibility")
        genome = as_single(genome, self.genome_size)[0]
        if not np.asarray(self.valid(genome[None]))[0]:
            self.decode(genome)
        genome = np.array(genome, dtype=self.genome_dtype)
        best = float(objective(genome[None])[0])
        while len(simpler := self.simplifications(genome)):
            scores = objective(simpler)
            scores = np.where(np.isnan(scores), -np.inf, scores)
            choice = int(np.argmax(scores))
            # A score that differs in the last bits only is the same score, summed in another order.
            if scores[choice] < best - 1e-9 * max(1.0, abs(best)):
                break
            genome, best = simpler[choice], max(best, float(scores[choice]))
        return genome

    @abstractmethod
    def summary(self, genome: npt.ArrayLike) -> dict[str, Any]:
        """Score, distance and what belongs beside them, of one genome; plain data."""

    @abstractmethod
    def explain(self, genome: npt.ArrayLike) -> list[dict[str, Any]]:
        """Where one layout wins and loses its score: a row per stage and goal; plain data."""

    def text(self, genome: npt.ArrayLike) -> str:
        """One layout as text: as its kind writes it (:mod:`legible_envs.layout_kinds`), or else as it prints itself."""
        layout = self.decode(genome)
        return kind_named(self.name).to_text(layout) if self.name in list_layout_kinds() else str(layout)

    def draw(self, genome: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """``(height, width, 3)`` picture of one layout: its text, unless a workspace overrides this."""
        from legible_envs.drawing.sheets import draw_text

        return draw_text(self.text(genome))

    def simulate(
        self, genome: npt.ArrayLike, participants: int, rng: np.random.Generator, **settings: Any
    ) -> list[Trajectory]:
        """Trajectories of simulated participants who each do the whole task in one layout.

        Args:
            genome: ``(d,)`` or a layout.
            participants: Number of participants.
            rng: Source of all randomness.
            **settings: Of the participants; each workspace documents its own.

        Raises:
            NotImplementedError: This workspace has no simulated participants.
        """
        raise NotImplementedError(
            f"{type(self).__name__} has no simulated participants; its class can define `simulate`"
        )

    # -- configuration ---------------------------------------------------------------------------------------------

    @abstractmethod
    def to_config(self) -> dict[str, Any]:
        """Settings as JSON-ready data with the key ``"workspace"``; :func:`make_workspace` reads them back."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.to_config() == other.to_config()  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash(repr(sorted(self.to_config().items())))

    def __repr__(self) -> str:
        settings = {key: value for key, value in self.to_config().items() if key != "workspace"}
        return f"{type(self).__name__}({', '.join(f'{key}={value!r}' for key, value in settings.items())})"


class Objective:
    """What a search maximises: ``objective(genomes) -> (n,)``, NaN where invalid or beyond the distance cap.

    ``"legibility"`` is Eq. 3, ``"efficiency"`` the negative distance, and ``"legible-efficient"`` the sum of both, each
    standardised by the workspace's :attr:`~Workspace.calibration`. The workspace's penalty is subtracted from each.

    Args:
        workspace: The workspace that scores.
        name: One of the three names.
        max_distance: Layouts with a longer distance count as failures; None means no cap.

    Raises:
        ValueError: An unknown name, or a cap that is not a positive number.
    """

    def __init__(self, workspace: Workspace, name: ObjectiveName, max_distance: float | None = None) -> None:
        if name not in get_args(ObjectiveName):
            raise ValueError(f"unknown objective {name!r}; expected one of {list(get_args(ObjectiveName))}")
        if max_distance is not None:
            real("max_distance", max_distance, 0, closed="neither", also="None")
        self.workspace = workspace
        self.name = name
        self.max_distance = max_distance

    def __call__(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` values of ``(n, d)`` genomes."""
        legibility, distance = self.workspace.scores(genomes)
        values = self._combine(legibility, distance) - self.workspace.penalty(genomes)
        if self.max_distance is not None:
            values[distance > self.max_distance] = np.nan
        return values

    def _combine(self, legibility: Array, distance: Array) -> Array:
        if self.name == "legibility":
            return legibility
        if self.name == "efficiency":
            return -distance
        scale = self.workspace.calibration
        return (legibility - scale["legibility_mean"]) / scale["legibility_sd"] - (
            distance - scale["distance_mean"]
        ) / scale["distance_sd"]

    @cached_property
    def floor(self) -> float:
        """A value far below what searches keep: ten standard deviations under the mean of random layouts.

        Archives use it as ``qd_score_offset``, so that filling a cell counts even where scores are negative.
        """
        scale = self.workspace.calibration
        if self.name == "legibility":
            return scale["legibility_mean"] - 10 * scale["legibility_sd"]
        if self.name == "efficiency":
            return -scale["distance_mean"] - 10 * scale["distance_sd"]
        return -20.0

    def __repr__(self) -> str:
        cap = "" if self.max_distance is None else f", max_distance={self.max_distance:g}"
        return f"{type(self.workspace).__name__}.objective({self.name!r}{cap})"


_registry = Registry(
    "workspace",
    "legible.workspaces",
    {
        "overcooked": "legible_envs.overcooked.design.workspace:OvercookedWorkspace",
        "tabletop": "legible_envs.tabletop.design.workspace:TabletopWorkspace",
    },
    ValueError,
)


def register_workspace(name: str, workspace: type[Workspace], *, overwrite: bool = False) -> None:
    """Make a workspace class known by name, for this process.

    Args:
        name: The name configurations use under ``"workspace"``.
        workspace: The class.
        overwrite: Whether an earlier registration of that name may be replaced.

    Raises:
        ValueError: The name is taken or not a name.
    """
    _registry.register(name, workspace, overwrite=overwrite)


def make_workspace(config: Mapping[str, Any] | str, **settings: Any) -> Workspace:
    """Build a workspace from a name or from what :meth:`Workspace.to_config` returned.

    Args:
        config: ``{"workspace": name, …settings}``, or the name alone: a built-in or registered one, one of an
            installed package (entry point group ``legible.workspaces``), or ``"module:Class"``.
        **settings: Further settings, which win.

    Raises:
        ValueError: Unknown name, unknown settings, or anything the workspace rejects.
    """
    merged = {"workspace": config} if isinstance(config, str) else dict(config)
    merged.update(settings)
    name = merged.pop("workspace", None)
    if not isinstance(name, str):
        raise ValueError("a workspace configuration needs the key 'workspace', e.g. {'workspace': 'overcooked'}")
    cls = workspace_class(name)
    known = inspect.signature(cls).parameters
    unknown = [key for key in merged if key not in known]
    if unknown:
        raise ValueError(f"unknown settings {unknown} of workspace {name!r}; it takes {list(known)}")
    return cls(**merged)


def workspace_class(name: str) -> type[Workspace]:
    """The class of a workspace, by any name that :func:`make_workspace` takes.

    Raises:
        ValueError: Unknown name, or what it names is no workspace.
    """
    cls = _registry.resolve(name)
    if not (isinstance(cls, type) and issubclass(cls, Workspace)):
        kind = "a class" if isinstance(cls, type) else f"of type {type(cls).__name__}"
        raise ValueError(f"workspace {name!r} is {kind}, which is not a subclass of Workspace")
    return cls


def list_workspaces() -> dict[str, Plugin]:
    """Every workspace known by name: built in, installed as an entry point, and registered in this process."""
    return _registry.list()


def as_batch(genomes: npt.ArrayLike, size: int) -> npt.NDArray[Any]:
    """Return genomes as an ``(n, size)`` array of numbers, in the type they came in.

    Raises:
        ValueError: Another shape, or data that is not numeric.
    """
    return number_rows("genomes", genomes, size)


def as_single(genome: npt.ArrayLike, size: int) -> npt.NDArray[Any]:
    """Return one genome as a ``(1, size)`` batch; see :func:`as_batch`."""
    array = number_rows("genomes", genome, size, or_one=True)
    if array.ndim != 1:
        raise ValueError(f"expected one genome of shape ({size},), got {array.shape}")
    return array[None]


MOST_GENOMES: Final = 1_000_000
"""Genomes of one call that draws some; more are drawn by several calls."""
MOST_NUMBERS: Final = 2**27
"""Numbers in all genomes of one call, which take up to a gibibyte."""


def check_draws(rng: np.random.Generator, *, size: int = 1, parents: int = 1, **counts: int) -> None:
    """Check what random genomes are drawn by: a generator, and how many; before any room is made for them.

    Args:
        rng: The generator.
        size: Numbers in a genome.
        parents: For how many genomes so many are drawn.
        counts: How many, by the name of the argument.

    Raises:
        ValueError: A count is no whole number from 0 to what one call may draw, or ``rng`` is no numpy Generator.
    """
    most = min(MOST_GENOMES, MOST_NUMBERS // max(1, size)) // max(1, parents)
    for name, count in counts.items():
        integer(name, count, 0, most)
    if not isinstance(rng, np.random.Generator):
        raise ValueError(f"`rng` must be a numpy random Generator such as np.random.default_rng(0), got {shown(rng)}")
