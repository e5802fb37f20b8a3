"""Edits and their masks against plain Python, on kitchens, tables and workspaces of other packages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.design_game.edits import KEEP, Edits
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.tabletop import TabletopWorkspace
from legible_envs.workspace import Workspace
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.valley_workspace import Valley

FOUR = ("onion", "dish", "pot", "serving")
WORKSPACES: dict[str, Workspace] = {
    "kitchen": OvercookedWorkspace(shape=(5, 6)),
    "locked kitchen": OvercookedWorkspace(
        shape=(5, 5),
        locked={"pot": (0, 2)},
        forbidden=[(2, 2)],
        distinct_access=True,
        stations=FOUR,
        recipes=[["onion"]],
    ),
    "table": TabletopWorkspace(),
    "obstacles": TabletopWorkspace(condition="obstacles"),
    "shelf": ShelfWorkspace(),
    "valley": Valley(),
}
LEVELS = 4


def edits_by_definition(workspace: Workspace, genome: Any) -> list[Any]:
    """What every edit makes of a genome, one after the other as the documentation lists them."""
    low, high = workspace.lower_bounds.tolist(), workspace.upper_bounds.tolist()
    whole = np.issubdtype(workspace.genome_dtype, np.integer)
    results, wide = [list(genome)], []
    for gene, (a, b) in enumerate(zip(low, high, strict=True)):
        values = list(range(a, b + 1)) if whole else [a + (b - a) * i / (LEVELS - 1) for i in range(LEVELS)]
        if a == b:
            continue
        if whole and b - a == 1:
            results.append([a + b - x if i == gene else x for i, x in enumerate(genome)])
            continue
        wide.append(gene)
        results += [[value if i == gene else x for i, x in enumerate(genome)] for value in values]
    if whole:
        for number, i in enumerate(wide):
            for j in wide[number + 1 :]:
                if (low[i], high[i]) == (low[j], high[j]):
                    swapped = list(genome)
                    swapped[i], swapped[j] = genome[j], genome[i]
                    results.append(swapped)
    return results


@pytest.mark.parametrize("name", WORKSPACES)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_edits_and_masks_are_those_of_the_definition(name: str, seed: int) -> None:
    workspace, rng = WORKSPACES[name], np.random.default_rng(seed)
    edits = Edits(workspace, LEVELS)
    genomes = workspace.perturb(workspace.sample(2, rng), 1, rng, phase=workspace.phases - 1)
    masks, candidates = edits.masks(genomes, workspace.valid), edits.candidates(genomes)
    for genome, mask, made in zip(genomes, masks, candidates, strict=True):
        expected = edits_by_definition(workspace, genome.tolist())
        assert len(expected) == edits.size
        assert np.allclose(made, expected, rtol=0, atol=1e-12)
        actions = np.arange(edits.size)
        assert np.array_equal(edits.apply(np.repeat(genome[None], edits.size, axis=0), actions), made)
        for action, edited in enumerate(made):
            good = bool(workspace.valid(edited[None])[0]) and not np.array_equal(edited, genome)
            assert mask[action] == (good or action == KEEP)


def test_masks_are_the_same_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    workspace = WORKSPACES["kitchen"]
    genomes = workspace.sample(5, np.random.default_rng(0))
    whole = Edits(workspace).masks(genomes, workspace.valid)
    calls: list[int] = []

    def allowed(batch: Any) -> Any:
        calls.append(len(batch))
        return workspace.valid(batch)

    assert np.array_equal(Edits(workspace).masks(genomes, allowed), whole)
    assert calls == [whole.size]  # all edits of all layouts in one call
    monkeypatch.setattr("legible_envs.design_game.edits._BATCH", 1)
    calls.clear()
    assert np.array_equal(Edits(workspace).masks(genomes, allowed), whole)
    assert calls == [whole.shape[1]] * 5


def test_every_layout_of_a_kitchen_can_be_reached() -> None:
    """Valid edits alone lead from any kitchen to any other, stations that change places included."""
    workspace = OvercookedWorkspace(shape=(4, 4), stations=FOUR, recipes=[["onion"]])
    edits, seen = Edits(workspace), set()
    frontier = workspace.sample(1, np.random.default_rng(0))
    while len(frontier):
        seen |= {genome.tobytes() for genome in frontier}
        reached = edits.candidates(frontier)[edits.masks(frontier, workspace.valid)]
        frontier = np.array([g for g in np.unique(reached, axis=0) if g.tobytes() not in seen]).reshape(-1, 8)
        frontier = frontier.astype(workspace.genome_dtype)
    slots = np.stack(np.meshgrid(*[np.arange(n) for n in (8, 8, 8, 8, 2, 2, 2, 2)], indexing="ij"), axis=-1).reshape(
        -1, 8
    )
    everything = slots[workspace.valid(slots)]
    assert len(seen) == len(everything) > 100


def test_edits_are_told_in_words() -> None:
    edits = Edits(WORKSPACES["kitchen"])
    words = [edits.describe(action) for action in (0, 1, edits.size - 22, edits.size - 1)]
    assert words == ["keep the layout", "set gene 0 to 0", "toggle gene 18", "swap genes 5 and 6"]


def test_large_ranges_are_edited_in_levels() -> None:
    class Wide(ShelfWorkspace):
        upper_bounds = property(lambda self: np.full(3, 5000, dtype=np.int64))
        lower_bounds = property(lambda self: np.zeros(3, dtype=np.int64))
        genome_dtype = property(lambda self: np.dtype(np.int64))

    edits = Edits(Wide(), 5)
    assert edits.values[1:6].tolist() == [0, 1250, 2500, 3750, 5000]
    with pytest.raises(ValueError, match=r"`levels` must be an integer from 2 to 1024, got 1"):
        Edits(WORKSPACES["table"], 1)
