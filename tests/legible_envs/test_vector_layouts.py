"""Layouts in vectors: one for all environments or one for each, in every form and every mode."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence

from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.layout_batches import layout_entries
from legible_envs.support.per_env import place_in_vector
from legible_envs.tabletop import TabletopWorkspace
from legible_envs.tabletop.settings import layout_entries as table_entries
from tests.legible_envs.environment_cases import IDS, KINDS, KITCHEN_ID, TABLE_ID

COUNT = 3
MODES = ["vector_entry_point", "sync", "async"]
WORKSPACES: dict[str, Any] = {
    name: (OvercookedWorkspace if name == KITCHEN_ID else TabletopWorkspace)() for name in IDS
}
GENOMES = {name: ws.sample(COUNT, np.random.default_rng(0)) for name, ws in WORKSPACES.items()}
LAYOUTS = {name: [WORKSPACES[name].decode(genome) for genome in genomes] for name, genomes in GENOMES.items()}


def forms(env_id: str) -> dict[str, Any]:
    """The same three layouts in every form that holds one for each environment."""
    genomes, layouts = GENOMES[env_id], LAYOUTS[env_id]
    drawings = [one.to_ascii() if env_id == KITCHEN_ID else one.to_json() for one in layouts]
    objects = np.empty(COUNT, dtype=object)
    objects[:] = layouts
    found = {
        "genomes": genomes,
        "genomes as float64": genomes.astype(np.float64),
        "a list of genomes": list(genomes),
        "a tuple of lists": tuple(genomes.tolist()),
        "layouts": layouts,
        "a tuple of layouts": tuple(layouts),
        "an array of layouts": objects,
        "drawings": drawings,
        "an array of drawings": np.array(drawings),
        "all sorts": [layouts[0], genomes[1].tolist(), drawings[2]],
    }
    if env_id == KITCHEN_ID:
        found |= {
            "genomes as float16": genomes.astype(np.float16),
            "genomes as int64": genomes.astype(np.int64),
            "cells": np.array([one.cells for one in (OvercookedLayout(each.cells) for each in layouts)]),
            "lists of rows": [drawing.split("\n") for drawing in drawings],
            "nested symbols": [[list(row) for row in drawing.split("\n")] for drawing in drawings],
            "rows in an array": np.array([drawing.split("\n") for drawing in drawings]),
        }
    else:
        found["mappings"] = [one.to_dict() for one in layouts]
    return found


def ids(layouts: Any) -> list[int]:
    return [int(layout.layout_id, 16) for layout in layouts]


@pytest.fixture(params=[(env_id, mode) for env_id in IDS for mode in MODES], ids="-".join)
def vector(request: pytest.FixtureRequest) -> Any:
    env_id, mode = request.param
    envs = gym.make_vec(env_id, num_envs=COUNT, vectorization_mode=mode)
    yield env_id, mode, envs
    envs.close()


def test_one_for_each_in_every_form(vector: Any) -> None:
    env_id, _, envs = vector
    other = KINDS[env_id].other
    for name, form in forms(env_id).items():
        envs.reset(seed=0, options={"layout": other})
        _, infos = envs.reset(seed=0, options={"layout": form})
        # Cells and drawings of one kitchen may differ in where the player starts, which a genome leaves open.
        expected = [layout.cells.tolist() if env_id == KITCHEN_ID else layout for layout in LAYOUTS[env_id]]
        layouts = envs.get_attr("layout")
        assert [one.cells.tolist() if env_id == KITCHEN_ID else one for one in layouts] == expected, name
        assert infos["layout_id"].tolist() == ids(layouts), name


def test_one_for_all_and_none(vector: Any) -> None:
    env_id, _, envs = vector
    first, second, third = LAYOUTS[env_id]
    _, infos = envs.reset(seed=0)
    own = infos["layout_id"].tolist()
    _, infos = envs.reset(options={"layout": GENOMES[env_id][0].astype(np.float64)})
    assert infos["layout_id"].tolist() == ids([first] * 3)
    _, infos = envs.reset(options={"layout": [second, None, third]})  # None keeps what there is
    assert infos["layout_id"].tolist() == ids([second, first, third])
    _, infos = envs.reset(options={"layout": [None] * 3})
    assert infos["layout_id"].tolist() == ids([second, first, third])
    _, infos = envs.reset()
    assert infos["layout_id"].tolist() == ids([second, first, third])
    _, infos = envs.reset(options={"layout": None})
    assert infos["layout_id"].tolist() == own
    envs.set_attr("layout", GENOMES[env_id])
    _, infos = envs.reset()
    assert infos["layout_id"].tolist() == ids(LAYOUTS[env_id])
    envs.set_attr("layout", [third, None, first])  # as in Gymnasium: None is the value, the environment's own
    _, infos = envs.reset()
    assert infos["layout_id"].tolist() == [*ids([third]), own[1], *ids([first])]


def test_a_mask_and_wrappers_leave_every_environment_its_place(vector: Any) -> None:
    env_id, _, envs = vector
    first, second, third = LAYOUTS[env_id]
    wrapped = gym.wrappers.vector.NormalizeReward(gym.wrappers.vector.RecordEpisodeStatistics(envs))
    wrapped.reset(seed=0, options={"layout": first})
    mask = np.array([False, True, True])
    wrapped.reset(options={"layout": [first, second, third], "reset_mask": mask})
    assert envs.get_attr("layout") == (first, second, third)
    mask = np.array([True, False, True])
    _, infos = wrapped.reset(options={"layout": [third, third, None], "reset_mask": mask})
    assert envs.get_attr("layout") == (third, second, third)
    assert infos["_layout_id"].tolist() == mask.tolist()


@pytest.mark.parametrize("count", [2, 4])
def test_another_number_of_layouts_is_refused_and_changes_nothing(vector: Any, count: int) -> None:
    env_id, mode, envs = vector
    envs.reset(seed=0)
    before = envs.get_attr("layout")
    layouts = [LAYOUTS[env_id][0]] * count
    if mode == "async":
        if count == 2:  # nobody tells a worker how many there are, so that too many pass
            with pytest.warns(UserWarning, match="Worker-2"), pytest.raises(LayoutError, match="must hold 3 values"):
                envs.reset(options={"layout": layouts})
        return
    with pytest.raises(LayoutError, match=f"`layout` must hold 3 values, one per environment, got {count}"):
        envs.reset(options={"layout": layouts})
    assert envs.get_attr("layout") == before


def test_a_bad_one_among_them_is_refused_and_changes_nothing(vector: Any) -> None:
    env_id, mode, envs = vector
    if mode != "vector_entry_point":
        pytest.skip("Gymnasium's vectors reset one environment after another")
    envs.reset(seed=0, options={"layout": LAYOUTS[env_id]})
    state = [rng.bit_generator.state for rng in envs.np_random]
    with pytest.raises(LayoutError):
        envs.reset(seed=5, options={"layout": [*LAYOUTS[env_id][:2], "bad\nlayout"]})
    assert envs.get_attr("layout") == tuple(LAYOUTS[env_id])
    assert [rng.bit_generator.state for rng in envs.np_random] == state


@pytest.mark.parametrize("env_id", IDS)
def test_an_environment_of_its_own_is_told_what_to_do_with_several(env_id: str) -> None:
    env = gym.make(env_id)
    env.reset(seed=0)
    before = env.unwrapped.layout
    for several in (GENOMES[env_id], LAYOUTS[env_id], GENOMES[env_id][:1]):
        with pytest.raises(LayoutError, match=r"one per environment of a vector, .* `set_attr\('layout'") as refusal:
            env.reset(options={"layout": several})
        assert refusal.value.rule == "count"
    assert env.unwrapped.layout is before
    assert place_in_vector(env.unwrapped) is None


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_what_a_workspace_decodes_a_reset_takes(env_id: str, dtype: type) -> None:
    """Such as an elite of a plain archive of pyribs, whatever the number type it keeps."""
    env, workspace = gym.make(env_id), WORKSPACES[env_id]
    for genome in workspace.sample(20, np.random.default_rng(1)).astype(dtype):
        _, info = env.reset(options={"layout": genome})
        assert info["layout_id"] == int(workspace.decode(genome).layout_id, 16)
    if env_id == KITCHEN_ID:
        with pytest.raises(LayoutError, match=r"is .*0\.5.*; expected a whole number"):
            env.reset(options={"layout": genome + dtype(0.5)})


def test_kitchens_and_genomes_are_told_apart_in_every_shape() -> None:
    """Where there are as many environments as rows, too: a genome is longer than a row."""
    for height in range(3, 65):
        for width in range(3, 65):
            shape, size = (height, width), 7 + (height - 2) * (width - 2)
            assert size > width
            assert layout_entries(np.zeros(shape, dtype=np.int8), shape) is None
            genomes = layout_entries(np.zeros((height, size)), shape)
            assert genomes is not None
            assert len(genomes) == height
    assert OvercookedWorkspace((5, 9)).genome_size == 7 + 3 * 7


def test_forms_of_one_layout_are_one() -> None:
    layout = LAYOUTS[KITCHEN_ID][0]
    drawing = layout.to_ascii()
    rows = drawing.split("\n")
    cells = layout.cells
    for one in (layout, drawing, f"\n{drawing}\n", rows, [list(row) for row in rows], np.array(rows), cells):
        assert layout_entries(one, (7, 7)) is None
    for one in (cells.tolist(), list(cells), GENOMES[KITCHEN_ID][0], GENOMES[KITCHEN_ID][0].tolist(), None, 5, []):
        assert layout_entries(one, (7, 7)) is None
    with pytest.raises(LayoutError, match=r"cells of a kitchen of shape \(7, 7\), or a genome of 32 .* \(3, 40\)"):
        layout_entries(np.zeros((3, 40)), (7, 7))
    table = LAYOUTS[TABLE_ID][0]
    for one in (table, table.to_json(), table.to_dict(), table.to_genome(), table.to_genome().tolist(), None, 5, []):
        assert table_entries(one) is None
    assert math.prod(np.shape(table_entries(np.zeros((4, 32))))) == 128


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("num_envs", [0, -1, 2.5, True, None, "3", math.nan, [], 10**400])
def test_numbers_of_environments_are_checked(env_id: str, num_envs: Any) -> None:
    with pytest.raises(ValueError, match=r"`num_envs` must be an integer (>=|from) 1"):
        gym.make_vec(env_id, num_envs=num_envs)
    if num_envs == 0:
        assert gym.make_vec(env_id, num_envs=np.int64(2)).num_envs == 2


def test_tables_in_a_vector_can_be_copied_and_made_again_from_their_spec() -> None:
    envs = gym.make_vec(TABLE_ID, num_envs=2, layout=LAYOUTS[TABLE_ID][0], max_episode_steps=3)
    again = gym.make_vec(EnvSpec.from_json(envs.spec.to_json()))
    first = envs.reset(seed=0)[0]
    assert np.array_equal(again.reset(seed=0)[0], first)
    actions = np.full((2, 2), 0.1, dtype=np.float32)
    envs.step(actions)
    twins = copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))
    for _ in range(5):
        results = [each.step(actions) for each in (envs, *twins)]
        assert all(data_equivalence(results[0], result, exact=True) for result in results[1:])
    endless = gym.make_vec(TABLE_ID, num_envs=1, max_episode_steps=-1)
    endless.reset(seed=0)
    assert not any(endless.step(np.zeros((1, 2)))[3].any() for _ in range(1801))
