"""Distributions of kitchens: seeded, split, and read from plain data."""

from __future__ import annotations

import json

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.layouts import LayoutSet, RandomLayouts, default_layout, read_distribution

NAME = "LegibleOvercooked-v0"


def draws(distribution, seed, count=50):
    rng = np.random.default_rng(seed)
    return [distribution.sample(rng) for _ in range(count)]


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.1, 0.9), st.integers(0, 1000))
def test_train_and_test_kitchens_never_meet(seed, fraction, split_seed):
    train, test = RandomLayouts((5, 5), split_seed=split_seed).split(fraction)
    assert not {k.layout_id for k in draws(train, seed, 20)} & {k.layout_id for k in draws(test, seed, 20)}
    assert all(not train.is_test(kitchen) for kitchen in draws(train, seed, 20))


def test_the_split_has_the_size_asked_for():
    everything = RandomLayouts((7, 7), test_fraction=0.25)
    share = np.mean([everything.is_test(kitchen) for kitchen in draws(everything, 0, 2000)])
    assert 0.21 < share < 0.29


def test_kitchens_follow_the_design_rules():
    workspace = OvercookedWorkspace(shape=(6, 7))
    for kitchen in draws(RandomLayouts((6, 7)), 0):
        assert workspace.valid(workspace.encode(kitchen)[None]).all()
    locked = RandomLayouts((7, 7), workspace={"locked": {"pot": (0, 3)}})
    assert all(kitchen.stations["pot"] == (0, 3) for kitchen in draws(locked, 0))


def test_obstacle_rate():
    assert all(kitchen.num_obstacles == 0 for kitchen in draws(RandomLayouts((7, 7), obstacle_rate=0.0), 0))
    few, many = (RandomLayouts((7, 7), obstacle_rate=rate) for rate in (0.05, 0.3))
    assert np.mean([k.num_obstacles for k in draws(few, 0)]) < np.mean([k.num_obstacles for k in draws(many, 0)])


def test_limited_number_of_kitchens():
    some = RandomLayouts((7, 7), num_layouts=4, layout_seed=3)
    assert len({kitchen.layout_id for kitchen in draws(some, 0, 100)}) == 4
    again = RandomLayouts((7, 7), num_layouts=4, layout_seed=3)
    assert draws(some, 1) == draws(again, 1)
    other = RandomLayouts((7, 7), num_layouts=4, layout_seed=4)
    assert not {k.layout_id for k in draws(some, 0)} & {k.layout_id for k in draws(other, 0)}


def test_plain_data_and_back():
    for value in (
        "random",
        "random:test",
        {"kind": "random", "split": "train", "num_layouts": 3, "workspace": {"distinct_access": True}},
        [default_layout((7, 7)).to_ascii()],
    ):
        distribution = read_distribution(value, (7, 7))
        config = json.loads(json.dumps(distribution.to_config()))
        assert draws(read_distribution(config, (7, 7)), 2) == draws(distribution, 2)
    assert isinstance(read_distribution([default_layout((7, 7))], (7, 7)), LayoutSet)


def test_any_object_that_draws():
    class Always:
        def sample(self, rng):
            return default_layout((7, 7))

    env = gym.make(NAME, layouts=Always())
    env.reset(seed=0)
    assert env.unwrapped.layout == default_layout((7, 7))


@pytest.mark.parametrize(
    "arguments",
    [
        {"split": "both"},
        {"test_fraction": 0.0},
        {"test_fraction": float("nan")},
        {"obstacle_rate": 1.0},
        {"num_layouts": 0},
    ],
)
def test_bad_arguments(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        RandomLayouts((7, 7), **arguments)


def test_bad_descriptions():
    for bad in ("everything", "random:half", 3, {"kind": "best"}, []):
        with pytest.raises(ValueError, match="layout"):
            read_distribution(bad, (7, 7))
    with pytest.raises(LayoutError, match="shape"):
        read_distribution(["XXX\nX X\nXXX"], (7, 7))
    with pytest.raises(ValueError, match=r"\(5, 5\)"):
        read_distribution(RandomLayouts((5, 5)), (7, 7))


def test_episodes_draw_kitchens_by_the_seed():
    def kitchens(seed):
        env = gym.make(NAME, layouts="random:train")
        ids = [env.reset(seed=seed)[1]["layout_id"]]
        return ids + [env.reset()[1]["layout_id"] for _ in range(10)]

    assert kitchens(0) == kitchens(0)
    assert len(set(kitchens(0))) == 11
    assert kitchens(0) != kitchens(1)


def test_asked_for_kitchen_comes_before_the_distribution():
    env = gym.make(NAME, layouts="random")
    kitchen = OvercookedLayout.from_ascii("XXTXOXX\nC     D\nX  V  X\nF 1   P\nX     X\nX     X\nXXXSXXX")
    env.reset(seed=0, options={"layout": kitchen})
    assert env.reset()[1]["layout_id"] == int(kitchen.layout_id, 16)
    assert env.reset(options={"layout": None})[1]["layout_id"] != kitchen.layout_id
