"""The command line: every command on a small budget, and bad input answered in one line with exit code 2."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from benchmarks.cli.app import CONTENTS, main
from benchmarks.cli.options import typed_value
from benchmarks.console import number, plural
from benchmarks.presenters.overcooked import load_kitchen
from legible_envs import __version__
from legible_envs.overcooked import OvercookedLayout, OvercookedScorer, OvercookedWorkspace, soup_task
from tests.support.command_line import legible, values
from tests.support.run_folders import write_run

KITCHEN = """\
XTXPXXX
X     O
X V   X
C     X
X   V F
X     X
XXDXSXX
"""
OVERCOOKED_AI = '{\n"grid": """XXPXX\n            O  2O\n            X1  X\n            XDXSX""",\n"cook_time": 20\n}\n'


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cli") / "run"
    result = legible(
        "optimize", "overcooked", "--shape", 5, 6, "--evaluations", 3000, "--seed", 4, "--out", folder, "--quiet"
    )
    assert result.exit_code == 0, result.output
    return folder


# -- single kitchens ---------------------------------------------------------------------------------------------------


def test_score_says_what_the_workspace_says(tmp_path: Path) -> None:
    (tmp_path / "k.txt").write_text(KITCHEN)
    result = legible("score", tmp_path / "k.txt")
    assert result.exit_code == 0, result.output
    workspace = OvercookedWorkspace(shape=(7, 7))
    genome = workspace.encode(KITCHEN)
    found = values(result)
    assert float(found["legibility"]) == pytest.approx(workspace.legibility(genome), abs=1e-3)
    assert float(found["distance"]) == pytest.approx(workspace.distance(genome), abs=1e-3)
    assert found["candidate set"] == "task"
    assert found["sequences"] == "7,484,400"


@pytest.mark.parametrize("options", [("--prefix", "sum"), ("--prefix", "0.25,0.5"), ("--pots", "1")])
def test_score_obeys_its_options(options: tuple[str, str]) -> None:
    name, value = options
    settings = {"prefix": (0.25, 0.5) if "," in value else value} if name == "--prefix" else {"pots": int(value)}
    workspace = OvercookedWorkspace(shape=(7, 7), **settings)
    found = values(legible("score", "-", *options, text=KITCHEN))
    assert float(found["legibility"]) == pytest.approx(workspace.legibility(workspace.encode(KITCHEN)), abs=1e-3)


def test_kitchens_outside_the_design_rules_are_scored_and_said_to_be(tmp_path: Path) -> None:
    (tmp_path / "cramped.layout").write_text(OVERCOOKED_AI)
    result = legible("score", tmp_path / "cramped.layout")
    assert result.exit_code == 0, result.output
    found = values(result)
    assert "onion" in found["design rules"]
    assert found["task"] == "onion + onion + onion"
    assert float(found["normalised"]) <= 1


DIVIDED = """\
XOXXXXXOX
S   P   X
X 2 X 1 S
X   D   X
XOXXXXXXX
"""


def test_score_and_show_are_of_one_player(tmp_path: Path) -> None:
    (tmp_path / "divided.txt").write_text(DIVIDED)
    scorer = OvercookedScorer(soup_task([("onion",) * 3]))
    for arguments, player in (((), 1), (("--player", 1), 1), (("--player", 2), 2)):
        found = values(legible("score", tmp_path / "divided.txt", *arguments))
        wanted = scorer.score_layout(OvercookedLayout.from_ascii(DIVIDED), player=player)
        assert float(found["legibility"]) == pytest.approx(wanted["score"], abs=1e-3)
        assert (found["player"], found["out of reach"]) == (str(player), ", ".join(wanted["out_of_reach"]))
    shown = legible("show", tmp_path / "divided.txt", "--player", 2, "--out", tmp_path / "divided.png")
    assert "onion@(4,1)" in shown.output
    assert "onion@(0,7)" in shown.output.split("Reaches")[0]
    assert "onion@(0,7)" not in shown.output.split("Reaches")[1]
    refused = legible("score", tmp_path / "divided.txt", "--player", 3)
    assert (refused.exit_code, refused.output) == (
        2,
        "Error: `player` must be an integer from 1 to 2 (the kitchen has 2 starts), got 3\n",
    )
    assert "player" not in values(legible("score", "-", text=KITCHEN))
    assert values(legible("score", "-", "--player", 1, text=KITCHEN))["player"] == "1"


def test_score_says_in_words_that_nobody_can_do_the_task_alone() -> None:
    result = legible("score", "-", text="XXOXX\nO1X2P\nD X S\nXXXXX\n")
    assert (result.exit_code, result.output) == (
        2,
        "Error: the task cannot be done in this kitchen by player 1, who starts at row 1, column 1: out of reach are "
        "the pot station (row 1, column 4) and the serving station (row 2, column 4)\n",
    )


def test_score_and_show_of_a_run_use_its_best_layout(run: Path) -> None:
    best = json.loads((run / "config.json").read_text())["result"]
    assert float(values(legible("score", run))["legibility"]) == pytest.approx(best["best_objective"], abs=1e-3)
    assert float(values(legible("score", run / "best.txt"))["legibility"]) == pytest.approx(
        best["best_objective"], abs=1e-3
    )
    assert load_kitchen(str(run)).layout.to_ascii() in (run / "best.txt").read_text()


def test_show_explains_where_the_score_comes_from(tmp_path: Path) -> None:
    picture = tmp_path / "confused.png"
    result = legible("show", "-", "--out", picture, text=KITCHEN)
    assert result.exit_code == 0, result.output
    workspace = OvercookedWorkspace(shape=(7, 7))
    worst = workspace.explain(workspace.encode(KITCHEN))[0]
    line = next(line for line in result.output.splitlines() if line.strip().startswith(worst["start"]))
    assert worst["goal"] in line
    assert f"{worst['contribution']:.3f}" in line
    assert picture.read_bytes().startswith(b"\x89PNG")


# -- searches ----------------------------------------------------------------------------------------------------------


def test_optimize_writes_a_whole_run(run: Path) -> None:
    files = {path.name for path in run.iterdir()}
    assert {"config.json", "metrics.csv", "archive.npz", "best.txt", "best.png", "report.html"} <= files
    config = json.loads((run / "config.json").read_text())
    assert config["seed"] == 4
    assert config["workspace"]["shape"] == [5, 6]
    workspace = OvercookedWorkspace(shape=(5, 6))
    genome = np.array(config["result"]["best_genome"], dtype=np.int8)
    assert workspace.legibility(genome) == pytest.approx(config["result"]["best_objective"])


def test_optimize_starts_from_an_existing_kitchen(run: Path, tmp_path: Path) -> None:
    kitchen, out = tmp_path / "mine.txt", tmp_path / "moved"
    kitchen.write_text((run / "best.txt").read_text())
    again = ("optimize", "overcooked", "--out", out, "--evaluations", 2000, "--quiet")
    result = legible(*again, "--start-from", kitchen, "--lock", "pot", "--relocation-cost", 100)
    assert result.exit_code == 0, result.output
    before, after = (OvercookedLayout.from_ascii(path.read_text()) for path in (kitchen, out / "best.txt"))
    assert after.stations == before.stations  # at this price nothing is moved
    assert legible(*again, "--resume").exit_code == 0
    refused = legible("optimize", "overcooked", "--lock", "pot", "--out", tmp_path / "none")
    assert refused.exit_code == 2
    assert "need --start-from" in refused.output


def test_optimize_does_not_touch_a_run_unasked(run: Path) -> None:
    before = (run / "archive.npz").read_bytes()
    result = legible("optimize", "overcooked", "--out", run, "--evaluations", 2000)
    assert result.exit_code == 2
    assert "--resume" in result.output
    assert "--overwrite" in result.output
    assert (run / "archive.npz").read_bytes() == before


def test_resume_takes_the_runs_own_settings_and_can_go_further(tmp_path: Path) -> None:
    out = tmp_path / "run"
    first = ("optimize", "overcooked", "--shape", 5, 5, "--seed", 9, "--prefix", "sum", "--out", out, "--quiet")
    assert legible(*first, "--evaluations", 2000).exit_code == 0
    result = legible("optimize", "overcooked", "--out", out, "--resume", "--evaluations", 6000, "--quiet")
    assert result.exit_code == 0, result.output
    config = json.loads((out / "config.json").read_text())
    assert config["result"]["evaluations"] >= 6000
    assert (config["seed"], config["workspace"]["prefix"]) == (9, "sum")
    refused = legible("optimize", "overcooked", "--out", out, "--resume", "--seed", 1)
    assert refused.exit_code == 2
    assert "seed" in refused.output


def test_resume_begins_a_search_where_there_is_none_and_says_so(tmp_path: Path) -> None:
    out, small = tmp_path / "run", ("--shape", 5, 5, "--evaluations", 1200, "--quiet", "--resume")
    result = legible("optimize", "overcooked", *small, "--out", out)
    assert result.exit_code == 0, result.output
    assert f"there is no search in {out} to go on with: one begins" in result.output
    for path in (out / "archive.npz", *(out / "checkpoint").iterdir()):
        path.unlink()
    begun = legible("optimize", "overcooked", "--resume", "--quiet", "--out", out)
    assert begun.exit_code == 0, begun.output
    assert "stopped before its first checkpoint; it begins anew with the same settings" in begun.output
    assert json.loads((out / "config.json").read_text())["evaluations"] == 1200
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").touch()
    refused = legible("optimize", "overcooked", *small, "--out", tmp_path / "other")
    assert refused.exit_code == 2
    assert "holds other files (thesis.tex)" in refused.output


def test_efficiency_and_a_distance_cap(tmp_path: Path) -> None:
    small = ("--shape", 5, 5, "--evaluations", 3000, "--quiet", "--objective", "legible-efficient")
    capped = legible("optimize", "overcooked", "--out", tmp_path / "a", *small, "--max-distance", 60)
    assert capped.exit_code == 0, capped.output
    assert float(values(legible("score", tmp_path / "a"))["distance"]) <= 60
    impossible = legible("optimize", "overcooked", "--out", tmp_path / "b", *small, "--max-distance", 1)
    assert impossible.exit_code == 1
    warned, ended = impossible.output.splitlines()
    assert warned.startswith("Warning: none of ")
    assert ended.startswith("no layout scored in ")
    assert ended.endswith("is --max-distance too low?")


def test_ctrl_c_says_how_to_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import optimizers

    def interrupted(*_: object, **__: object) -> None:
        raise optimizers.SearchInterrupted("stopped", partial=None)

    monkeypatch.setattr(optimizers, "search", interrupted, raising=False)
    result = legible("optimize", "overcooked", "--out", tmp_path / "my run")
    assert result.exit_code == 130
    assert "--resume --out " in result.output
    assert "my run'" in result.output, "the folder is quoted for the shell"


def test_a_second_ctrl_c_stops_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import optimizers

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(optimizers, "search", interrupted, raising=False)
    result = legible("optimize", "overcooked", "--out", tmp_path / "run")
    assert result.exit_code == 130
    assert result.output.startswith("stopped; nothing was written to ")
    assert "Aborted" not in result.output


def test_options_of_an_emitter_reach_it_and_are_kept(tmp_path: Path) -> None:
    out = tmp_path / "run"
    start = ("optimize", "overcooked", "--shape", 5, 5, "--quiet", "--out", out)
    options = ("--emitter", "ribs.emitters:GaussianEmitter", "--emitter-option", "sigma=0.5",
               "--emitter-option", "batch_size=32")  # fmt: skip
    first = legible(*start, *options, "--evaluations", 1500)
    assert first.exit_code == 0, first.output
    kept = json.loads((out / "config.json").read_text())["emitter"]
    assert kept["options"] == {"sigma": 0.5, "batch_size": 32}
    again = legible("optimize", "overcooked", "--resume", "--evaluations", 2500, "--quiet", "--out", out)
    assert again.exit_code == 0, again.output
    other = legible("optimize", "overcooked", "--resume", "--emitter-option", "sigma=2.0", "--quiet", "--out", out)
    assert other.exit_code == 2
    assert "emitter" in other.output


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.5", 0.5), ("7", 7), ("true", True), ("sum", "sum"), ("'7'", "7"), ('"7"', "7"), ("[7, 7]", [7, 7]),
        ("{a = 1}", {"a": 1}), ('{"a": 1}', {"a": 1}), ("null", None), ("1_000", 1000), ("inf", math.inf),
        ("2020-01-01", "2020-01-01"), ("[2020-01-01]", "[2020-01-01]"), ("", ""), ("a=b", "a=b"),
        ("1\nb = 2", "1\nb = 2"), ("[" * 10_000, "[" * 10_000), ("9" * 5000, "9" * 5000),
    ],
)  # fmt: skip
def test_values_are_typed_as_in_the_file_of_a_sweep(text: str, value: object) -> None:
    assert typed_value(text) == value
    assert type(typed_value(text)) is type(value)


def test_numbers_are_rounded_by_one_rule_as_the_pages_do() -> None:
    """Halves away from zero, from the exact value, once; ``toFixed`` of the reports' script does the same."""
    assert [number(x) for x in (-25.17499, -25.175, 0.125, -0.125, 2.675, 1.005)] == [
        "-25.17", "-25.18", "0.13", "-0.13", "2.67", "1.00"]  # fmt: skip
    assert [number(x, 0) for x in (0.5, 1.5, 2.5, 1234567.5, -0.4)] == ["1", "2", "3", "1,234,568", "0"]
    assert [number(x) for x in (None, math.nan, math.inf, 1e300)][:3] == ["-", "-", "inf"]
    rng = np.random.default_rng(0)
    for value in rng.normal(0, 30, 2000):
        assert abs(float(number(value, 3).replace(",", "")) - value) <= 0.0005 + 1e-12


