"""Trajectories come out of Minari data sets, whoever recorded them, exactly as they were played."""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.rollouts import RecordTrajectories, Trajectory, from_minari, load_trajectories, to_minari
from legible_envs.tabletop.humans import sample_person
from legible_envs.tabletop.policies import ReachingPlayer
from tests.legible_envs.rollouts.hostile import HARD_NAMES

minari = pytest.importorskip("minari")

KITCHEN, TABLE = "LegibleOvercooked-v0", "LegibleTabletop-v0"
OTHER = "XOTXX\nX   C\nX1  F\nP   D\nXXSXX"


@pytest.fixture(autouse=True)
def _local(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))


@pytest.fixture
def collector(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Minari's own recorder, which needs one function of jax."""
    try:
        import jax
    except ImportError:
        tree = types.ModuleType("jax.tree_util")
        tree.tree_map = _tree_map  # type: ignore[attr-defined]
        jax = types.ModuleType("jax")
        jax.tree_util = tree  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "jax", jax)
        monkeypatch.setitem(sys.modules, "jax.tree_util", tree)
    return minari.DataCollector  # type: ignore[no-any-return]


def _tree_map(f: Callable[..., Any], tree: Any, *rest: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _tree_map(f, value, *(each[key] for each in rest)) for key, value in tree.items()}
    return f(tree, *rest)


def played(env: Any, episodes: int = 2, **reset: Any) -> list[Trajectory]:
    """The trajectories that the environment itself tells of its episodes."""
    rng = np.random.default_rng(0)
    is_kitchen = env.unwrapped.spec.id == KITCHEN
    player: Any = ScriptedPlayer(env, rng) if is_kitchen else ReachingPlayer(env, sample_person(rng), rng)
    found = []
    for _ in range(episodes):
        (observation, info), over = env.reset(**reset), False
        while not over:
            observation, _, terminated, truncated, info = env.step(player(observation, info))
            over = terminated or truncated
        found += env.unwrapped.trajectories()
    return found


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "kitchen": (KITCHEN, {"shape": (5, 6)}),
    "random kitchens": (KITCHEN, {"shape": (5, 5), "layouts": "random"}),
    "vectors": (KITCHEN, {"shape": (5, 5), "obs_type": "vector"}),
    "pictures": (KITCHEN, {"shape": (5, 5), "obs_type": "rgb"}),
    "table": (TABLE, {}),
    "table with a robot": (TABLE, {"partner": "robot"}),
    "bins": (TABLE, {"task": "bins"}),
}


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("case", CASES)
def test_what_minaris_collector_recorded_is_read(case: str, collector: Callable[..., Any]) -> None:
    name, arguments = CASES[case]
    env = collector(gym.make(name, max_episode_steps=150 if case == "pictures" else None, **arguments))
    expected = played(env, episodes=1 if case == "pictures" else 2)
    assert expected
    dataset = env.create_dataset("mine/played-v0")
    assert from_minari(dataset) == expected
    if case == "kitchen":
        folder = Path(dataset.storage.data_path)
        assert load_trajectories("mine/played-v0") == load_trajectories(folder) == expected
        assert load_trajectories(folder.parent) == expected
        everything = from_minari("mine/played-v0", participant="p", condition="c", candidate_set="all")
        assert {(t.participant, t.condition, t.candidate_set) for t in everything} == {("p", "c", "all")}
        with pytest.raises(ValueError, match="it looks like an HDF5 file"):
            load_trajectories(folder / "main_data.hdf5")


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_layouts_of_resets_are_played_on_until_they_are_replaced(collector: Callable[..., Any]) -> None:
    env = collector(gym.make(KITCHEN, shape=(5, 5), max_episode_steps=100))
    first, later = played(env, 1), played(env, 1, options={"layout": OTHER}) + played(env, 1)
    expected = first + later
    assert len({trajectory.layout for trajectory in expected}) == 2
    dataset = env.create_dataset("mine/layouts-v0")
    assert from_minari(dataset) == expected
    last = dataset.filter_episodes(lambda episode: episode.id == 2)  # which names no layout
    with pytest.raises(ValueError, match=r"episode 2 of .* begins in none of the states .*give layouts to `reset"):
        from_minari(last)
    # episodes whose options were lost begin on a layout that another one names
    assert from_minari(dataset.filter_episodes(lambda episode: episode.id != 0)) == later


def test_recorded_trajectories_survive_with_their_labels() -> None:
    env = RecordTrajectories(gym.make(KITCHEN, shape=(5, 5), max_episode_steps=80), candidate_set="all")
    for name in (*HARD_NAMES, "\0", ""):
        env.participant = env.condition = name
        played(env, 1)
    assert len({trajectory.participant for trajectory in env.trajectories()}) > 60
    assert from_minari(to_minari(env, "mine/kitchens-v0")) == env.trajectories()
    table = RecordTrajectories(gym.make(TABLE, max_episode_steps=400), participant="p")
    played(table, 2, options={"start": (0.3, 0.05)})
    assert table.trajectories()
    assert from_minari(to_minari(table, "mine/tables-v0")) == table.trajectories()


