"""What Eq. 1 and fitted predictors predict of simulated participants at a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from legible_envs.rollouts import Trajectory
from legible_envs.tabletop import TableObject, TabletopLayout, VirtualObstacle
from legible_envs.tabletop.design.workspace import TabletopWorkspace
from legible_envs.tabletop.humans import (
    Person,
    ReachModel,
    simulate_participants,
    simulate_reach,
)
from legible_envs.tabletop.partner.belief import GoalBelief
from predictors import (
    BayesianGoalPredictor,
    ShortestDistance,
    StraightLineBayesian,
    TimeSeriesGaussian,
    check_predictor,
)
from tests.legible_envs.tabletop.human_cases import COLUMNS, HOME, detour, random_tables


def test_the_first_sample_gives_nothing_away() -> None:
    """The uniform-prior Eq. 1, told where people start, reads the prior off their first samples."""
    reaches = [
        reach
        for number, layout in enumerate([COLUMNS.layout, with_walls()])
        for reach in simulate_participants(layout, 60, np.random.default_rng(number))
    ]
    prior = np.array([1 / len(reach.candidates) for reach in reaches])
    first = [reach.first(1) for reach in reaches]
    assert StraightLineBayesian().fit(reaches).score(first) == pytest.approx(prior.mean())
    right = []
    for reach in reaches:
        belief = GoalBelief(reach.layout, start=reach.start, goals=reach.candidates)  # type: ignore[arg-type]
        told = belief.update(reach.states[0])
        right.append(max(told, key=lambda goal: told[goal]) == reach.goal)
    assert np.mean(right) == pytest.approx(prior.mean(), abs=4 * np.sqrt((prior * (1 - prior)).sum()) / len(prior))


def with_walls() -> TabletopLayout:
    walls = [VirtualObstacle((0.45, 0.45), 1.5), VirtualObstacle((0.57, 0.45), 1.5), VirtualObstacle((0.33, 0.62), 1.6)]
    layout = COLUMNS.layout.with_obstacles(walls)
    layout.validate()
    return layout


def test_eq_1_follows_shortest_paths_on_a_table() -> None:
    rng = np.random.default_rng(0)
    reaches = [
        Trajectory(
            simulate_reach(layout, "home", goal, Person(), rng)[1], goal=goal, candidates=layout.goals, layout=layout
        )
        for layout in random_tables(6, seed=7)
        for goal in layout.goals
    ]
    predictor = StraightLineBayesian(beta=15.0).fit(reaches)
    for reach in reaches:
        part = reach.prefix(0.5)
        paths = part.layout.paths  # type: ignore[union-attr]
        now, then = paths.lengths(paths.nearest_free(part.states[[-1, 0]]))
        weights = np.exp(-15.0 * (now - then))
        assert predictor.predict_proba([part])[0] == pytest.approx(weights / weights.sum(), abs=1e-12)
        assert predictor.predict_proba([reach.first(1)])[0] == pytest.approx(0.25)
    straight = StraightLineBayesian(beta=15.0, obstacles=False).fit(reaches)
    bare = [
        Trajectory(r.states, goal=r.goal, candidates=r.candidates, layout=r.layout.with_obstacles([])) for r in reaches
    ]  # type: ignore[union-attr]
    assert predictor.predict_proba_at(bare) == pytest.approx(
        straight.predict_proba_at([replace_positions(r) for r in bare]), abs=1e-12
    )
    check_predictor(predictor, reaches)
    for reach in reaches[:3]:
        stream = predictor.stream(reach)
        for count, state in enumerate(reach.states, 1):
            row = predictor.predict_proba([reach.first(count)])[0]
            assert list(stream.update(state).values()) == pytest.approx(row, abs=1e-12)


def replace_positions(reach: Trajectory) -> Trajectory:
    return Trajectory(
        reach.states,
        goal=reach.goal,
        candidates=reach.candidates,
        goal_positions=tuple(reach.layout.place(goal) for goal in reach.candidates),  # type: ignore[union-attr]
    )


def test_eq_1_is_finite_inside_obstacles_and_follows_moved_objects() -> None:
    layout = detour().with_obstacles([VirtualObstacle((0.62, 0.3)), VirtualObstacle((0.3, 0.4), 1.0)])
    layout = TabletopLayout([*layout.objects, TableObject("tin", (0.15, 0.3))], layout.obstacles)
    options = {"goal": "cup", "candidates": ("cup", "tin"), "layout": layout}
    predictor = StraightLineBayesian().fit([Trajectory([HOME, (0.6, 0.5)], **options)])
    buried, beside = (0.62, 0.31), (0.62, 0.33)
    assert not layout.paths.is_free([buried])[0]
    assert layout.paths.nearest_free([buried])[0] == pytest.approx(beside)
    rows = predictor.predict_proba([Trajectory([HOME, at], complete=False, **options) for at in (buried, beside)])
    assert np.isfinite(rows).all()
    assert rows[0] == pytest.approx(rows[1], abs=1e-12)
    off = predictor.predict_proba([Trajectory([HOME, (-0.2, 0.3)], complete=False, **options)])[0]
    assert off[1] > 0.9
    moved = Trajectory([HOME, (0.5, 0.06)], complete=False, goal_positions=((0.15, 0.3), (0.6, 0.5)), **options)
    stayed = Trajectory([HOME, (0.5, 0.06)], complete=False, **options)
    assert predictor.predict_proba([moved])[0] == pytest.approx(predictor.predict_proba([stayed])[0][::-1])
    with pytest.raises(ValueError, match="spoon"):
        predictor.fit([Trajectory([HOME], candidates=("spoon",), layout=layout)]).predict_proba(
            [Trajectory([HOME], candidates=("spoon",), layout=layout)]
        )


def test_kitchen_predictors_do_not_read_tables() -> None:
    reach = Trajectory([(1, 1), (2, 2)], goal="cup", candidates=("cup",), layout=detour())
    for predictor in (BayesianGoalPredictor(), ShortestDistance("geodesic")):
        with pytest.raises(ValueError, match="is for trajectories in kitchens; this one has a TabletopLayout"):
            predictor.fit([reach]).predict_proba([reach])


def test_people_can_be_learned_and_plain_minimum_jerk_is_only_straight() -> None:
    """As in recorded reaches, who learns from other people reads them better than straight lines do."""
    workspace = TabletopWorkspace()
    genome = workspace.sample(1, np.random.default_rng(1))[0]
    plain = ReachModel(replace(Person(), skew=1.0, skew_trial=0.0, bow=0.0, bow_trial=0.0, aim=0.0), 0.0, 0.0, 0.0)
    learned_gains = []
    for model in (ReachModel(), plain):
        reaches = workspace.simulate(genome, 40, np.random.default_rng(0), population=model)
        reaches = [reach for reach in reaches if reach.start == "assembly" and len(reach.candidates) > 1]
        train = [reach for reach in reaches if int(reach.participant.partition("/")[2]) < 25]
        test = reaches[len(train) :]
        lines, learned = (p.fit(train).score(test) for p in (StraightLineBayesian(), TimeSeriesGaussian()))
        learned_gains.append(learned - lines)
    assert learned_gains[0] > 0.03 > learned_gains[1]


@pytest.mark.slow
def test_people_are_read_better_on_optimised_tables_as_long_as_they_keep_off_obstacles() -> None:
    """The order of the paper's conditions, judged with people whom the search does not know."""
    from optimizers import search

    layouts = {"baseline": TabletopWorkspace().baseline}
    for condition in ("placement", "both"):
        workspace = TabletopWorkspace(condition=condition)
        layouts[condition] = search(workspace, objective="legibility", evaluations=20_000, seed=0).best_layout

    def accuracy(condition: str, crossing_rate: float = 0.0) -> float:
        model = ReachModel(Person(crossing_rate=crossing_rate))
        people = simulate_participants(layouts[condition], 30, np.random.default_rng(0), population=model)
        return StraightLineBayesian().fit(people).score(people)

    assert accuracy("baseline") + 0.05 < accuracy("placement") < accuracy("both") - 0.02
    complying = [accuracy("both", rate) for rate in (0.0, 0.1, 0.5, 1.0)]
    assert complying == sorted(complying, reverse=True)
    assert complying[3] < accuracy("placement")  # people who ignore obstacles are misread