def test_what_the_console_shows_is_what_the_page_shows(run: Path) -> None:
    """The page rounds what it is given once more: it must be given nearly all of it."""
    from benchmarks.reports.search_report import _plain

    rng = np.random.default_rng(1)
    for value in [-25.17499, 12.34499, *rng.normal(0, 30, 2000)]:
        assert number(_plain(float(value))) == number(float(value))


@pytest.mark.parametrize(
    ("count", "noun", "text"),
    [(1, "evaluation", "1 evaluation"), (0, "trial", "0 trials"), (2000, "trajectory", "2,000 trajectories"),
     (2, "search", "2 searches"), (2, "day", "2 days")],
)  # fmt: skip
def test_counts_are_in_the_right_number(count: int, noun: str, text: str) -> None:
    assert plural(count, noun) == text


def test_report_is_written_anew(run: Path) -> None:
    before = (run / "report.html").read_bytes()
    (run / "report.html").unlink()
    (run / "best.png").unlink()
    assert legible("report", run).exit_code == 0
    assert (run / "report.html").read_bytes() == before
    assert (run / "best.png").exists()


def test_emitters_are_listed() -> None:
    result = legible("emitters")
    assert result.exit_code == 0
    assert "improve" in result.output


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "text", "message"),
    [
        (("score", "nowhere.txt"), None, "No such file"),
        (("score", "-"), "XXX\nX X\nXX", "row 2"),
        (("score", "-"), "XXX\nX?X\nXXX", "row 1, column 1"),
        (("score", "-"), "", "empty"),
        (("show", "-"), "XPX\nX X\nXXX", "station"),
        (("score", "-", "--prefix", "7"), KITCHEN, "7"),
        (("optimize", "overcooked", "--shape", "3", "7"), None, "shape"),
        (("optimize", "overcooked", "--emitter", "nobody"), None, "nobody"),
        (("optimize", "overcooked", "--emitter", "json:nobody"), None, "nobody"),
        (("optimize", "overcooked", "--prefix", "most"), None, "most"),
        (("optimize", "overcooked", "--max-distance", "-3"), None, "--max-distance"),
        (("optimize", "kitchenette"), None, "kitchenette"),
        (("report", "."), None, "config.json"),
        (("humans", "fetch", "--from", "not-the-archive"), None, "not-the-archive"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], text: str | None, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LEGIBLE_DATA", str(tmp_path / "data"))
    (tmp_path / "not-the-archive").write_text("something else")
    result = legible(*arguments, text=text)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert result.output.splitlines()[-1] == errors[0]


def test_a_folder_or_binary_file_is_no_layout(tmp_path: Path) -> None:
    (tmp_path / "noise").write_bytes(bytes(range(128, 256)))
    for source in (tmp_path, tmp_path / "noise"):
        result = legible("score", source)
        assert result.exit_code == 2
        assert str(source) in result.output


def test_traceback_on_request(tmp_path: Path) -> None:
    result = legible("--traceback", "score", tmp_path / "nowhere")
    assert isinstance(result.exception, FileNotFoundError)


def test_score_predicts_recorded_trajectories_of_the_kitchen(tmp_path: Path) -> None:
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.rollouts import Trajectory, save_trajectories
    from predictors import BayesianGoalPredictor

    layout, other = OvercookedLayout.from_ascii(KITCHEN), OvercookedLayout.from_ascii(KITCHEN.replace("V", " "))
    cells = [(5, 4), (5, 5), (4, 5), (4, 6)]
    walk = Trajectory(cells, start="serving", goal="fish", candidates=("fish", "tomato"), layout=layout)
    away = Trajectory(cells, start="serving", goal="fish", candidates=("fish", "tomato"), layout=other)
    save_trajectories(tmp_path / "walks.npz", [walk, away, walk])
    result = legible("score", "-", "--trajectories", tmp_path / "walks.npz", text=KITCHEN)
    assert result.exit_code == 0, result.output
    assert "2 trajectories" in result.output
    expected = BayesianGoalPredictor().fit([walk]).score([walk], fractions=(0.5,))
    row = next(line for line in result.output.splitlines() if line.strip().startswith("Eq. 1")).split()
    assert float(row[4]) == pytest.approx(expected, abs=1e-3)


@pytest.fixture
def walks_of_run(run: Path, tmp_path: Path) -> Path:
    """Walks of eight people in the best kitchen of a run, in two conditions, as CSV."""
    import gymnasium as gym
    import numpy as np

    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.policies import ScriptedPlayer
    from legible_envs.rollouts import record_episode, write_csv

    layout = OvercookedLayout.from_ascii((run / "best.txt").read_text())
    env = gym.make("LegibleOvercooked-v0", shape=layout.shape, layout=layout)
    walks = []
    for person in range(8):
        player = ScriptedPlayer(env, np.random.default_rng(person))
        labels = {"participant": f"p{person}", "condition": "ab"[person % 2], "candidate_set": "all"}
        walks += record_episode(env, player, seed=person, **labels)
    return write_csv(tmp_path / "walks.csv", walks)


def test_score_evaluates_predictors_and_reports_them(run: Path, walks_of_run: Path) -> None:
    import json

    import pandas as pd

    from legible_envs.rollouts import CUTS, read_csv
    from predictors.evaluation import compare_conditions, evaluate

    options = ("--cut", "cells", "--folds", 2, "--repeats", 1, "--by-participant", "--seed", 3)
    named = ("--predictor", "bayesian", "--predictor", "shortest-distance")
    before = (run / "report.html").read_bytes()
    result = legible("score", run, "--trajectories", walks_of_run, *named, *options)
    assert result.exit_code == 0, result.output
    assert CUTS["cells"].split(" of ")[0] in " ".join(result.output.split())
    walks = read_csv(walks_of_run)
    expected = evaluate(
        ["bayesian", "shortest-distance"], walks, cut="cells", cv=2, repeats=1, groups="participant", seed=3
    )
    folder = run / "people"
    found = pd.read_csv(folder / "predictions.csv")
    assert found["correct"].tolist() == pytest.approx(expected.table["correct"].tolist())
    about = json.loads((folder / "reading.json").read_text())
    assert about["definition"] == expected.definition
    assert about["summary"][0]["f1"] == pytest.approx(expected.summary()["f1"][0])
    tested = pd.read_csv(folder / "comparison_anova.csv")
    assert set(tested["compared"]) == {"predictor", "condition (bayesian)", "condition (shortest-distance)"}
    row = tested.query("compared == 'predictor' and at == 'mean'").iloc[0]
    assert row["F"] == pytest.approx(compare_conditions(expected, factor="predictor", at="mean").anova["F"][0])
    figures = {path.name for path in folder.glob("*.svg")}
    assert figures == {"accuracy.svg", "confusion.svg", "learning_curve.svg"}
    page, report = (folder / "report.html").read_text(), (run / "report.html").read_text()
    for text in (page, report):
        assert text.count("data:image/svg+xml;base64,") == 3
        assert "Goal prediction" in text
        assert "http://" not in text.replace("http://www.w3.org", "")
    assert legible("report", run).exit_code == 0
    assert (run / "report.html").read_text() == report
    shutil.rmtree(folder)
    legible("report", run)
    assert (run / "report.html").read_bytes() == before


def test_files_of_a_reading_cannot_run_anything(run: Path, walks_of_run: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    few = ("--folds", 2, "--repeats", 1, "--no-curve")
    result = legible(
        "score", run / "best.txt", "--trajectories", walks_of_run, "--predictor", "bayesian", *few, "--out", out
    )
    assert result.exit_code == 0, result.output
    assert not (out / "learning_curve.svg").exists()
    from benchmarks.reports.prediction_report import evaluation_section

    (out / "accuracy.svg").write_text("<svg><script>alert(1)</script></svg>")
    with pytest.warns(UserWarning, match=r"accuracy\.svg beside it was changed since it was written"):
        assert evaluation_section(out) is None
    about = json.loads((out / "reading.json").read_text())
    assert about.pop("sha256")
    about |= {"schema": 1, "notes": ["<script>alert(1)</script>"]}  # files of earlier versions have no digests
    (out / "reading.json").write_text(json.dumps(about))
    section = evaluation_section(out)
    assert section is not None
    assert "&lt;script&gt;" in section
    assert "<script" not in section
    (out / "reading.json").write_text("{")
    with pytest.warns(UserWarning, match=r"reading\.json: not valid JSON.*evaluate again"):
        assert evaluation_section(out) is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--predictor", "bayesian"), "--predictor needs --trajectories"),
        (("--folds", 3), "--folds is about --predictor"),
        (("--out", "x"), "--out is about --predictor"),
    ],
)
def test_options_of_predictors_need_them(arguments: tuple[str, ...], message: str) -> None:
    result = legible("score", "-", *arguments, text=KITCHEN)
    assert result.exit_code == 2
    assert message in result.output


