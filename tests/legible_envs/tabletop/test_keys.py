"""Random keys of tables: the kernel decodes them as the rules say in plain sentences."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from legible_envs.tabletop import TabletopWorkspace
from legible_envs.tabletop.design.keys import TableKeys

WORKSPACES = {
    "both": TabletopWorkspace(),
    "placement": TabletopWorkspace(condition="placement", object_spacing=0.11),
    "obstacles": TabletopWorkspace(condition="obstacles"),
    "strict": TabletopWorkspace(max_obstacles=2, max_detour=1.1, object_clearance=0.06),
}
MOVES = sorted(
    ((a * 0.005, b * 0.005) for a in range(-140, 141) for b in range(-100, 101)), key=lambda m: m[0] ** 2 + m[1] ** 2
)
TURNS = (0.0, math.pi / 4, -math.pi / 4, math.pi / 2)
SHIFTS = np.array(
    sorted(
        (
            (a * 0.02, b * 0.02, turn)
            for a, b, turn in itertools.product(range(-7, 8), range(-7, 8), TURNS)
            if math.hypot(a * 0.02, b * 0.02) <= 0.15
        ),
        key=lambda s: s[0] ** 2 + s[1] ** 2 + (s[2] * 0.05) ** 2,
    )
)


def literal_table(workspace, keys):
    """Objects one after the other at the nearest place with room, then each obstacle at the nearest valid pose."""
    low, high = workspace.lower_bounds, workspace.upper_bounds
    wanted = low + np.clip(keys, 0, 1) * (high - low)
    first = 2 * len(workspace.rules.movable)
    placed: list[tuple[float, float]] = []
    for i in range(0, first, 2):
        for dx, dy in MOVES:
            x, y = wanted[i] + dx, wanted[i + 1] + dy
            inside = low[i] <= x <= high[i] and low[i + 1] <= y <= high[i + 1]
            # objects that all stay are not compared with one another
            stay = not workspace.rules.moves_objects
            if inside and (
                stay or all(math.dist((x, y), at) >= workspace.rules.object_spacing - 1e-9 for at in placed)
            ):
                placed.append((x, y))
                break
    genome = np.zeros(workspace.genome_size)
    genome[:first] = np.ravel(placed)
    to = first
    for at in range(first, workspace.genome_size, 4):
        if wanted[at] > 0.5:
            tried = np.repeat(genome[None], len(SHIFTS), axis=0)
            tried[:, to] = 1
            tried[:, to + 1 : to + 4] = wanted[at + 1 : at + 4] + SHIFTS
            angle = tried[:, to + 3]
            tried[:, to + 3] = np.where(SHIFTS[:, 2] == 0, angle, angle - math.pi * np.round(angle / math.pi))
            allowed = workspace.valid(tried)
            if allowed.any():
                genome = tried[int(np.argmax(allowed))]
                to += 4
    return genome


@pytest.mark.slow
@pytest.mark.parametrize("name", WORKSPACES)
def test_the_kernel_reads_tables_as_its_rules_say(name):
    workspace = WORKSPACES[name]
    space = workspace.continuous()
    assert isinstance(space.decoder, TableKeys)
    keys = np.random.default_rng(0).random((150, space.solution_dim))
    keys = np.concatenate([keys, space.sample(50, np.random.default_rng(1)) + np.linspace(-0.1, 0.1, 50)[:, None]])
    expected = np.array([literal_table(workspace, row) for row in keys])
    np.testing.assert_allclose(space.decode(keys), expected, rtol=0, atol=1e-12)


def test_objects_that_find_no_room_lie_as_in_a_valid_table(monkeypatch):
    workspace = WORKSPACES["placement"]
    decoder = TableKeys(workspace, workspace.rules)
    keys = np.random.default_rng(2).random((100, decoder.size))
    expected = decoder.decode(keys)
    # without steps to other places only tables that are valid as they are come back
    monkeypatch.setattr(decoder, "_moves", np.zeros((1, 3)))
    genomes = decoder.decode(keys)
    fell_back = (genomes == decoder.decode(np.zeros((1, decoder.size)))).all(axis=1)
    assert 10 < fell_back.sum() < 100
    assert workspace.valid(genomes).all()
    np.testing.assert_array_equal(genomes[~fell_back], expected[~fell_back])


def test_a_small_step_lays_an_obstacle_where_there_was_none():
    workspace = WORKSPACES["both"]
    space = workspace.continuous()
    keys = space.sample(400, np.random.default_rng(3))
    assert (workspace.num_obstacles(space.decode(keys)) == 0).all()
    stepped = keys + np.random.default_rng(4).normal(0, 0.2, keys.shape)
    assert (workspace.num_obstacles(space.decode(stepped)) > 0).mean() > 0.2
