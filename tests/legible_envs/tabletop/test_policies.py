"""Simulated people play ``LegibleTabletop-v0``: they finish every task, alone and beside a robot."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import legible_envs
from legible_envs.tabletop import TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.humans import Person, ReachModel, sample_person
from legible_envs.tabletop.policies import ReachingPlayer
from predictors import StraightLineBayesian

assert legible_envs

Drawn = tuple[Person, np.random.Generator]
WALLS = [VirtualObstacle((0.45, 0.45), 1.5), VirtualObstacle((0.57, 0.45), 1.5), VirtualObstacle((0.33, 0.62), 1.6)]


def walled() -> TabletopLayout:
    return TabletopTask.named("columns").layout.with_obstacles(WALLS)


def play(person: Drawn, options: dict[str, Any] | None = None, seed: int = 0, **arguments: Any) -> Any:
    """Play one episode; the environment, what was seen of it, and the last info."""
    env = gym.make("LegibleTabletop-v0", **arguments)
    player = ReachingPlayer(env, *person)
    obs, info = env.reset(seed=seed, options=options)
    seen, over = [obs], False
    while not over:
        action = player(obs, info)
        assert env.action_space.contains(action)
        assert np.hypot(*action) <= 1 + 1e-6
        obs, _, terminated, truncated, info = env.step(action)
        seen.append(obs)
        over = terminated or truncated
    assert terminated
    return env.unwrapped, np.array(seen), info


def someone(seed: int, **habits: Any) -> Drawn:
    """A random person and the source of their randomness."""
    rng = np.random.default_rng(seed)
    return ReachModel(Person(**habits)).sample_person(rng), rng


@pytest.mark.parametrize(
    ("task", "contact"), [("columns", "slow"), ("columns", "always"), ("tea", "always"), ("bins", "slow")]
)
def test_every_task_is_finished(task: str, contact: str) -> None:
    graph = TabletopTask.named(task).graph
    env, _, info = play(someone(0), task=task, contact=contact)
    assert info["num_done"] == graph.length
    reaches = env.trajectories()
    assert len(reaches) == graph.length
    if task != "bins":
        assert sorted(reach.goal for reach in reaches) == sorted(graph.goals)
    assert 4 < info["time"] < 40  # seconds; the limit is 60


def test_orders_differ_and_seeds_repeat() -> None:
    first, again, other = (play(someone(seed), task="tea") for seed in (3, 3, 4))
    assert np.array_equal(first[1], again[1])
    assert first[1].shape != other[1].shape or not np.array_equal(first[1], other[1])
    orders = {tuple(r.goal for r in play(someone(seed), task="tea")[0].trajectories()) for seed in range(6)}
    assert len(orders) > 2


def test_hands_keep_off_obstacles_unless_the_person_crosses() -> None:
    for seed in range(4):
        _, _, info = play(someone(seed, start_sd=0.01), {"layout": walled()}, virtual_obstacles="soft")
        assert info["crossings"] == 0
    crossings = [
        play(someone(seed, crossing_rate=1.0), {"layout": walled()}, virtual_obstacles="soft")[2]["crossings"]
        for seed in range(2)
    ]
    assert min(crossings) > 0


def test_people_who_cross_are_stopped_by_hard_obstacles_and_find_round_them() -> None:
    env, _, info = play(someone(0, crossing_rate=1.0), {"layout": walled()})
    assert info["crossings"] == 0
    points = np.concatenate([reach.states for reach in env.trajectories()])
    assert walled().paths.is_free(points).mean() > 0.999


def test_one_player_plays_many_episodes_and_takes_the_goal_that_was_set() -> None:
    env = gym.make("LegibleTabletop-v0", task="tea")
    player = ReachingPlayer(env, *someone(0))
    for goal in ("teabag", "cup", "teabag"):
        obs, info = env.reset(options={"goal": goal})
        player(obs, info)
        assert player.goal == goal
        over = False
        while not over:
            obs, _, terminated, truncated, info = env.step(player(obs, info))
            over = terminated or truncated
        assert info["num_done"] == 5
        assert env.unwrapped.trajectories()[0].goal == goal  # type: ignore[attr-defined]
    obs, info = env.reset()
    for _ in range(10):  # broken off: the next episode begins anew
        obs, *_, info = env.step(player(obs, info))
    obs, info = env.reset(options={"layout": None})
    assert (env.step(player(obs, info))[0] != 0).any()


def test_a_team_finishes_sooner_and_never_waits_for_ever() -> None:
    alone = [play(someone(seed))[2]["time"] for seed in range(3)]
    team = [play(someone(seed), partner="robot")[2] for seed in range(3)]
    assert np.mean([info["time"] for info in team]) < np.mean(alone)
    assert all(info["num_done"] == 8 for info in team)


def test_a_player_belongs_to_one_table_and_plays_under_wrappers() -> None:
    with pytest.raises(ValueError, match="one environment"):
        ReachingPlayer(gym.make_vec("LegibleTabletop-v0", num_envs=2), *someone(0))  # type: ignore[arg-type]
    plain = gym.make("LegibleTabletop-v0", task="tea")
    wrapped = gym.wrappers.RescaleObservation(plain, np.float32(0.0), np.float32(1.0))
    actions = []
    for env in (plain, wrapped):
        player = ReachingPlayer(env, *someone(1))
        obs, info = env.reset(seed=0)
        played = []
        for _ in range(120):
            played.append(player(obs, info))
            obs, *_, info = env.step(played[-1])
        actions.append(np.array(played))
    assert np.array_equal(*actions)


def test_grasps_and_releases_take_the_persons_pause() -> None:
    times = [play(someone(0, pause=pause), task="tea")[2]["time"] for pause in (0.0, 1.0)]
    assert times[1] - times[0] == pytest.approx(9.0, abs=0.4)  # 5 grasps and 4 releases before the last


def test_eq_1_predicts_played_reaches_better_the_more_it_sees() -> None:
    reaches = [reach for seed in range(4) for reach in play(someone(seed))[0].trajectories(participant=str(seed))]
    predictor = StraightLineBayesian().fit(reaches)
    early, late = (predictor.score(reaches, fractions=(f,), cut="arc") for f in (0.1, 0.9))
    assert late > 0.8
    assert late > early + 0.15  # half of the reaches have one or two candidates


def test_a_goal_out_of_reach_is_given_up_for_another() -> None:
    env = gym.make("LegibleTabletop-v0", task="tea")
    obs, info = env.reset(options={"goal": "cup"})
    player = ReachingPlayer(env, *someone(0))
    table = env.unwrapped
    for step in range(600):
        obs, *_, info = env.step(player(obs, info))
        if step == 1:  # a box of obstacles round the cup, which env.reset would refuse
            x, y = table.layout.place("cup")  # type: ignore[attr-defined]
            box = [
                VirtualObstacle((x + dx, y + dy), a)
                for dx, dy, a in ((0, 0.1, 0), (0, -0.1, 0), (0.1, 0, np.pi / 2), (-0.1, 0, np.pi / 2))
            ]
            game = table._game  # type: ignore[attr-defined]
            game.layout = game.layout.with_obstacles(box)
            game._grown = game.layout.paths.boxes
        if table.holding is not None:  # type: ignore[attr-defined]
            break
    assert table.holding == "teabag"  # type: ignore[attr-defined]


def test_sampled_people_play() -> None:
    rng = np.random.default_rng(9)
    assert play((sample_person(rng), rng), task="tea")[2]["num_done"] == 5
