"""The design problem: genomes, rules, variation, measures, objectives, configuration."""

from __future__ import annotations

import copy
import itertools
import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import LayoutError, TaskError
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace, soup_task
from legible_envs.overcooked.layout import STATION_TYPES
from legible_envs.workspace import make_workspace, register_workspace

KITCHEN = "XXOXTXX\nX     X\nC  V  F\nX     X\nX  V  D\nX     X\nXXPXSXX"


def rule_of(build) -> str:
    with pytest.raises(LayoutError) as caught:
        build()
    assert str(caught.value)
    return caught.value.rule


@given(st.integers(0, 2**32 - 1), st.sampled_from([(5, 5), (4, 9), (7, 7), (9, 6)]), st.floats(0, 0.5))
@settings(max_examples=60, deadline=None)
def test_samples_are_valid_and_round_trip(seed, shape, rate):
    ws = OvercookedWorkspace(shape)
    genomes = ws.sample(5, np.random.default_rng(seed), obstacle_rate=rate)
    assert genomes.dtype == np.int8
    assert genomes.shape == (5, 7 + (shape[0] - 2) * (shape[1] - 2))
    assert ws.valid(genomes).all()
    for genome in genomes:
        layout = ws.decode(genome)
        assert (ws.encode(layout) == genome).all()
        assert (ws.encode(layout.to_ascii()) == genome).all()
        assert layout.num_obstacles == genome[7:].sum()
        assert set(layout.stations) == set(STATION_TYPES)
        for a, b in itertools.combinations(layout.stations.values(), 2):
            assert abs(a[0] - b[0]) + abs(a[1] - b[1]) >= 2
        field = layout.distances_from(layout.access("pot"))
        assert all(field[layout.access(name)[0]] >= 0 for name in layout.stations)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=100, deadline=None)
def test_every_array_in_range_decodes_or_is_rejected(seed, distinct):
    ws = OvercookedWorkspace((5, 6), distinct_access=distinct)
    rng = np.random.default_rng(seed)
    genomes = rng.integers(ws.lower_bounds, ws.upper_bounds, size=(10, ws.genome_size), endpoint=True)
    genomes[::2] = ws.sample(5, rng)
    genomes[::2, rng.integers(ws.genome_size)] ^= 1
    valid = ws.valid(genomes)
    assert (np.isfinite(ws.legibility(genomes)) == valid).all()
    assert (np.isfinite(ws.distance(genomes)) == valid).all()
    for genome, is_valid in zip(genomes, valid, strict=True):
        if is_valid:
            assert (ws.encode(ws.decode(genome)) == genome).all()
        else:
            rule = rule_of(lambda genome=genome: ws.decode(genome))
            assert rule in {"range", "distinct", "spacing", "distinct-access", "access", "reachable"}


def test_perturbations_change_one_thing_and_stay_valid():
    ws = OvercookedWorkspace((7, 7))
    rng = np.random.default_rng(0)
    parents = ws.sample(200, rng)
    children = ws.perturb(parents, 20, rng)
    assert children.shape == (4000, ws.genome_size)
    assert ws.valid(children).all()
    difference = children != np.repeat(parents, 20, axis=0)
    stations, bits = difference[:, :7].sum(1), difference[:, 7:].sum(1)
    kinds = {"move": (stations == 1) & (bits == 0), "swap": (stations == 2) & (bits == 0)}
    change = children[:, 7:].sum(1, dtype=int) - np.repeat(parents, 20, axis=0)[:, 7:].sum(1, dtype=int)
    kinds["add"] = (stations == 0) & (bits == 1) & (change == 1)
    kinds["remove"] = (stations == 0) & (bits == 1) & (change == -1)
    assert sum(kinds.values()).all()
    assert all(0.22 < kind.mean() < 0.28 for kind in kinds.values())


def test_a_parent_without_a_valid_child_repeats_itself():
    locked = {"onion": (0, 1), "dish": (1, 0)}
    ws = OvercookedWorkspace(
        (3, 3),
        stations=("onion", "dish"),
        task={"start": "dish", "subtasks": [{"name": "a", "goals": ["onion"]}]},
        locked=locked,
    )
    parent = ws.sample(1, np.random.default_rng(0))
    assert (ws.perturb(parent, 3, np.random.default_rng(0)) == parent).all()


