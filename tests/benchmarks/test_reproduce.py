"""The command that runs experiments, and the page it writes, on a small experiment of its own."""

from __future__ import annotations

import importlib
import re
import sys
import types
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from jinja2 import UndefinedError
from PIL import Image

from benchmarks.cli import reproduce as reproducing
from benchmarks.cli.app import main
from benchmarks.csv_tables import write_tables
from benchmarks.reports.experiment_report import Section, write_experiment_report
from benchmarks.reports.narrative import narrate
from benchmarks.trials import run_trials
from benchmarks.trials.functions import name_of
from legible_envs.datasets.overcooked_2019 import RecordingsError


@pytest.fixture
def small_experiment(monkeypatch: pytest.MonkeyPatch) -> None:
    """An experiment like the real ones: trials, a table from their results, sections from the table."""
    module, analysis = types.ModuleType("small_experiment"), types.ModuleType("small_experiment.analysis")

    def reproduce(folder, *, quick, seeds, workers, scheduler, progress, **_):
        trials = [{"seed": seed} for seed in range(seeds or (2 if quick else 4))]
        rows = run_trials(
            "tests.benchmarks.trial_functions:draw", trials, folder, workers=1, scheduler=scheduler, progress=progress
        )
        write_tables(folder / "tables", [("values", rows)])

    def sections(folder):
        return [
            Section(
                "What came out", "Words & more.\n\nA second one.", {"Values": pd.read_csv(folder / "tables/values.csv")}
            )
        ]

    module.reproduce, analysis.sections = reproduce, sections
    monkeypatch.setitem(sys.modules, "small_experiment", module)
    monkeypatch.setitem(sys.modules, "small_experiment.analysis", analysis)
    experiment = reproducing.Experiment({".": "small_experiment"}, "Small?", "Few words.")
    monkeypatch.setitem(reproducing.EXPERIMENTS, "overcooked", experiment)


def test_the_command_runs_analyses_and_reports(small_experiment: None, tmp_path: Path) -> None:
    arguments = ["reproduce", "overcooked", "--quick", "--out", str(tmp_path)]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    assert "values.csv" in done.output
    page = (tmp_path / "report.html").read_text()
    assert "What came out" in page
    assert "Words &amp; more." in page
    assert "quick version" in page
    assert page.count("<tr>") == 1 + 4
    stamps = [path.stat().st_mtime_ns for path in sorted((tmp_path / "cells").iterdir())]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert stamps == [path.stat().st_mtime_ns for path in sorted((tmp_path / "cells").iterdir())]
    assert (tmp_path / "report.html").read_text() == page


def test_seeds_replace_the_experiments_own_number(small_experiment: None, tmp_path: Path) -> None:
    CliRunner().invoke(main, ["reproduce", "overcooked", "--seeds", "3", "--out", str(tmp_path)])
    assert len(list((tmp_path / "cells").iterdir())) == 3


def test_every_experiment_has_its_module() -> None:
    for experiment in reproducing.EXPERIMENTS.values():
        for name in experiment.modules.values():
            assert callable(importlib.import_module(f"{name}.analysis").sections)
            assert callable(importlib.import_module(name).reproduce)


def test_what_needs_recordings_says_that_they_are_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def reproduce(folder: Path, **how: object) -> None:
        raise RecordingsError("no recordings; run `legible humans fetch`")

    module = types.ModuleType("needs_recordings")
    module.reproduce = reproduce
    monkeypatch.setitem(sys.modules, "needs_recordings", module)
    experiment = reproducing.Experiment({"recorded": "needs_recordings"}, "Recorded?", "")
    monkeypatch.setitem(reproducing.EXPERIMENTS, "overcooked", experiment)
    page = reproducing.run_experiment("overcooked", tmp_path).read_text()
    assert "Left out: no recordings" in page


