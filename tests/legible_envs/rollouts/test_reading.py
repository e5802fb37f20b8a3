"""One door for trajectories: files are known by what is in them, and others are named for what they are."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.cli.app import main
from legible_envs.datasets.pointing import load_pointing
from legible_envs.rollouts import Trajectory, load_trajectories, save_trajectories, write_csv
from legible_envs.support.files import open_npz
from tests.legible_envs.rollouts.hostile import KITCHEN
from tests.legible_envs.support.test_file_kinds import EXAMPLES

WALK = Trajectory([(1, 1), (0, 1)], goal="onion", candidates=("onion", "tomato"), layout=KITCHEN)


@pytest.mark.parametrize("suffix", ["npz", "csv", "pickle", "json", ""])
@pytest.mark.parametrize("name", EXAMPLES)
def test_other_files_are_named_for_what_they_are(tmp_path: Path, name: str, suffix: str) -> None:
    content, words = EXAMPLES[name]
    path = tmp_path / f"file.{suffix}"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"expected|zero bytes|UTF-8") as caught:
        load_trajectories(path)
    message = str(caught.value)
    assert str(path) in message
    assert words in message
    assert "allow_pickle" not in message


def test_no_message_advises_to_load_pickles(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    for content in (pickle.dumps([1]), b"{}", b"text"):
        path.write_bytes(content)
        with pytest.raises(ValueError, match="looks like"):
            load_trajectories(path)
    with open_npz(save_trajectories(tmp_path / "whole.npz", [WALK])) as stored:
        arrays = dict(stored) | {"states": np.array([{}])}
    np.savez(path, **arrays)
    with pytest.raises(ValueError, match="it holds pickled objects, which are never loaded"):
        load_trajectories(path)
    np.savez(path, kind="legible-envs trajectories", schema=1)
    with pytest.raises(ValueError, match="records"):
        load_trajectories(path)


def test_names_do_not_matter(tmp_path: Path) -> None:
    save_trajectories(tmp_path / "walks.csv", [WALK])
    write_csv(tmp_path / "walks.npz", [WALK])
    for name in ("walks.csv", "walks.npz"):
        assert load_trajectories(tmp_path / name) == [WALK]
        assert load_trajectories(str(tmp_path / name)) == [WALK]


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="there is no file"):
        load_trajectories(tmp_path / "none.npz")
    with pytest.raises(FileNotFoundError, match="no Minari data set of this id"):
        load_trajectories("none/none-v0")
    with pytest.raises(ValueError, match="it is a folder, but no Minari data set"):
        load_trajectories(tmp_path)


def test_the_command_line_says_it_too(tmp_path: Path) -> None:
    kitchen, path = tmp_path / "k.txt", tmp_path / "walks.npz"
    kitchen.write_text(KITCHEN.to_ascii())
    path.write_text('{"a": 1}')
    result = CliRunner().invoke(main, ["score", str(kitchen), "--trajectories", str(path)])
    assert result.exit_code == 2
    said = " ".join(result.output.split())
    assert "it looks like JSON, an object with the keys 'a'; expected an .npz" in said
    assert "pickle.load" not in said


@pytest.mark.parametrize("name", EXAMPLES)
def test_pointing_is_refused_in_words(tmp_path: Path, name: str) -> None:
    content, words = EXAMPLES[name]
    for suffix in ("csv", "csv.gz", "npz", "zip"):
        path = tmp_path / f"pointing.{suffix}"
        path.write_bytes(content)
        with pytest.raises(ValueError, match="no table of pointing") as caught:
            load_pointing(path)
        assert words in str(caught.value)


HEADER = "participant,condition,trial,target,target_x,target_y,t_ms,x,y\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADER.replace(",y\n", ",x\n") + "1,a,1,1,300,0,0,0,0\n", r"the columns \['y'\] are missing"),
        (HEADER.replace(",y\n", ",y,x\n") + "1,a,1,1,300,0,0,0,0,0\n", r"the columns \['x'\] are there twice"),
        (
            HEADER + "1,a,1,1,300,0,0,0,0\n1,a,1,1,300,0,10,1_0,0\n",
            "row 2 of data: 'x' must be a finite number, got '1_0'",
        ),
        (HEADER + "1,a,1,1,300,0,0,0,\n", "row 1 of data: 'y' must be a finite number"),
        (HEADER + ",a,1,1,300,0,0,0,0\n", "row 1 of data: 'participant' must be given"),
        (HEADER + "1,a,4,1,300,0,0,0,0\n1,a,4,1,300,0,9,0,0\n", "trial 4 of participant 1, condition a, has no motion"),
    ],
)
def test_bad_pointing_is_refused_with_its_row(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "pointing.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_pointing(path)
