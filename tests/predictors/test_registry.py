"""Predictors of goals on the grid, the contract they keep, and how they are judged."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

import predictors.registry as registry
from benchmarks.experiments.prediction import UNTRAINED, accuracy_table, score_recorded_play
from benchmarks.experiments.prediction.run import score_every_walk
from benchmarks.experiments.prediction.sweep import LAYOUTS
from legible_envs.errors import LayoutError
from legible_envs.legibility import optimal_costs, posterior
from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import CUTS, Trajectory
from legible_envs.support import plugins
from predictors import (
    BayesianGoalPredictor,
    GoalPredictor,
    ShortestDistance,
    check_predictor,
    list_predictors,
    make_predictor,
    register_predictor,
)
from predictors.base import correctness
from predictors.checks import example_walks
from predictors.evaluation import accuracy_at
from predictors.registry import PredictorError

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nX V D\nX   X\nXXSPX")
THREE = ("onion", "tomato", "dish")
ALL = [ShortestDistance(), ShortestDistance("geodesic"), BayesianGoalPredictor(), BayesianGoalPredictor(beta=0.3)]


def walk(cells: Any, goal: str | None = "onion", candidates: tuple[str, ...] = THREE, **more: Any) -> Trajectory:
    return Trajectory(np.array(cells), goal=goal, candidates=candidates, **{"layout": KITCHEN, **more})


@st.composite
def kitchens_and_walks(draw: st.DrawFn) -> Trajectory:
    """A random small kitchen, stations inside and several of a kind included, and a random walk in it."""
    rows, cols = draw(st.integers(3, 6)), draw(st.integers(3, 6))
    symbols = draw(st.lists(st.sampled_from("    XVOTDSP"), min_size=rows * cols, max_size=rows * cols))
    start = draw(st.integers(0, rows * cols - 1))
    symbols[start] = " "
    layout = OvercookedLayout.from_rows([symbols[r * cols : (r + 1) * cols] for r in range(rows)])
    cells = [divmod(start, cols)]
    away = layout.distances_from(cells)
    goals = [n for n in layout.stations if any(away[cell] >= 0 for cell in layout.access(n))]
    for _ in range(draw(st.integers(0, 8))):
        row, col = cells[-1]
        steps = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
        beside = [cell for cell in steps if layout.is_floor(cell)]
        if beside:
            cells.append(draw(st.sampled_from(beside)))
    assume(goals)
    candidates = tuple(draw(st.lists(st.sampled_from(goals), min_size=1, unique=True)))
    ending = [n for n in candidates if cells[-1] in layout.access(n)]
    if ending and draw(st.booleans()):
        return walk([*cells, layout.stations[ending[0]]], ending[0], candidates, layout=layout)
    return walk(cells, None, candidates, layout=layout, complete=False)


def graph_to(layout: OvercookedLayout, goal: str) -> dict[Any, dict[Any, float]]:
    """Floor cells one step apart, and the last step into the goal, from which nothing leads away."""
    height, width = layout.shape
    graph: dict[Any, dict[Any, float]] = {layout.stations[goal]: {}}
    for row in range(height):
        for col in range(width):
            if layout.is_floor((row, col)):
                beside = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
                graph[row, col] = {c: 1.0 for c in beside if layout.is_floor(c) or c == layout.stations[goal]}
    return graph


# -- against the definitions -----------------------------------------------------------------------------------------


@settings(max_examples=150, deadline=None)
@given(kitchens_and_walks(), st.sampled_from([0.0, 0.4, 1.0, 3.0]))
def test_eq_1_is_the_readable_definition(found: Trajectory, beta: float) -> None:
    assert found.layout is not None
    first, last = tuple(found.states[0].tolist()), tuple(found.states[-1].tolist())
    remaining, optimal = {}, {}
    for goal in found.candidates:
        costs = optimal_costs(graph_to(found.layout, goal), found.layout.stations[goal])
        remaining[goal], optimal[goal] = costs.get(last, np.inf), costs[first]
    if beta == 0:  # the definition is 0 * inf for a person inside a station
        remaining = {g: (c if np.isfinite(c) else 1e300) for g, c in remaining.items()}
    if found.complete:
        expected = {goal: float(goal == found.goal) for goal in found.candidates}
    else:
        expected = posterior(remaining, optimal, beta)
    predictor = BayesianGoalPredictor(beta=beta).fit([found])
    row = dict(zip(predictor.classes_, predictor.predict_proba([found])[0], strict=True))
    assert row == pytest.approx(expected, abs=1e-12)


@settings(max_examples=150, deadline=None)
@given(kitchens_and_walks(), st.sampled_from(["manhattan", "geodesic"]))
def test_the_heuristic_is_the_nearest_station(found: Trajectory, metric: str) -> None:
    assert found.layout is not None
    row, col = found.states[-1].tolist()
    away = {}
    for goal in found.candidates:
        station = found.layout.stations[goal]
        costs = optimal_costs(graph_to(found.layout, goal), station)
        manhattan = abs(station[0] - row) + abs(station[1] - col)
        away[goal] = manhattan if metric == "manhattan" else costs.get((row, col), np.inf)
    nearest = [goal for goal, cost in away.items() if cost == min(away.values())]
    predictor = ShortestDistance(metric=metric).fit([found])  # type: ignore[arg-type]
    probabilities = predictor.predict_proba([found])[0]
    assert probabilities.tolist() == [1 / len(nearest) if name in nearest else 0.0 for name in predictor.classes_]


@pytest.mark.parametrize("predictor", ALL, ids=repr)
def test_nothing_observed_is_the_prior(predictor: GoalPredictor) -> None:
    walks = example_walks()
    rows = clone(predictor).fit(walks).predict_proba([w.first(0) for w in walks])
    for row, w in zip(rows, walks, strict=True):
        assert sorted(row, reverse=True)[: len(w.candidates)] == [1 / len(w.candidates)] * len(w.candidates)


def test_one_cell_leaks_nothing_to_eq_1() -> None:
    # From a station with several access cells too: the way begins on the first cell.
    cells = [(r, c) for r, c in np.argwhere(KITCHEN.cells == 0).tolist()]
    predictor = BayesianGoalPredictor(beta=5.0).fit([walk([cells[0]])])
    rows = predictor.predict_proba([walk([cell], complete=False) for cell in cells])
    assert (rows == 1 / 3).all()


def test_complete_walks_are_read_right_by_everyone() -> None:
    walks = example_walks()
    for predictor in ALL:
        fitted = clone(predictor).fit(walks)
        assert fitted.predict(walks).tolist() == [w.goal for w in walks]
        assert (fitted.predict_proba(walks).max(axis=1) == 1.0).all()


# -- the contract ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("predictor", ALL, ids=repr)
def test_ours_keep_the_contract(predictor: GoalPredictor) -> None:
    check_predictor(predictor)
    assert clone(predictor).get_params() == predictor.get_params()


@settings(max_examples=40, deadline=None)
@given(kitchens_and_walks(), st.sampled_from(ALL))
def test_a_stream_says_what_predict_proba_says(found: Trajectory, predictor: GoalPredictor) -> None:
    fitted = clone(predictor).fit([found])
    columns = [fitted.classes_.tolist().index(name) for name in found.candidates]
    stream = fitted.stream(found)
    assert list(stream.belief.values()) == fitted.predict_proba([found.first(0)])[0, columns].tolist()
    for count, cell in enumerate(found.states, 1):
        for _ in range(2):  # standing still changes nothing
            belief = stream.update(cell)
        assert list(belief) == list(found.candidates)
        row = fitted.predict_proba([found.first(count)])[0]
        assert list(belief.values()) == row[columns].tolist()


def test_bad_points_are_refused_and_change_nothing() -> None:
    stream = BayesianGoalPredictor().fit([walk([(1, 1)])]).stream(walk([(3, 3)]))
    before = stream.update((1, 1), time=1.0)
    bad_points: list[Any] = [(np.nan, 1.0), (1, 2, 3), 5, ("a", "b"), [[1, 2]]]
    for point in bad_points:
        with pytest.raises(ValueError, match="point"):
            stream.update(point)
    with pytest.raises(ValueError, match="backwards"):
        stream.update((1, 2), time=0.5)
    assert stream.belief == before


def test_fractions_are_the_prefixes_they_name() -> None:
    walks = example_walks()
    fractions = (0.05, 0.3, 0.31, 0.8, 1.0)
    for predictor in ALL:
        fitted = clone(predictor).fit(walks)
        for cut in CUTS:
            cube = fitted.predict_proba_at(walks, fractions, cut)  # type: ignore[arg-type]
            assert cube.shape == (len(walks), len(fractions), 3)
            for column, fraction in enumerate(fractions):
                rows = fitted.predict_proba([w.prefix(fraction, cut) for w in walks])  # type: ignore[arg-type]
                assert np.array_equal(cube[:, column], rows)


def test_bad_input_is_refused_in_words() -> None:
    good = walk([(1, 1), (0, 1)])
    for predictor in ALL:
        fitted = clone(predictor).fit([good])
        with pytest.raises(NotFittedError, match="call `fit`"):
            clone(predictor).predict_proba([good])
        with pytest.raises(ValueError, match="at least one trajectory"):
            clone(predictor).fit([])
        with pytest.raises(TypeError, match="put it in a list"):
            fitted.predict_proba(good)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="got ndarray at index 0"):
            fitted.predict_proba([np.zeros((2, 2))])  # type: ignore[list-item]
        with pytest.raises(ValueError, match=r"unknown goals \['pot'\]"):
            fitted.predict_proba([walk([(3, 3)], "pot", ("onion", "pot"))])
        with pytest.raises(ValueError, match="state 1, row 2, column 2 is neither floor"):
            fitted.predict_proba([walk([(1, 1), (2, 2), (3, 3)])])
        with pytest.raises(ValueError, match="state 0, row 0, column 1"):
            fitted.predict_proba([walk([(0, 1), (1, 1)])])
        with pytest.raises(ValueError, match="state 0, row 9, column -4"):
            fitted.predict_proba([walk([(9, -4)])])
        with pytest.raises(ValueError, match="cells"):
            fitted.predict_proba([walk([(1.0, 1.0)])])
        with pytest.raises(ValueError, match="needs the layout"):
            fitted.predict_proba([walk([(1, 1)], layout=None)])
        bare = OvercookedLayout.from_ascii("XXXTX\nX   X\nX   D\nXXSPX")
        with pytest.raises((ValueError, LayoutError), match="onion"):
            fitted.predict_proba([walk([(1, 1)], layout=bare)])
        with pytest.raises(ValueError, match="no known goal"):
            fitted.score([walk([(1, 1), (0, 1)], None)])
        with pytest.raises(ValueError, match="not both"):
            fitted.score([good, good.first(1)])
        with pytest.raises(ValueError, match="no trajectories"):
            fitted.score([])


def test_bad_parameters_and_goals_out_of_reach_are_refused() -> None:
    for beta in (-1.0, np.inf, np.nan, "much", True):
        with pytest.raises(ValueError, match="beta"):
            BayesianGoalPredictor(beta=beta).fit([walk([(1, 1)])])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="metric"):
        ShortestDistance("taxi").fit([walk([(1, 1)])]).predict_proba([walk([(1, 1)])])  # type: ignore[arg-type]
    split = OvercookedLayout.from_ascii("XOXTX\nX X D\nX X X\nXXPXX")
    apart = walk([(1, 1), (0, 1)], layout=split)
    with pytest.raises(ValueError, match=r"'tomato' cannot be reached from row 1, column 1"):
        BayesianGoalPredictor().fit([apart]).predict_proba([apart])


# -- judging ---------------------------------------------------------------------------------------------------------


def test_ties_count_what_they_are_worth() -> None:
    rows = np.array([[0.5, 0.5, 0.0], [0.5, 0.5 - 1e-12, 0.0], [0.2, 0.3, 0.5], [1 / 3, 1 / 3, 1 / 3]])
    goals = np.array([0, 1, 1, 2])
    assert correctness(rows, goals).tolist() == pytest.approx([0.5, 0.5, 0.0, 1 / 3])
    assert correctness(rows, goals, "strict").tolist() == [0.0, 0.0, 0.0, 0.0]
    assert correctness(rows, np.array([0, 0, 2, 0]), "strict").tolist() == [0.0, 0.0, 1.0, 0.0]
    cube = np.stack([rows, rows[::-1]], axis=1)
    assert correctness(cube, goals).shape == (4, 2)
    with pytest.raises(ValueError, match="ties"):
        correctness(rows, goals, "first")  # type: ignore[arg-type]


def test_the_score_is_the_expected_accuracy_of_guessing_among_ties() -> None:
    walks = example_walks()
    for predictor in ALL:
        fitted = clone(predictor).fit(walks)
        fractions = (0.2, 0.5, 0.8)
        rng, hits = np.random.default_rng(0), []
        for fraction in fractions:
            rows = fitted.predict_proba([w.prefix(fraction) for w in walks])
            for row, w in zip(rows, walks, strict=True):
                top = fitted.classes_[row >= row.max() - 1e-9]
                hits.append(np.mean(rng.choice(top, 4000) == w.goal))
        assert fitted.score(walks, fractions=fractions) == pytest.approx(np.mean(hits), abs=0.01)
        prefixes = [w.prefix(0.5) for w in walks]
        assert fitted.score(prefixes) == pytest.approx(fitted.score(walks, fractions=(0.5,)))
        assert fitted.score(walks, ties="strict") <= fitted.score(walks)


def test_tables_are_tidy_and_say_what_they_mean() -> None:
    walks = example_walks()
    fitted = BayesianGoalPredictor().fit(walks)
    table = accuracy_at(fitted, walks, (0.3, 0.6), cut="cells")
    assert len(table) == 2 * len(walks)
    assert table["correct"].mean() == pytest.approx(fitted.score(walks, fractions=(0.3, 0.6), cut="cells"))
    assert table.attrs == {"cut": "cells", "definition": CUTS["cells"], "ties": "fractional", "candidate_set": "all"}
    row = table.iloc[5]
    assert (row.trajectory, row.fraction, row.goal, row.participant) == (2, 0.6, "tomato", "p2")
    probabilities = fitted.predict_proba([walks[2].prefix(0.6, "cells")])[0]
    assert row.probability == probabilities[fitted.classes_.tolist().index("tomato")]
    assert row.states == walks[2].prefix_length(0.6, "cells")
    other = Trajectory(walks[0].states, goal="onion", candidates=THREE, layout=walks[0].layout, candidate_set="game")
    with pytest.raises(ValueError, match=r"\['all', 'game'\]"):
        accuracy_at(fitted, [*walks, other])


# -- plugging in -----------------------------------------------------------------------------------------------------


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
            row[self._columns(w)] = 1 / len(w.candidates)
        best = rows.sum(axis=0).argmax()
        return np.where(rows[:, [best]] > 0, np.eye(len(self.classes_))[best], rows)


class Smallest(GoalPredictor):
    """The least that a predictor has to define."""

    def predict_proba(self, X: Any) -> Any:
        rows = np.zeros((len(X), len(self.classes_)))
        for row, w in zip(rows, X, strict=True):
            row[self._columns(w)] = 1 / len(w.candidates)
        return rows


def test_the_check_says_what_is_wrong() -> None:
    check_predictor(Smallest)
    with pytest.raises(PredictorError, match="ignorance of the goal"):
        check_predictor(Peeking)
    with pytest.raises(PredictorError) as caught:
        check_predictor(Sloppy)
    assert "parameters" in str(caught.value)
    assert "fit: must return self, returned NoneType" in str(caught.value)
    with pytest.raises(PredictorError, match="without being candidates"):
        check_predictor(Spreading)
    with pytest.raises(PredictorError, match="depends on the other samples"):
        check_predictor(Crowd, example_walks()[:4])


def test_predictors_are_found_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry._registry, "_registered", {})
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


def test_importing_the_package_is_cheap() -> None:
    program = (
        "import sys, predictors; heavy = {'sklearn', 'pandas', 'numba', 'torch', 'scipy', 'ribs'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", f"{program}; assert not heavy, heavy"], check=True)


# -- recorded people -------------------------------------------------------------------------------------------------


@pytest.mark.data
def test_recorded_people_are_read_as_well_as_measured_before() -> None:
    scores = score_recorded_play(predictors=UNTRAINED, repeats=1)
    table = accuracy_table(scores).set_index(["layout", "predictor"])
    expected = {
        "asymmetric_advantages": (502, 0.605, 0.712),
        "coordination_ring": (807, 0.293, 0.337),
        "cramped_room": (424, 0.350, 0.471),
        "random3": (673, 0.448, 0.378),
    }
    assert list(expected) == list(LAYOUTS)
    for layout, (count, nearest, bayesian) in expected.items():
        assert table.loc[(layout, "shortest distance"), "walks"] == count
        assert table.loc[(layout, "shortest distance"), "mean"] == pytest.approx(nearest, abs=0.001)
        assert table.loc[(layout, "Eq. 1"), "mean"] == pytest.approx(bayesian, abs=0.001)
    assert scores.attrs["candidate_set"] == "all"
    assert len(scores) == len(LAYOUTS) * len(UNTRAINED) * 9
    columns = [f"{percent} %" for percent in range(10, 100, 10)]
    assert table.columns.tolist() == ["walks", *columns, "mean", "chance"]


@pytest.mark.data
def test_candidates_of_the_running_game_are_judged_apart() -> None:
    rows = score_every_walk(layouts=("cramped_room",), fractions=(0.5,), candidate_set="game", repeats=1)
    assert rows.attrs["candidate_set"] == "game"
    assert 0 < rows["trajectory"].nunique() < 424
    with pytest.raises(ValueError, match="no walks to score"):
        score_every_walk(layouts=("random0",))
