"""The predictors of the project by name at the table: entry points, the built-in belief, and what must be fitted."""

from __future__ import annotations

import tomllib
import warnings
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from legible_envs.support import plugins
from legible_envs.tabletop.partner.belief import BayesianIntent
from legible_envs.tabletop.partner.intent import make_intent_predictor
from predictors import MaxEntIRL, TimeSeriesGaussian, list_predictors
from tests.legible_envs.tabletop.table_envs import FIRST, WALL, make
from tests.legible_envs.tabletop.table_player import next_point, play, towards

GROUP = "legible.predictors"
PROJECT = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NAMED: dict[str, str] = PROJECT["entry-points"][GROUP]


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """The project as it is installed: with the entry points that pyproject.toml lists."""
    points = [EntryPoint(name, target, GROUP) for name, target in NAMED.items()]
    monkeypatch.setattr(plugins, "entry_points", lambda group: points if group == GROUP else [])


def reach(env, steps=12):
    """The last info of a reach for one goal."""
    _, info = env.reset(seed=0)
    for _ in range(steps):
        info = env.step(towards(env, next_point(env, FIRST[3])))[4]
    return info


def test_entry_points_are_the_predictors_that_are_listed():
    listed = list_predictors()
    assert NAMED.items() <= {name: plugin.target for name, plugin in listed.items()}.items()
    assert set(NAMED) == {name for name, plugin in listed.items() if plugin.origin == "built in"}


@pytest.mark.parametrize("arguments", [{}, {"partner": "robot"}])
@pytest.mark.parametrize("name", ["reach-gaussian", "reach-bayesian", "reach-logistic"])
def test_the_table_knows_them_by_name(name, arguments):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        belief = reach(make(layout=WALL, predictor=name, **arguments))["belief"]
    assert belief[:4].sum() == pytest.approx(1.0)
    assert not belief[4:].any()
    assert np.ptp(belief[:4]) > 0.05
    by_class = reach(make(layout=WALL, predictor=NAMED[name], **arguments))
    assert by_class["belief"].tolist() == belief.tolist()


def test_bayesian_names_the_built_in_belief_and_is_the_default():
    assert isinstance(make_intent_predictor("bayesian"), BayesianIntent)
    assert isinstance(make_intent_predictor(), BayesianIntent)
    named = reach(make(layout=WALL, partner="robot", predictor="bayesian"))
    assert data_equivalence(named, reach(make(layout=WALL, partner="robot")), exact=True)
    assert named["belief"].tolist() == reach(make(layout=WALL, predictor="bayesian"))["belief"].tolist()
    with pytest.raises(ValueError, match=r"no predictor named 'eq1'; known: bayesian, .*reach-gaussian"):
        make(predictor="eq1")


@pytest.mark.parametrize("arguments", [{}, {"partner": "robot"}])
def test_a_name_that_cannot_be_fitted_at_a_table_is_an_error_that_says_how(arguments):
    env = make(predictor="maxent-irl", **arguments)
    for _ in range(2):
        with pytest.raises(ValueError, match=r"maxent-irl must be fitted.*pass a fitted instance, .*MaxEntIRL\(\)"):
            env.reset(seed=0)
    with pytest.warns(RuntimeWarning, match=r"MaxEntIRL must be fitted.*pass a fitted instance"):
        assert not make(predictor=MaxEntIRL(), **arguments).reset(seed=0)[1]["belief"].any()


def test_a_fitted_instance_is_taken_as_it_is():
    reaches = [reach for seed in range(2) for reach in _played(seed)]
    fitted = TimeSeriesGaussian().fit(reaches)
    belief = reach(make(predictor=fitted))["belief"]
    assert belief[:4].sum() == pytest.approx(1.0)
    assert belief.tolist() != reach(make(predictor="reach-gaussian"))["belief"].tolist()


def _played(seed):
    env = make()
    play(env, seed)
    return env.unwrapped.trajectories()


def test_the_belief_of_a_name_goes_through_vectors_and_specs():
    import gymnasium as gym
    from gymnasium.envs.registration import EnvSpec

    env = make(predictor="reach-bayesian")
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert reach(env)["belief"].tolist() == reach(again)["belief"].tolist()
    envs = gym.make_vec("LegibleTabletop-v0", num_envs=2, vectorization_mode="sync", predictor="reach-bayesian")
    _, info = envs.reset(seed=0)
    assert info["belief"][:, WALL.index(FIRST[0])] == pytest.approx(np.full(2, 0.25))
