"""The archive of a search: a pyribs ``GridArchive`` with one cell per combination of a workspace's measures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from ribs.archives import GridArchive

from legible_envs.key_space import KeySpace
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.stored_arrays import stored_array
from legible_envs.support.validation import entries, integer, shown
from legible_envs.workspace import Workspace
from optimizers.errors import SearchError

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = [
    "FIELDS",
    "MOST_BYTES",
    "MOST_CELLS",
    "WorkspaceArchive",
    "archive_arrays",
    "check_archive_dims",
    "make_archive",
    "read_archive",
    "write_archive",
]

MOST_CELLS: Final = 10_000_000
"""How many cells an archive may have."""

MOST_BYTES: Final = 2**32
"""How large the genomes, scores and measures of an archive may be together, were all its cells filled."""

FIELDS = ("solution", "objective", "measures", "index")
"""Arrays of ``archive.npz``, one row per elite in ascending cell index."""


class WorkspaceArchive(GridArchive):
    """A ``GridArchive`` that passes over layouts without a score.

    Layouts that score NaN (over the distance cap, say) are not added; ``add`` reports status 0 and value NaN for them.
    Everything else is pyribs' own, so any scheduler, emitter and plot made for a ``GridArchive`` works.
    """

    def add(
        self, solution: npt.ArrayLike, objective: npt.ArrayLike, measures: npt.ArrayLike, **fields: npt.ArrayLike
    ) -> dict[str, npt.NDArray[Any]]:
        """Insert a batch.

        Args:
            solution: ``(n, d)`` genomes.
            objective: ``(n,)`` scores, NaN where a layout is not allowed.
            measures: ``(n, k)`` measures; ignored where the score is NaN.
            **fields: Extra fields as in ``GridArchive.add``.

        Returns:
            ``status`` ``(n,)`` (0 not added, 1 improved its cell, 2 filled a new cell) and ``value`` ``(n,)``.

        Raises:
            ValueError: The archive's genomes are whole numbers and those given are not.
        """
        self._refuse_fractions(solution)
        scores = np.asarray(objective, dtype=np.float64)
        scored = ~np.isnan(scores)
        if scored.all() and scored.size:
            return super().add(solution, scores, measures, **fields)
        info = {"status": np.zeros(scores.shape, dtype=np.int32), "value": np.full(scores.shape, np.nan)}
        if scored.any():
            part = super().add(
                np.asarray(solution)[scored],
                scores[scored],
                np.asarray(measures)[scored],
                **{name: np.asarray(values)[scored] for name, values in fields.items()},
            )
            for name, values in part.items():
                info[name][scored] = values
        return info

    def _refuse_fractions(self, solution: npt.ArrayLike) -> None:
        """What the archive would cut to whole numbers in silence is refused."""
        genomes, dtype = np.asarray(solution), self.dtypes["solution"]
        if np.issubdtype(dtype, np.integer) and genomes.dtype.kind == "f":
            cut = ~(genomes == np.rint(genomes))
            if cut.any():
                row, gene = (int(i) for i in np.argwhere(cut)[0][-2:])
                raise ValueError(
                    f"genomes of this archive are whole numbers ({dtype}); gene {gene} of row {row} is "
                    f"{genomes[row, gene]:g}. For solutions that are real numbers, make_archive(workspace.continuous())"
                )


def make_archive(
    workspace: Workspace | KeySpace,
    *,
    seed: int | np.random.SeedSequence | None = None,
    score_floor: float | None = None,
    **options: Any,
) -> WorkspaceArchive:
    """Make the archive that fits a workspace: its genomes, one cell per combination of its measures.

    Where genomes are whole numbers, so are the archive's solutions, and pyribs' own emitters cannot move there: they
    take the type of their step sizes from the archive, so that ``sigma=0.5`` becomes 0, and their evolution strategies
    fail in compiled code. For a loop of your own with them, make the archive of ``workspace.continuous()``, whose
    solutions are random keys in [0, 1] (float64).

    Args:
        workspace: The design problem; gives genome size and type, archive dimensions and ranges. Or its
            ``continuous()``.
        seed: Seed of the archive's own sampling.
        score_floor: Subtracted from scores in the QD score, so that filling a cell never lowers it; default the
            workspace's own lower bound.
        **options: Passed on to ``ribs.archives.GridArchive`` (``dims``, ``ranges``, ``extra_fields``, ...).

    Returns:
        An empty archive.

    Raises:
        ValueError: It would have more than :data:`MOST_CELLS` cells, or take more than :data:`MOST_BYTES` bytes.
    """
    if isinstance(workspace, KeySpace):
        size, dtype = workspace.solution_dim, np.dtype(np.float64)
    else:
        size, dtype = workspace.genome_size, workspace.genome_dtype
    settings: dict[str, Any] = {
        "solution_dim": int(size),
        "dims": [int(n) for n in workspace.archive_dims],
        "ranges": [(float(low), float(high)) for low, high in workspace.archive_ranges],
        "qd_score_offset": float(workspace.score_floor if score_floor is None else score_floor),
        "solution_dtype": dtype,
    }
    settings |= options
    settings["dims"] = check_archive_dims(settings["dims"])
    row = int(settings["solution_dim"]) * dtype.itemsize + 8 * (1 + len(settings["dims"]))
    if (size := row * math.prod(settings["dims"])) > MOST_BYTES:
        raise ValueError(
            f"an archive of {math.prod(settings['dims']):,} cells of {row:,} bytes takes {size:,} bytes; at most "
            f"{MOST_BYTES:,} are kept"
        )
    return WorkspaceArchive(seed=seed, **settings)


def check_archive_dims(dims: Any, name: str = "dims") -> list[int]:
    """Numbers of cells along each measure, as a list; messages call them by ``name``.

    Raises:
        ValueError: They are no whole numbers > 0, or make more than :data:`MOST_CELLS` cells.
    """
    counts = [integer(name, count, 1) for count in entries(dims)]
    if not counts or math.prod(counts) > MOST_CELLS:
        raise ValueError(f"`{name}` must make an archive of 1 to {MOST_CELLS:,} cells, got {shown(dims)}")
    return counts


def archive_arrays(archive: ArchiveBase) -> dict[str, npt.NDArray[Any]]:
    """The elites as plain arrays (:data:`FIELDS`), in ascending cell index whatever the order they were found in."""
    data = archive.data(list(FIELDS))
    order = np.argsort(data["index"], kind="stable")
    return {name: np.ascontiguousarray(data[name][order]) for name in FIELDS}


def write_archive(path: Path, archive: ArchiveBase) -> None:
    """Write ``archive.npz``: plain arrays, no pickle, replaced in one step."""
    arrays: dict[str, Any] = archive_arrays(archive)
    write_npz(path, arrays)


def read_archive(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Read what :func:`write_archive` wrote; nothing is unpickled.

    Raises:
        FileNotFoundError: There is no such file.
        OSError: It cannot be read.
        SearchError: It is not such an archive: an array is missing, of another kind or shape than the others say, not
            finite, or a cell is there twice.
    """
    refusal = f"{path} is not an archive written by a search, or it is damaged"
    try:
        with open_npz(path, most_bytes=MOST_BYTES) as stored:
            missing = [name for name in FIELDS if name not in stored]
            if missing:
                raise SearchError(f"{refusal}: it lacks the arrays {missing}, it has {sorted(stored)}")
            objective = stored_array(stored, "objective", "f", (None,), finite=True)
            rows = len(objective)
            kinds = "iu" if rows else "iuf"  # pyribs gives the cells of an empty archive as floats
            index = stored_array(stored, "index", kinds, (rows,))
            if rows and (index.min() < 0 or len(np.unique(index)) < rows):
                raise ValueError("`index` must hold numbers of cells from 0 on, each once")
            arrays = {
                "solution": stored_array(stored, "solution", "iuf", (rows, None), finite=True),
                "objective": objective,
                "measures": stored_array(stored, "measures", "iuf", (rows, None), finite=True),
                "index": index,
            }
    except SearchError:
        raise
    except ValueError as error:
        raise SearchError(f"{refusal}: {error}") from error
    return arrays
