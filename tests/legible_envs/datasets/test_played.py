"""Data sets of played episodes: what Minari loads back, the same for a seed, and played again by the environment."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import legible_envs
from legible_envs.datasets.played import make_played_dataset
from legible_envs.datasets.players import PLAYERS, find_player
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.rollouts import Trajectory, from_minari, load_trajectories
from legible_envs.support.plain_data import parse_json

minari = pytest.importorskip("minari")

KITCHEN = "XOTXX\nX   C\nX1  F\nP   D\nXXSXX"
HERE = "tests.legible_envs.datasets.test_played"

CASES: list[tuple[str, str, dict[str, Any]]] = [
    *(("overcooked", player, {"layout": KITCHEN}) for player in PLAYERS["overcooked"]),
    ("overcooked", "boltzmann", {"shape": (5, 5), "layouts": "random:train", "obs_type": "vector"}),
    *(("tabletop", player, {"max_episode_steps": 150}) for player in PLAYERS["tabletop"]),
]


def drift(observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
    """A policy for tables that needs neither the environment nor a generator."""
    return np.array([0.5, 0.25], dtype=np.float32)


class Restless:
    """A policy for kitchens that is made with the environment and a generator."""

    def __init__(self, env: Any, rng: np.random.Generator) -> None:
        self.rng = rng

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> int:
        return int(self.rng.choice(np.flatnonzero(info["action_mask"])))


class Pair(Restless):
    """A joint policy of all cooks."""

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> Any:
        return [int(self.rng.choice(np.flatnonzero(mask))) for mask in info["action_mask"]]


class Broken(Restless):
    """Gives no action in its fourth step."""

    steps = 0

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> Any:
        self.steps += 1
        return 0 if self.steps < 4 else float("nan")


class Endless:
    """A distribution of kitchens that is no plain data."""

    def sample(self, rng: np.random.Generator) -> OvercookedLayout:
        return OvercookedLayout.from_ascii(KITCHEN)


def arrays(dataset: Any) -> list[bytes]:
    """Every array of every episode, byte for byte, with its type and shape."""
    names = ("observations", "actions", "rewards", "terminations", "truncations")
    found = [np.asarray(getattr(episode, name)) for episode in dataset.iterate_episodes() for name in names]
    return [str((array.dtype, array.shape)).encode() + array.tobytes() for array in found]


@pytest.mark.parametrize(
    ("domain", "player", "arguments"), CASES, ids=lambda value: value if isinstance(value, str) else ""
)
def test_what_was_played_is_loaded_back(tmp_path: Path, domain: str, player: str, arguments: dict[str, Any]) -> None:
    known = os.environ.get("MINARI_DATASETS_PATH")
    made = make_played_dataset(tmp_path, domain, player=player, episodes=3, participants=2, seed=5, **arguments)
    assert os.environ.get("MINARI_DATASETS_PATH") == known
    loaded = minari.MinariDataset(tmp_path / domain / f"{player}-v0" / "data")
    assert loaded.total_episodes == 3
    env = loaded.recover_environment()
    assert loaded.observation_space == env.observation_space == made.observation_space
    assert loaded.action_space == env.action_space
    for episode in loaded.iterate_episodes():
        steps = len(episode.actions)
        assert len(episode.observations) == steps + 1
        assert len(episode.rewards) == len(episode.terminations) == len(episode.truncations) == steps
        assert (episode.terminations | episode.truncations).tolist() == [False] * (steps - 1) + [True]
        assert all(env.observation_space.contains(observation) for observation in episode.observations)
    about = list(loaded.storage.get_episode_metadata(range(3)))
    assert [each["participant"] for each in about] == [f"{player}/0", f"{player}/1", f"{player}/0"]
    assert len({each["seed"] for each in about}) == 3
    # The recovered environment plays the same: every observation and reward is compared.
    found = from_minari(loaded)
    assert {trajectory.participant for trajectory in found} == {f"{player}/0", f"{player}/1"}
    assert {trajectory.condition for trajectory in found} == {"simulated"}
    assert load_trajectories(tmp_path / domain / f"{player}-v0") == found


def test_a_seed_makes_the_same_arrays(tmp_path: Path) -> None:
    def made(name: str, **changes: Any) -> list[bytes]:
        options: dict[str, Any] = {"player": "boltzmann", "episodes": 2, "seed": 1, "shape": (5, 5), **changes}
        return arrays(make_played_dataset(tmp_path, dataset_id=f"{name}-v0", **options))

    first = made("first")
    assert made("again") == first
    assert made("more", episodes=3)[: len(first)] == first, "further episodes do not change the ones before"
    other = made("other", seed=2)
    assert not set(other[0::5]) & set(first[0::5])


def test_what_the_data_set_says_of_itself(tmp_path: Path) -> None:
    make_played_dataset(
        tmp_path, player="scripted", episodes=1, seed=3, shape=(5, 5), author=["A", "B"], dataset_id="mine/deep/test-v2"
    )
    data = tmp_path / "mine" / "deep" / "test-v2" / "data"
    about = parse_json((data / "metadata.json").read_text(encoding="utf-8"))
    assert isinstance(about, dict)
    assert about["dataset_id"] == "mine/deep/test-v2"
    assert sorted(about["author"]) == ["A", "B"]
    assert "scripted player" in about["description"]
    version = f"legible-envs=={legible_envs.__version__}"
    assert about["requirements"] == [version]
    assert about["legible_envs"] == {"code": version, "player": "scripted", "participants": 1, "seed": 3}
    assert (tmp_path / "mine" / "namespace_metadata.json").exists()
    assert (tmp_path / "mine" / "deep" / "namespace_metadata.json").exists()
    assert not (tmp_path / "namespace_metadata.json").exists()


def test_minari_finds_it_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_played_dataset(tmp_path, "tabletop", player=drift, episodes=1, max_episode_steps=20)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert list(minari.list_local_datasets()) == ["tabletop/drift-v0"]
    episode = minari.load_dataset("tabletop/drift-v0")[0]
    assert (episode.actions == np.array([0.5, 0.25], dtype=np.float32)).all()
    assert episode.truncations[-1]


def test_policies_of_users_are_players(tmp_path: Path) -> None:
    by_name = make_played_dataset(tmp_path, player=f"{HERE}:Restless", episodes=2, seed=4, max_episode_steps=50)
    assert by_name.id == "overcooked/Restless-v0"
    again = make_played_dataset(tmp_path, player=Restless, episodes=2, seed=4, max_episode_steps=50, dataset_id="b-v0")
    assert arrays(by_name) == arrays(again)
    of_one = make_played_dataset(
        tmp_path, "tabletop", player=f"{HERE}:drift", episodes=1, max_episode_steps=5, dataset_id="c-v0"
    )
    assert of_one.total_steps == 5


def test_cooks_of_one_kitchen_have_trajectories_of_their_own(tmp_path: Path) -> None:
    made = make_played_dataset(
        tmp_path,
        player=Pair,
        episodes=2,
        num_players=2,
        layout=KITCHEN,
        max_episode_steps=1500,
    )
    assert made.observation_space.shape == (2, 5, 5, 30)
    assert made[0].actions.shape[1:] == (2,)
    found = from_minari(made, candidate_set="all")
    name = f"{HERE}:Pair/0"
    assert {trajectory.participant for trajectory in found} == {f"{name}/0", f"{name}/1"}


def test_nothing_is_left_of_what_failed(tmp_path: Path) -> None:
    with pytest.raises(
        RuntimeError, match=r"gave an action that is none in episode 0, step 3: expected an action 0\.\.5"
    ):
        make_played_dataset(tmp_path, player=Broken, episodes=2, shape=(5, 5))
    with pytest.raises(RuntimeError, match="failed in episode 0, step 0: TypeError"):
        make_played_dataset(tmp_path, player=lambda observation: 0, episodes=2, shape=(5, 5), dataset_id="d-v0")
    assert list(tmp_path.iterdir()) == []
    make_played_dataset(tmp_path, player=Restless, episodes=1, max_episode_steps=3, dataset_id="d-v0")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FileExistsError, match="there is a data set 'd-v0'"):
        make_played_dataset(tmp_path, player=Restless, episodes=1, max_episode_steps=3, dataset_id="d-v0")
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"domain": "office"}, ValueError, "domain"),
        ({"player": "reach"}, ValueError, r"no player 'reach' in overcooked; there are scripted, boltzmann"),
        ({"player": "nowhere:Policy"}, ValueError, "cannot be imported"),
        ({"player": 3}, TypeError, "a player is a name"),
        ({"player": OvercookedLayout}, RuntimeError, "cannot be made with"),
        ({"episodes": 0}, ValueError, "episodes"),
        ({"participants": 0}, ValueError, "participants"),
        ({"seed": -1}, ValueError, "seed"),
        ({"dataset_id": "../x-v0"}, ValueError, "a data set is called like"),
        ({"dataset_id": "x"}, ValueError, "a data set is called like"),
        ({"layout": "XX"}, ValueError, "both sides"),
        ({"speed": 1}, ValueError, r"LegibleOvercooked-v0 cannot be made with \['speed'\]"),
        ({"layouts": Endless()}, ValueError, "must be data that JSON can hold"),
    ],
)
def test_what_is_refused(tmp_path: Path, arguments: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make_played_dataset(tmp_path / "out", **{"episodes": 1, **arguments})
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())


def test_the_scripted_hand_is_steady() -> None:
    """Two scripted hands with other generators reach alike where they choose the same goal."""
    env = gym.make("LegibleTabletop-v0")
    paths = []
    for seed in (0, 1):
        observation, info = env.reset(seed=0, options={"goal": "red-circle"})
        policy = find_player("tabletop", "scripted").make(env, np.random.default_rng(seed))
        paths.append([policy(observation, info)])
        for _ in range(20):
            observation, _, _, _, info = env.step(paths[-1][-1])
            paths[-1].append(policy(observation, info))
    assert np.array_equal(*paths)


def test_a_kitchen_is_what_its_trajectories_say(tmp_path: Path) -> None:
    found: list[Trajectory] = from_minari(make_played_dataset(tmp_path, player="cloned", episodes=1, layout=KITCHEN))
    env = OvercookedEnv(layout=KITCHEN)
    assert {trajectory.layout for trajectory in found} == {env.layout}
