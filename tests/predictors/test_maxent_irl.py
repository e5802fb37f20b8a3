"""The maximum-entropy IRL predictor: its belief, what it learns, and what it refuses."""

from __future__ import annotations

import itertools
import pickle
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import BayesianGoalPredictor, MaxEntIRL, check_predictor
from predictors.checks import example_trajectories
from tests.predictors.maxent_cases import GOALS, ROOM, neighbours_of, random_costs, sample_walks


def test_its_belief_is_bayes_rule_on_walks() -> None:
    """P(G | prefix) from the probabilities of all walks that begin so."""
    walks = sample_walks(ROOM, random_costs(ROOM, 11, 2.8, 3.2), 60, np.random.default_rng(11))
    irl = MaxEntIRL(l2=50.0).fit(walks)
    prefix = [(3, 1), (2, 1), (1, 1)]
    weights = []
    for goal in irl.classes_:
        every, queue = [], [list(prefix)]
        while queue:
            cells = queue.pop()
            if cells[-1] in ROOM.access(goal):
                states = np.array([*cells, ROOM.stations[goal]])
                every.append(Trajectory(states, goal=str(goal), candidates=GOALS, layout=ROOM))
            if len(cells) < 13:
                queue.extend([*cells, beside] for beside in neighbours_of(ROOM, cells[-1]))
        weights.append(np.exp(irl.log_likelihoods(every)).sum())
    part = Trajectory(np.array(prefix), candidates=GOALS, layout=ROOM, complete=False)
    assert irl.predict_proba([part])[0] == pytest.approx(np.array(weights) / sum(weights), abs=1e-3)


def test_it_is_eq_1_with_soft_learned_costs() -> None:
    walks = sample_walks(ROOM, random_costs(ROOM, 12), 80, np.random.default_rng(12))
    parts = [w.first(t) for w in walks[:20] for t in range(w.num_states + 1)]
    for prior in ("uniform", "empirical"):
        irl = MaxEntIRL(prior=prior).fit(walks)
        for cell_costs in ("learned", MaxEntIRL(), irl.cost_):
            eq_1 = BayesianGoalPredictor(costs="soft", cell_costs=cell_costs, prior=prior).fit(walks)
            assert np.allclose(eq_1.predict_proba(parts), irl.predict_proba(parts), atol=1e-12)


def test_features_are_shared_by_kitchens() -> None:
    def beside_obstacle(layout: OvercookedLayout) -> Any:
        near = np.zeros(layout.shape)
        for row, col in np.argwhere(layout.cells == 2):
            for dr, dc in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                near[row + dr, col + dc] = 1.0
        return near.reshape(-1, 1)

    layouts = [ROOM, OvercookedLayout.from_ascii("XOXTX\nX   X\nX  VD\nX   X\nXXSPX")]
    rng = np.random.default_rng(13)
    walks = [
        w
        for layout in layouts
        for w in sample_walks(layout, 1.4 + 0.8 * beside_obstacle(layout).reshape(layout.shape), 600, rng, GOALS[:2])
    ]
    irl = MaxEntIRL(beside_obstacle, l2=0.1).fit(walks)
    (weight,) = irl.coef_
    assert weight == pytest.approx(0.8, abs=0.2)
    assert set(irl.costs_) == set(layouts)
    assert not hasattr(irl, "cost_")
    new = OvercookedLayout.from_ascii("XOXTX\nX   X\nXV  D\nX   X\nXXSPX")
    map_ = irl.cost_map(new)
    assert map_[3, 1] - map_[3, 3] == pytest.approx(weight)
    with pytest.raises(ValueError, match="one of the 2 kitchens"):
        irl.draw_reward()
    assert irl.draw_reward(new).dtype == np.uint8
    # One matrix serves all kitchens of a shape. Positions written out say what "position" says, but for the level.
    matrix = MaxEntIRL(beside_obstacle(ROOM)).fit(walks[:600])
    alone = MaxEntIRL(beside_obstacle).fit(walks[:600])
    assert np.allclose(matrix.cost_, alone.cost_, equal_nan=True)
    one_hot, position = MaxEntIRL(np.eye(ROOM.cells.size)).fit(walks[:600]), MaxEntIRL().fit(walks[:600])
    assert one_hot.log_likelihood_ == pytest.approx(position.log_likelihood_, abs=0.01)
    assert one_hot.coef_.shape == (ROOM.cells.size,)