def test_the_page_holds_its_pictures_and_asks_for_nothing(tmp_path: Path) -> None:
    picture = tmp_path / "a_curve.svg"
    picture.write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    table = pd.DataFrame(
        {"name": ["<b>", None], "value": [0.123456, float("nan")], "count": [1, 2], "good": [True, False]}
    )
    page = write_experiment_report(
        tmp_path, [Section("A", "Say `a<b` twice.\n\nOne ` alone", {"Numbers": table}, [picture])], title="T", lede="L"
    ).read_text()
    assert "<p>Say <code>a&lt;b</code> twice.</p><p>One ` alone</p>" in page
    assert "data:image/svg+xml;base64," in page
    assert "&lt;b&gt;" in page
    assert "0.1235" in page
    assert re.findall(r"<td[^>]*>(yes|no)</td>", page) == ["yes", "no"]
    assert not re.search(r"(?:src|href)=\"(?!data:|#)", page)
    for size, is_wide in (((400, 100), True), ((100, 100), False)):
        Image.new("RGB", size).save(tmp_path / "board.png")
        page = write_experiment_report(tmp_path, [Section("A", figures=[tmp_path / "board.png"])], title="T", lede="L")
        assert ('<figure class="wide">' in page.read_text()) == is_wide
    picture.rename(tmp_path / "a.gif")
    with pytest.raises(ValueError, match=r"must be one of.*\.png"):
        write_experiment_report(tmp_path, [Section("A", figures=[tmp_path / "a.gif"])], title="T", lede="L")


def test_prose_names_all_its_figures_and_is_escaped_on_the_page(tmp_path: Path) -> None:
    budgets = [
        {"budget": "2000", "methods": ["<b>", "nslc"], "all": False},
        {"budget": "paper", "methods": [], "all": False},
    ]
    text = narrate("optimizers/optimum", optimum=-1.5, budgets=budgets)
    assert "Reached in every search: at 2,000 evaluations by <b>, nslc; at the paper's iterations by none." in text
    page = write_experiment_report(tmp_path, [Section("A", text)], title="T", lede="L").read_text()
    assert "&lt;b&gt;, nslc" in page
    assert "<b>, nslc" not in page
    with pytest.raises(UndefinedError, match="optimum"):
        narrate("optimizers/optimum", budgets=budgets)


@pytest.mark.parametrize(
    ("function", "name", "before"),
    [
        ("optimizers.run:run_search", "optimizers/search", "optimizer_comparison.run:run_cell"),
        ("overcooked.run:find_layout", "overcooked/layout", "overcooked_conditions.run:find_layout"),
        ("overcooked.run:fit_people", "overcooked/people", "overcooked_conditions.run:fit_people"),
        ("overcooked.run:evaluate_predictor", "overcooked/accuracy", "overcooked_conditions.run:read_people"),
        ("overcooked.run:trace_learning_curve", "overcooked/curve", "overcooked_conditions.run:learn_people"),
        ("tabletop.run:find_table", "tabletop/layout", "tabletop_conditions.run:find_table"),
        ("tabletop.run:evaluate_predictor", "tabletop/accuracy", "tabletop_conditions.run:read_people"),
        ("tabletop.run:trace_learning_curve", "tabletop/curve", "tabletop_conditions.run:learn_people"),
        ("tabletop.run:spread_of_reaches", "tabletop/spread", "tabletop_conditions.run:spread_of_reaches"),
        ("tabletop.run:play_with_robot", "tabletop/team", "tabletop_conditions.run:play_with_robot"),
        ("recorded.run:score_stages", "recorded/score", "recorded_people.run:score_stages"),
        ("recorded.run:evaluate_by_stage", "recorded/accuracy", "recorded_people.run:read_stages"),
    ],
)
def test_trials_finished_under_earlier_names_of_functions_stay_valid(function: str, name: str, before: str) -> None:
    assert name_of(f"benchmarks.experiments.{function}") == (name, (f"benchmarks.{before}",))
