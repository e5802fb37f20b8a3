"""Trajectories survive CSV; episodes of any player become trajectories and Minari data sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.overcooked.human_play import Played, trajectories_from_played
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.trajectories import trajectories_from_views
from legible_envs.rollouts import (
    RecordTrajectories,
    Trajectory,
    read_any,
    read_csv,
    record_episode,
    save_trajectories,
    to_minari,
    write_csv,
)
from legible_envs.tabletop import TableObject, TabletopLayout, VirtualObstacle

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nX 1 X\nXXSPX")
TABLE = TabletopLayout([TableObject("a cup, red", (0.1 + 0.2, 0.5))], [VirtualObstacle((0.4, 0.2), 1 / 3)])
NAMES = st.text(
    st.characters(exclude_characters=";\x00\r\n", exclude_categories=["Cs", "Cc", "Zs"]), min_size=1, max_size=5
)


@st.composite
def trajectories(draw: st.DrawFn, grid: bool) -> Trajectory:
    count = draw(st.integers(1, 6))
    number = st.integers(0, 9) if grid else st.floats(-2, 2, allow_subnormal=False)
    states = draw(st.lists(st.tuples(number, number), min_size=count, max_size=count))
    names = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    return Trajectory(
        np.array(states, dtype=int if grid else float),
        times=np.cumsum(draw(st.lists(st.floats(0, 3), min_size=count, max_size=count))),
        start=draw(st.sampled_from(["", "pot", 'a "quoted", name'])),
        goal=draw(st.sampled_from([None, *names])),
        candidates=tuple(names),
        participant=draw(st.sampled_from(["", "p1", "Zoë"])),
        condition=draw(st.sampled_from(["", "legible"])),
        layout=draw(st.sampled_from([None, KITCHEN, TABLE])),
        layout_name=draw(st.sampled_from(["", "home, sweet"])),
        candidate_set=draw(st.sampled_from(["task", "game", "all"])),
        complete=draw(st.booleans()),
        goal_positions=draw(st.sampled_from([None, tuple((0.1 * i, 1e-9) for i in range(len(names)))])),
    )


# -- CSV --------------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(found=st.booleans().flatmap(lambda grid: st.lists(trajectories(grid), max_size=5)))
def test_trajectories_survive_csv(tmp_path_factory: pytest.TempPathFactory, found: list[Trajectory]) -> None:
    path = write_csv(tmp_path_factory.mktemp("csv") / "walks.csv", found)
    assert read_csv(path) == found
    assert read_any(path) == found


def test_csv_of_other_people_needs_little(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "\ufefftrajectory,row,col,goal,mood\n7,1,1,onion,good\n7,0,1,onion,bad\nz,1,3,tomato,\nz,0,3,tomato,\n"
    )
    first, second = read_csv(path, layout=KITCHEN)
    assert first == Trajectory([(1, 1), (0, 1)], goal="onion", candidates=("onion", "tomato"), layout=KITCHEN)
    assert second.goal == "tomato"
    path.write_text("trajectory,time,x,y,goal,candidates\na,0,.5,1,,left; right\na,.1,.5,1e-1,,left; right\n")
    (reach,) = read_csv(path)
    assert (reach.goal, reach.candidates, reach.times.tolist()) == (None, ("left", "right"), [0.0, 0.1])
    assert not reach.is_grid


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected columns 'trajectory'"),
        ("trajectory,goal\na,b\n", "row, col"),
        ("trajectory,y,goal\na,1,b\n", "row, col"),
        ("row,col,goal\n1,1,b\n", "'trajectory'"),
        ("trajectory,row,col,goal\na,1,x,b\n", "trajectory 'a': line 2: 'col' must be a whole number, got 'x'"),
        ("trajectory,x,goal\na,1,b\na,,b\n", "line 3: 'x' must be a number, got ''"),
        ("trajectory,x,goal\na,nan,b\n", "must be finite"),
        ("trajectory,x,goal\na,1,b\na,2,c\n", "line 3: 'goal' differs from line 2"),
        ("trajectory,x,goal\na,1,b\nc,1,b\na,2,b\n", "line 4: rows of trajectory 'a' are not together"),
        ("trajectory,x,time,goal\na,1,0,b\na,1,,b\n", "line 3: no time"),
        ("trajectory,x,time,goal\na,1,1,b\na,1,0,b\n", "never decrease"),
        ("trajectory,x,goal,candidates\na,1,b,c;d\n", "not among the candidates"),
        ("trajectory,x,goal,positions\na,1,b,1;x\n", "line 2: 'positions' must be numbers"),
        ("trajectory,x,goal,positions\na,1,b,1;2\n", "one finite position for each of 1"),
        ("trajectory,x,goal,complete\na,1,b,yes\n", "0 or 1"),
        ("trajectory,x,goal,candidate_set\na,1,b,none\n", "candidate_set"),
        ("trajectory,row,col,goal,layout\na,1,1,b,XX/X\n", "row"),
    ],
)
def test_bad_csv_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_csv(path)
    assert "bad.csv" in str(caught.value)


def test_what_csv_cannot_hold_is_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "w.csv", [Trajectory([(1, 1)], candidates=("a",))])
    before = path.read_bytes()
    cell = Trajectory([(1, 1)], candidates=("a",))
    for bad, message in (
        ([cell, Trajectory([(1.0, 1.0)], candidates=("a",))], "one kind"),
        ([cell.first(0)], "has no states"),
        ([Trajectory([(1, 1)], candidates=("a;b",))], "';'"),
        ([Trajectory([(1.0,) * 4], candidates=("a",))], "1 to 3"),
    ):
        with pytest.raises(ValueError, match=message):
            write_csv(path, bad)
        assert path.read_bytes() == before
    with pytest.raises(FileNotFoundError):
        read_csv(tmp_path / "none.csv")
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError, match="not a CSV"):
        read_csv(path)


# -- episodes ---------------------------------------------------------------------------------------------------------


def scripted(episodes: int = 2, steps: int = 10_000, **labels: Any) -> RecordTrajectories:
    env = RecordTrajectories(gym.make("LegibleOvercooked-v0", shape=(5, 6)), **labels)
    player = ScriptedPlayer(env, np.random.default_rng(0))
    for seed in range(episodes):
        observation, info = env.reset(seed=seed)
        for _ in range(steps):
            observation, _, terminated, truncated, info = env.step(player(observation, info))
            if terminated or truncated:
                break
    return env


def test_a_recording_holds_the_walks_of_its_episodes() -> None:
    env = scripted(participant="s")
    assert len(env.episodes) == 2
    plain = gym.make("LegibleOvercooked-v0", shape=(5, 6))
    player = ScriptedPlayer(plain, np.random.default_rng(0))
    expected = [walk for seed in range(2) for walk in record_episode(plain, player, seed=seed, participant="s")]
    assert len(expected) > 10
    assert env.trajectories() == expected
    everything = scripted(candidate_set="all")
    assert {walk.candidate_set for walk in everything.trajectories()} == {"all"}
    assert everything.env.unwrapped.trajectories(candidate_set="all") == everything.trajectories()[-12:]  # type: ignore[attr-defined]
    env.participant = "t"
    assert [walk.participant for walk in env.trajectories()] == ["s"] * 12 + ["t"] * 12
    with pytest.raises(LayoutError, match="CartPole"):
        RecordTrajectories(gym.make("CartPole-v1"))


@pytest.mark.usefixtures("no_screen")
def test_gymnasiums_own_play_can_be_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    from gymnasium.utils.play import PlayableGame, play

    env = RecordTrajectories(
        gym.make(
            "LegibleOvercooked-v0", shape=(5, 5), layout=KITCHEN, recipes=[("onion",) * 3], render_mode="rgb_array"
        )
    )
    script = iter([0, 2, 0, 0, 5])

    def press(game: PlayableGame, event: Any) -> None:
        action = next(script, None)
        game.running = action is not None
        game.pressed_keys = [] if action is None else [action]

    monkeypatch.setattr(PlayableGame, "process_event", press)
    import pygame

    monkeypatch.setattr(pygame.event, "get", lambda: [None])
    play(env, keys_to_action={(key,): key for key in range(6)}, noop=4, fps=1000, seed=0)
    assert len(env.episodes) == 1
    assert env.episodes[0].actions == [0, 2, 0, 0, 5]


def as_played(env: RecordTrajectories) -> Played:
    layout = OvercookedLayout.from_ascii(env.episodes[0].options["layout"])
    from legible_envs.overcooked.recipes import PAPER_SOUPS

    counts = [len(episode) for episode in env.episodes]
    return Played(
        layout,
        PAPER_SOUPS,
        actions=np.concatenate([episode.actions for episode in env.episodes]).astype(np.int8),
        episodes=np.repeat(np.arange(len(counts)), counts).astype(np.int32),
        rewards=np.concatenate([episode.rewards for episode in env.episodes]),
    )


def test_recordings_of_play_become_the_walks_that_were_played(tmp_path: Path) -> None:
    env = scripted(episodes=1, participant="me", condition="home")
    played = as_played(env)
    found = trajectories_from_played(played, participant="me", condition="home")
    assert found == env.trajectories()
    assert len(found) == 12
    played.save(tmp_path / "me.npz")
    assert read_any(tmp_path / "me.npz") == trajectories_from_played(played, participant="me")
    save_trajectories(tmp_path / "walks.npz", found)
    assert read_any(tmp_path / "walks.npz") == found
    wrong = Played(played.layout, played.recipes, actions=played.actions, episodes=played.episodes,
                   rewards=played.rewards + 1)  # fmt: skip
    with pytest.raises(ValueError, match="step 0 was recorded with reward"):
        trajectories_from_played(wrong)
    (tmp_path / "other.npz").write_bytes(b"no")
    with pytest.raises(ValueError, match="cannot read trajectories"):
        read_any(tmp_path / "other.npz")


def test_a_minari_data_set_is_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = scripted()
    env.reset(seed=7)
    env.step(4)  # broken off
    to_minari(env, "kitchen/scripted-v0", author="someone", description="Two games.")
    loaded = minari.load_dataset("kitchen/scripted-v0")
    assert loaded.total_episodes == 3
    assert loaded.total_steps == sum(len(episode) for episode in env.episodes)
    for theirs, ours in zip(loaded.iterate_episodes(), env.episodes, strict=True):
        np.testing.assert_array_equal(theirs.observations, np.stack(ours.observations))
        np.testing.assert_array_equal(theirs.actions, ours.actions)
        np.testing.assert_allclose(theirs.rewards, ours.rewards)
        assert theirs.terminations[-1] or theirs.truncations[-1]
    again = loaded.recover_environment()
    assert again.spec.id == "LegibleOvercooked-v0"
    assert again.observation_space == env.observation_space
    with pytest.raises(ValueError, match="already"):
        to_minari(env, "kitchen/scripted-v0")
    with pytest.raises(ValueError, match="nothing was recorded"):
        to_minari(RecordTrajectories(gym.make("LegibleOvercooked-v0")), "kitchen/empty-v0")


def test_reaches_become_a_minari_data_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = RecordTrajectories(gym.make("LegibleTabletop-v0", max_episode_steps=5), participant="p")
    env.action_space.seed(0)
    for seed in range(2):
        env.reset(seed=seed, options={"start": "red-circle"})
        while not (env.episodes and (seed + 1 == len(env.episodes)) and env.episodes[-1].truncations[-1]):
            env.step(env.action_space.sample())
    to_minari(env, "table/random-v0")
    loaded = minari.load_dataset("table/random-v0")
    assert (loaded.total_episodes, loaded.total_steps) == (2, 10)
    for theirs, ours in zip(loaded.iterate_episodes(), env.episodes, strict=True):
        np.testing.assert_array_equal(theirs.observations, np.stack(ours.observations))
        np.testing.assert_array_equal(theirs.actions, np.stack(ours.actions))
    again = env.unwrapped.settings.read(env.episodes[0].options["layout"])  # type: ignore[attr-defined]
    assert again == env.unwrapped.layout  # type: ignore[attr-defined]
    assert env.episodes[0].options["start"] == "red-circle"


def test_the_trajectories_of_an_episode_are_those_of_its_views() -> None:
    """They are played again from the actions; the views are what was seen of every state."""
    env = gym.make("LegibleOvercooked-v0", layouts="random", shape=(6, 6), virtual_obstacles="soft")
    game: Any = env.unwrapped
    assert game.trajectories() == []
    rng = np.random.default_rng(0)
    for seed in range(5):
        player = ScriptedPlayer(env, rng)
        observation, info = env.reset(seed=seed)
        views, goals = [game.view()], [game.goals]
        for _ in range(250):
            action = player(observation, info) if rng.random() < 0.9 else int(rng.integers(6))
            observation, _, over, _, info = env.step(action)
            views.append(game.view())
            goals.append(game.goals)
            if over:
                break
        for kind, options in (("game", {"valid_goals": goals}), ("all", {})):
            expected = trajectories_from_views(views, participant="p", min_candidates=2, **options)
            assert game.trajectories(participant="p", candidate_set=kind, min_candidates=2) == expected
            assert expected