def test_perturbing_an_invalid_parent_is_refused():
    ws = OvercookedWorkspace((7, 7))
    with pytest.raises(LayoutError):
        ws.perturb(np.zeros((1, ws.genome_size), dtype=np.int8), 2, np.random.default_rng(0))
    with pytest.raises(ValueError, match="phase"):
        ws.perturb(ws.sample(1, np.random.default_rng(0)), 2, np.random.default_rng(0), phase=1)


def test_random_stations_are_uniform_over_what_is_valid():
    """Without obstacles every valid seating is equally likely (chi-square on a case small enough to list)."""
    from scipy.stats import chisquare

    stations = ("onion", "dish", "pot")
    task = {"start": "dish", "subtasks": [{"name": "a", "goals": ["onion"], "then": ["pot"]}]}
    ws = OvercookedWorkspace((4, 4), stations=stations, task=task)
    genomes = ws.sample(20_000, np.random.default_rng(0), obstacle_rate=0.0)
    every = np.array(list(itertools.product(range(8), repeat=3)), dtype=np.int8)
    every = every[ws.valid(np.concatenate([every, np.zeros((len(every), 4), np.int8)], axis=1))]
    codes = genomes[:, :3].astype(int) @ [64, 8, 1]
    counts = np.array([(codes == code).sum() for code in every.astype(int) @ [64, 8, 1]])
    assert counts.sum() == len(genomes)
    assert chisquare(counts).pvalue > 1e-3


def test_measures_are_obstacles_and_rank_of_reading_order():
    ws = OvercookedWorkspace((7, 7))
    genomes = ws.sample(300, np.random.default_rng(4))
    measures = ws.measures(genomes)
    ranks = {order: rank for rank, order in enumerate(itertools.permutations(ws.ranked))}
    for genome, (obstacles, rank) in zip(genomes, measures, strict=True):
        layout = ws.decode(genome)
        order = tuple(sorted(ws.ranked, key=lambda name: layout.stations[name]))
        assert rank == ranks[order]
        assert obstacles == layout.num_obstacles
        assert ws.order_names[int(rank)] == "".join(dict(zip(STATION_TYPES, "TOCFDPS", strict=True))[n] for n in order)
    assert ws.archive_dims == (26, 24)
    assert OvercookedWorkspace(ranked="all").archive_dims == (26, 5040)
    whole = OvercookedWorkspace(ranked="all")
    ranks_all = whole.measures(genomes)[:, 1]
    assert ranks_all.max() < 5040
    assert len(set(ranks_all)) > 250


def test_objectives():
    ws = OvercookedWorkspace((7, 7))
    genomes = ws.sample(1000, np.random.default_rng(8))
    legibility, distance = ws.legibility(genomes), ws.distance(genomes)
    np.testing.assert_array_equal(ws.objective("legibility")(genomes), legibility)
    np.testing.assert_array_equal(ws.objective("efficiency")(genomes), -distance)
    both = ws.objective("legible-efficient")(genomes)
    # Another sample of the same size standardises to nearly mean 0 in both terms.
    assert abs(both.mean()) < 0.2
    assert np.corrcoef(both, legibility)[0, 1] > 0.3
    capped = ws.objective("legibility", max_distance=120.0)(genomes)
    assert np.isnan(capped[distance > 120]).all()
    np.testing.assert_array_equal(capped[distance <= 120], legibility[distance <= 120])
    again = pickle.loads(pickle.dumps(ws.objective("legible-efficient")))
    np.testing.assert_array_equal(again(genomes), both)
    for name in ("legibility", "efficiency", "legible-efficient"):
        objective = ws.objective(name)
        assert objective.floor < np.nanmin(objective(genomes))
    assert set(ws.calibration) == {"legibility_mean", "legibility_sd", "distance_mean", "distance_sd"}
    with pytest.raises(ValueError, match="unknown objective"):
        ws.objective("beauty")
    with pytest.raises(ValueError, match="max_distance"):
        ws.objective("legibility", max_distance=-1)


def test_pruning_removes_what_does_nothing_and_never_lowers_the_score():
    ws = OvercookedWorkspace((7, 7))
    genomes = ws.sample(20, np.random.default_rng(9))
    for genome in genomes:
        pruned = ws.prune(genome)
        assert ws.legibility(pruned) >= ws.legibility(genome) - 1e-6
        assert ((pruned[7:] == 1) <= (genome[7:] == 1)).all()
        for simpler in ws.simplifications(pruned):
            assert ws.legibility(simpler) < ws.legibility(pruned)
        shorter = ws.prune(genome, ws.objective("efficiency"))
        assert ws.distance(shorter) <= ws.distance(genome) + 1e-9


