"""The robot partner in closed loop: beside a hand that reaches straight, and in the environment."""

import copy
import math
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.tabletop import TableObject, TabletopLayout
from legible_envs.tabletop.partner.robot import RobotPartner
from tests.legible_envs.tabletop.robot_cases import COLUMNS, TEA, WALLED, commands, ready, senses
from tests.legible_envs.tabletop.table_team import Team


def shuffled(rng):
    """The columns' cubes anywhere in the region, 8 cm apart."""
    centres = []
    while len(centres) < 8:
        at = rng.uniform((0.10, 0.20), (0.80, 0.70))
        if all(math.dist(at, other) > 0.08 for other in centres):
            centres.append(tuple(at))
    objects = zip(COLUMNS.layout.objects, centres, strict=True)
    return TabletopLayout([TableObject(o.name, at) for o, at in objects])


# -- in closed loop ----------------------------------------------------------------------------------------------------


def check_episode(team):
    """What must hold in every episode."""
    robot, column = team.robot, set(team.layout.goals[:4])
    for s, c in team.log:
        assert c.target is None or c.target not in (s.person_holding, c.predicted) or c.target == s.holding
        if c.grasp is not None:
            assert c.grasp in s.free
            assert c.grasp != c.predicted
            assert c.grasp != s.person_holding
        if c.state in ("approach", "grasp"):
            assert c.target in s.free
        if c.belief is not None:
            assert tuple(c.belief) == s.goals
            assert c.predicted == (
                max(c.belief, key=c.belief.get) if max(c.belief.values()) > robot.threshold else None
            ) or sorted(c.belief.values())[-1] == pytest.approx(sorted(c.belief.values())[-2])
        assert np.hypot(*c.velocity) <= robot.max_speed + 1e-12
    first = next((i for i, (_, c) in enumerate(team.log) if c.decided), len(team.log))
    assert all(c.state == "wait" and not c.velocity.any() for _, c in team.log[:first])
    assert team.finished
    if team.task is COLUMNS:
        assert set(team.done[:4]) == column


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.3, 0.6, 0.8, 0.95, 0.999]),
    st.floats(0.1, 1.5),
    st.floats(0.2, 1.5),
    st.sampled_from(["columns", "walled", "shuffled", "tea"]),
)
def test_teams_always_finish_and_the_robot_keeps_its_rules(seed, threshold, robot_speed, hand_speed, table):
    layouts = {"walled": WALLED, "shuffled": shuffled(np.random.default_rng(seed))}
    robot = RobotPartner(threshold=threshold, max_speed=robot_speed)
    task = TEA if table == "tea" else COLUMNS
    check_episode(Team(robot, task, layouts.get(table), seed=seed, hand_speed=hand_speed).play())


def test_the_robot_does_its_share():
    by_robot = [list(Team(RobotPartner(), COLUMNS, seed=s).play().placed_by.values()).count("robot") for s in range(6)]
    assert min(by_robot) >= 1
    alone = Team(RobotPartner(threshold=1.0), COLUMNS).play()
    together = Team(RobotPartner(), COLUMNS).play()
    assert together.time < alone.time


def test_threshold_1_never_acts_and_threshold_0_acts_at_once():
    never = Team(RobotPartner(threshold=1.0), COLUMNS, seed=2).play()
    assert never.finished
    assert set(never.placed_by.values()) == {"person"}
    assert all(c.state == "wait" and not c.decided and not c.velocity.any() for _, c in never.log)
    # even where there is but one goal, and where the hand is at it
    assert any(c.belief is not None and max(c.belief.values()) == 1 for _, c in never.log)
    at_once = Team(RobotPartner(threshold=0), COLUMNS, seed=2).play()
    first = next(i for i, (s, _) in enumerate(at_once.log) if len(s.reach))
    assert at_once.log[first][1].state == "approach"
    tie = ready(threshold=0).step(senses())
    assert (tie.predicted, tie.decided) == ("blue-circle", True)  # of tied goals the nearest to the hand


def test_a_lower_threshold_decides_earlier():
    fractions = [
        np.mean([Team(RobotPartner(threshold=t), COLUMNS, seed=s).play().metrics.summary()["decision_fraction"]
                 for s in range(3)])
        for t in (0.0, 0.5, 0.9)
    ]  # fmt: skip
    assert fractions == sorted(fractions)
    assert fractions[0] < fractions[-1]


def test_beside_a_person_who_does_nothing_it_stays_at_home():
    team = Team(RobotPartner(), COLUMNS, idle=True).play(5.0)
    assert not team.done
    assert all(c.state == "wait" and not c.velocity.any() and c.belief is None for _, c in team.log)


def test_episodes_are_deterministic_and_leave_nothing_behind():
    robot = RobotPartner()
    first = commands(Team(robot, COLUMNS, seed=5).play())
    assert commands(Team(RobotPartner(), COLUMNS, seed=5).play()) == first
    Team(robot, TEA, seed=1).play(3.0)
    assert commands(Team(robot, COLUMNS, seed=5).play()) == first  # used before, in the middle of another task


def test_it_can_be_copied_and_pickled_in_the_middle_of_an_episode():
    team = Team(RobotPartner(), COLUMNS, seed=4)
    team.play(3.1)
    for twin in (copy.deepcopy(team), pickle.loads(pickle.dumps(team))):
        twin.play()
        twin_commands = commands(twin)
    assert commands(team.play()) == twin_commands


# -- in the environment ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        {"partner": "robot"},
        {"partner": {"max_speed": 1.0}, "threshold": 0.5, "layout": WALLED},
        {"partner": "robot", "predictor": "predictors.reaching.bayesian:StraightLineBayesian", "layout": WALLED},
        {"partner": "robot", "threshold": 0.0, "virtual_obstacles": "soft", "task": "tea", "contact": "always"},
    ],
)
def test_teams_of_simulated_people_and_robots_finish_in_the_environment(arguments):
    import gymnasium as gym

    from legible_envs.tabletop.humans import sample_person
    from legible_envs.tabletop.policies import ReachingPlayer

    warnings.simplefilter("error", RuntimeWarning)  # the predictor never fails; pytest restores the filters
    env = gym.make("legible_envs:LegibleTabletop-v0", **arguments)
    by_robot = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        player = ReachingPlayer(env, sample_person(rng), rng)
        obs, info = env.reset(seed=seed)
        over = False
        while not over:
            obs, _, terminated, truncated, info = env.step(player(obs, info))
            view = env.unwrapped.view()
            assert view.robot_holding is None or view.robot_holding != view.holding
            over = terminated or truncated
        assert terminated
        assert info["completion_time"] == info["time"]
        assert 0 <= info["concurrent_activity"] <= 1 - max(info["human_idle"], info["robot_idle"]) + 1e-9
        by_robot += info["num_done"] - len(env.unwrapped.trajectories())
    assert by_robot > 0
