"""Check that an emitter keeps the contract, and say in words what it gets wrong."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.key_space import KeySpace
from legible_envs.support.contracts import global_random_state
from legible_envs.workspace import Workspace
from optimizers.emitters.registry import EmitterSpec, emitter_name, make_emitter, resolve_emitter
from optimizers.errors import EmitterError

__all__ = ["check_emitter"]

_ROUNDS = 5
_INITIAL = 64


def check_emitter(
    emitter: EmitterSpec,
    workspace: Workspace | KeySpace | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    seed: int = 0,
) -> None:
    """Run an emitter for a few batches and check everything a search relies on.

    The emitter can be made, proposes numbers of the right shape, stays within bounds (and is valid, if it claims
    ``emits_valid``), takes results that include layouts without a score, repeats itself with the same seed and not
    with another, leaves the global random state and the archive alone, and pickles in mid-search.

    Args:
        emitter: Name, ``"module:Class"``, factory or proposing function.
        workspace: Where to try it; default a 5x5 kitchen. Emitters that know no workspace may be tried in random keys:
            give ``workspace.continuous()``.
        options: Its keyword arguments.
        seed: Seed of the trial.

    Raises:
        EmitterError: Something is wrong; ``problems`` lists each in a sentence.
    """
    if workspace is None:
        from legible_envs.overcooked.design.workspace import OvercookedWorkspace

        workspace = OvercookedWorkspace(shape=(5, 5))
    name = emitter_name(emitter)
    try:
        resolve_emitter(emitter)
        trial = _Trial(emitter, workspace, options, seed)
    except EmitterError as error:
        raise EmitterError(f"{name} cannot be used: {error}", problems=error.problems) from error
    except Exception as error:
        raise EmitterError(f"{name} cannot be used: making it raised {_said(error)}") from error
    problems = trial.problems or _repeats(trial, lambda s: _Trial(emitter, workspace, options, s), seed)
    if problems:
        listed = "\n".join(f"- {problem}" for problem in problems)
        raise EmitterError(f"{name} breaks the emitter contract:\n{listed}", problems=problems)


class _Trial:
    """A short search with one emitter, watched closely; what it proposed, and what was wrong."""

    def __init__(
        self, spec: EmitterSpec, given: Workspace | KeySpace, options: Mapping[str, Any] | None, seed: int
    ) -> None:
        from optimizers.archives import make_archive
        from optimizers.emitters.adapter import GenomeAdapter

        workspace: Workspace = given.workspace if isinstance(given, KeySpace) else given
        self.workspace = workspace
        self.problems: list[str] = []
        self.batches: list[npt.NDArray[Any]] = []
        self.pickle: bytes | None = None
        self.archive = make_archive(workspace, seed=0)
        self._rng = np.random.default_rng(0)
        start = workspace.sample(_INITIAL, self._rng)
        self.archive.add(start, self._rng.random(len(start)), workspace.measures(start))
        before = global_random_state()
        self.emitter = make_emitter(spec, self.archive, given, seed=seed, options=options)
        self._adapted = isinstance(self.emitter, GenomeAdapter)
        for round_ in range(_ROUNDS):
            if not self._one_round(round_):
                break
        if global_random_state() != before:
            self.problems.append("it uses or seeds numpy's global random state; draw from a Generator made of `seed`")

    def _one_round(self, round_: int) -> bool:
        """Ask, check, add and tell once; False where going on makes no sense."""
        held = len(self.archive), float(self.archive.stats.qd_score)
        try:
            genomes = np.asarray(self.emitter.ask())
        except EmitterError as error:
            self.problems.append(str(error))
            return False
        except Exception as error:
            self.problems.append(f"ask() raised {_said(error)} in round {round_}")
            return False
        if held != (len(self.archive), float(self.archive.stats.qd_score)):
            self.problems.append("ask() adds to the archive; only the scheduler may")
        if not self._proposal_fits(genomes):
            return False
        self.batches.append(genomes.copy())
        scores = self._rng.random(len(genomes))
        scores[:: max(2, len(genomes) // 3)] = np.nan  # some layouts have no score: over the distance cap, say
        measures = self.workspace.measures(genomes)
        info = self.archive.add(genomes, scores, measures)
        try:
            self.emitter.tell(genomes, scores, measures, info)
        except Exception as error:
            hint = "" if self._adapted else "; scores of layouts that are not allowed are NaN"
            call = "tell(solution, objective, measures, add_info)"
            self.problems.append(f"{call} raised {_said(error)} in round {round_}{hint}")
            return False
        if round_ == 1:
            self._try_pickle()
        return True

    def _proposal_fits(self, genomes: npt.NDArray[Any]) -> bool:
        """Check shape, type, bounds and validity of a batch."""
        size, dtype = self.workspace.genome_size, np.dtype(self.workspace.genome_dtype)
        raw = self.emitter.raw if self._adapted and self.emitter.raw is not None else genomes
        found = len(self.problems)
        if genomes.ndim != 2 or genomes.shape[1] != size:
            self.problems.append(f"ask() must return shape (n, {size}), it returned {genomes.shape}")
        elif not len(genomes):
            self.problems.append("ask() returned no layouts although it is not done")
        elif genomes.dtype != dtype:
            self.problems.append(f"it claims emits_valid but ask() returns {genomes.dtype}, genomes are {dtype}")
        elif np.issubdtype(raw.dtype, np.floating) and np.isnan(raw).any():
            self.problems.append("ask() returned NaN")
        elif not self._adapted:
            out = (genomes < self.workspace.lower_bounds) | (genomes > self.workspace.upper_bounds)
            if out.any():
                row, gene = np.argwhere(out)[0]
                low, high = self.workspace.lower_bounds[gene], self.workspace.upper_bounds[gene]
                self.problems.append(f"ask() left the bounds: gene {gene} is {genomes[row, gene]}, not {low}..{high}")
            elif not self.workspace.valid(genomes).all():
                wrong = int((~self.workspace.valid(genomes)).sum())
                self.problems.append(f"it claims emits_valid but {wrong} of {len(genomes)} layouts are not valid")
        return len(self.problems) == found

    def _try_pickle(self) -> None:
        """Check that a copy through pickle goes on; a checkpoint is such a copy."""
        try:
            self.pickle = pickle.dumps(self.emitter)
            copy = pickle.loads(self.pickle)
            if not isinstance(copy.ask(), np.ndarray):
                self.problems.append("after pickling, ask() no longer returns an array")
        except Exception as error:
            self.problems.append(f"it does not pickle ({_said(error)}), so runs with it cannot be checkpointed")


def _repeats(trial: _Trial, again: Callable[[int], _Trial], seed: int) -> list[str]:
    """Check that the seed, and nothing else, decides what is proposed."""
    same, other = again(seed), again(seed + 1)
    problems = []
    if not _equal(trial.batches, same.batches):
        problems.append("two runs with the same seed proposed different layouts")
    elif _equal(trial.batches, other.batches):
        problems.append("another seed proposed the very same layouts: the seed is not used")
    return problems


def _equal(a: list[npt.NDArray[Any]], b: list[npt.NDArray[Any]]) -> bool:
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def _said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