def test_starting_from_an_existing_kitchen():
    ws = OvercookedWorkspace((7, 7), start_from=KITCHEN, relocation_cost=0.5, locked=["pot", "serving"])
    sample = ws.sample(50, np.random.default_rng(0))
    assert ws.decode(sample[0]) == OvercookedLayout.from_ascii(KITCHEN)
    assert ws.relocations(sample)[0] == 0
    pots = sample[:, ws.stations.index("pot")]
    assert (pots == pots[0]).all()
    children = ws.perturb(sample, 20, np.random.default_rng(1))
    assert (children[:, ws.stations.index("pot")] == pots[0]).all()
    moved = (children[:, :7] != sample[0, :7]).sum(axis=1)
    np.testing.assert_array_equal(ws.relocations(children), moved)
    np.testing.assert_allclose(ws.objective()(children), ws.legibility(children) - 0.5 * moved)
    assert ws.summary(children[0])["relocations"] == moved[0]


def test_forbidden_cells_stay_as_they_are():
    ws = OvercookedWorkspace((7, 7), forbidden=[(0, 3), (3, 3), (3, 2)])
    rng = np.random.default_rng(0)
    genomes = ws.perturb(ws.sample(100, rng), 20, rng)
    slot, bits = ws.rules.slots.index((0, 3)), [ws.rules.inner.index(cell) for cell in [(3, 3), (3, 2)]]
    assert not (genomes[:, :7] == slot).any()
    assert not genomes[:, [7 + bit for bit in bits]].any()
    broken = genomes[0].copy()
    broken[7 + bits[0]] = 1
    assert rule_of(lambda: ws.decode(broken)) == "forbidden"


def test_distinct_access():
    shared = "XOXXX\nT   X\nX   C\nX   X\nXPXSX"
    task = {"start": "serving", "subtasks": [{"name": "a", "goals": ["onion", "tomato", "cabbage"], "then": ["pot"]}]}
    stations = ("onion", "tomato", "cabbage", "pot", "serving")
    assert OvercookedWorkspace((5, 5), stations=stations, task=task).encode(shared).shape == (14,)
    strict = OvercookedWorkspace((5, 5), stations=stations, task=task, distinct_access=True)
    assert rule_of(lambda: strict.encode(shared)) == "distinct-access"


@pytest.mark.parametrize(
    ("drawing", "rule"),
    [
        (KITCHEN[:-8], "shape"),
        (KITCHEN.replace("X     X\nXXP", "X X   X\nXXP"), "inner"),
        (KITCHEN.replace("C  V  F", "X CV  F"), "border"),
        (KITCHEN.replace("XXOXTXX", "OXXXTXX"), "border"),
        (KITCHEN.replace("XXOXTXX", "XXO TXX"), "border"),
        (KITCHEN.replace("XXOXTXX", "XXOTXXX"), "spacing"),
        (KITCHEN.replace("XXOXTXX", "XXOXOXX"), "unique"),
        (KITCHEN.replace("XXOXTXX", "XXOXXXX"), "station"),
        (KITCHEN.replace("X     X\nC", "X V   X\nC"), "access"),
        (KITCHEN.replace("X  V  D\nX     X", "XVVVVVD\nX     X").replace("VD", " D"), "valid"),
        (KITCHEN.replace("X  V  D", "XVVVVVD"), "access"),
        (KITCHEN.replace("X     X\nX  V  D", "XVVVVVX\nX  V  D"), "reachable"),
    ],
)
def test_layouts_outside_the_rules_name_the_rule(drawing, rule):
    ws = OvercookedWorkspace((7, 7))
    if rule == "valid":
        assert ws.valid(ws.encode(drawing)[None]).all()
    else:
        assert rule_of(lambda: ws.encode(drawing)) == rule


