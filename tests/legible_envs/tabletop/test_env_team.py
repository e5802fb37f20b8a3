"""The table as an environment: beliefs, robots, hands on the keyboard, and what is recorded."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.rollouts import load_trajectories, save_trajectories
from legible_envs.rollouts.recording import RecordTrajectories
from legible_envs.tabletop.partner.belief import GoalBelief
from tests.legible_envs.tabletop.table_envs import APART, FIRST, SECOND, TASK, WALL, make
from tests.legible_envs.tabletop.table_player import (
    Doubtful,
    Grabber,
    Mute,
    fetch,
    go_to,
    next_point,
    play,
    towards,
)


def test_beliefs_are_bayesian_goal_inference_along_the_reach():
    env = make(layout=WALL, predictor="bayesian")
    _, info = env.reset(seed=0)
    assert env.unwrapped.belief == pytest.approx(dict.fromkeys(FIRST, 0.25))
    assert info["belief"].tolist() == pytest.approx([0.25] * 4 + [0.0] * 4)
    expected = GoalBelief(WALL, start="home", goals=sorted(FIRST))
    for _ in range(100):
        info = env.step(towards(env, next_point(env, FIRST[3])))[4]
        if info["holding"] >= 0:
            break
        assert env.unwrapped.belief == pytest.approx(expected.update(env.unwrapped.hand))
        assert dict(zip(WALL.goals, info["belief"], strict=True)) == {
            **dict.fromkeys(SECOND, 0.0),
            **env.unwrapped.belief,
        }
    assert info["holding"] == WALL.index(FIRST[3])
    assert env.unwrapped.belief is None
    assert info["belief"].tolist() == [0.0] * 8
    fetch(env, FIRST[3])
    assert set(env.unwrapped.view().belief) == set(FIRST[:3])
    assert "belief" not in make().reset()[1]


def test_a_robot_and_a_person_build_together():
    states = set()

    class Watched(gym.Wrapper):
        def step(self, action):
            result = self.env.step(action)
            states.add(self.env.unwrapped.robot_state)
            return result

    alone, together = play(make(layout=APART)), play(Watched(make(layout=APART, partner="robot")))
    info = together[-1][4]
    assert info["num_done"] == 8
    assert len(together) < len(alone)
    assert math.fsum(r[1] for r in together) == pytest.approx(8 - 0.05 * len(together) / 30)
    assert info["completion_time"] == pytest.approx(len(together) / 30)
    for measure in ("human_idle", "robot_idle", "concurrent_activity"):
        assert 0 <= info[measure] <= 1
    assert info["concurrent_activity"] > 0.2
    assert 0 < info["decision_time"] < 1
    assert 0 < info["decided_rightly"] <= 1
    assert info["conflicts"] >= 0
    assert [r[4]["completion_time"] for r in together[:-1]] == [math.inf] * (len(together) - 1)
    assert states == {"wait", "approach", "grasp", "carry", "place"}


def test_robots_take_only_what_is_valid_and_move_no_faster_than_they_can():
    env = make(partner=Grabber(*SECOND[:1], *FIRST[:1], speed=5.0))
    env.reset(seed=0)
    before = env.unwrapped.view().robot
    assert before == pytest.approx((0.6, 0.75))
    for _ in range(120):
        env.step(np.zeros(2))
        view = env.unwrapped.view()
        assert math.dist(before, view.robot) <= 1.0 / 30 + 1e-9
        before = view.robot
        if view.robot_holding:
            assert (view.positions[0] == view.robot).all()
            assert view.status[0] == "robot"
    assert env.unwrapped.view().status == ("placed",) + ("free",) * 7
    assert env.unwrapped.positions[0].tolist() == list(TASK.configuration[FIRST[0]])


def test_who_takes_an_object_first_has_it():
    env = make(partner=Grabber(FIRST[2], speed=1.0))
    env.reset(seed=0)
    target = TASK.layout.place(FIRST[2])
    for _ in range(60):
        info = env.step(towards(env, target, 2.0))[4]
    # the gripper was faster to the same cube, or the hand: never both
    view = env.unwrapped.view()
    assert (view.holding is None) != (view.status[2] == "hand")
    slow = make(partner=Grabber(FIRST[2], speed=0.05))
    slow.reset(seed=0)
    go_to(slow, target, near=0.02)
    for _ in range(10):
        info = slow.step(np.zeros(2))[4]
    assert info["holding"] == TASK.layout.index(FIRST[2])
    assert FIRST[2] not in slow.unwrapped.goals
    assert slow.unwrapped.view().robot_holding is None


def test_what_a_robot_holds_is_not_valid_for_the_person_until_it_is_dropped():
    env = make(partner=Grabber(FIRST[1], drop_after=5))
    env.reset(seed=0)
    status = []
    for _ in range(90):
        info = env.step(np.zeros(2))[4]
        status.append(env.unwrapped.view().status[1])
        assert (FIRST[1] in env.unwrapped.goals) == info["goal_mask"][1] == (status[-1] == "free")
    assert [s for s, before in zip(status, ["", *status], strict=False) if s != before] == ["free", "robot", "free"]
    assert info["num_done"] == 0
    dropped = env.unwrapped.positions[1]
    assert math.dist(dropped, TASK.layout.place(FIRST[1])) > 0.05
    for name in (*FIRST, *SECOND):
        result = fetch(env, name)
    assert result[2]


def test_second_objects_wait_for_first_ones_in_the_gripper():
    env = make(partner=Grabber(FIRST[0], speed=0.3))
    env.reset(seed=0)
    for name in FIRST[1:]:
        fetch(env, name)
    while env.unwrapped.view().status[0] != "placed":
        assert env.unwrapped.goals == ()
        env.step(np.zeros(2))
    assert set(env.unwrapped.goals) == set(SECOND)


@pytest.mark.parametrize("predictor", [Mute(), "tests.legible_envs.tabletop.table_player:Doubtful"])
def test_a_predictor_that_fails_is_reported_once_and_the_episode_goes_on(predictor):
    env = make(partner="robot", predictor=predictor)
    with pytest.warns(RuntimeWarning, match="robot waits") as caught:
        results = play(env)
    assert len(caught) == 1
    assert not any(result[4]["belief"].any() for result in results)
    info = results[-1][4]
    assert info["num_done"] == 8
    assert math.isfinite(info["completion_time"])
    with pytest.warns(RuntimeWarning, match="Doubtful"):
        assert not make(predictor=Doubtful()).reset()[1]["belief"].any()


class Confident:
    """Sure from the beginning that the person goes for the first candidate by name."""

    classes_ = ()

    def stream(self, context):
        self.goals = context.candidates
        return self

    def update(self, point, time=None):
        return {goal: float(i == 0) for i, goal in enumerate(self.goals)}


def test_partners_and_predictors_of_ones_own():
    env = make(partner="robot", predictor=Confident())
    _, info = env.reset(seed=0)
    assert env.unwrapped.goal_names[info["belief"].argmax()] == env.unwrapped.goals[0]
    assert env.unwrapped.robot_target == env.unwrapped.goal_names[info["robot_target"]]
    assert env.unwrapped.robot_state != "wait"
    assert env.unwrapped.view().threshold == 0.8
    assert make(partner="tests.legible_envs.tabletop.table_player:Grabber").reset()[1]["robot_target"] == -1
    assert make(partner={"threshold": 0.3}).unwrapped.view().threshold == 0.3


@pytest.mark.filterwarnings("ignore:.*matplotlib")
@pytest.mark.usefixtures("no_screen")
def test_playable_by_hand():
    """``gymnasium.utils.play`` accepts the environment and its keys; with them a cube is fetched."""
    import pygame
    from gymnasium.utils.play import PlayableGame

    env = make(render_mode="rgb_array")
    env.reset(options={"start": np.add(TASK.layout.place(FIRST[0]), (0.05, -0.1))})
    assert {pygame.K_UP, pygame.K_a} < PlayableGame(env, None).relevant_keys
    keys = env.unwrapped.get_keys_to_action()
    assert len(keys) == 16
    assert all(env.action_space.contains(action) for action in keys.values())
    for pressed in ([pygame.K_UP], [pygame.K_a], [pygame.K_s], [pygame.K_DOWN, pygame.K_RIGHT]):
        before = env.unwrapped.hand
        for _ in range(6):
            env.step(keys[tuple(sorted(pressed))])
        x, y = env.unwrapped.hand - before
        expected = {pygame.K_UP: (0, 0.1), pygame.K_a: (-0.1, 0), pygame.K_s: (0, -0.1)}
        assert (x, y) == pytest.approx(expected.get(pressed[0], (0.1 / math.sqrt(2), -0.1 / math.sqrt(2))), abs=1e-6)
    env.reset(options={"start": np.add(TASK.layout.place(FIRST[0]), (0.0, -0.1))})
    for _ in range(6):
        assert env.step(keys[(pygame.K_w,)])[4]["holding"] == -1
    assert env.step(np.zeros(2))[4]["holding"] == 0


# -- what is recorded -------------------------------------------------------------------------------------------------


def test_reaches_become_trajectories():
    env = make(layout=WALL)
    results = play(env, seed=3)
    reaches = env.unwrapped.trajectories(participant="p1", condition="both")
    assert [r.start for r in reaches] == ["home"] + ["assembly"] * 7
    assert {r.goal for r in reaches[:4]} == set(FIRST)
    assert [len(r.candidates) for r in reaches] == [4, 3, 2, 1] * 2
    for reach in reaches:
        assert (reach.layout, reach.participant, reach.condition) == (WALL, "p1", "both")
        assert reach.states.dtype == np.float64
        assert np.diff(reach.times) == pytest.approx(1 / 30)
        assert reach.goal_positions == tuple(WALL.place(name) for name in reach.candidates)
        away = np.abs(reach.states[-1] - WALL.place(reach.goal)) - 0.0225
        assert math.hypot(*np.maximum(away, 0)) <= 0.03
    assert tuple(reaches[0].states[0]) == (0.6, 0.05)
    total = sum(np.hypot(*np.diff(r.states, axis=0).T).sum() for r in reaches)
    assert total < results[-1][4]["path_length"]
    env.reset()
    assert env.unwrapped.trajectories() == []


def test_reaches_of_many_episodes_are_kept(tmp_path):
    env = RecordTrajectories(make(partner="robot"), participant="p2", condition="robot")
    counts = [len(env.trajectories())]
    for seed in range(2):
        info = play(env, seed)[-1][4]
        counts.append(len(env.trajectories()))
    assert counts[0] == 0 < counts[1] < counts[2] < 16  # the robot takes some
    assert info["num_done"] == 8
    with pytest.raises(LayoutError):
        env.reset(options={"layout": 3})
    assert len(env.trajectories()) == counts[2]
    env.reset()
    assert len(env.trajectories()) == counts[2]
    assert {(r.participant, r.condition) for r in env.trajectories()} == {("p2", "robot")}
    path = save_trajectories(tmp_path / "reaches.npz", env.trajectories())
    assert load_trajectories(path) == env.trajectories()
    with pytest.raises(LayoutError, match="LegibleTabletop"):
        RecordTrajectories(gym.make("CartPole-v1"))


def test_playing_on_after_the_end_changes_nothing():
    env = make(partner="robot")
    last = play(env)[-1]
    after = env.unwrapped.step(np.array([0.1, 0.0]))
    assert after[2]
    assert after[1] < 0
    assert after[4]["completion_time"] == pytest.approx(last[4]["completion_time"], abs=0.05)
