"""The command `legible datasets make`: what it writes, and what it refuses in one line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from legible_envs.overcooked import OvercookedLayout
from tests.support.command_line import legible

minari = pytest.importorskip("minari")

KITCHEN = "XOTXX\nX   C\nX1  F\nP   D\nXXSXX\n"
OTHER = "XOTXX\nX   C\nF1  X\nP   D\nXXSXX\n"


def made(out: Path, *arguments: object) -> Any:
    """The data set that the command writes with these arguments."""
    result = legible("datasets", "make", "--out", out, *arguments)
    assert result.exit_code == 0, result.output
    (name,) = [line.partition(":")[0] for line in result.output.splitlines() if "-v0: " in line]
    assert result.output.rstrip().endswith(str(out / name))
    return minari.MinariDataset(out / name / "data")


def test_kitchens_of_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "elsewhere"))
    for name, drawing in (("a.txt", KITCHEN), ("b.txt", OTHER)):
        (tmp_path / name).write_text(drawing, encoding="utf-8")
    of_one = made(tmp_path / "out", "--player", "boltzmann", "--layout", tmp_path / "a.txt", "--episodes", 3,
                  "--participants", 2, "--seed", 7, "--author", "Ada", "--author", "Grace",
                  "--description", "What for.", "--name", "mine/one-v0")  # fmt: skip
    assert os.environ["MINARI_DATASETS_PATH"] == str(tmp_path / "elsewhere")
    assert not (tmp_path / "elsewhere").exists()
    assert of_one.id == "mine/one-v0"
    assert of_one.recover_environment().unwrapped.layout.to_ascii() == KITCHEN.strip()
    about = of_one.storage.metadata
    assert (about["author"], about["description"]) == ({"Ada", "Grace"}, "What for.")
    assert about["legible_envs"]["seed"] == 7
    people = [each["participant"] for each in of_one.storage.get_episode_metadata(range(3))]
    assert people == ["boltzmann/0", "boltzmann/1", "boltzmann/0"]

    of_both = made(tmp_path / "out", "--layout", tmp_path / "a.txt", "--layout", tmp_path / "b.txt", "--episodes", 8,
                   "--obs-type", "vector", "--argument", "max_episode_steps=30")  # fmt: skip
    assert of_both.observation_space.shape == (54,)
    assert of_both.total_steps == 240
    drawn = {each["options"]["layout"] for each in of_both.storage.get_episode_metadata(range(8))}
    assert drawn == {KITCHEN.strip(), OTHER.strip()}


def test_random_kitchens_and_tables(tmp_path: Path) -> None:
    drawn = made(tmp_path, "--layout", "random:test", "--shape", 5, 5, "--episodes", 2)
    kitchens = drawn.recover_environment().unwrapped.settings.distribution
    about = drawn.storage.get_episode_metadata(range(2))
    assert all(kitchens.is_test(OvercookedLayout.from_ascii(each["options"]["layout"])) for each in about)
    table = made(tmp_path, "--env", "tabletop", "--player", "reach", "--task", "bins", "--episodes", 1)
    assert table.recover_environment().unwrapped.task.name == "bins"
    assert table.id == "tabletop/reach-v0"


@pytest.mark.data
def test_recorded_kitchens_make_a_data_set_each(tmp_path: Path) -> None:
    result = legible("datasets", "make", "--player", "recorded", "--episodes", 1, "--obs-type", "vector", "--layout",
                     "cramped_room", "--layout", "random3", "--out", tmp_path)  # fmt: skip
    assert result.exit_code == 0, result.output
    for name in ("cramped_room", "random3"):
        dataset = minari.MinariDataset(tmp_path / "overcooked" / f"recorded-{name}-v0" / "data")
        assert dataset.observation_space.shape == (2, 65)
        assert dataset.total_episodes == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--player", "recorded", "--env", "tabletop"), "--player recorded goes with --env overcooked"),
        (("--player", "recorded", "--seed", 1), "--seed has no meaning for recorded games"),
        (("--player", "recorded", "--name", "x-v0"), "--name takes one --layout"),
        (("--env", "tabletop", "--shape", 5, 5), "--shape goes with --env overcooked"),
        (("--env", "tabletop", "--layout", "a", "--layout", "b"), "a data set of tables has one"),
        (("--task", "bins"), "--task goes with --env tabletop"),
        (("--layout", "random", "--layout", "a"), "random draws its own kitchens"),
        (("--from", "."), "--from goes with --player recorded"),
        (("--player", "nobody"), "no player 'nobody' in overcooked; there are scripted, boltzmann, planner, cloned"),
        (("--name", "../x-v0"), "a data set is called like"),
        (("--argument", "seed=1", "--argument", "seed=2"), "--argument seed is given twice"),
        (("--argument", "partner_speed=1"), "partner_speed"),
        (("--layout", "no-such-file.txt"), "no-such-file.txt"),
    ],
)
def test_what_is_refused(tmp_path: Path, arguments: tuple[object, ...], message: str) -> None:
    result = legible("datasets", "make", *arguments, "--out", tmp_path / "out")
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