def test_unknown_predictors_and_too_few_walks_are_said_in_a_line(walks_of_run: Path, run: Path) -> None:
    for arguments, message in (
        (("--predictor", "nobody"), "nobody"),
        (("--predictor", "grid-ngram", "--folds", 1000), "1000 folds need at least"),
    ):
        result = legible("score", run, "--trajectories", walks_of_run, *arguments)
        assert result.exit_code == 2, result.output
        assert message in result.output
        assert "Traceback" not in result.output


def test_trajectories_of_another_kitchen_are_refused(tmp_path: Path) -> None:
    from legible_envs.rollouts import save_trajectories

    save_trajectories(tmp_path / "none.npz", [])
    result = legible("score", "-", "--trajectories", tmp_path / "none.npz", text=KITCHEN)
    assert result.exit_code == 2
    assert "none.npz" in result.output


# -- the command itself ------------------------------------------------------------------------------------------------


def test_help_is_a_table_of_contents_of_every_command() -> None:
    result = legible("--help")
    assert result.exit_code == 0
    lines = result.output.splitlines()
    named = [name for names in CONTENTS.values() for name in names]
    assert {name.split()[0] for name in named} == set(main.commands)
    groups = {name: group for name, group in main.commands.items() if isinstance(group, click.Group)}
    below = {f"{name} {command}" for name, group in groups.items() for command in group.commands}
    assert {name for name in named if " " in name} == below
    for title, names in CONTENTS.items():
        start = lines.index(f"{title}:")
        for row, name in zip(lines[start + 1 :], names, strict=False):
            assert row.strip().startswith(name)
            assert row.rstrip().endswith("."), "one line each"
    for name in named:
        assert legible(*name.split(), "--help").exit_code == 0


def test_version() -> None:
    assert __version__ in legible("--version").output


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys; from benchmarks.cli.app import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'ribs', 'sklearn', 'pandas', 'pygame', 'torch', 'scipy'} & sys.modules.keys()\n"
        "sys.exit(' '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_output_survives_a_terminal_without_unicode(tmp_path: Path) -> None:
    (tmp_path / "k.txt").write_text(KITCHEN)
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.cli.app", "show", str(tmp_path / "k.txt")],
        capture_output=True,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert b"legibility" in done.stdout
    assert b" T##" in done.stdout


def test_written_runs_of_the_tests_are_runs(tmp_path: Path) -> None:
    write_run(tmp_path, OvercookedWorkspace(shape=(6, 6)), 10)
    assert legible("show", tmp_path).exit_code == 0
