"""``legible train``: a run, one that goes on, and what it refuses in one line."""

from __future__ import annotations

import builtins
import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.experiments.learning.recipes import recipe
from benchmarks.experiments.learning.settings import TrainingSettings
from tests.support.command_line import legible

torch = pytest.importorskip("torch")

SMALL = (
    "--shape", 5, 5, "--recipe", "onion", "--set", "ppo.num_envs=4", "--set", "ppo.rollout=16", "--set", "ppo.batch=32",
    "--set", "ppo.epochs=1", "--set", "network.hidden=[8]", "--set", "environment.arguments.max_episode_steps=40",
)  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("train") / "run"
    result = legible("train", "overcooked", *SMALL, "--steps", 128, "--seed", 5, "--out", folder)
    assert result.exit_code == 0, result.output
    assert "policy: return" in result.output
    assert "scripted cook: return 31.00" in result.output
    return folder


def test_a_run_is_written_with_its_settings(run: Path) -> None:
    settings = TrainingSettings.from_dict(json.loads((run / "settings.json").read_text()))
    assert (settings.steps, settings.seed, settings.ppo.num_envs, settings.network.hidden) == (128, 5, 4, [8])
    assert settings.environment.arguments["recipes"] == [["onion"]]
    assert settings.environment.arguments["shape"] == [5, 5]
    assert settings.environment.arguments["shaping"] is True
    assert len((run / "curve.csv").read_text().splitlines()) == 3


def test_a_run_goes_on_with_its_own_settings(run: Path) -> None:
    before = (run / "checkpoint.npz").read_bytes()
    result = legible("train", "overcooked", "--out", run, "--resume")
    assert result.exit_code == 0, result.output
    assert (run / "checkpoint.npz").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--resume", "--steps", 256), "`steps` was 128 and is now 256"),
        (("--resume", "--obs", "grid"), "`environment.arguments.obs_type` was 'vector' and is now 'grid'"),
        (("--resume", "--set", "ppo.gamma=0.9"), "`ppo.gamma` was 0.99 and is now 0.9"),
        ((), "holds a training already"),
    ],
)
def test_other_settings_and_another_run_are_refused(run: Path, arguments: Any, said: str) -> None:
    result = legible("train", "overcooked", "--out", run, *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_the_other_environment_is_refused(run: Path) -> None:
    result = legible("train", "tabletop", "--out", run, "--resume")
    assert result.exit_code == 2
    assert "holds a training of LegibleOvercooked-v0, not of LegibleTabletop-v0" in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("tabletop", "--obs", "grid"), "--obs is about a kitchen"),
        (("tabletop", "--recipe", "onion"), "--recipe is about a kitchen"),
        (("overcooked", "--layouts", "random", "--layout", "k.txt"), "not both"),
        (("overcooked", "--set", "ppo.learning_rate=-1"), "`ppo.learning_rate` must be a finite number > 0"),
        (("overcooked", "--set", "ppo.speed=1"), "`ppo` has the unknown key 'speed'"),
        (("overcooked", "--set", "a.b.c=1"), "there is no setting 'a.b.c'"),
        (("overcooked", "--recipe", "pear"), "pear"),
        (("overcooked", "--layout", "no-such-file.txt"), "no-such-file.txt"),
        (("chess",), "chess"),
    ],
)
def test_bad_input_is_answered_in_one_line(arguments: Any, said: str, tmp_path: Path) -> None:
    result = legible("train", *arguments, "--out", tmp_path / "run")
    assert result.exit_code == 2
    assert said in result.output
    assert "Traceback" not in result.output
    assert not (tmp_path / "run" / "checkpoint.npz").exists()


def test_without_torch_it_is_said_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load = builtins.__import__

    def without(name: str, *arguments: Any, **options: Any) -> Any:
        if name.split(".")[0] == "torch":
            raise ImportError("No module named 'torch'")
        return load(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    result = legible("train", "overcooked", "--out", tmp_path / "run")
    assert result.exit_code == 2
    assert "pip install legible-envs[torch]" in result.output


def test_two_cooks_are_played_by_one_network(tmp_path: Path) -> None:
    from benchmarks.experiments.learning.policy import load_policy

    result = legible("train", "overcooked", *SMALL, "--num-players", 2, "--steps", 128, "--out", tmp_path / "run")
    assert result.exit_code == 0, result.output
    policy = load_policy(tmp_path / "run")
    assert policy.space.players == 2
    kitchen = {"shape": (5, 5), "recipes": [["onion"]], "obs_type": "vector", "num_players": 2}
    env = gym.make("LegibleOvercooked-v0", **kitchen)
    obs, info = env.reset(seed=0)
    for _ in range(20):
        actions = policy(obs, info)
        assert actions.shape == (2,)
        assert info["action_mask"][np.arange(2), actions].all()
        obs, _, _, _, info = env.step(actions)
    one = policy(obs[1], {"action_mask": info["action_mask"][1]})  # as one of the cooks
    assert info["action_mask"][1][one]


def test_a_layout_of_a_file_is_what_is_played(tmp_path: Path) -> None:
    drawing = "XPXXX\nO   S\nX   X\nX  1D\nXXXXX\n"
    (tmp_path / "k.txt").write_text(drawing)
    result = legible(
        "train", "overcooked", *SMALL[3:], "--layout", tmp_path / "k.txt", "--steps", 64, "--out", tmp_path / "run"
    )
    assert result.exit_code == 0, result.output
    settings = TrainingSettings.from_dict(json.loads((tmp_path / "run" / "settings.json").read_text()))
    assert settings.environment.arguments["layout"].split() == drawing.split()


def test_recipes_have_convolutions_for_grids_alone() -> None:
    assert recipe("overcooked", {"obs_type": "grid"}).network.channels
    assert not recipe("overcooked", {}).network.channels
    assert recipe("tabletop", {}).environment.arguments["shaping"] == {"discount": 0.995}
    with pytest.raises(ValueError, match="`domain` must be one of"):
        recipe("chess", {})
