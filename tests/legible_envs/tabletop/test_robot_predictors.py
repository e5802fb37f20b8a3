"""The predictors a robot partner asks: what it shows them, what it refuses, and what it does where one fails."""

import math
import warnings

import numpy as np
import pytest

from legible_envs.tabletop.partner.belief import GoalBelief
from legible_envs.tabletop.partner.robot import RobotPartner
from tests.legible_envs.tabletop.robot_cases import AT_RED, COLUMNS, TEA, WALLED, Uniform, commands, ready, senses
from tests.legible_envs.tabletop.table_team import Team

# -- predictors --------------------------------------------------------------------------------------------------------


class Faulty(Uniform):
    """Right at first, then wrong."""

    def __init__(self, fault="raise", after=3):
        super().__init__()
        self.fault, self.after = fault, after

    def update(self, point, time=None):
        belief = super().update(point, time)
        first = next(iter(belief))
        if len(self.points) <= self.after:
            return belief
        match self.fault:
            case "raise":
                raise RuntimeError("out of tea")
            case "nan":
                return {**belief, first: math.nan}
            case "negative":
                return {g: (-1.0 if g == first else (2.0 / (len(belief) - 1))) for g in belief}
            case "sum":
                return dict.fromkeys(belief, 1.0 + len(belief))
            case "unknown":
                return {**belief, "elephant": 0.0}
            case "missing":
                return {g: p for g, p in belief.items() if g != first} or {"elephant": 1.0}
            case "none":
                return None
            case "text":
                return dict.fromkeys(belief, "sure")


@pytest.mark.parametrize("fault", ["raise", "nan", "negative", "sum", "unknown", "missing", "none", "text"])
def test_a_predictor_that_fails_is_reported_once_and_the_robot_waits(fault):
    robot = RobotPartner(Faulty(fault))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        team = Team(robot, COLUMNS, seed=1).play()
        Team(robot, COLUMNS, seed=2).play(2.0)
    assert [w.category for w in caught] == [RuntimeWarning]
    assert "Faulty" in str(caught[0].message)
    assert robot.failure in str(caught[0].message)
    assert team.finished  # the episode went on
    for s, c in team.log:  # without a belief it only acts on what it sees the person hold
        if c.belief is None and s.person_holding is None:
            assert not c.decided
    failed = [s.reach_number for s, c in team.log if len(s.reach) > 4 and s.goals and not s.person_holding]
    assert failed
    assert all(c.belief is None for s, c in team.log if len(s.reach) > 4 and s.reach_number in failed)


def test_a_predictor_that_fails_at_first_may_do_better_in_the_next_reach():
    class Late(Faulty):
        def stream(self, context):
            if not self.streams:
                self.streams.append(None)
                raise KeyError("not yet")
            return Uniform().stream(context)

    with pytest.warns(RuntimeWarning, match=r"Late.*not yet"):
        team = Team(RobotPartner(Late()), COLUMNS, seed=1).play()
    beliefs = {s.reach_number for s, c in team.log if c.belief is not None}
    assert 1 not in beliefs
    assert 2 in beliefs


def test_a_predictor_sees_each_reach_from_its_beginning_once_and_nothing_of_the_future():
    spy = Uniform()
    team = Team(RobotPartner(spy, threshold=0), COLUMNS, seed=3)
    while not team.finished:
        team.step()
        if spy.streams and team.log[-1][1].belief is not None:
            s = team.log[-1][0]
            context, points, times = spy.streams[-1]
            assert points == [tuple(p) for p in s.reach]
            assert times == s.times.tolist()
            assert context.candidates == s.goals
            assert context.layout is team.layout
            assert context.goal_positions == tuple(tuple(s.positions[team.layout.index(g)].tolist()) for g in s.goals)
    assert not any(c.num_states for c, _, _ in spy.streams)
    assert len(spy.streams) >= team.number
    assert {c.start for c, _, _ in spy.streams} == {"home", "assembly"}


def test_where_the_valid_goals_change_during_a_reach_the_predictor_sees_it_again():
    spy = Uniform()
    robot = ready(predictor=spy)
    robot.step(senses((0.5, 0.2)))
    robot.step(senses((0.5, 0.2), goals=COLUMNS.layout.goals[:3]))
    assert [c.candidates for c, _, _ in spy.streams] == [COLUMNS.layout.goals[:4], COLUMNS.layout.goals[:3]]
    assert spy.streams[0][1] == spy.streams[1][1] == [(0.6, 0.05), (0.5, 0.2)]


