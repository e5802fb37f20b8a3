"""A workspace as vectors of real numbers: the continuous face that optimisers of other packages search.

pyribs' own emitters, and most optimisers there are, move points in a box of real numbers. Few such points are valid
layouts. A :class:`KeySpace` gives them the box [0, 1]^m instead, in which every point is one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from legible_envs.random_keys import KeyDecoder
from legible_envs.support.arrays import number_rows

__all__ = ["KeyObjective", "KeySpace"]

Array = npt.NDArray[np.float64]


class _Objective(Protocol):
    """An objective on genomes, as :meth:`.Workspace.objective` returns it."""

    @property
    def max_distance(self) -> float | None:
        """Greatest distance allowed."""

    @property
    def floor(self) -> float:
        """A value far below what searches keep."""

    def __call__(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` values of ``(n, d)`` genomes."""


class _Design(Protocol):
    """The part of a workspace that a :class:`KeySpace` needs."""

    @property
    def measure_names(self) -> tuple[str, str]:
        """Names of the two measures."""

    @property
    def archive_dims(self) -> tuple[int, int]:
        """Number of archive cells along each measure."""

    @property
    def archive_ranges(self) -> list[tuple[float, float]]:
        """Lower and upper end of each measure."""

    @property
    def score_floor(self) -> float:
        """A value far below what searches keep."""

    @property
    def genome_size(self) -> int:
        """Number of genes."""

    def key_decoder(self) -> KeyDecoder:
        """How keys stand for layouts."""

    def sample(self, n: int, rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` random valid genomes."""

    def valid(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes are valid layouts."""

    def decode(self, genome: npt.ArrayLike) -> Any:
        """The layout of one genome."""

    def scores(self, genomes: npt.NDArray[Any]) -> tuple[Array, Array]:
        """``(n,)`` legibility and distance."""

    def measures(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, 2)`` measures."""

    def objective(self, name: Any = ..., max_distance: float | None = ...) -> _Objective:
        """What a search maximises."""


class KeySpace:
    """The layouts of a workspace as vectors of ``m`` random keys in [0, 1]; every vector is a valid layout.

    Vectors that would not be valid stand for one near by, which the decoder finds (its class documents how); the same
    vector always stands for the same layout. Keys below 0 count as 0 and keys above 1 as 1, so that emitters without
    bounds work too; give those that take bounds :attr:`bounds`, or they wander where nothing changes any more. Keys
    that are NaN or infinite are refused.

    Scores are those of :class:`.Workspace` and never NaN: any optimiser may keep and compare them.

    Args:
        workspace: The design problem; usually one calls its :meth:`~.Workspace.continuous`.
        decoder: What turns keys into genomes and back; the workspace's own if None.

    Attributes:
        workspace: The design problem.
        decoder: What turns keys into genomes and back.
        solution_dim: Number of keys, ``m``.

    Raises:
        TypeError: The workspace has no key decoder.

    Example:
        >>> from legible_envs.overcooked import OvercookedWorkspace
        >>> space = OvercookedWorkspace(shape=(5, 5)).continuous()
        >>> keys = np.random.default_rng(0).random((1000, space.solution_dim))
        >>> space.valid(keys).all(), np.isfinite(space.legibility(keys)).all()
        (np.True_, np.True_)
    """

    def __init__(self, workspace: _Design, decoder: KeyDecoder | None = None) -> None:
        self.workspace: Any = workspace
        self.decoder = workspace.key_decoder() if decoder is None else decoder
        if not isinstance(self.decoder, KeyDecoder):
            raise TypeError(
                f"{type(workspace).__name__}.key_decoder() must return a KeyDecoder (legible_envs.random_keys), "
                f"it returned {type(self.decoder).__name__}"
            )
        self.solution_dim = int(self.decoder.size)

    # -- the box -------------------------------------------------------------------------------------------------------

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """``m`` pairs ``(0.0, 1.0)``, the ``bounds`` of pyribs' emitters."""
        return [(0.0, 1.0)] * self.solution_dim

    @property
    def lower_bounds(self) -> Array:
        """``(m,)`` zeros."""
        return np.zeros(self.solution_dim)

    @property
    def upper_bounds(self) -> Array:
        """``(m,)`` ones."""
        return np.ones(self.solution_dim)

    @property
    def measure_names(self) -> tuple[str, str]:
        """Names of the two measures."""
        return self.workspace.measure_names

    @property
    def archive_dims(self) -> tuple[int, int]:
        """Number of archive cells along each measure: ``dims`` of a ``GridArchive``."""
        return self.workspace.archive_dims

    @property
    def archive_ranges(self) -> list[tuple[float, float]]:
        """Lower and upper end of each measure: ``ranges`` of a ``GridArchive``."""
        return self.workspace.archive_ranges

    @property
    def score_floor(self) -> float:
        """A value far below what searches keep: ``qd_score_offset`` of an archive."""
        return self.workspace.score_floor

    # -- keys and layouts ----------------------------------------------------------------------------------------------

    def sample(self, n: int, rng: np.random.Generator) -> Array:
        """``(n, m)`` keys of ``n`` random layouts, distributed as the workspace's own ``sample``."""
        return self.decoder.encode(self.workspace.sample(n, rng))

    def decode(self, keys: npt.ArrayLike) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes of ``(n, m)`` keys; one ``(d,)`` genome of one ``(m,)`` vector.

        Raises:
            ValueError: The keys have another shape, are no real numbers, or not finite; the message names the row.
        """
        array = self._checked(keys)
        genomes = self.decoder.decode(np.atleast_2d(array))
        return genomes if array.ndim == 2 else genomes[0]

    def encode(self, genomes: npt.ArrayLike) -> Array:
        """``(n, m)`` keys that decode into ``(n, d)`` valid genomes; ``(m,)`` of one ``(d,)`` genome.

        Genomes of whole numbers come back as they are, real ones up to rounding.

        Raises:
            LayoutError: A genome is not valid; the message says why.
            ValueError: Another shape, or no numbers.
        """
        array = number_rows("genomes", genomes, self.workspace.genome_size, or_one=True)
        batch = np.atleast_2d(array)
        valid = np.asarray(self.workspace.valid(batch), dtype=bool)
        if not valid.all():
            self.workspace.decode(batch[int(np.argmin(valid))])
        keys = self.decoder.encode(batch)
        return keys if array.ndim == 2 else keys[0]

    def layout(self, keys: npt.ArrayLike) -> Any:
        """The layout that one ``(m,)`` vector of keys stands for."""
        vector = self._checked(keys)
        if vector.ndim != 1:
            raise ValueError(f"expected one vector of keys of shape ({self.solution_dim},), got {vector.shape}")
        return self.workspace.decode(self.decode(vector))

    def valid(self, keys: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """``(n,)`` whether the ``(n, m)`` keys stand for valid layouts: all do."""
        return np.asarray(self.workspace.valid(self._genomes(keys)), dtype=np.bool_)

    # -- what they score -----------------------------------------------------------------------------------------------

    def legibility(self, keys: npt.ArrayLike) -> Any:
        """``(n,)`` legibility per task execution of ``(n, m)`` keys; one number of one ``(m,)`` vector."""
        return self._score(keys, 0)

    def distance(self, keys: npt.ArrayLike) -> Any:
        """``(n,)`` expected distance of one task execution of ``(n, m)`` keys; one number of one ``(m,)`` vector."""
        return self._score(keys, 1)

    def measures(self, keys: npt.ArrayLike) -> Array:
        """``(n, 2)`` what an archive is laid out by, of ``(n, m)`` keys."""
        return np.asarray(self.workspace.measures(self._genomes(keys)), dtype=np.float64)

    def objective(self, name: str = "legibility", max_distance: float | None = None) -> KeyObjective:
        """What a search maximises, as a callable ``(n, m) -> (n,)``; see :class:`KeyObjective`."""
        return KeyObjective(self, name, max_distance)

    def evaluate(
        self, keys: npt.ArrayLike, objective: str | Callable[[Array], Array] = "legibility"
    ) -> tuple[Array, Array]:
        """Objective and measures of a batch, decoded once: what a pyribs scheduler is told.

        Args:
            keys: ``(n, m)``.
            objective: Name known to :meth:`objective`, or what it returned.

        Returns:
            ``(n,)`` objective and ``(n, 2)`` measures, all finite.
        """
        wanted = self.objective(objective) if isinstance(objective, str) else objective
        if not isinstance(wanted, KeyObjective):
            raise TypeError(f"`objective` must be a name or what objective(...) returned, got {type(wanted).__name__}")
        genomes = self._genomes(keys)
        return wanted.of_genomes(genomes), np.asarray(self.workspace.measures(genomes), dtype=np.float64)

    # -- helpers -------------------------------------------------------------------------------------------------------

    def _genomes(self, keys: npt.ArrayLike) -> npt.NDArray[Any]:
        """``(n, d)`` genomes of a batch of keys."""
        array = self._checked(keys)
        if array.ndim != 2:
            raise ValueError(f"expected keys of shape (n, {self.solution_dim}), got {array.shape}")
        return self.decoder.decode(array)

    def _score(self, keys: npt.ArrayLike, which: int) -> Any:
        array = self._checked(keys)
        values = self.finite(self.workspace.scores(self.decoder.decode(np.atleast_2d(array)))[which])
        return values if array.ndim == 2 else float(values[0])

    def finite(self, values: Array) -> Array:
        """``(n,)`` the scores of decoded layouts, which must be numbers.

        Raises:
            RuntimeError: One is not: the workspace's decoder, or its scores, break their contract.
        """
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise RuntimeError(
                f"the keys of row {bad[0]} decode into a layout without a finite score, so the key decoder or the "
                f"scores of {type(self.workspace).__name__} are wrong; check_workspace says what"
            )
        return values

    def _checked(self, keys: npt.ArrayLike) -> Array:
        """``(n, m)`` or ``(m,)`` keys as float64.

        Raises:
            ValueError: Another shape, no real numbers, or not finite.
        """
        array = number_rows("keys", keys, self.solution_dim, or_one=True)
        with np.errstate(over="ignore"):
            array = array.astype(np.float64)
        if not np.isfinite(array).all():
            *row, key = (int(i) for i in np.argwhere(~np.isfinite(array))[0])
            where = f"row {row[0]}, key {key}" if row else f"key {key}"
            raise ValueError(f"keys must be finite numbers, got {array[*row, key]:g} in {where}")
        return array

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.workspace, self.decoder)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KeySpace) and self.workspace == other.workspace

    def __hash__(self) -> int:
        return hash(("KeySpace", self.workspace))

    def __repr__(self) -> str:
        return f"{self.workspace!r}.continuous()"


class KeyObjective:
    """What a search maximises, of keys: ``objective(keys) -> (n,)``, finite for every finite vector.

    :class:`.Objective` gives NaN to layouts beyond a distance cap, which pyribs' archives refuse. Here they score
    :attr:`floor` (ten standard deviations below the mean of random layouts) less what they exceed the cap by. They may
    fill cells where nothing else was found: elites at or below ``floor`` are not allowed.

    Args:
        space: Where the keys come from.
        name: ``"legibility"``, ``"efficiency"`` or ``"legible-efficient"``, as for :class:`.Objective`.
        max_distance: The cap; None means none.

    Attributes:
        space: Where the keys come from.
        name: Which objective.
        max_distance: The cap.

    Raises:
        ValueError: An unknown name, or a cap that is not a positive number.
    """

    def __init__(self, space: KeySpace, name: str = "legibility", max_distance: float | None = None) -> None:
        self._objective = space.workspace.objective(name, max_distance)
        self.space, self.name, self.max_distance = space, name, max_distance

    @property
    def floor(self) -> float:
        """A value below every layout that searches keep; see :class:`.Objective`."""
        return float(self._objective.floor)

    def __call__(self, keys: npt.ArrayLike) -> Array:
        """``(n,)`` values of ``(n, m)`` keys."""
        return self.of_genomes(self.space._genomes(keys))

    def of_genomes(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n,)`` values of ``(n, d)`` valid genomes."""
        values = np.array(self._objective(genomes), dtype=np.float64)
        beyond = np.isnan(values)
        if self.max_distance is not None and beyond.any():
            excess = self.space.workspace.scores(genomes[beyond])[1] - self.max_distance
            values[beyond] = self.floor - excess
        return self.space.finite(values)

    def __repr__(self) -> str:
        cap = "" if self.max_distance is None else f", max_distance={self.max_distance:g}"
        return f"{self.space!r}.objective({self.name!r}{cap})"