def test_a_kitchen_never_seen_has_the_uniform_cost() -> None:
    walks = example_trajectories()
    irl = MaxEntIRL().fit(walks)
    new = OvercookedLayout.from_ascii("XOXTX\nX   X\nX V D\nX   X\nXXSPX")
    assert irl.cost_map(new)[new.cells == 0] == pytest.approx(irl.uniform_cost_)
    part = Trajectory([(3, 1), (2, 1)], candidates=GOALS, layout=new, complete=False)
    eq_1 = BayesianGoalPredictor(irl.uniform_cost_, costs="soft").fit([part])
    assert irl.predict_proba([part]) == pytest.approx(eq_1.predict_proba([part]))


def test_it_keeps_the_contract_and_forgets_on_refitting() -> None:
    check_predictor(MaxEntIRL())
    check_predictor(MaxEntIRL(prior="empirical"))
    irl = MaxEntIRL().fit(example_trajectories())
    assert {name for name in vars(irl) if name.endswith("_")} >= {"cost_", "reward_", "costs_", "coef_", "classes_"}
    assert np.array_equal(irl.reward_, -irl.cost_, equal_nan=True)
    assert np.isnan(irl.cost_[0]).all()
    copy = pickle.loads(pickle.dumps(irl))
    assert np.array_equal(copy.cost_, irl.cost_, equal_nan=True)
    other = sample_walks(ROOM, random_costs(ROOM, 14), 20, np.random.default_rng(14))
    irl.fit([*other, *example_trajectories()])
    assert not hasattr(irl, "cost_")
    assert len(irl.costs_) == 2
    assert clone(irl).get_params()["l2"] == irl.l2


def test_the_reward_is_drawn_where_people_walk() -> None:
    walks = sample_walks(ROOM, random_costs(ROOM, 15, 1.0, 3.5), 300, np.random.default_rng(15))
    irl = MaxEntIRL().fit(walks)
    image = irl.draw_reward(tile=32, values=True, title="learned reward")
    assert image.shape[1:] == (5 * 32, 3)
    plain = irl.draw_reward(tile=32)
    from legible_envs.overcooked.rendering import draw_layout

    bare = draw_layout(ROOM, tile=32)
    for row, col in itertools.product(range(5), range(5)):
        tile = np.s_[row * 32 : (row + 1) * 32, col * 32 : (col + 1) * 32]
        assert np.array_equal(plain[tile], bare[tile]) == (ROOM.cells[row, col] != 0)
    assert MaxEntIRL(l2=1e9).fit(walks).draw_reward(tile=16) is not None  # all cells alike


def test_bad_walks_and_parameters_are_refused_in_words() -> None:
    good = example_trajectories()
    one = good[0]

    def changed(cells: Any, goal: str | None = "onion", **more: Any) -> Trajectory:
        return Trajectory(np.array(cells), goal=goal, candidates=GOALS, layout=one.layout, **more)

    cases = [
        (changed([(3, 2), (1, 2), (1, 1), (0, 1)]), "row 3, column 2 to row 1, column 2, which is not one step"),
        (changed([(3, 2), (2, 2)], None), "complete trajectories with known goals"),
        (changed([(3, 2), (2, 2)], complete=False), "complete trajectories with known goals"),
        (changed([(3, 2), (2, 2)]), "ends with the cell of its goal station"),
        (changed([(0, 1)]), "after one floor cell or more"),
        (changed([(3, 2), (4, 2), (0, 1)]), "state 1, row 4, column 2 is neither floor"),
        (changed([(1, 3), (0, 3)]), "ends with the cell of its goal station"),
    ]
    for walk, message in cases:
        with pytest.raises(ValueError, match=message):
            MaxEntIRL().fit([*good, walk])
    for parameters, message in (
        ({"l2": 0.0}, "l2"),
        ({"l2": -1}, "l2"),
        ({"features": "colour"}, "features"),
        ({"features": np.ones((3, 2))}, r"features must have shape \(25, k\)"),
        ({"features": np.full((25, 1), np.nan)}, "row 1, column 1 are not"),
        ({"prior": "flat"}, "prior"),
        ({"max_iter": 0}, "max_iter"),
        ({"tol": "tiny"}, "tol"),
    ):
        with pytest.raises(ValueError, match=message):
            MaxEntIRL(**parameters).fit(good)  # type: ignore[arg-type]