def kitchens(name: str = "mine/small-v0", **arguments: Any) -> tuple[Any, list[Trajectory]]:
    env = RecordTrajectories(gym.make(KITCHEN, shape=(5, 5), max_episode_steps=60, **arguments))
    played(env, 1)
    return to_minari(env, name), env.trajectories()


def changed(dataset: Any, **values: Any) -> None:
    """Change a data set's file: arrays of its first episode at (index, value), or metadata."""
    import h5py

    folder = Path(dataset.storage.data_path)
    with h5py.File(folder / "main_data.hdf5", "a") as file:
        for key, value in values.items():
            if key in file["episode_0"]:
                index, new = value
                file["episode_0"][key][index] = new
    about = json.loads((folder / "metadata.json").read_text())
    about.update({key: value for key, value in values.items() if key in about})
    (folder / "metadata.json").write_text(json.dumps(about))


def test_an_episode_that_does_not_play_again_is_refused() -> None:
    for number, (change, message) in enumerate(
        [
            ({"actions": (7, 9)}, "episode 0 of .*, step 7: .*9"),
            ({"observations": (5, 3)}, "episode 0 of .* plays otherwise than it was recorded, from step 4 on"),
            ({"rewards": (3, 0.5)}, "step 3 was recorded with reward 0.5 and gives 0 now"),
            ({"observations": (0, 3)}, "begins in none of the states|plays otherwise"),
        ]
    ):
        dataset, _ = kitchens(f"mine/changed{number}-v0")
        changed(dataset, **change)
        with pytest.raises(ValueError, match=message):
            from_minari(dataset)


def test_data_sets_of_others_are_refused_in_words(tmp_path: Path) -> None:
    dataset, expected = kitchens()
    spec = dataset.env_spec.to_json()
    for old, new, message in (
        (KITCHEN, "CartPole-v1", r"is of CartPole-v1; trajectories are known in .*LegibleOvercooked-v0.*`env=`"),
        ('"shape"', '"partner": "os:getcwd", "shape"', r"asks for code by its name: partner='os:getcwd'; pass `env=`"),
        ('"shape"', '"shapes"', "LegibleOvercooked-v0 cannot be made"),
        (
            '"additional_wrappers": []',
            '"additional_wrappers": [{"name": "A", "entry_point": "os:getcwd", "kwargs": {}}]',
            "asks for code by its name: wrapper os:getcwd",
        ),
    ):
        assert old in spec
        changed(dataset, env_spec=spec.replace(old, new))
        with pytest.raises(ValueError, match=message):
            from_minari("mine/small-v0")
    changed(dataset, env_spec=spec.replace(KITCHEN, "CartPole-v1"))
    assert from_minari("mine/small-v0", env=gym.make(KITCHEN, shape=(5, 5), max_episode_steps=60)) == expected
    with pytest.raises(ValueError, match="CartPoleEnv tells no trajectories"):
        from_minari("mine/small-v0", env=gym.make("CartPole-v1"))
    # an entry point that the file names is never imported: the registered one is used
    changed(dataset, env_spec=spec.replace("legible_envs.overcooked.env:OvercookedEnv", "nowhere:Nothing"))
    assert from_minari("mine/small-v0") == expected
    with pytest.raises(FileNotFoundError, match="no Minari data set 'mine/none-v0'"):
        from_minari("mine/none-v0")
    folder = tmp_path / "odd" / "data"
    folder.mkdir(parents=True)
    for text, message in (("[", "no Minari data set that can be read"), ("{}", "its metadata lack")):
        (folder / "metadata.json").write_text(text)
        with pytest.raises(ValueError, match=message):
            load_trajectories(folder.parent)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_wrappers_of_gymnasium_are_made_again_and_hidden_changes_are_noticed(collector: Callable[..., Any]) -> None:
    env = collector(gym.wrappers.FlattenObservation(gym.make(KITCHEN, shape=(5, 5), max_episode_steps=60)))
    expected = played(env, 1)
    assert from_minari(env.create_dataset("mine/flat-v0")) == expected
    env = collector(gym.make(TABLE, max_episode_steps=200))
    env.reset(seed=0)
    goals = env.unwrapped.goals
    rng = np.random.default_rng(1)
    person = sample_person(rng)
    player = ReachingPlayer(env, person, rng)
    observation, info = env.reset(seed=0)
    for step in range(120):
        if step == 60:
            env.unwrapped._game.hand = (0.3, 0.3)
        observation, *_, info = env.step(player(observation, info))
    assert goals
    with pytest.raises(ValueError, match="plays otherwise than it was recorded, from step 60 on"):
        from_minari(env.create_dataset("mine/moved-v0"))