def test_predict_proba_is_enough():
    class Bare:
        classes_ = np.array(sorted(COLUMNS.layout.goals))

        def predict_proba(self, prefixes):
            rows = []
            for prefix in prefixes:
                stream = GoalBelief(
                    prefix.layout, start=prefix.states[0], goals=prefix.candidates, positions=prefix.goal_positions
                )
                belief = stream.update(prefix.states[-1])
                rows.append([belief.get(g, 0.0) for g in self.classes_])
            return np.array(rows)

    assert commands(Team(RobotPartner(Bare()), COLUMNS, WALLED, seed=1).play()) == commands(
        Team(RobotPartner(), COLUMNS, WALLED, seed=1).play()
    )


@pytest.mark.parametrize(
    ("spec", "error", "message"),
    [
        ("no.such.module:Thing", ValueError, "cannot be imported"),
        ("math:no_such_name", ValueError, "cannot be imported"),
        ("unheard-of", ValueError, "module:Class"),
        ("math:dist", ValueError, "without arguments"),
        ("collections:Counter", TypeError, "stream"),
        (3, TypeError, "stream"),
        (Uniform, TypeError, "stream"),
    ],
)
def test_what_is_no_predictor_is_named(spec, error, message):
    with pytest.raises(error, match=message):
        RobotPartner(spec)


# -- the predictors of this project ------------------------------------------------------------------------------------


def reaches_of_people(layout=COLUMNS.layout):
    from legible_envs.tabletop.humans import simulate_participants

    return simulate_participants(layout, 4, np.random.default_rng(0), task=COLUMNS)


def test_a_fitted_predictor_plugs_in():
    from predictors import StraightLineBayesian

    straight = StraightLineBayesian(obstacles=False).fit(reaches_of_people())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        team = Team(RobotPartner(straight), COLUMNS, seed=1).play()
    # Without obstacles the built-in belief is the same; rounding may differ.
    own = Team(RobotPartner(), COLUMNS, seed=1).play()
    assert [(c.target, c.predicted, c.state) for _, c in team.log] == [
        (c.target, c.predicted, c.state) for _, c in own.log
    ]
    for (_, theirs), (_, ours) in zip(team.log, own.log, strict=True):
        assert (theirs.belief is None) == (ours.belief is None)
        assert theirs.belief is None or theirs.belief == pytest.approx(ours.belief, abs=1e-9)
    walled = Team(RobotPartner(straight), COLUMNS, WALLED, seed=1).play()
    assert walled.log[20][1].belief != Team(RobotPartner(), COLUMNS, WALLED, seed=1).play().log[20][1].belief


@pytest.mark.parametrize(
    "spec",
    [
        "predictors.reaching.bayesian:StraightLineBayesian",
        "predictors.reaching.gaussian:TimeSeriesGaussian",
        "predictors:ReachLogistic",
    ],
)
def test_a_predictor_named_by_its_class_is_fitted_on_simulated_people(spec):
    robot = RobotPartner(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        team = Team(robot, COLUMNS, WALLED, seed=2).play(4.0)
    assert robot.failure is None
    assert any(c.belief is not None for _, c in team.log)
    assert any(c.target for _, c in team.log)


def test_on_another_table_it_is_fitted_anew():
    spec = "predictors.reaching.bayesian:StraightLineBayesian"
    robot = RobotPartner(spec)
    first = commands(Team(robot, COLUMNS, WALLED, seed=2).play())
    assert Team(robot, TEA, seed=2).play().finished
    assert commands(Team(robot, COLUMNS, WALLED, seed=2).play()) == first
    assert commands(Team(RobotPartner(spec), COLUMNS, WALLED, seed=2).play()) == first
    assert robot.failure is None


def test_fitting_leaves_the_users_predictor_alone():
    from predictors import StraightLineBayesian

    mine = StraightLineBayesian()
    team = Team(RobotPartner(mine), COLUMNS, seed=1).play()
    assert any(c.belief for _, c in team.log)
    assert not hasattr(mine, "classes_")


def test_a_predictor_that_cannot_be_fitted_is_reported():
    class Unteachable(Uniform):
        def fit(self, X):
            raise ValueError("I know better")

    robot = RobotPartner(Unteachable())
    with pytest.warns(RuntimeWarning, match="know better"):
        robot.reset(COLUMNS.layout, COLUMNS)
    assert robot.step(senses(AT_RED)).belief is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot.reset(COLUMNS.layout, COLUMNS)


def test_a_predictor_that_could_be_fitted_elsewhere_is_fitted_there_again():
    class Choosy(Uniform):
        def fit(self, X):
            if X[0].layout == WALLED:
                raise ValueError("no walls")

    def believes_at(layout):
        robot.reset(layout, COLUMNS)
        return robot.step(senses(AT_RED)).belief is not None

    robot = RobotPartner(Choosy())
    assert believes_at(COLUMNS.layout)
    with pytest.warns(RuntimeWarning, match="no walls"):
        assert not believes_at(WALLED)
    assert believes_at(COLUMNS.layout)