def test_bad_genomes():
    ws = OvercookedWorkspace((7, 7))
    good = ws.sample(1, np.random.default_rng(0))[0]
    for value in (np.nan, -1, 0.5, 200, np.inf):
        genome = good.astype(float)
        genome[0] = value
        assert rule_of(lambda genome=genome: ws.decode(genome)) == "range"
        batch = np.stack([good.astype(float), genome])
        np.testing.assert_array_equal(np.isnan(ws.legibility(batch)), [False, True])
        np.testing.assert_array_equal(ws.valid(batch), [True, False])
        assert np.isfinite(ws.measures(batch)[0]).all()
    wide = good.astype(np.int64)
    wide[1] += 256  # would wrap round to a valid slot
    assert not ws.valid(wide[None])[0]
    with pytest.raises(LayoutError):
        ws.legibility(np.zeros(ws.genome_size))
    for wrong in (good[:-1], good[None], "genome"):
        with pytest.raises(ValueError, match="expected"):
            ws.decode(wrong)
    with pytest.raises(ValueError, match=r"\(n, 32\)"):
        ws.legibility(np.zeros((2, 31), dtype=np.int8))


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"shape": (2, 7)}, LayoutError, "`shape` must be an integer from 3 to 64 cells, got 2"),
        ({"shape": 7}, LayoutError, "shape"),
        ({"shape": (7, 65)}, LayoutError, "from 3 to 64 cells, got 65"),
        ({"prefix": "median"}, ValueError, "prefix"),
        ({"c": -1}, ValueError, "`c` must be a finite number >= 0, got -1"),
        ({"beta": float("nan")}, ValueError, "`beta` must be a finite number >= 0, got nan"),
        ({"ties": "first"}, ValueError, "`ties` must be 'expected' or 'strict', got 'first'"),
        ({"human": "drunk"}, ValueError, "`human` must be 'shortest' or 'boltzmann', got 'drunk'"),
        ({"pots": 0}, TaskError, "`pots` must be None or an integer >= 1, got 0"),
        ({"stations": ("onion", "onion")}, LayoutError, "different"),
        ({"stations": ("onion", "fork")}, LayoutError, "fork|different"),
        ({"ranked": ("fork",)}, ValueError, "ranked"),
        ({"locked": {"fork": (0, 1)}}, LayoutError, "lock"),
        ({"locked": {"pot": (0, 0)}}, LayoutError, "corners"),
        ({"locked": ["pot"]}, LayoutError, "start_from"),
        ({"forbidden": [(0, 0)]}, LayoutError, "forbidden cell"),
        ({"cell_costs": np.zeros((7, 7))}, ValueError, "cell_costs"),
        ({"cell_costs": np.ones((5, 5))}, ValueError, "shape"),
        ({"start_from": "XXX\nX X\nXXX"}, LayoutError, "3"),
        ({"task": {"start": "moon", "subtasks": [{"name": "a", "goals": ["onion"]}]}}, TaskError, "moon"),
    ],
)
def test_bad_arguments(arguments, error, message):
    with pytest.raises(error, match=message):
        OvercookedWorkspace(**arguments)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(33, 33), (34, 33), (33, 34), (64, 64), (3, 64)])
def test_genomes_of_every_shape(shape):
    """Genomes are int8 where that holds every slot, as they always were, and int16 beyond."""
    ws = OvercookedWorkspace(shape)
    wide = sum(shape) > 67
    assert ws.genome_dtype == (np.int16 if wide else np.int8)
    assert ws.lower_bounds.dtype == ws.upper_bounds.dtype == ws.genome_dtype
    assert ws.upper_bounds[0] == len(ws.rules.slots) - 1 == 2 * sum(shape) - 9
    rng = np.random.default_rng(0)
    genomes = ws.sample(3, rng, obstacle_rate=0.02)
    last = np.r_[ws.upper_bounds[:1], genomes[0, 1:]]  # a station in the last slot
    genomes[0] = np.where(ws.valid(last[None])[0], last, genomes[0])
    children = ws.perturb(genomes, 4, rng)
    keys = ws.key_decoder()
    for batch in (genomes, children, keys.decode(keys.encode(children), children, rng)):
        assert batch.dtype == ws.genome_dtype
        assert ws.valid(batch).all()
        assert all(np.array_equal(ws.encode(ws.decode(genome)), genome) for genome in batch)
        assert ws.valid(batch.astype(np.int64)).all()
        assert not ws.valid(batch.astype(np.int64) + 2**16).any()
        assert np.array_equal(ws.measures(batch), ws.measures(batch.astype(float)))
    assert np.array_equal(keys.decode(keys.encode(children), children, rng), children)
    assert ws.simplifications(genomes[0]).dtype == ws.genome_dtype
    with pytest.raises(LayoutError, match="gene 0"):
        ws.decode(genomes[0].astype(np.int64) + 2**16)


