"""A workspace in a package outside the tree: searched, shown, scored, reported and saved like the built-in ones."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from legible_envs.rollouts import Trajectory, load_trajectories, read_csv, save_trajectories, write_csv
from legible_envs.workspace import make_workspace
from tests.support.command_line import legible, page_data

SHELF = "tests.support.shelf_workspace:ShelfWorkspace"


@pytest.fixture
def aisle(aisle_package: Path, tmp_path: Path) -> Path:
    """The folder of a search of aisles."""
    found = importlib.import_module("legible_workspace_example")
    assert found.__file__ is not None
    assert Path(found.__file__).is_relative_to(aisle_package), "the package that was installed, not the one in the tree"
    out = tmp_path / "run"
    result = legible("optimize", "aisle", "--evaluations", 150, "--out", out, "--quiet", "--seed", 2)
    assert result.exit_code == 0, result.output
    assert "steps" in result.output
    return out


@pytest.mark.usefixtures("aisle_package")
def test_the_package_is_listed() -> None:
    result = legible("workspaces")
    assert "aisle" in result.output
    assert "overcooked" in result.output


def test_a_search_of_the_package_is_shown_scored_and_reported(aisle: Path, tmp_path: Path) -> None:
    files = {path.name for path in aisle.iterdir()}
    assert {"config.json", "archive.npz", "metrics.csv", "best.txt", "best.png", "report.html"} <= files
    config = json.loads((aisle / "config.json").read_text())
    best = config["result"]["best_objective"]
    for source, text in ((aisle, None), (aisle / "best.txt", None), ("-", (aisle / "best.txt").read_text())):
        result = legible("score", source, text=text)
        assert result.exit_code == 0, result.output
        line = next(line for line in result.output.splitlines() if line.startswith("legibility"))
        assert float(line.split()[1]) == pytest.approx(best, abs=1e-4)
    shown = legible("show", aisle, "--out", tmp_path / "aisle.png")
    assert shown.exit_code == 0, shown.output
    assert (tmp_path / "aisle.png").read_bytes() == (aisle / "best.png").read_bytes()
    assert "steps from the entrance" in shown.output
    assert (aisle / "best.txt").read_text().splitlines()[0] in shown.output
    with Image.open(aisle / "best.png") as image:
        assert image.size == (6 * 32, 4 * 32)
    before = (aisle / "report.html").read_bytes()
    assert legible("report", aisle).exit_code == 0
    assert (aisle / "report.html").read_bytes() == before
    data, page = page_data(aisle), before.decode()
    assert data["workspace"] == "aisle"
    assert data["cells"][0][5] == (aisle / "best.txt").read_text().rstrip("\n")
    assert "Draws aisles" in page
    assert "A search for legible aisles: aisle" in page
    assert "over all shortest paths, prefixes and orders of picking" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page


def test_a_search_of_the_package_takes_settings_and_goes_on(aisle: Path, tmp_path: Path) -> None:
    result = legible("optimize", "aisle", "--resume", "--evaluations", 250, "--out", aisle, "--quiet")
    assert result.exit_code == 0, result.output
    assert json.loads((aisle / "config.json").read_text())["result"]["evaluations"] >= 250
    heavy = tmp_path / "heavy"
    result = legible("optimize", "aisle", "--set", "heavy=true", "--evaluations", 100, "--out", heavy, "--quiet")
    assert result.exit_code == 0, result.output
    assert json.loads((heavy / "config.json").read_text())["workspace"] == {"workspace": "aisle", "heavy": True}
    assert "B" in (heavy / "best.txt").read_text().splitlines()[3]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("optimize", "aisle", "--shape", 5, 5), "--shape is about a kitchen, not about aisle"),
        (("optimize", "aisle", "--condition", "both"), "--condition is about a table, not about aisle"),
        (("optimize", "aisle", "--start-from", "x.txt"), "--start-from does not apply"),
        (("optimize", "aisle", "--prefix", "sum"), "unknown settings ['prefix'] of workspace 'aisle'"),
        (("optimize", "aisle", "--set", "colour=1"), "unknown settings ['colour']"),
        (("optimize", "aisle", "--set", "colour"), "not NAME=VALUE"),
        (("score", "-"), "each of ['B', 'L', 'T'] must lie in one bay"),
        (("play", "-"), "expected a kitchen"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    aisle_package: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str | int, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    lower = "......" if arguments[0] == "score" else "L....."
    result = legible(*arguments, text=f"|T....B|\n|      |\n|      |\n|{lower}|\n")
    assert result.exit_code == 2, result.output
    errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert not (tmp_path / "runs").exists()


def test_trajectories_in_an_aisle_are_kept(aisle_package: Path, tmp_path: Path) -> None:
    workspace = make_workspace("aisle")
    layout, other = (workspace.decode(g) for g in workspace.sample(2, np.random.default_rng(0)))
    found = [
        Trajectory([(1, 0), (1, 1), (0, 1)], goal="tape", candidates=("tape", "boxes"), layout=each, participant=name)
        for each in (layout, other)
        for name in ("p1", "p2")
    ]
    save_trajectories(tmp_path / "t.npz", found)
    write_csv(tmp_path / "t.csv", found)
    assert load_trajectories(tmp_path / "t.npz") == read_csv(tmp_path / "t.csv") == found
    result = legible("score", "-", "--trajectories", tmp_path / "t.npz", text=str(layout))
    assert result.exit_code == 2
    assert "no predictor comes with this aisle; name one with --predictor" in result.output
    (tmp_path / "none.npz").write_bytes((tmp_path / "t.npz").read_bytes())
    save_trajectories(tmp_path / "none.npz", found[2:])
    result = legible("score", "-", "--trajectories", tmp_path / "none.npz", text=str(layout))
    assert "no trajectory recorded on this aisle" in result.output


def test_a_workspace_without_a_presenter_is_shown_as_text(tmp_path: Path) -> None:
    out = tmp_path / "run"
    result = legible("optimize", SHELF, "--evaluations", 3000, "--out", out, "--quiet")
    assert result.exit_code == 0, result.output
    assert not (out / "best.png").exists()
    best = (out / "best.txt").read_text()
    assert best.splitlines()[0] in result.output
    for command in (("score", out), ("show", out), ("score", out / "best.txt", "--workspace", SHELF)):
        shown = legible(*command)
        assert shown.exit_code == 0, shown.output
        assert "legibility" in shown.output
    assert "as a picture" not in legible("show", out).output
    refused = legible("show", out, "--out", tmp_path / "best.png")
    assert refused.exit_code == 2
    assert "this layout has no picture" in refused.output
    data = page_data(out)
    assert data["cells"][0][5] == best.rstrip("\n")
    assert all(cell[5] for cell in data["cells"])
    page = (out / "report.html").read_text()
    assert "Eq. 2 and 3" not in page
    assert f"are those of the workspace “{SHELF}”" in page
    before = (out / "report.html").read_bytes()
    assert legible("report", out).exit_code == 0
    assert (out / "report.html").read_bytes() == before
    again = legible("optimize", SHELF, "--resume", "--evaluations", 4000, "--out", out, "--quiet")
    assert again.exit_code == 0, again.output


def test_a_search_without_a_folder_is_written_under_a_plain_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = legible("optimize", SHELF, "--evaluations", 2000, "--quiet")
    assert result.exit_code == 0, result.output
    name = "tests-support-shelf_workspace-ShelfWorkspace-legibility-seed0"
    assert (tmp_path / "runs" / name / "report.html").is_file()
