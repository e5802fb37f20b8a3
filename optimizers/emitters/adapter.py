"""Let any pyribs emitter, or a plain function, search a workspace it knows nothing about."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.key_space import KeySpace
from legible_envs.workspace import Workspace
from optimizers.emitters.base import AddInfo, Seed, WorkspaceEmitter
from optimizers.errors import EmitterError

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["FloatArchiveView", "FunctionEmitter", "GenomeAdapter", "KeyAdapter", "KeyArchiveView"]

_PATIENCE = 100


class FloatArchiveView:
    """An archive seen by an emitter that thinks in real numbers: the same elites, genomes as float64.

    pyribs' own emitters take the type of their step sizes and bounds from the archive; on integer genomes a step size
    of 0.5 becomes 0 and an absent bound a number. Reading goes to the archive behind, writing is the scheduler's.
    """

    def __init__(self, archive: ArchiveBase) -> None:
        self._archive = archive

    def __getattr__(self, name: str) -> Any:
        if name == "_archive":  # absent only while being unpickled
            raise AttributeError(name)
        return getattr(self._archive, name)

    def __len__(self) -> int:
        return len(self._archive)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (self._as_float(elite) for elite in self._archive)

    @property
    def dtypes(self) -> dict[str, Any]:
        """Types of the fields, genomes as float64."""
        return {**self._archive.dtypes, "solution": np.dtype(np.float64)}

    @property
    def best_elite(self) -> dict[str, Any] | None:
        """The best elite, or None while the archive is empty."""
        best = self._archive.best_elite
        return None if best is None else self._as_float(best)

    def sample_elites(self, n: int, replace: bool = True) -> dict[str, Any]:
        """Draw ``n`` elites."""
        return self._as_float(self._archive.sample_elites(n, replace=replace))

    def retrieve(self, measures: npt.ArrayLike) -> tuple[npt.NDArray[np.bool_], dict[str, Any]]:
        """Elites in the cells of ``(n, k)`` measures; integer genomes have no sentinel for an empty cell."""
        occupied, data = self._archive.retrieve(measures)
        return occupied, self._as_float(data)

    def data(self, fields: Any = None, return_type: Any = None) -> Any:
        """All elites, as ``archive.data``."""
        found = self._archive.data(fields, return_type)
        if fields == "solution" and return_type is None:
            return self._seen(found)
        return self._as_float(found) if isinstance(found, Mapping) else found

    def _as_float(self, data: Mapping[str, Any]) -> dict[str, Any]:
        return {name: self._seen(values) if name == "solution" else values for name, values in data.items()}

    def _seen(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """``(n, d)`` genomes, or one ``(d,)``, as the emitter sees them."""
        return np.asarray(genomes, dtype=np.float64)


class KeyArchiveView(FloatArchiveView):
    """An archive of genomes seen by an emitter that moves in random keys: the same elites, as keys in [0, 1]."""

    def __init__(self, archive: ArchiveBase, space: KeySpace) -> None:
        super().__init__(archive)
        self._space = space

    @property
    def solution_dim(self) -> int:
        """Number of keys."""
        return self._space.solution_dim

    def _seen(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        keys = self._space.decoder.encode(np.atleast_2d(genomes))
        return keys if np.ndim(genomes) == 2 else keys[0]


class GenomeAdapter(WorkspaceEmitter):
    """Turns what an emitter proposes into valid genomes, and results back into what the emitter expects.

    ``ask`` rounds to whole numbers (only where genomes are integer), clips to the workspace's bounds, and leaves out
    what is still not valid. ``tell`` gives the emitter back its whole batch, its own numbers unrounded: a layout that
    was left out, or that has no score, is reported as not added (status 0), with the worst score seen so far, an
    improvement value no better than any other, and the measures of the archive's lower bounds. While the archive is
    empty, random layouts are proposed in its stead.

    Args:
        archive: Archive of the search.
        workspace: The design problem.
        emitter: The emitter to adapt.
        name: What to call it in errors.
        seed: Seed of the random layouts.
        initial: Random layouts proposed while the archive is empty.

    Attributes:
        emitter: The emitter that is adapted.
        raw: ``(n, d)`` what it proposed last, before rounding, clipping and filtering; None for random layouts.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        emitter: Any,
        *,
        name: str = "emitter",
        seed: Seed = None,
        initial: int = 1000,
    ) -> None:
        super().__init__(archive, workspace, seed=seed)
        self.emitter = emitter
        self._name = name
        self._initial = initial
        self._worst = np.inf
        self._width = int(archive.solution_dim)
        self.raw: npt.NDArray[Any] | None = None
        self._kept = np.zeros(0, dtype=bool)

    def __getattr__(self, name: str) -> Any:
        # `done` and `settings` are optional in the contract: present here exactly where the emitter has them.
        if name in ("done", "settings") and "emitter" in self.__dict__:
            return getattr(self.emitter, name)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def ask(self) -> npt.NDArray[Any]:
        """Propose ``(m, d)`` valid genomes.

        Raises:
            EmitterError: The emitter proposed an array of a wrong shape, or nothing valid in 100 batches.
        """
        if self.archive.empty:
            self.raw = None
            return self._workspace.sample(self._initial, self._rng)
        for _ in range(_PATIENCE):
            raw = np.asarray(self.emitter.ask())
            if raw.ndim != 2 or raw.shape[1] != self._width or not np.issubdtype(raw.dtype, np.number):
                raise EmitterError(
                    f"{self._name}: ask() must return numbers of shape (n, {self._width}), "
                    f"it returned {raw.dtype} of shape {raw.shape}"
                )
            genomes = self.to_genomes(raw)
            self.raw, self._kept = raw, np.asarray(self._workspace.valid(genomes), dtype=bool)
            if self._kept.any() or not len(raw):
                return genomes[self._kept]
            self.tell(genomes[:0], np.zeros(0), np.zeros((0, len(self.archive.lower_bounds))), {})
        raise EmitterError(f"{self._name}: no valid layout in {_PATIENCE} consecutive batches")

    def to_genomes(self, raw: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Round, clip and convert; ``(n, d)`` in and out. NaN becomes the lower bound."""
        dtype = self.archive.dtypes["solution"]
        if raw.dtype != dtype:
            raw = np.where(np.isnan(raw), self.lower_bounds, raw)
            if np.issubdtype(dtype, np.integer):
                raw = np.rint(raw)
        return np.clip(raw, self.lower_bounds, self.upper_bounds).astype(dtype)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Hand the results back to the emitter, in its own order and numbers."""
        if self.raw is None:
            return
        scores = np.asarray(objective, dtype=np.float64)
        scored = ~np.isnan(scores)
        if scored.any():
            self._worst = min(self._worst, float(scores[scored].min()))
        worst = self._worst if np.isfinite(self._worst) else float(self.archive.qd_score_offset)
        best = float(self.archive.stats.obj_max) if self.archive.stats.obj_max is not None else worst
        rows = np.flatnonzero(self._kept)[scored]
        n = len(self.raw)
        whole_scores = np.full(n, worst)
        whole_scores[rows] = scores[scored]
        whole_measures = np.tile(np.asarray(self.archive.lower_bounds, dtype=np.float64), (n, 1))
        whole_measures[rows] = np.asarray(measures, dtype=np.float64)[scored]
        info: AddInfo = {"status": np.zeros(n, dtype=np.int32), "value": np.full(n, worst - best)}
        for name in ("status", "value"):
            if name in add_info:
                info[name][rows] = np.asarray(add_info[name])[scored]
        self.emitter.tell(self.raw, whole_scores, whole_measures, info)


class KeyAdapter(GenomeAdapter):
    """Lets an emitter that knows no workspace move in random keys: what it proposes is always a valid layout.

    The archive of the search holds layouts, as ever; the emitter sees their keys (:class:`KeyArchiveView`).

    Args:
        archive: Archive of the search, on genomes.
        space: The random keys of the design problem.
        emitter: The emitter to adapt.
        name: What to call it in errors.
        seed: Seed of the random layouts.
    """

    def __init__(
        self, archive: ArchiveBase, space: KeySpace, emitter: Any, *, name: str = "emitter", seed: Seed = None
    ) -> None:
        super().__init__(archive, space.workspace, emitter, name=name, seed=seed)
        self._space = space
        self._width = space.solution_dim

    def to_genomes(self, raw: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """``(n, d)`` the layouts that ``(n, m)`` keys stand for.

        Raises:
            EmitterError: Keys that are not finite.
        """
        try:
            return self._space.decode(raw)
        except ValueError as error:
            raise EmitterError(f"{self._name}: ask() proposed what no layout is made of: {error}") from error


class FunctionEmitter(WorkspaceEmitter):
    """A plain function as an emitter.

    Args:
        archive: Archive of the search; never empty when the function is called.
        workspace: The design problem.
        propose: ``propose(archive, workspace, rng, **options)`` returning ``(n, d)`` genomes, any ``n >= 1``.
        options: Passed to every call.
        seed: Seed of ``rng``.
    """

    emits_valid = False

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        propose: Callable[..., npt.NDArray[Any]],
        options: Mapping[str, Any] | None = None,
        seed: Seed = None,
    ) -> None:
        super().__init__(archive, workspace, seed=seed)
        self._propose = propose
        self._options = dict(options or {})

    def ask(self) -> npt.NDArray[Any]:
        """Call the function."""
        return self._propose(self.archive, self._workspace, self._rng, **self._options)
