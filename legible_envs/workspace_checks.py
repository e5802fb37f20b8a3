"""Checks of a third-party workspace; every problem found is said in a sentence."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from legible_envs.errors import LayoutError, WorkspaceError
from legible_envs.support.contracts import find_problems, refuse
from legible_envs.workspace import Workspace, make_workspace

__all__ = ["check_workspace"]

SAMPLES = 64
CHILDREN = 4


def check_workspace(workspace: Workspace, *, seed: int = 0) -> None:
    """Check what a search, an environment or a report relies on.

    Bounds, samples, children, scores, measures, random keys, decoding, pruning, pickling, configuration and
    repeatability; and that the workspace leaves numpy's global random state alone.

    Args:
        workspace: The workspace to try.
        seed: Seed of the trial.

    Raises:
        WorkspaceError: Something is wrong; ``problems`` lists each in a sentence.
    """
    if not isinstance(workspace, Workspace):
        raise WorkspaceError(f"expected a Workspace, got {type(workspace).__name__}", problems=("not a Workspace",))
    checks = (_genomes, _variation, _scores, _keys, _one_layout, _configuration)
    found = find_problems({check.__name__.strip("_"): partial(check, workspace, seed) for check in checks})
    refuse(workspace, "workspace", found, WorkspaceError)


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def _genomes(workspace: Workspace, seed: int) -> Iterator[str]:
    d, low, high = workspace.genome_size, workspace.lower_bounds, workspace.upper_bounds
    if np.shape(low) != (d,) or np.shape(high) != (d,):
        yield f"bounds have shapes {np.shape(low)} and {np.shape(high)}; expected ({d},) each"
        return
    if (np.asarray(low) > np.asarray(high)).any():
        yield "some lower bounds exceed the upper bounds"
    genomes = workspace.sample(SAMPLES, _rng(seed))
    yield from _batch_problems(workspace, genomes, SAMPLES, "sample")
    if not np.array_equal(genomes, workspace.sample(SAMPLES, _rng(seed))):
        yield "sample gives different genomes for the same seed"
    if np.array_equal(genomes, workspace.sample(SAMPLES, _rng(seed + 1))):
        yield "sample gives the same genomes for different seeds"


def _batch_problems(workspace: Workspace, genomes: Any, n: int, method: str) -> Iterator[str]:
    expected = (n, workspace.genome_size)
    if not isinstance(genomes, np.ndarray) or genomes.shape != expected:
        yield f"{method} returned {type(genomes).__name__} of shape {np.shape(genomes)}; expected an array {expected}"
        return
    if genomes.dtype != workspace.genome_dtype:
        yield f"{method} returned dtype {genomes.dtype}; genome_dtype is {workspace.genome_dtype}"
    if (genomes < workspace.lower_bounds).any() or (genomes > workspace.upper_bounds).any():
        yield f"{method} returned genes out of bounds"
    valid = workspace.valid(genomes)
    if np.shape(valid) != (n,):
        yield f"valid returned shape {np.shape(valid)} for {n} genomes"
    elif not np.all(valid):
        yield f"{method} returned {n - int(np.sum(valid))} of {n} genomes that `valid` rejects"


def _variation(workspace: Workspace, seed: int) -> Iterator[str]:
    parents = workspace.sample(8, _rng(seed))
    kept = parents.copy()
    if workspace.phases < 1:
        yield f"phases is {workspace.phases}; expected at least 1"
    for phase in range(workspace.phases):
        children = workspace.perturb(parents, CHILDREN, _rng(seed), phase=phase)
        yield from _batch_problems(workspace, children, 8 * CHILDREN, f"perturb (phase {phase})")
        if not np.array_equal(children, workspace.perturb(parents, CHILDREN, _rng(seed), phase=phase)):
            yield f"perturb (phase {phase}) gives different children for the same seed"
        if np.array_equal(children, np.repeat(parents, CHILDREN, axis=0)):
            yield f"perturb (phase {phase}) changes nothing"
    if not np.array_equal(parents, kept):
        yield "perturb changes its parents in place"


def _scores(workspace: Workspace, seed: int) -> Iterator[str]:
    genomes = workspace.sample(SAMPLES, _rng(seed))
    results: dict[str, Callable[[Any], Any]] = {
        "legibility": workspace.legibility,
        "distance": workspace.distance,
        "penalty": workspace.penalty,
    }
    for name, method in results.items():
        values = np.asarray(method(genomes))
        if values.shape != (SAMPLES,):
            yield f"{name} returned shape {values.shape} for {SAMPLES} genomes"
        elif not np.isfinite(values).all():
            yield f"{name} is not finite for {int((~np.isfinite(values)).sum())} of {SAMPLES} valid genomes"
        elif not np.array_equal(values, method(genomes)):
            yield f"{name} gives different values for the same genomes"
        elif not np.allclose(values[:5], method(genomes[:5]), rtol=1e-12, atol=1e-12):
            yield f"{name} of a layout depends on the batch it is in"
    measures = np.asarray(workspace.measures(genomes))
    ranges = np.asarray(workspace.archive_ranges, dtype=float)
    if measures.shape != (SAMPLES, 2) or ranges.shape != (2, 2) or len(workspace.archive_dims) != 2:
        yield f"measures {measures.shape}, archive_ranges {ranges.shape}, archive_dims: expected (n, 2), (2, 2) and two"
    elif (measures < ranges[:, 0]).any() or (measures > ranges[:, 1]).any():
        yield "some measures lie outside archive_ranges"
    if len(workspace.measure_names) != 2:
        yield f"measure_names must be two names, got {workspace.measure_names!r}"


def _keys(workspace: Workspace, seed: int) -> Iterator[str]:
    """The continuous face: genomes come back from their keys, and every vector of keys is a valid layout."""
    rng, space = _rng(seed), workspace.continuous()
    genomes = workspace.sample(SAMPLES, rng)
    keys, shape = space.encode(genomes), (SAMPLES, space.solution_dim)
    if np.shape(keys) != shape or (keys < 0).any() or (keys > 1).any():
        yield f"the key decoder encodes {SAMPLES} genomes as shape {np.shape(keys)}; expected {shape}, within [0, 1]"
        return
    back = space.decode(keys)
    if back.shape != genomes.shape or not np.allclose(back, genomes, rtol=1e-9, atol=1e-9):
        yield "some genomes do not come back from their keys"
    cases = {
        "random": rng.random(shape),
        "extreme": rng.integers(0, 2, shape).astype(np.float64),
        "outlying": rng.normal(0.5, 10.0, shape),
        "equal": np.repeat(np.linspace(0, 1, SAMPLES)[:, None], shape[1], axis=1),
    }
    for name, given in cases.items():
        decoded = space.decode(given)
        yield from _batch_problems(workspace, decoded, SAMPLES, f"decoding {name} keys")
        if not np.array_equal(decoded, space.decode(given)):
            yield f"decoding {name} keys gives different layouts for the same keys"
        elif not np.array_equal(decoded[:5], space.decode(given[:5])):
            yield f"the layout that {name} keys stand for depends on the batch they are in"


def _one_layout(workspace: Workspace, seed: int) -> Iterator[str]:
    for genome in workspace.sample(2, _rng(seed)):
        layout = workspace.decode(genome)
        if not np.allclose(workspace.encode(layout), genome, rtol=1e-9, atol=1e-9):
            yield "encode(decode(genome)) is another genome"
            break
        for name, result in (("summary", workspace.summary(genome)), ("explain", workspace.explain(genome))):
            try:
                json.dumps(result)
            except (TypeError, ValueError) as error:
                yield f"{name} is not plain data: {error}"
        objective = workspace.objective("legibility")
        before, after = (float(objective(g[None])[0]) for g in (genome, workspace.prune(genome)))
        if after < before - 1e-6 * max(1.0, abs(before)):
            yield f"prune lowered the legibility, penalty subtracted, from {before:g} to {after:g}"
    broken = np.full(workspace.genome_size, np.nan)
    if not np.isnan(np.asarray(workspace.legibility(broken[None]))).all():
        yield "a genome of NaN has a score; expected NaN"
    try:
        workspace.decode(broken)
        yield "decode accepts a genome of NaN; expected a LayoutError"
    except LayoutError:
        pass


def _configuration(workspace: Workspace, seed: int) -> Iterator[str]:
    genomes = workspace.sample(8, _rng(seed))
    copies = {"a pickled copy": pickle.loads(pickle.dumps(workspace))}
    config = json.loads(json.dumps(workspace.to_config()))
    if config.get("workspace") != workspace.name:
        yield f"to_config()['workspace'] is {config.get('workspace')!r}; its name is {workspace.name!r}"
    else:
        copies["the workspace made from to_config()"] = make_workspace(config)
    for what, copy in copies.items():
        if not np.array_equal(copy.legibility(genomes), workspace.legibility(genomes)):
            yield f"{what} scores differently"
