"""Trajectories: values, prefixes, files, and walks cut out of played episodes."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import legible_envs
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.trajectories import (
    dispensers_in_reach,
    find_walks,
    trajectories_from_views,
)
from legible_envs.rollouts import (
    CUTS,
    Trajectory,
    load_trajectories,
    read_csv,
    record_episode,
    save_trajectories,
    write_csv,
)
from legible_envs.tabletop import Table, TableObject, TabletopLayout, VirtualObstacle

assert legible_envs

KITCHENS = [
    OvercookedLayout.from_ascii("XOXTX\nX   X\nD   P\nXXSXX"),
    OvercookedLayout.from_ascii("XXPXX\nO  2O\nX1  X\nXDXSX"),
]
TABLES = [
    TabletopLayout([TableObject("cup", (0.1 + 0.2, 0.5)), TableObject("Löffel", (0.6, 1 / 3), size=(0.1, 0.02))]),
    TabletopLayout([TableObject("cup", (0.3, 0.5))], [VirtualObstacle((0.4, 0.2), 0.3)], Table(hand=0.03)),
]
TEXT = st.text(max_size=5)
NAMES = st.lists(st.text(min_size=1, max_size=5), min_size=1, max_size=4, unique=True)


@st.composite
def walks(draw: st.DrawFn, grid: bool) -> Trajectory:
    count = draw(st.integers(0, 7))
    numbers = st.integers(-9, 70) if grid else st.floats(-1e3, 1e3)
    states = draw(st.lists(st.tuples(numbers, numbers), min_size=count, max_size=count))
    candidates = tuple(draw(NAMES))
    return Trajectory(
        np.array(states, dtype=np.int64 if grid else np.float64).reshape(count, 2),
        np.cumsum(draw(st.lists(st.floats(0, 9), min_size=count, max_size=count))),
        start=draw(TEXT),
        goal=draw(st.none() | st.sampled_from(candidates)),
        candidates=candidates,
        participant=draw(TEXT),
        condition=draw(TEXT),
        layout=draw(st.none() | st.sampled_from([*KITCHENS, *TABLES])),
        layout_name=draw(TEXT),
        candidate_set=draw(st.sampled_from(["task", "game", "all"])),
        complete=draw(st.booleans()),
    )


def reach(states: object, **more: object) -> Trajectory:
    return Trajectory(states, candidates=("a", "b"), **{"goal": "a", **more})  # type: ignore[arg-type]


# -- files ------------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.booleans().flatmap(lambda grid: st.lists(walks(grid), max_size=5)))
def test_saved_and_loaded_trajectories_are_equal(
    tmp_path_factory: pytest.TempPathFactory, found: list[Trajectory]
) -> None:
    path = tmp_path_factory.mktemp("walks") / "walks.npz"
    assert save_trajectories(path, found) == path
    loaded = load_trajectories(path)
    assert len(loaded) == len(found)
    for before, after in zip(found, loaded, strict=True):
        for name in {field.name for field in fields(Trajectory)} - {"states", "times"}:
            assert getattr(after, name) == getattr(before, name)
        np.testing.assert_array_equal(after.states, before.states)
        np.testing.assert_array_equal(after.times, before.times)
        assert after == before or before.num_states == 0  # an empty prefix has no kind of its own


def test_files_hold_no_pickles_and_say_what_they_are(tmp_path: Path) -> None:
    save_trajectories(tmp_path / "w.npz", [reach([(1, 1), (1, 2)], layout=KITCHENS[0])])
    with np.load(tmp_path / "w.npz", allow_pickle=False) as file:
        assert str(file["kind"]) == "legible-envs trajectories"
        assert int(file["schema"]) == 1
        records = json.loads(file["records"].tobytes())
    assert records["trajectories"][0]["candidates"] == ["a", "b"]


def test_files_need_no_newer_version_than_what_is_in_them(tmp_path: Path) -> None:
    walk = reach([(0.1, 0.1), (0.3, 0.5)])
    at = {"goal_positions": ((0.3, 0.5), (0.5, 0.5))}
    for schema, options in ((1, {}), (1, {"layout": KITCHENS[0]}), (2, at), (3, {"layout": TABLES[1], **at})):
        found = [reach(walk.states, **options), walk]
        save_trajectories(tmp_path / "w.npz", found)
        assert load_trajectories(tmp_path / "w.npz") == found
        with np.load(tmp_path / "w.npz", allow_pickle=False) as file:
            assert int(file["schema"]) == schema


def test_a_layout_of_an_unknown_kind_is_named(tmp_path: Path) -> None:
    save_trajectories(tmp_path / "w.npz", [reach([(0.1, 0.1)], layout=TABLES[0])])
    with np.load(tmp_path / "w.npz") as file:
        arrays = dict(file)
    records = arrays["records"].tobytes().replace(b'"kind": "tabletop"', b'"kind": "seesaw"')
    np.savez(tmp_path / "w.npz", **{**arrays, "records": np.frombuffer(records, dtype=np.uint8)})
    known = r"'seesaw'; known: \['overcooked', 'tabletop'.*entry point group 'legible.layouts'"
    with pytest.raises(ValueError, match=f"w.npz: layout 0: no layout kind named {known}"):
        load_trajectories(tmp_path / "w.npz")
    write_csv(tmp_path / "w.csv", [reach([(0.1, 0.1)], layout=TABLES[0])])
    header, row = (tmp_path / "w.csv").read_text().splitlines()
    (tmp_path / "w.csv").write_text(f"{header},layout_kind\n{row},seesaw\n")
    with pytest.raises(ValueError, match=f"trajectory '0': no layout kind named {known}"):
        read_csv(tmp_path / "w.csv")


def records(**changes: object) -> np.ndarray:
    record = {"start": "s", "goal": "a", "candidates": ["a", "b"], "layout": None} | changes
    content = {"layouts": [], "trajectories": [record]}
    return np.frombuffer(json.dumps(content).encode(), dtype=np.uint8)


def test_unreadable_files_are_refused_in_words(tmp_path: Path) -> None:
    path = tmp_path / "w.npz"
    save_trajectories(path, [reach([(1, 1), (1, 2)])])
    whole = path.read_bytes()
    with np.load(path) as file:
        arrays = dict(file)
    cases = {"cut": whole[: len(whole) // 2], "text": b"hello", "empty": b""}
    for name, content in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match="cannot read trajectories from"):
            load_trajectories(tmp_path / name)
    for change, message in (
        ({"schema": 99}, "schema 99"),
        ({"kind": "cake"}, "it looks like an .npz with the arrays .*; expected"),
        ({"offsets": np.array([0, 5])}, "`offsets` must rise from 0 to the number of states, 2"),
        (
            {"offsets": np.array([0, 2, 2])},
            r"`offsets` must be whole numbers of shape \(2\), got int64 of shape \(3,\)",
        ),
        ({"times": np.array(0.0)}, r"`times` must be numbers of shape \(2\), got float64 of shape \(\)"),
        ({"times": np.array([0.0, np.nan])}, r"`times` must be finite, got nan at \[1\]"),
        ({"states": np.zeros(2)}, r"`states` must be numbers of shape \(any, any\), got float64 of shape \(2,\)"),
        ({"records": records(layout=7)}, "trajectory 0 names layout 7; the file has 0, from 0 on"),
        ({"records": records(candidates="ab")}, r"`trajectories\[0\].candidates` must be a list, got 'ab'"),
        ({"records": records(goal=3)}, r"`trajectories\[0\].goal` must be a non-empty text, got 3"),
        ({"records": np.frombuffer(b"{}", dtype=np.uint8)}, "layouts"),
    ):
        np.savez(tmp_path / "bad.npz", **{**arrays, **change})
        with pytest.raises(ValueError, match=message):
            load_trajectories(tmp_path / "bad.npz")
    np.savez(tmp_path / "object.npz", **{**arrays, "states": np.array([{}], dtype=object)})
    with pytest.raises(ValueError, match="cannot read"):
        load_trajectories(tmp_path / "object.npz")
    with pytest.raises(FileNotFoundError):
        load_trajectories(tmp_path / "nowhere.npz")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "w.npz"
    save_trajectories(path, [reach([(1, 1), (1, 2)])])
    before = path.read_bytes()

    def full_disk(file: object, **arrays: object) -> None:
        file.write(b"half")  # type: ignore[attr-defined]
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full_disk)
    with pytest.raises(OSError, match="No space left"):
        save_trajectories(path, [reach([(1, 1)])])
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_cells_and_positions_do_not_mix_in_a_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one kind"):
        save_trajectories(tmp_path / "w.npz", [reach([(1, 1)]), reach([(1.0, 1.0)])])
    with pytest.raises(ValueError, match="one kind"):
        save_trajectories(tmp_path / "w.npz", [reach([(1.0, 1.0, 2.0)]), reach([(1.0, 1.0)])])


# -- values -----------------------------------------------------------------------------------------------------------


def test_trajectories_are_immutable_values() -> None:
    source = np.array([(1, 1), (1, 2)])
    walk = reach(source)
    source[:] = 9
    assert walk.states.tolist() == [[1, 1], [1, 2]]
    with pytest.raises(ValueError, match="read-only"):
        walk.states[0, 0] = 5
    with pytest.raises(AttributeError):
        walk.goal = "b"  # type: ignore[misc]
    twins = [reach([(1, 1), (1, 2)]), copy.deepcopy(walk), pickle.loads(pickle.dumps(walk))]
    for twin in twins:
        assert twin == walk
        assert hash(twin) == hash(walk)
        assert not twin.states.flags.writeable
    assert walk != reach([(1, 1), (1, 3)])
    assert walk != reach([(1.0, 1.0), (1.0, 2.0)])
    assert walk != reach([(1, 1), (1, 2)], goal="b")
    assert walk != "walk"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"states": [(1, 1), (1, 2, 3)]}, "mixed dimensions"),
        ({"states": [1, 2, 3]}, "shape"),
        ({"states": [("a", "b")]}, "dtype"),
        ({"states": [(0.0, 1.0), (0.0, np.nan)]}, "state 1, coordinate 1 is nan"),
        ({"states": [(0.0, np.inf)]}, "finite"),
        ({"states": [(0.0, 1e200), (1.0, 1.0)]}, r"state 0, coordinate 1 is 1e\+200; states must be .*metres"),
        ({"states": [(0, 2 * 10**9), (1, 1)]}, "state 0, coordinate 1 is 2000000000; states must be cells"),
        ({"states": np.array([(0, 2**64 - 1), (1, 1)], dtype=np.uint64)}, "states must be cells"),
        ({"states": np.array([(-(2**63), 0), (1, 1)])}, "states must be cells"),
        ({"states": np.array([(0.0, np.longdouble("1e400")), (0.0, 0.0)])}, "state 0, coordinate 1"),
        ({"states": np.ma.masked_array([(0.0, 1.0), (0.0, 1.0)], mask=[(0, 1), (0, 0)])}, "1 entries are missing"),
        ({"states": [(True, False), (True, True)]}, "dtype bool"),
        ({"states": [(1j, 0), (0, 0)]}, "dtype complex"),
        ({"times": ["0", "1_0"]}, "times must be numbers"),
        ({"times": [False, True]}, "times must be numbers"),
        ({"times": [1.7e18, 1.8e18]}, r"times must be seconds up to 1e\+12, got 1\.8e\+18"),
        ({"times": np.ma.masked_array([0.0, 1.0], mask=[0, 1])}, "missing"),
        ({"goal_positions": (("0", "1"), ("1", "1"))}, "goal positions must be numbers"),
        ({"goal_positions": ((0.0, 1e10), (1.0, 1.0))}, "metres or pixels"),
        ({"participant": 3}, "`participant` must be a text, got 3"),
        ({"condition": None}, "`condition` must be a text"),
        ({"start": 1.0}, "`start` must be a text"),
        ({"layout_name": b"a"}, "`layout_name` must be a text"),
        ({"complete": 1}, "`complete` must be True or False"),
        ({"times": [0.0]}, "shape"),
        ({"times": [1.0, 0.0]}, "never decrease"),
        ({"times": [0.0, np.nan]}, "finite"),
        ({"goal": "c"}, "'c' is not among the candidates"),
        ({"candidates": ()}, "at least one goal"),
        ({"candidates": ("a", "a")}, "each once"),
        ({"candidates": ("a", "")}, "non-empty"),
        ({"candidate_set": "some"}, "candidate_set"),
    ],
)
def test_bad_trajectories_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Trajectory(**{"states": [(1, 1), (1, 2)], "goal": "a", "candidates": ("a", "b"), **change})  # type: ignore[arg-type]


@settings(max_examples=60, deadline=None)
@given(walks(grid=True), st.data())
def test_cells_given_several_times_in_a_row_are_kept_once(walk: Trajectory, data: st.DataObject) -> None:
    assert (np.abs(np.diff(walk.states, axis=0)).sum(axis=1) > 0).all()
    counts = np.array(data.draw(st.lists(st.integers(1, 3), min_size=walk.num_states, max_size=walk.num_states)), int)
    states, times = np.repeat(walk.states, counts, axis=0), np.repeat(walk.times, counts)
    idle = Trajectory(states.reshape(-1, 2), times, candidates=("a",))
    assert idle.states.tolist() == walk.states.tolist()
    assert idle.times.tolist() == walk.times.tolist()
    assert not idle.states.flags.writeable
    assert not idle.times.flags.writeable
    counted = Trajectory(states.reshape(-1, 2), candidates=("a",)).times  # of arrival, in ticks
    assert counted.tolist() == (np.cumsum(counts) - counts).tolist()


def test_pauses_between_positions_stay() -> None:
    walk = reach([(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)], times=[0.0, 1.0, 2.0])
    assert walk.num_states == 3
    assert walk.times.tolist() == [0.0, 1.0, 2.0]


# -- prefixes ---------------------------------------------------------------------------------------------------------


def test_steps_follow_the_definition_of_the_score() -> None:
    from legible_envs.legibility import prefix_weights

    for length in range(2, 12):
        walk = reach([(0, i) for i in range(length)])
        for fraction in (0.1, 0.25, 0.5, 0.9, 1.0):
            observed = prefix_weights((fraction,), length).index(1.0) + 1
            assert walk.prefix(fraction).num_states == observed


def test_cells_follow_their_definition() -> None:
    for count in range(1, 15):
        walk = reach([(0, i) for i in range(count + 1)])
        for tenth in range(11):
            # Whole numbers: floor(tenth / 10 * (n - 1)) without rounding errors.
            assert walk.prefix_length(tenth / 10, "cells") == tenth * (count - 1) // 10 + 1


def test_time_and_arc_cut_where_they_say() -> None:
    walk = reach([(0.0, 0.0), (3.0, 4.0), (3.0, 4.0), (3.0, 14.0)], times=[2.0, 3.0, 11.0, 12.0])
    assert walk.arc_lengths.tolist() == [0.0, 5.0, 5.0, 15.0]
    assert [walk.prefix_length(f, "time") for f in (0.0, 0.1, 0.5, 0.9, 1.0)] == [1, 2, 2, 3, 4]
    assert [walk.prefix_length(f, "arc") for f in (0.0, 0.3, 1 / 3, 0.9, 1.0)] == [1, 1, 3, 3, 4]
    assert reach([(0, 0), (3, 4)]).arc_lengths.tolist() == [0.0, 7.0]


@settings(max_examples=60, deadline=None)
@given(walks(grid=False), st.sampled_from(list(CUTS)))
def test_prefixes_are_beginnings_that_grow(walk: Trajectory, cut: str) -> None:
    if not walk.complete or walk.num_states < 2:
        with pytest.raises(ValueError, match="prefix"):
            walk.prefix(0.5, cut)  # type: ignore[arg-type]
        return
    lengths = [walk.prefix_length(f, cut) for f in np.linspace(0.01, 1, 40)]  # type: ignore[arg-type]
    assert lengths == sorted(lengths)
    assert lengths[0] >= 1
    part = walk.prefix(0.5, cut)  # type: ignore[arg-type]
    assert not part.complete
    assert part.states.tolist() == walk.states[: part.num_states].tolist()
    assert len(part.arc_lengths) == part.num_states
    assert (part.goal, part.candidates, part.layout) == (walk.goal, walk.candidates, walk.layout)
    if cut in ("steps", "cells"):
        assert lengths[-1] <= walk.num_states - 1


def test_bad_prefixes_are_refused() -> None:
    walk = reach([(0, 0), (0, 1)])
    for fraction in (-0.1, 1.1, float("nan"), 0.0, "0.5", True, None):
        with pytest.raises(ValueError, match="fraction"):
            walk.prefix(fraction)  # type: ignore[arg-type]
    for count in (2.0, 1.5, True, -1, "1"):
        with pytest.raises(ValueError, match="count"):
            walk.first(count)  # type: ignore[arg-type]
    assert walk.first(np.int8(1)).num_states == 1  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown cut"):
        walk.prefix(0.5, "half")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="count"):
        walk.first(3)
    assert walk.first(0).num_states == 0


# -- episodes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("candidate_set", ["game", "all"])
def test_a_scripted_episode_gives_the_fetches_of_its_task(candidate_set: str) -> None:
    env = gym.make("LegibleOvercooked-v0", shape=(7, 7))
    kinds = []
    for seed in range(5):
        player = ScriptedPlayer(env, np.random.default_rng(seed))
        found = record_episode(
            env,
            player,
            seed=seed,
            candidate_set=candidate_set,  # type: ignore[arg-type]
            participant="script",
            condition="random",
        )
        layout = env.unwrapped.view().layout  # type: ignore[attr-defined]
        # 9 ingredients and 3 dishes, the first from serving, where the task begins.
        assert len(found) == 12
        assert found[0].start == "serving"
        for walk in found:
            assert walk.layout == layout
            assert walk.candidate_set == candidate_set
            assert walk.start.partition("@")[0] in ("pot", "serving")
            check_station_to_station(layout, walk)
        if candidate_set == "all":
            assert all(set(walk.candidates) == {"tomato", "onion", "cabbage", "fish", "dish"} for walk in found)
        kinds += [len(walk.candidates) for walk in found]
    assert candidate_set == "all" or min(kinds) == 1 < max(kinds)


def check_station_to_station(layout: OvercookedLayout, walk: Trajectory) -> None:
    cells = [tuple(cell) for cell in walk.states.tolist()]
    assert walk.goal is not None
    assert cells[0] in layout.access(walk.start)
    assert cells[-2] in layout.access(walk.goal)
    assert cells[-1] == layout.stations[walk.goal]
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in pairwise(cells))
    assert all(layout.is_floor(cell) for cell in cells[:-1])
    assert (np.diff(walk.times) > 0).all()


def test_views_of_an_episode_give_the_same_walks() -> None:
    env = gym.make("LegibleOvercooked-v0", shape=(6, 7))
    expected = record_episode(env, ScriptedPlayer(env, np.random.default_rng(3)), seed=3, candidate_set="all")
    player = ScriptedPlayer(env, np.random.default_rng(3))
    observation, info = env.reset(seed=3)
    views, over = [env.unwrapped.view()], False  # type: ignore[attr-defined]
    while not over:
        observation, _, terminated, truncated, info = env.step(player(observation, info))
        views.append(env.unwrapped.view())  # type: ignore[attr-defined]
        over = terminated or truncated
    assert trajectories_from_views(views) == expected
    assert trajectories_from_views(views, min_positions=99) == []
    with pytest.raises(ValueError, match="no views"):
        trajectories_from_views([])
    with pytest.raises(ValueError, match="one list per state"):
        trajectories_from_views(views, valid_goals=[["onion"]])


def test_walks_end_and_break_off_where_hands_fill() -> None:
    layout = OvercookedLayout.from_ascii("XOPXX\nX   D\nXXSXX")
    onion, pot, dish = layout.stations["onion"], layout.stations["pot"], layout.stations["dish"]
    assert (onion, pot, dish) == ((0, 1), (0, 2), (1, 4))
    # Facing the pot, put the onion in; rest; walk east, bump, rest, take a dish; put it on a counter; take it again.
    cells = np.array([(1, 2), (1, 2), (1, 2), (1, 3), (1, 3), (1, 3), (1, 3), (1, 3), (1, 3)])
    facing = np.array([0, 0, 0, 2, 2, 2, 0, 0, 0])
    held = np.array([2, 0, 0, 0, 0, 5, 5, 0, 5])
    walks_found = list(find_walks(layout, cells, facing, held))
    assert [(w.start, w.goal, w.cells, w.ticks) for w in walks_found] == [("pot", "dish", ((1, 2), (1, 3)), (1, 3, 5))]
    # Nothing begins at a counter, and what begins empty-handed begins only where it is said to.
    assert list(find_walks(layout, cells[7:], facing[7:], held[7:])) == []
    first = list(find_walks(layout, cells[2:], facing[2:], held[2:], start="serving"))
    assert [(w.start, w.goal) for w in first] == [("serving", "dish")]


def test_dispensers_in_reach_stop_at_walls() -> None:
    layout = OvercookedLayout.from_ascii("XOXTX\nX X D\nX X X\nXXPXX")
    assert dispensers_in_reach(layout, (1, 1)) == ("onion",)
    assert dispensers_in_reach(layout, (2, 3)) == ("tomato", "dish")
