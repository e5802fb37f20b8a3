"""The continuous face of workspaces: every vector of keys is a valid layout, every valid layout has a vector."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.errors import LayoutError, WorkspaceError
from legible_envs.key_space import KeySpace
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.random_keys import BoundedKeys, KeyDecoder
from legible_envs.tabletop import TabletopLayout, TabletopWorkspace
from legible_envs.workspace_checks import check_workspace
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.valley_workspace import Valley

KITCHENS = {
    "5x5": OvercookedWorkspace(shape=(5, 5)),
    "7x7": OvercookedWorkspace(),
    "5x9 ruled": OvercookedWorkspace(
        shape=(5, 9), distinct_access=True, locked={"pot": (0, 3)}, forbidden=[(2, 2), (4, 4)]
    ),
    "four stations": OvercookedWorkspace(
        shape=(4, 6), stations=("onion", "dish", "pot", "serving"), recipes=[["onion"] * 3]
    ),
}
TABLES = {
    "both": TabletopWorkspace(),
    "placement": TabletopWorkspace(condition="placement", object_spacing=0.12),
    "obstacles": TabletopWorkspace(condition="obstacles"),
    "strict": TabletopWorkspace(max_obstacles=2, max_detour=1.1, object_clearance=0.06),
}
DESIGNS = {**KITCHENS, **TABLES, "shelf": ShelfWorkspace(), "valley": Valley()}
every_design = pytest.mark.parametrize("workspace", DESIGNS.values(), ids=DESIGNS)


def varied(workspace, n, seed=0):
    """Random valid genomes after some steps of every phase, so that tables have obstacles too."""
    rng = np.random.default_rng(seed)
    genomes = workspace.sample(n, rng)
    for _ in range(4):
        for phase in range(workspace.phases):
            genomes = workspace.perturb(genomes, 1, rng, phase=phase)
    return genomes


def hard_keys(m, rng, n=60):
    """Random, extreme, outlying and equal keys."""
    corners = rng.integers(0, 2, (n, m)).astype(float)
    equal = np.repeat(np.linspace(0, 1, n)[:, None], m, axis=1)
    edges = np.nextafter(corners, 1 - corners)
    huge = np.stack([np.full(m, -1e300), np.full(m, 1e300), np.full(m, 0.5), np.full(m, -0.0)])
    return np.concatenate([rng.random((n, m)), corners, edges, rng.normal(0.5, 5.0, (n, m)), equal, huge])


@pytest.mark.slow
@every_design
def test_genomes_come_back_from_their_keys(workspace):
    space = workspace.continuous()
    genomes = varied(workspace, 1500)
    keys = space.encode(genomes)
    assert keys.shape == (1500, space.solution_dim)
    assert ((keys >= 0) & (keys <= 1)).all()
    back = space.decode(keys)
    assert back.dtype == workspace.genome_dtype
    if np.issubdtype(workspace.genome_dtype, np.integer):
        np.testing.assert_array_equal(back, genomes)
    else:
        np.testing.assert_allclose(back, genomes, rtol=0, atol=1e-14)


@pytest.mark.slow
@every_design
def test_every_vector_is_a_valid_layout_with_a_score(workspace):
    space = workspace.continuous()
    keys = hard_keys(space.solution_dim, np.random.default_rng(1))
    genomes = space.decode(keys)
    assert workspace.valid(genomes).all()
    assert space.valid(keys).all()
    for values in (space.legibility(keys), space.distance(keys), space.measures(keys)):
        assert np.isfinite(values).all()
    np.testing.assert_array_equal(space.legibility(keys), workspace.legibility(genomes))
    # The same keys, whatever else is in the batch, and however far they lie outside.
    np.testing.assert_array_equal(space.decode(keys[::-3]), genomes[::-3])
    np.testing.assert_array_equal(space.decode(np.clip(keys, 0, 1)), genomes)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(space)).decode(keys[:20]), genomes[:20])


@every_design
def test_what_was_decoded_stays_where_it_is(workspace):
    space = workspace.continuous()
    genomes = space.decode(np.random.default_rng(2).random((300, space.solution_dim)))
    np.testing.assert_allclose(space.decode(space.encode(genomes)), genomes, rtol=0, atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(sorted(TABLES)))
def test_objects_that_have_room_stay_where_their_keys_put_them(seed, name):
    workspace = TABLES[name]
    space = workspace.continuous()
    rng = np.random.default_rng(seed)
    keys = rng.random((1, space.solution_dim))
    n = 2 * len(workspace.rules.movable)
    low, high = workspace.lower_bounds[:n], workspace.upper_bounds[:n]
    wanted, got = low + keys[0, :n] * (high - low), space.decode(keys)[0, :n]
    moved = np.hypot(*(wanted - got).reshape(-1, 2).T)
    first = int(np.argmax(moved > 1e-12)) if (moved > 1e-12).any() else len(moved)
    for i in range(first + 1, len(moved)):
        # an object that moved had too little room among those before it
        if moved[i] > 1e-12:
            before = got.reshape(-1, 2)[:i]
            assert (np.hypot(*(before - wanted.reshape(-1, 2)[i]).T) < workspace.rules.object_spacing).any()
    assert moved.max(initial=0) < 0.45
    assert moved[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("name", TABLES)
def test_obstacles_near_a_place_where_they_are_allowed_are_kept(name):
    workspace = TABLES[name]
    if workspace.condition == "placement":
        pytest.skip("has none")
    space = workspace.continuous()
    genomes = varied(workspace, 400, seed=3)
    shaken = space.encode(genomes)
    first = 2 * len(workspace.rules.movable)
    there = workspace.num_obstacles(genomes) > 0
    shaken[:, first:] += np.random.default_rng(0).normal(0, 0.005, shaken[:, first:].shape)
    kept = workspace.num_obstacles(space.decode(shaken))
    assert (kept >= workspace.num_obstacles(genomes))[there].mean() > 0.95


def test_random_keys_reach_every_kind_of_kitchen_and_table():
    kitchen, table = OvercookedWorkspace(), TabletopWorkspace()
    space = kitchen.continuous()
    genomes = space.decode(np.random.default_rng(0).random((30_000, space.solution_dim)))
    slots = np.stack([np.bincount(genomes[:, i], minlength=20) for i in range(7)]) / len(genomes)
    assert slots.min() > 0.4 / 20
    assert slots.max() < 1.6 / 20
    orders = np.bincount(kitchen.measures(genomes)[:, 1].astype(int), minlength=24) / len(genomes)
    assert orders.min() > 0.85 / 24
    assert orders.max() < 1.15 / 24
    bits = genomes[:, 7:].mean(axis=0)
    assert bits.min() > 0.1
    assert bits.max() < 0.5
    space = table.continuous()
    genomes = space.decode(np.random.default_rng(0).random((2000, space.solution_dim)))
    numbers = np.bincount(table.num_obstacles(genomes), minlength=5) / len(genomes)
    np.testing.assert_allclose(numbers, np.array([1, 4, 6, 4, 1]) / 16, atol=0.04)
    orders = np.bincount(table.measures(genomes)[:, 1].astype(int), minlength=24)
    assert orders.min() > 0.5 * 2000 / 24


# -- the door ----------------------------------------------------------------------------------------------------------

SPACE = KITCHENS["5x5"].continuous()
M = SPACE.solution_dim


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (np.zeros((3, M - 1)), rf"expected keys of shape \(n, {M}\) or \({M},\), got \(3, {M - 1}\)"),
        (np.zeros((2, 3, M)), rf"got \(2, 3, {M}\)"),
        ([[0.1, 0.2], [0.3]], "rows of different lengths"),
        (np.zeros((2, M), dtype=complex), "expected numeric keys, got dtype complex128"),
        (np.full((2, M), "a"), "expected numeric keys, got dtype <U1"),
        (np.full((2, M), None), "expected numeric keys, got dtype object"),
        (np.ma.masked_equal(np.eye(2, M), 1), "without masked entries"),
    ],
)
def test_what_are_no_keys_is_refused(keys, message):
    for method in (SPACE.decode, SPACE.legibility, SPACE.distance, SPACE.measures, SPACE.valid, SPACE.evaluate):
        with pytest.raises(ValueError, match=message):
            method(keys)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_keys_that_are_not_finite_are_refused(bad):
    keys = np.full((4, M), 0.5)
    keys[2, 5] = bad
    with pytest.raises(ValueError, match=f"keys must be finite numbers, got {bad:g} in row 2, key 5"):
        SPACE.legibility(keys)
    with pytest.raises(ValueError, match=f"got {bad:g} in key 5"):
        SPACE.layout(keys[2])


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.longdouble, ">f8", np.int8, bool, np.uint64])
def test_keys_of_any_numeric_type_are_read(dtype):
    keys = (np.random.default_rng(0).random((50, M)) > 0.5).astype(dtype)
    np.testing.assert_array_equal(SPACE.decode(keys), SPACE.decode(keys.astype(np.float64)))
    np.testing.assert_array_equal(SPACE.decode(keys.tolist()), SPACE.decode(keys.astype(np.float64)))


def test_one_vector_gives_one_result():
    keys = SPACE.sample(3, np.random.default_rng(0))
    genome = SPACE.decode(keys[1])
    assert genome.shape == (KITCHENS["5x5"].genome_size,)
    assert SPACE.legibility(keys[1]) == SPACE.legibility(keys)[1]
    assert isinstance(SPACE.distance(keys[1]), float)
    assert isinstance(SPACE.layout(keys[1]), OvercookedLayout)
    assert isinstance(TABLES["both"].continuous().layout(np.full(32, 0.3)), TabletopLayout)
    np.testing.assert_array_equal(SPACE.encode(genome), SPACE.encode(genome[None])[0])
    with pytest.raises(ValueError, match="expected one vector of keys"):
        SPACE.layout(keys)
    with pytest.raises(ValueError, match=rf"expected keys of shape \(n, {M}\)"):
        SPACE.measures(keys[1])
    assert SPACE.decode(np.zeros((0, M))).shape == (0, KITCHENS["5x5"].genome_size)


def test_layouts_that_are_not_valid_have_no_keys():
    genomes = KITCHENS["5x5"].sample(3, np.random.default_rng(0))
    genomes[1, 0] = genomes[1, 1]
    with pytest.raises(LayoutError):
        SPACE.encode(genomes)
    with pytest.raises(LayoutError):
        SPACE.encode(genomes + 0.5)


# -- objectives --------------------------------------------------------------------------------------------------------


@every_design
@pytest.mark.parametrize("name", ["legibility", "efficiency", "legible-efficient"])
def test_objectives_are_those_of_genomes(workspace, name):
    space = workspace.continuous()
    keys = np.random.default_rng(4).random((50, space.solution_dim))
    objective = space.objective(name)
    np.testing.assert_array_equal(objective(keys), workspace.objective(name)(space.decode(keys)))
    values, measures = space.evaluate(keys, name)
    np.testing.assert_array_equal(values, objective(keys))
    np.testing.assert_array_equal(measures, space.measures(keys))
    assert objective.floor == workspace.objective(name).floor


def test_layouts_beyond_a_cap_score_below_all_others_and_never_nan():
    workspace = KITCHENS["7x7"]
    space = workspace.continuous()
    keys = np.random.default_rng(5).random((2000, space.solution_dim))
    capped, on_genomes = space.objective(max_distance=120), workspace.objective(max_distance=120)
    values, expected, distance = capped(keys), on_genomes(space.decode(keys)), space.distance(keys)
    beyond = np.isnan(expected)
    assert 0 < beyond.sum() < len(keys)
    np.testing.assert_array_equal(values[~beyond], expected[~beyond])
    np.testing.assert_allclose(values[beyond], capped.floor - (distance[beyond] - 120))
    assert values[beyond].max() < values[~beyond].min()
    assert repr(capped).endswith(".continuous().objective('legibility', max_distance=120)")
    np.testing.assert_array_equal(space.evaluate(keys, capped)[0], values)


def test_wrong_objectives_are_named():
    with pytest.raises(ValueError, match="unknown objective 'beauty'"):
        SPACE.objective("beauty")
    with pytest.raises(ValueError, match="`max_distance` must be None or a finite number > 0"):
        SPACE.objective(max_distance=-1)
    with pytest.raises(TypeError, match="`objective` must be a name or what objective"):
        SPACE.evaluate(np.zeros((1, M)), lambda keys: keys[:, 0])


def test_the_box_is_as_pyribs_wants_it():
    assert SPACE.bounds == [(0.0, 1.0)] * M
    np.testing.assert_array_equal(SPACE.lower_bounds, np.zeros(M))
    np.testing.assert_array_equal(SPACE.upper_bounds, np.ones(M))
    workspace = KITCHENS["5x5"]
    for name in ("measure_names", "archive_dims", "archive_ranges", "score_floor"):
        assert getattr(SPACE, name) == getattr(workspace, name)
    assert SPACE == workspace.continuous() != KITCHENS["7x7"].continuous()
    assert hash(SPACE) == hash(workspace.continuous())
    assert repr(SPACE) == f"{workspace!r}.continuous()"


# -- decoders of other packages ----------------------------------------------------------------------------------------


def test_repair_without_an_anchor_keeps_the_genes_there_is_room_for():
    shelf = ShelfWorkspace()
    keys = BoundedKeys(shelf)
    genomes = shelf.all_genomes()
    np.testing.assert_array_equal(keys.decode(keys.encode(genomes)), genomes)
    raw = np.random.default_rng(1).random((400, shelf.genome_size))
    decoded = keys.decode(raw)
    wanted = np.minimum(np.floor(raw * (shelf.upper_bounds + 1.0)), shelf.upper_bounds)
    assert shelf.valid(decoded).all()
    already = shelf.valid(wanted)
    np.testing.assert_array_equal(decoded[already], wanted[already])
    # The lamps may be anything; of three boxes mostly two or three stand where they should.
    np.testing.assert_array_equal(decoded[:, 3:], wanted[:, 3:])
    assert ((decoded[:, :3] == wanted[:, :3]).sum(axis=1) >= 2).mean() > 0.85
    with pytest.raises(ValueError, match="`rng` must be a numpy Generator"):
        keys.decode(raw, shelf.sample(400, np.random.default_rng(0)))


class Broken(BoundedKeys):
    """Decodes without repairing."""

    def decode(self, keys, anchors=None, rng=None):
        return self._stretch(keys)


class BrokenShelf(ShelfWorkspace):
    def key_decoder(self):
        return Broken(self)


class NoDecoder(ShelfWorkspace):
    def key_decoder(self):
        return None


class AnchorsNeeded(ShelfWorkspace):
    def key_decoder(self):
        class Old(BoundedKeys):
            def decode(self, keys, anchors, rng):
                return super().decode(keys, anchors, rng)

        return Old(self)


def test_decoders_that_break_the_contract_are_named():
    with pytest.raises(RuntimeError, match="BrokenShelf are wrong; check_workspace says what"):
        BrokenShelf().continuous().legibility(np.zeros((2, 6)))
    with pytest.raises(TypeError, match=r"NoDecoder\.key_decoder\(\) must return a KeyDecoder .* NoneType"):
        NoDecoder().continuous()
    for workspace, problem in (
        (BrokenShelf(), "decoding random keys returned .* genomes that `valid` rejects"),
        (NoDecoder(), "must return a KeyDecoder"),
        (AnchorsNeeded(), "anchors"),
    ):
        with pytest.raises(WorkspaceError, match=problem):
            check_workspace(workspace)


@pytest.mark.usefixtures("aisle_package")
@pytest.mark.parametrize("heavy", [False, True])
def test_a_workspace_of_another_package_has_a_continuous_face(heavy):
    from legible_envs.workspace import make_workspace

    space = make_workspace("aisle", heavy=heavy).continuous()
    assert isinstance(space, KeySpace)
    assert isinstance(space.decoder, KeyDecoder)
    keys = hard_keys(space.solution_dim, np.random.default_rng(0), n=20)
    assert space.valid(keys).all()
    assert np.isfinite(space.legibility(keys)).all()
