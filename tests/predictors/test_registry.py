"""Predictors by name, plugged in from elsewhere, and the check that says what one gets wrong."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import predictors.registry as registry
from legible_envs.rollouts import Trajectory
from legible_envs.support import plugins
from predictors import (
    BayesianGoalPredictor,
    GoalPredictor,
    GridLogistic,
    GridNeighbours,
    GridNGram,
    MaxEntIRL,
    ShortestDistance,
    check_predictor,
    list_predictors,
    make_predictor,
    register_predictor,
)
from predictors.checks import example_trajectories
from predictors.registry import BUILT_IN, ENTRY_POINT_GROUP, PredictorError


class Peeking(ShortestDistance):
    """Looks up the answer."""

    def candidate_probabilities(self, walk: Trajectory) -> Any:
        return np.array(
            [float(name == walk.goal) if walk.goal else 1 / len(walk.candidates) for name in walk.candidates]
        )


class Sloppy(GoalPredictor):
    """Gets nearly everything wrong."""

    def __init__(self, scale: float = 1.0) -> None:
        self.scale = scale * 2
        self.seen_ = 0

    def fit(self, X: Any, y: object = None) -> Any:
        super().fit(X)

    def predict_proba(self, X: Any) -> Any:
        return np.ones((len(X), len(self.classes_)))


class Spreading(GoalPredictor):
    """Gives every goal the same, candidate or not."""

    def predict_proba(self, X: Any) -> Any:
        return np.full((len(X), len(self.classes_)), 1 / len(self.classes_))


class Crowd(GoalPredictor):
    """Lets the samples vote."""

    def predict_proba(self, X: Any) -> Any:
        rows = np.zeros((len(X), len(self.classes_)))
        for row, w in zip(rows, X, strict=True):
            row[self.candidate_columns(w)] = 1 / len(w.candidates)
        best = rows.sum(axis=0).argmax()
        return np.where(rows[:, [best]] > 0, np.eye(len(self.classes_))[best], rows)


class Smallest(GoalPredictor):
    """The least that a predictor has to define."""

    def predict_proba(self, X: Any) -> Any:
        rows = np.zeros((len(X), len(self.classes_)))
        for row, w in zip(rows, X, strict=True):
            row[self.candidate_columns(w)] = 1 / len(w.candidates)
        return rows


def test_the_check_says_what_is_wrong() -> None:
    check_predictor(Smallest)
    with pytest.raises(PredictorError, match="ignorance of the goal"):
        check_predictor(Peeking)
    with pytest.raises(PredictorError) as caught:
        check_predictor(Sloppy)
    assert "parameters" in str(caught.value)
    assert "fit: must return self, returned NoneType" in str(caught.value)
    with pytest.raises(PredictorError, match="without being one of its candidates"):
        check_predictor(Spreading)
    with pytest.raises(PredictorError, match="depends on the other samples"):
        check_predictor(Crowd, example_trajectories()[:4])


@pytest.mark.usefixtures("clean_registries")
def test_predictors_are_found_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(make_predictor("bayesian", beta=2.0), BayesianGoalPredictor)
    assert make_predictor("shortest-distance", metric="geodesic").get_params() == {"metric": "geodesic"}
    assert isinstance(make_predictor("predictors:ShortestDistance"), ShortestDistance)
    made = ShortestDistance()
    assert make_predictor(made) is made
    register_predictor("smallest", Smallest)
    assert isinstance(make_predictor("smallest"), Smallest)
    point = EntryPoint("outside", "predictors.grid.bayesian:BayesianGoalPredictor", registry.ENTRY_POINT_GROUP)
    broken = EntryPoint("broken", "no_such_module:Thing", registry.ENTRY_POINT_GROUP)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point, broken])
    assert isinstance(make_predictor("outside"), BayesianGoalPredictor)
    known = list_predictors()
    assert {"bayesian", "maxent-irl", "shortest-distance", "smallest", "outside", "broken"} <= set(known)
    assert known["outside"].origin.startswith("entry point of")
    assert known["smallest"].origin == "registered"
    for spec, message in (
        ("nobody", r"no predictor named 'nobody'; known: bayesian"),
        ("broken", "cannot be imported"),
        ("predictors:Nothing", "cannot be imported"),
        ("math:pi", "not a class or function"),
        (dict, "must be a GoalPredictor, got dict"),
        (3, "got int"),
    ):
        with pytest.raises(PredictorError, match=message):
            make_predictor(spec)  # type: ignore[arg-type]
    with pytest.raises(PredictorError, match="cannot be made with"):
        make_predictor("bayesian", gamma=1)
    with pytest.raises(PredictorError, match="takes no parameters"):
        make_predictor(made, metric="geodesic")
    for name in ("smallest", "bayesian", "a:b", ""):
        with pytest.raises(PredictorError):
            register_predictor(name, Smallest)
    register_predictor("smallest", Smallest, overwrite=True)
    with pytest.raises(PredictorError, match="callable"):
        register_predictor("other", 3)  # type: ignore[arg-type]


@pytest.mark.usefixtures("clean_registries")
@pytest.mark.parametrize("metadata", ["none", "ours", "another package's"])
def test_built_in_predictors_are_listed_once_whatever_is_installed(
    metadata: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An installation may be older than the entry points of this project, and has them otherwise."""
    points = [EntryPoint(name, target, ENTRY_POINT_GROUP) for name, target in BUILT_IN.items()]
    if metadata == "another package's":
        points = [EntryPoint("bayesian", "predictors.grid.shortest_distance:ShortestDistance", ENTRY_POINT_GROUP)]
    monkeypatch.setattr(plugins, "entry_points", lambda group: [] if metadata == "none" else points)
    assert {name: (info.origin, info.target) for name, info in list_predictors().items()} == {
        name: ("built in", target) for name, target in BUILT_IN.items()
    }
    assert type(make_predictor("bayesian")) is BayesianGoalPredictor


def test_built_in_predictors_are_the_entry_points_of_this_project() -> None:
    """The environment of the table must not import this package, and finds predictors by these."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"][ENTRY_POINT_GROUP] == BUILT_IN


def test_built_in_predictors_are_known_by_name() -> None:
    names = {
        "maxent-irl": MaxEntIRL,
        "grid-logistic": GridLogistic,
        "grid-knn": GridNeighbours,
        "grid-ngram": GridNGram,
    }
    for name, kind in names.items():
        assert type(make_predictor(name)) is kind
    assert len(example_trajectories()) == 8


def test_importing_the_package_is_cheap() -> None:
    program = (
        "import sys, predictors; heavy = {'sklearn', 'pandas', 'numba', 'torch', 'scipy', 'ribs'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", f"{program}; assert not heavy, heavy"], check=True)