@pytest.mark.slow
def test_scores_of_genomes_in_wide_integers_are_those_of_the_layout():
    ws = OvercookedWorkspace((3, 66 - 2))
    big = OvercookedWorkspace((40, 40), recipes=[["onion", "fish"]])
    for workspace, rate in ((ws, 0.0), (big, 0.1)):
        genomes = workspace.sample(2, np.random.default_rng(1), obstacle_rate=rate)
        for genome, score, distance in zip(genomes, *workspace.scores(genomes), strict=True):
            summary = workspace.summary(genome)
            assert np.isclose(summary["score"], score, rtol=1e-9)
            assert np.isclose(summary["distance"], distance, rtol=1e-9)


def test_archives_of_wide_genomes_lose_nothing():
    ribs = pytest.importorskip("ribs")
    from optimizers import make_archive

    assert ribs
    ws = OvercookedWorkspace((40, 40))
    archive = make_archive(ws, score_floor=0.0)
    genomes = ws.sample(5, np.random.default_rng(0), obstacle_rate=0.05)
    archive.add(genomes, np.arange(5.0), ws.measures(genomes))
    assert archive.data("solution").dtype == np.int16
    assert {tuple(row) for row in archive.data("solution")} <= {tuple(row) for row in genomes}


def test_no_room():
    ws = OvercookedWorkspace((4, 4))
    with pytest.raises(LayoutError, match="no valid layout"):
        ws.sample(1, np.random.default_rng(0))


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"shape": (5, 9), "prefix": (0.2, 0.5), "c": 2, "beta": 0.5, "ties": "strict", "pots": 1, "ranked": "all"},
        {"start_from": KITCHEN, "relocation_cost": 1.0, "locked": ["pot"], "forbidden": [(3, 3)]},
        {"cell_costs": np.full((7, 7), 2.0), "distinct_access": True},
        {"task": soup_task([("onion", "fish")]), "recipes": [("onion", "fish")]},
    ],
)
def test_configuration_round_trips(arguments):
    ws = OvercookedWorkspace(**arguments)
    config = json.loads(json.dumps(ws.to_config()))
    again = make_workspace(config)
    assert again == ws
    assert again.to_config() == ws.to_config()
    for other in (pickle.loads(pickle.dumps(ws)), copy.deepcopy(ws)):
        genomes = ws.sample(5, np.random.default_rng(0))
        np.testing.assert_array_equal(other.legibility(genomes), ws.legibility(genomes))
    assert repr(ws).startswith("OvercookedWorkspace(")


def test_workspaces_by_name():
    assert make_workspace("overcooked", shape=(5, 5)).shape == (5, 5)
    assert make_workspace("legible_envs.overcooked.design.workspace:OvercookedWorkspace").shape == (7, 7)

    class Tiny(OvercookedWorkspace):
        name = "tiny"

    register_workspace("tiny", Tiny)
    assert isinstance(make_workspace({"workspace": "tiny"}), Tiny)
    for bad, message in [
        ("nowhere", "no workspace named"),
        ({"workspace": "overcooked", "colour": 1}, "unknown settings"),
        ({}, "needs the key"),
        ("json:dumps", "not a subclass"),
        ("no.such.module:Thing", "cannot be imported"),
    ]:
        with pytest.raises(ValueError, match=message):
            make_workspace(bad)


def test_two_workspaces_with_different_recipes_live_side_by_side():
    soups = OvercookedWorkspace((7, 7))
    onions = OvercookedWorkspace((7, 7), recipes=[("onion",) * 3])
    genomes = soups.sample(20, np.random.default_rng(0))
    before = soups.legibility(genomes).copy()
    other = onions.legibility(genomes)
    np.testing.assert_array_equal(soups.legibility(genomes), before)
    assert not np.allclose(other, before)


def test_candidate_sets_must_not_be_mixed():
    """The score by precedence and the score with one pot are different quantities."""
    genomes = OvercookedWorkspace((7, 7)).sample(500, np.random.default_rng(0))
    free, one = (OvercookedWorkspace((7, 7), pots=pots).legibility(genomes) for pots in (None, 1))
    from scipy.stats import spearmanr

    assert 0.2 < spearmanr(free, one).statistic < 0.95
