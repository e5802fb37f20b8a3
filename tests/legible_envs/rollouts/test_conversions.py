"""Trajectories survive CSV; episodes of any player become trajectories and Minari data sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.overcooked.human_play import Played, trajectories_from_played
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.trajectories import trajectories_from_views
from legible_envs.rollouts import (
    RecordTrajectories,
    load_trajectories,
    record_episode,
    save_trajectories,
    to_minari,
)
from legible_envs.tabletop import TableObject, TabletopLayout, VirtualObstacle

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nX 1 X\nXXSPX")
TABLE = TabletopLayout([TableObject("a cup, red", (0.1 + 0.2, 0.5))], [VirtualObstacle((0.4, 0.2), 1 / 3)])
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
    assert load_trajectories(tmp_path / "me.npz") == trajectories_from_played(played, participant="me")
    save_trajectories(tmp_path / "walks.npz", found)
    assert load_trajectories(tmp_path / "walks.npz") == found
    wrong = Played(played.layout, played.recipes, actions=played.actions, episodes=played.episodes,
                   rewards=played.rewards + 1)  # fmt: skip
    with pytest.raises(ValueError, match="step 0 was recorded with reward"):
        trajectories_from_played(wrong)
    (tmp_path / "other.npz").write_bytes(b"no")
    with pytest.raises(ValueError, match="cannot read trajectories"):
        load_trajectories(tmp_path / "other.npz")


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
