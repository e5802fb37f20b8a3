"""The robot partner alone: what it decides from what it senses, and its settings."""

import itertools
import math

import numpy as np
import pytest

from legible_envs.tabletop import TabletopTask
from legible_envs.tabletop.partner.belief import GoalBelief
from legible_envs.tabletop.partner.robot import RobotPartner
from tests.legible_envs.tabletop.robot_cases import AT_RED, COLUMNS, TEA, ready, senses
from tests.legible_envs.tabletop.table_team import RATE, Team

# -- what it decides ---------------------------------------------------------------------------------------------------


def test_it_waits_until_it_is_sure():
    robot = ready()
    unsure = robot.step(senses())
    assert (unsure.state, unsure.decided, unsure.target, unsure.velocity.tolist()) == ("wait", False, None, [0, 0])
    assert unsure.belief == dict.fromkeys(COLUMNS.layout.goals[:4], 0.25)
    sure = robot.step(senses(AT_RED))
    belief = GoalBelief(COLUMNS.layout, start=(0.6, 0.05), goals=COLUMNS.layout.goals[:4]).update(AT_RED)
    assert sure.belief == belief
    assert belief["red-circle"] > 0.8
    assert (sure.decided, sure.predicted, sure.state) == (True, "red-circle", "approach")
    assert sure.target == "yellow-triangle"  # of the other three the nearest to the gripper
    assert np.hypot(*sure.velocity) > 0


def test_of_the_others_it_takes_the_nearest_to_its_gripper():
    rng = np.random.default_rng(3)
    for _ in range(50):
        robot = ready(threshold=0)
        gripper, hand = rng.uniform((0, 0), (1.2, 0.8), (2, 2))
        command = robot.step(senses(hand, gripper=gripper))
        others = [g for g in COLUMNS.layout.goals[:4] if g != command.predicted]
        assert command.target == min(others, key=lambda g: math.dist(COLUMNS.layout.place(g), gripper))
        assert command.belief[command.predicted] == max(command.belief.values())


def test_if_the_predicted_goal_is_all_there_is_it_waits():
    robot = ready()
    command = robot.step(senses(free=["red-circle"]))
    assert command.belief == {"red-circle": 1.0}
    assert (command.predicted, command.state, command.target) == ("red-circle", "wait", None)


def test_what_the_person_holds_is_certain():
    robot = ready()
    left = COLUMNS.layout.goals[1:4]
    command = robot.step(senses(person_holding="red-circle", goals=(), free=left))
    assert (command.predicted, command.belief, command.state) == ("red-circle", None, "approach")
    assert command.target in left
    # Once they have placed it the old reach says nothing of the next.
    robot = ready()
    robot.step(senses((0.3, 0.3), person_holding="red-circle", goals=(), free=()))
    assert robot.step(senses((0.2, 0.35), (0.95, 0.6), free=left)).belief is None
    assert robot.step(senses(number=2, start=(0.95, 0.6), free=left)).belief


def test_it_yields_what_the_person_takes_and_decides_anew():
    robot = ready()
    first = robot.step(senses(AT_RED))
    assert first.target == "yellow-triangle"
    left = tuple(g for g in COLUMNS.layout.goals[:4] if g != "yellow-triangle")
    taken = robot.step(senses(AT_RED, (0.72, 0.55), person_holding="yellow-triangle", goals=(), free=left))
    assert taken.conflict
    assert taken.predicted == "yellow-triangle"
    assert (taken.state, taken.target) == ("approach", "green-triangle")
    assert not robot.step(senses(AT_RED, (0.72, 0.55), person_holding="yellow-triangle", goals=(), free=left)).conflict


def test_it_yields_as_soon_as_it_is_sure_that_the_person_wants_the_same():
    robot = ready()
    assert robot.step(senses(AT_RED)).target == "yellow-triangle"
    turned = robot.step(senses(AT_RED, (0.5, 0.45), (0.718, 0.547)))
    assert (turned.predicted, turned.conflict) == ("yellow-triangle", False)
    assert turned.target == "green-triangle"


def test_once_decided_it_keeps_its_target_when_unsure():
    robot = ready()
    target = robot.step(senses(AT_RED)).target
    unsure = robot.step(senses(AT_RED, (0.6, 0.06)))
    assert (unsure.decided, unsure.target, unsure.state) == (False, target, "approach")


def test_what_vanished_without_the_person_is_no_conflict():
    robot = ready()
    robot.step(senses(AT_RED))
    gone = robot.step(senses(AT_RED, free=COLUMNS.layout.goals[:3]))
    assert not gone.conflict
    assert gone.target == "green-triangle"


def test_it_takes_only_what_has_a_place():
    task = TabletopTask("half", TEA.layout, TEA.graph, {"cup": (1.0, 0.45)})
    robot = ready(task)
    command = robot.step(senses(person_holding="cup", goals=(), free=("teabag",), task=task))
    assert command.state == "wait"
    by_other_hands = robot.step(senses(holding="teabag", free=(), task=task, time=1.0))
    assert by_other_hands.velocity.tolist() == [0, 0]
    assert robot.step(senses(holding="teabag", free=(), task=task, time=2.0)).release


def test_a_fetch_from_wait_to_wait():
    team = Team(RobotPartner(grasp_time=0.2), COLUMNS, seed=1).play()
    states = [command.state for _, command in team.log]
    changes = states[:1] + [b for a, b in itertools.pairwise(states) if a != b]
    followers = {"wait": {"approach"}, "approach": {"grasp", "wait"}, "grasp": {"carry", "wait", "approach"}}
    followers |= {"carry": {"place"}, "place": {"wait", "approach"}}
    assert all(b in followers[a] for a, b in itertools.pairwise(changes))
    assert set(states) == set(followers)
    grasps = [s.time for s, c in team.log if c.grasp]
    begins = [s.time for (_, a), (s, c) in itertools.pairwise(team.log) if a.state != "grasp" == c.state]
    assert len(grasps) == list(team.placed_by.values()).count("robot")
    for grasp in grasps:
        begin = max(time for time in begins if time <= grasp)  # it may have begun others, and yielded
        assert grasp - begin == pytest.approx(0.2, abs=0.6 / RATE)


# -- predictors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"threshold": -0.1},
        {"threshold": 1.1},
        {"threshold": math.nan},
        {"threshold": True},
        {"threshold": "high"},
        {"rate": 0},
        {"max_speed": 0},
        {"max_speed": math.inf},
        {"acceleration": -1},
        {"reach": 0},
        {"grasp_time": -1},
        {"clearance": -1},
        {"home": (1, 2, 3)},
        {"home": (math.nan, 0)},
    ],
)
def test_wrong_settings_are_named(options):
    with pytest.raises(ValueError, match=f"`{next(iter(options))}`"):
        RobotPartner(**options)


def test_a_home_off_the_table_is_rejected_at_the_table():
    with pytest.raises(ValueError, match="off the table"):
        RobotPartner(home=(2, 0)).reset(COLUMNS.layout, COLUMNS)
    assert RobotPartner(home=(0.2, 0.7)).reset(COLUMNS.layout, COLUMNS).tolist() == [0.2, 0.7]
