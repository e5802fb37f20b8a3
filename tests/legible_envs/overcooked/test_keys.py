"""Random keys of kitchens: every vector is a valid kitchen, every valid kitchen has a vector."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.overcooked.design.keys import KitchenKeys

KITCHENS = [
    OvercookedWorkspace(shape=(5, 5)),
    OvercookedWorkspace(shape=(5, 9), distinct_access=True, locked={"pot": (0, 3)}, forbidden=[(2, 2), (4, 4)]),
    OvercookedWorkspace(shape=(9, 9)),
]


@pytest.mark.parametrize("workspace", KITCHENS, ids=["5x5", "5x9-ruled", "9x9"])
def test_kitchens_and_keys_there_and_back(workspace):
    keys = workspace.key_decoder()
    assert isinstance(keys, KitchenKeys)
    rng = np.random.default_rng(0)
    genomes = workspace.sample(300, rng)
    encoded = keys.encode(genomes)
    assert ((encoded > 0) & (encoded < 1)).all()
    np.testing.assert_array_equal(keys.decode(encoded, genomes, rng), genomes)
    anything = np.concatenate([rng.random((300, keys.size)), rng.normal(0.5, 3.0, (300, keys.size))])
    decoded = keys.decode(anything, genomes, rng)
    assert decoded.dtype == workspace.genome_dtype
    assert workspace.valid(decoded).all()
    np.testing.assert_array_equal(decoded, keys.decode(anything, genomes[::-1], np.random.default_rng(9)))


def literal_kitchen(workspace, keys):
    """The decoder's rules as sentences: the nearest place that leaves room, then obstacles in descending order."""
    stations, slots = len(workspace.stations), len(workspace.rules.slots)
    allowed, compatible = workspace.rules.geometry.allowed, workspace.rules.geometry.compatible

    def place(chosen):
        i = len(chosen)
        if i == stations:
            return chosen
        at = keys[i] * slots - 0.5
        ring = sorted(range(slots), key=lambda s: min(abs(s - at), slots - abs(s - at)))
        for slot in ring:
            if allowed[i, slot] and all(compatible[slot, other] for other in chosen):
                found = place([*chosen, slot])
                if found:
                    return found
        return None

    genome = np.zeros(workspace.genome_size, dtype=np.int8)
    genome[:stations] = place([])
    for cell in sorted(range(len(keys) - stations), key=lambda cell: -keys[stations + cell]):
        if keys[stations + cell] > 0.5:
            genome[stations + cell] = 1
            genome[stations + cell] = workspace.valid(genome[None])[0]
    return genome


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([KITCHENS[0], KITCHENS[2]]))
def test_the_kernel_reads_kitchens_as_its_rules_say(seed, workspace):
    keys = np.random.default_rng(seed).random((1, workspace.genome_size))
    decoded = workspace.key_decoder().decode(keys, np.zeros((1, 0)), np.random.default_rng(0))
    np.testing.assert_array_equal(decoded[0], literal_kitchen(workspace, keys[0]))
