"""Tables of heterogeneous teams: person and robot each keep to what they can perform, and wait for one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from legible_envs import TaskError
from legible_envs.tabletop import TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.humans.simulation import sample_person, simulate_participants
from legible_envs.tabletop.policies import ReachingPlayer
from legible_envs.tabletop.scoring.explanation import score_layout
from legible_envs.tabletop.scoring.scorer import TabletopScorer
from legible_envs.tasks import TaskGraph
from tests.legible_envs.tabletop.table_envs import make
from tests.legible_envs.tabletop.table_player import Grabber, Player, go_to, play

TEA = TabletopTask.named("tea")


def team_task(**agents: str) -> TabletopTask:
    """Making tea, where some objects are for one agent alone."""
    subtasks = [replace(s, agents=agents[s.name]) if s.name in agents else s for s in TEA.graph.subtasks]
    return replace(TEA, name="tea for two", graph=TaskGraph(subtasks, TEA.graph.start))


SHARED = team_task(cup="human", kettle="robot", sugar="robot")


def who_places(env, player, seed=0) -> tuple[dict[str, str], bool]:
    """Play an episode; who took each object last, and whether the task was done."""
    _, info = env.reset(seed=seed)
    game, taken, over = env.unwrapped.game, {}, False
    while not over:
        info = (result := env.step(player(env.unwrapped, info)))[4]
        over = result[2] or result[3]
        taken |= {game.names[i]: who for i, who in ((game.holding, "human"), (game.robot_holding, "robot")) if i >= 0}
        assert not {"kettle", "sugar"} & set(env.unwrapped.goal_names[info["goal_mask"]])
        assert "cup" not in game.robot_goals
    return taken, result[2]


@pytest.mark.parametrize("seed", [0, 1])
def test_each_does_what_it_can_perform(seed):
    env = make(task=SHARED, partner="robot", max_speed=3.0)
    person = ReachingPlayer(env, sample_person(np.random.default_rng(seed)), np.random.default_rng(seed))
    taken, is_done = who_places(env, lambda _, info: person(None, info), seed)
    assert is_done
    assert taken["cup"] == "human"
    assert taken["kettle"] == taken["sugar"] == "robot"
    assert {t.goal for t in env.unwrapped.trajectories()} <= {"cup", "teabag", "milk"}


def test_a_person_with_nothing_to_do_waits_for_a_robot_that_needs_no_prediction():
    env = make(task=team_task(cup="robot", teabag="robot"), partner="robot", threshold=1.0)
    _, info = env.reset(seed=0)
    assert env.unwrapped.goals == ()
    assert not info["goal_mask"].any()
    assert info["stage"] == -1
    assert env.unwrapped.robot_target in ("cup", "teabag")
    result = play(env)[-1]
    assert result[2]
    assert len(env.unwrapped.trajectories()) == 3  # at a threshold of 1 the robot takes nothing that both can
    assert result[4]["conflicts"] == 0


def test_a_hand_takes_nothing_that_only_the_robot_may():
    env = make(task=team_task(cup="robot"), partner=Grabber())
    env.reset(seed=0)
    go_to(env, TEA.layout.place("cup"), near=0.002)
    for _ in range(5):
        assert env.step(np.zeros(2, dtype=np.float32))[4]["holding"] == -1
    assert env.unwrapped.goals == ("teabag",)
    with pytest.raises(ValueError, match="one of \\['teabag'\\]; got 'cup'"):
        env.reset(options={"goal": "cup"})


def test_a_gripper_takes_nothing_that_only_the_person_may():
    grabber = Grabber("cup", "teabag")
    env = make(task=team_task(cup="human"), partner=grabber)
    env.reset(seed=0)
    for _ in range(120):
        env.step(np.zeros(2, dtype=np.float32))
    game = env.unwrapped.game
    assert game.statuses()[game.index["cup"]] == "free"
    assert game.statuses()[game.index["teabag"]] == "placed"
    assert not game.robot_take("cup")


def test_tasks_that_nobody_could_finish_are_refused():
    with pytest.raises(TaskError, match=r"only a robot can perform, and there is none: \['kettle', 'sugar'\]"):
        TabletopEnv(task=SHARED)
    with pytest.raises(TaskError, match="only a robot can perform, and there is none"):
        TabletopEnv(task=SHARED.to_dict(), predictor="bayesian")
    places = {name: at for name, at in SHARED.configuration.items() if name != "sugar"}
    with pytest.raises(TaskError, match="goal 'sugar', and a robot carries objects to a point; give 'sugar' a place"):
        TabletopEnv(task=replace(SHARED, configuration=places), partner="robot")


def test_scores_are_of_what_the_person_may_do():
    layout = SHARED.layout.with_obstacles([VirtualObstacle((0.55, 0.45), 0.3)])
    scorer = TabletopScorer(SHARED)
    result, expected = scorer.score_layout(layout), score_layout(layout, SHARED)
    assert result["score"] == pytest.approx(expected["score"], abs=1e-9)
    assert result["distance"] == pytest.approx(expected["distance"])
    assert result["score"] != pytest.approx(TabletopScorer(TEA).score_layout(layout)["score"], abs=1e-3)
    assert {row["goal"] for row in scorer.explain_layout(layout)} == {"cup", "teabag", "milk"}
    workspace = TabletopWorkspace(task=SHARED)
    assert workspace.legibility(workspace.sample(3, np.random.default_rng(0))).shape == (3,)
    assert workspace.ranked == ("cup", "teabag")
    reaches = simulate_participants(layout, 2, np.random.default_rng(0), task=SHARED)
    assert sorted(r.goal for r in reaches) == sorted(["cup", "teabag", "milk"] * 2)
    assert not any({"kettle", "sugar"} & set(r.candidates) for r in reaches)


def test_files_keep_who_can_do_what(tmp_path):
    SHARED.to_yaml(tmp_path / "tea.yaml")
    again = TabletopTask.from_yaml(tmp_path / "tea.yaml")
    assert again == SHARED
    assert hash(again) == hash(SHARED)
    assert again != TEA


def test_players_of_tasks_for_everybody_are_as_before():
    env = make(task=team_task(), partner="robot", threshold=1.0)
    env.reset(seed=0)
    player = Player()
    for _ in range(150):
        env.step(player(env))
        assert env.unwrapped.robot_state == "wait"
