"""Bayesian goal inference and the nearest goal in random kitchens, against their readable definitions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sklearn.base import clone

from legible_envs.legibility import optimal_costs, posterior
from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import BayesianGoalPredictor, GoalPredictor, ShortestDistance
from tests.predictors.cases import ROOM, walk

ALL = [ShortestDistance(), ShortestDistance("geodesic"), BayesianGoalPredictor(), BayesianGoalPredictor(beta=0.3)]


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


@settings(max_examples=40, deadline=None)
@given(kitchens_and_walks(), st.sampled_from(ALL))
def test_a_stream_over_a_random_walk_says_what_predict_proba_says(found: Trajectory, predictor: GoalPredictor) -> None:
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


def test_one_cell_leaks_nothing_to_eq_1() -> None:
    # From a station with several access cells too: the way begins on the first cell.
    cells = [(r, c) for r, c in np.argwhere(ROOM.cells == 0).tolist()]
    predictor = BayesianGoalPredictor(beta=5.0).fit([walk([cells[0]])])
    rows = predictor.predict_proba([walk([cell], complete=False) for cell in cells])
    assert (rows == 1 / 3).all()


def test_bad_parameters_and_goals_out_of_reach_are_refused() -> None:
    for beta in (-1.0, np.inf, np.nan, "much", True):
        with pytest.raises(ValueError, match="beta"):
            BayesianGoalPredictor(beta=beta).fit([walk([(1, 1)])])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="metric"):
        ShortestDistance("taxi").fit([walk([(1, 1)])]).predict_proba([walk([(1, 1)])])  # type: ignore[arg-type]
    split = OvercookedLayout.from_ascii("XOXTX\nX X D\nX X X\nXXPXX")
    apart = walk([(1, 1), (0, 1)], layout=split)
    there = replace(apart.first(1), goal=None, candidates=("tomato", "dish"))
    with pytest.raises(ValueError, match=r"'tomato' cannot be reached from row 1, column 1"):
        BayesianGoalPredictor().fit([apart]).predict_proba([there])
