"""The experiment on tables: its trials, its tables and words, and that it resumes; on a very small version of it."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.conditions import (
    beside_published,
    compare_layouts,
    figures_of_merit,
    in_order,
    slug,
    stacked,
)
from benchmarks.experiments.figures import accuracy_by_condition, bars_by_condition
from benchmarks.experiments.predictor_settings import PredictorSetting
from benchmarks.experiments.tabletop import QUICK, Settings, narrative, reproduce, run, sections, sweep, tables
from benchmarks.experiments.trial_rows import accuracy_rows, by_table, confusion_matrix, curve_rows, logged_rows
from benchmarks.reports.experiment_report import Section
from legible_envs.tabletop import TabletopLayout, TabletopTask, TabletopWorkspace
from predictors.evaluation import learning_curve

SMALL = Settings(
    layouts=2,
    participants=4,
    initial=100,
    evaluations=600,
    predictors=sweep.PREDICTORS[:2],
    folds=2,
    repeats=1,
    shares=(0.3, 1.0),
    curve_repeats=2,
    crossing=(1.0,),
    samples=12,
    robots=(sweep.ROBOTS[0], sweep.ROBOTS[3]),
    rounds=1,
)


@pytest.fixture(scope="session")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a whole, very small run."""
    folder = tmp_path_factory.mktemp("tabletop-conditions")
    reproduce(folder, settings=SMALL, workers=1)
    return folder


@pytest.fixture(scope="session")
def pieces(small_run: Path) -> list[Section]:
    """What is told about it."""
    return sections(small_run)


@pytest.fixture(scope="session")
def results(small_run: Path) -> tables.Results:
    """What it logged."""
    return tables.load_results(small_run)


def place(condition: str = "Baseline", layout: TabletopLayout | None = None) -> dict[str, Any]:
    """A table as trials name it."""
    layout = layout or TabletopTask.named("columns").layout
    return {"condition": condition, "layout": 0, "json": json.dumps(layout.to_dict())}


# -- trials ------------------------------------------------------------------------------------------------------------


def test_settings_are_plain_data_and_every_cell_is_another() -> None:
    places = [place(condition) | {"layout": number} for condition in sweep.CONDITIONS for number in range(2)]
    for settings in (QUICK, SMALL, sweep.FULL):
        made = (sweep.accuracy_trials, sweep.curve_trials, sweep.spread_trials, sweep.team_trials)
        for trials in (sweep.layout_trials(settings), *(function(settings, places) for function in made)):
            texts = [json.dumps(trial, sort_keys=True, allow_nan=False) for trial in trials]
            assert len(set(texts)) == len(texts) > 0
    assert sweep.FULL.layouts >= 5
    assert (sweep.FULL.participants, sweep.FULL.curve_repeats) == (12, 10)


def test_all_predictors_meet_the_same_participants_and_other_tables_have_others() -> None:
    trials = sweep.accuracy_trials(SMALL, [place("Both"), place("Baseline")])
    seeds = {condition: {trial["seed"] for trial in trials if trial["condition"] == condition} for condition in
             ("Both", "Baseline")}  # fmt: skip
    assert len(seeds["Both"]) == len(seeds["Baseline"]) == 1
    assert seeds["Both"] != seeds["Baseline"]
    assert {trial["crossing"] for trial in trials if trial["condition"] == "Baseline"} == {0.0}
    assert {trial["crossing"] for trial in trials if trial["condition"] == "Both"} == {0.0, 1.0}


def test_a_searched_table_is_what_the_search_finds_and_keeps_to_its_condition() -> None:
    trial = next(trial for trial in sweep.layout_trials(SMALL) if trial["condition"] == "Virtual Obstacle")
    row = run.find_table(trial)
    layout = TabletopLayout.from_json(row["json"])
    baseline = TabletopTask.named("columns").layout
    assert np.array_equal(layout.centres, baseline.centres)
    assert row["num_obstacles"] == len(layout.obstacles) > 0
    assert row["score"] == pytest.approx(TabletopWorkspace(condition="obstacles").summary(layout)["score"])
    assert row == run.find_table(trial)


def test_the_random_table_is_the_median_of_many() -> None:
    trial = {"condition": "Random", "layout": 3, "initial": 101}
    row = run.find_table(trial)
    ws = TabletopWorkspace(condition="placement")
    scores = np.sort(ws.legibility(ws.sample(101, np.random.default_rng(3))))
    assert row["score"] == pytest.approx(scores[50])


def test_people_who_comply_or_not_are_the_same_people() -> None:
    ws = TabletopWorkspace(condition="obstacles")
    layout = ws.decode(ws.sample(5, np.random.default_rng(1))[np.argmax(ws.num_obstacles(
        ws.sample(5, np.random.default_rng(1))))])  # fmt: skip
    trials = [
        trial for trial in sweep.accuracy_trials(SMALL, [place("Both", layout)]) if trial["predictor"] == "nearest cube"
    ]
    good, bad = (run.simulate(trial) for trial in trials)
    assert [(w.participant, w.goal, w.start) for w in good] == [(w.participant, w.goal, w.start) for w in bad]
    assert len(good) == 6 * SMALL.participants  # of eight reaches two have one goal only
    assert any(not np.array_equal(a.states, b.states) for a, b in zip(good, bad, strict=True))


def test_reaches_behind_covariances_are_balanced_and_rows_are_their_moments() -> None:
    trial = sweep.spread_trials(SMALL, [place()])[0]
    rows = pd.DataFrame(run.spread_of_reaches(trial))
    assert set(rows["reaches"]) == {SMALL.participants}
    assert rows.groupby(["alignment", "goal"]).size().eq(SMALL.samples).all()
    reaches = run._balanced_reaches(trial)
    goal = reaches[0].goal
    ends = np.array([r.states[-1] - r.states[0] for r in reaches if r.goal == goal])
    last = rows[(rows["alignment"] == "none") & (rows["goal"] == goal)].iloc[-1]
    assert (last["x"], last["y"]) == pytest.approx(ends.mean(axis=0))
    assert [[last["xx"], last["xy"]], [last["xy"], last["yy"]]] == pytest.approx(np.cov(ends.T), abs=1e-12)


def test_a_robot_that_predicts_is_sure_earlier_than_one_that_does_not() -> None:
    settings = dataclasses.replace(SMALL, participants=2, robots=(sweep.ROBOTS[0], *sweep.ROBOTS[2:]))
    eq1, blind, alone = (pd.DataFrame(run.play_with_robot(trial)) for trial in sweep.team_trials(settings, [place()]))
    assert eq1["done"].eq(8).all()
    assert blind["decided"].eq(0).all()
    assert eq1["decision_fraction"].mean() < blind["decision_fraction"].mean() == 1
    assert eq1["completion_time"].mean() < alone["completion_time"].mean()
    assert "conflicts" not in alone


# -- evaluating -------------------------------------------------------------------------------------------------------


def test_accuracy_rows_agree_with_one_another() -> None:
    trial = sweep.accuracy_trials(SMALL, [place()])[0]
    reaches = run.simulate(trial)
    rows = pd.DataFrame(accuracy_rows(sweep.PREDICTORS[3].make(), reaches, folds=3, repeats=2, seed=1))
    parts = dict(list(rows.groupby("table")))
    means = [
        np.average(parts["accuracy"]["correct"], weights=parts["accuracy"]["walks"]),
        np.average(parts["start"]["correct"], weights=parts["start"]["walks"]),
        parts["metrics"]["accuracy"].mean(),
    ]
    assert means == pytest.approx([means[0]] * 3)
    confusion = parts["confusion"]
    assert confusion["count"].sum() == pytest.approx(len(reaches))
    hits = confusion[confusion["goal"] == confusion["predicted"]]["count"].sum()
    assert hits / len(reaches) == pytest.approx(means[0])
    fewer = accuracy_rows(sweep.PREDICTORS[3].make(), reaches, folds=3, repeats=2, seed=1, starts=False,
                        confusion_over="sum")  # fmt: skip
    others = by_table(pd.DataFrame(fewer))
    assert set(others) == {"accuracy", "metrics", "confusion"}
    fractions = parts["accuracy"]["fraction"].nunique()
    np.testing.assert_allclose(others["confusion"]["count"], fractions * confusion["count"])


def test_logged_rows_come_back_with_every_name(tmp_path: Path) -> None:
    rows = pd.DataFrame(
        [
            {"table": "confusion", "goal": "NA", "predicted": "None", "count": 2.0, "layout": 0},
            {"table": "confusion", "goal": "None", "predicted": "None", "count": 3.0, "layout": 0},
            {"table": "confusion", "goal": "NA", "predicted": "NA", "count": 9.0, "layout": 1},
            {"table": "other", "value": 1.0},
        ]
    )
    rows.to_csv(tmp_path / "readings.csv", index=False)
    (tmp_path / "people.csv").write_text("\n")
    parts = by_table(logged_rows(tmp_path, "readings", "tabletop"))
    assert list(parts["other"]) == ["table", "value"]
    matrix = confusion_matrix(parts["confusion"], layout=0)
    assert matrix.index.tolist() == matrix.columns.tolist() == ["NA", "None"]
    assert matrix.to_numpy().tolist() == [[0, 2], [0, 3]]
    assert logged_rows(tmp_path, "people", "tabletop").empty
    with pytest.raises(FileNotFoundError, match="legible reproduce kitchens"):
        logged_rows(tmp_path, "curves", "kitchens")


def test_learning_curves_begin_where_every_goal_is_known() -> None:
    reaches = run.simulate(sweep.accuracy_trials(dataclasses.replace(SMALL, participants=8), [place()])[0])
    rows = pd.DataFrame(curve_rows(PredictorSetting("k-NN", "reach-knn").make(), reaches, shares=(0.2, 1.0), repeats=3,
                                   seed=0, rare="redraw"))  # fmt: skip
    assert rows.groupby("split")["share"].apply(list).tolist() == [[0.2, 1.0]] * 3
    whole, some = (rows[rows["share"] == share]["accuracy"].mean() for share in (1.0, 0.2))
    assert whole > some
    few = [reach for reach in reaches if len(reach.candidates) == 2]
    with pytest.raises(ValueError, match="mention every goal"):
        curve_rows(PredictorSetting("k-NN", "reach-knn").make(), few, shares=(0.05,), repeats=1, seed=0, rare="redraw")
    with pytest.raises(ValueError, match="single trajectories"):
        learning_curve("reach-knn", reaches, groups="participant", rare="redraw")
    with pytest.raises(ValueError, match="'error' or 'redraw', got 'keep'"):
        learning_curve("reach-knn", reaches, rare="keep")  # type: ignore[arg-type]


# -- the whole of it --------------------------------------------------------------------------------------------------


@pytest.mark.slow  # the first that needs the whole run
def test_nothing_runs_twice_and_the_analysis_repeats_itself(small_run: Path, pieces: list[Section]) -> None:
    def content() -> dict[str, bytes]:
        made = [*(small_run / "tables").iterdir(), *(small_run / "figures").iterdir()]
        return {path.name: path.read_bytes() for path in made}

    stamps = [path.stat().st_mtime_ns for path in sorted((small_run / "cells").iterdir())]
    before = content()
    for path in (*(small_run / "tables").iterdir(), *(small_run / "figures").iterdir()):
        path.unlink()
    reproduce(small_run, settings=SMALL, workers=1)
    sections(small_run)
    assert [path.stat().st_mtime_ns for path in sorted((small_run / "cells").iterdir())] == stamps
    assert content() == before


def test_a_cell_that_is_lost_comes_back_the_same(small_run: Path) -> None:
    read = {path: json.loads(path.read_text()) for path in (small_run / "cells").iterdir()}
    functions = {"accuracy": run.evaluate_predictor, "curve": run.trace_learning_curve}
    functions |= {"spread": run.spread_of_reaches, "team": run.play_with_robot}
    for name, function in functions.items():
        content = next(content for content in read.values() if content["function"] == f"tabletop/{name}")
        again = function(content["cell"])
        plain = [{k: v for k, v in row.items() if v == v and v is not None} for row in again]
        kept = [{k: v for k, v in row.items() if v is not None} for row in content["rows"]]
        assert plain == kept


def test_sections_have_words_tables_and_figures(pieces: list[Section]) -> None:
    titles = [section.title for section in pieces]
    assert titles[0] == "Tables"
    assert {"Beside the paper", "Hypotheses", "With a robot"} <= set(titles)
    for section in pieces:
        assert section.text
        assert "nan" not in re.findall(r"[a-z]+", section.text)
        assert all(path.stat().st_size > 0 for path in section.figures)
        assert all(len(table) for table in section.tables.values())


def test_tables_set_ours_beside_the_published(results: tables.Results) -> None:
    metrics = tables.metrics_table(results)
    table = tables.beside_published(metrics, results.predictors[:2]).set_index("condition")
    assert table.loc["Both", "f1, paper"] == 0.936
    own = metrics[(metrics["predictor"] == results.predictors[0]) & (metrics["condition"] == "Both")]
    assert table.loc["Both", f"f1, {results.predictors[0]}"] == own["f1"].item()
    assert list(metrics["condition"][:5]) == list(sweep.CONDITIONS)
    spread = tables.spread_beside_published(tables.spread_table(results)).set_index("condition")
    assert spread.loc["Baseline", "determinant, paper"] == 9.36e-6
    assert (spread > 0).all(axis=None)


def test_teams_are_compared_with_the_baseline_and_signs_are_right(results: tables.Results) -> None:
    people = tables.team_people(results)
    reader = str(people["reader"].iloc[0])
    means = people[people["reader"] == reader].groupby("condition")["completion_time"].mean()
    rows = tables.team_differences(results, reader)
    own = rows[rows["measure"] == "completion_time"].set_index("condition")["difference"]
    assert set(own.index) == set(sweep.CONDITIONS) - {"Baseline"}
    for condition in own.index.astype(str):
        assert own[condition] == pytest.approx(means[condition] - means["Baseline"])
    table = tables.team_table(results)
    assert ((table["low"] <= table["mean"]) & (table["mean"] <= table["high"])).all()


def test_determinant_and_trace_of_known_covariances() -> None:
    rows = pd.DataFrame({"xx": [4.0], "xy": [1.0], "yy": [9.0]})
    sizes = tables.sizes_of_covariances(rows).iloc[0]
    assert (sizes["determinant"], sizes["trace"]) == pytest.approx((np.linalg.det([[4, 1], [1, 9]]), 13))


def test_words_follow_the_numbers() -> None:
    def rows(values: dict[str, float]) -> str:
        metrics = pd.DataFrame(
            [
                {"predictor": name, "condition": c, "f1": v, "precision": v, "recall": v}
                for name in ("A", "B")
                for c, v in {"Random": 0.1, **values}.items()
            ]
        )
        return narrative.about_agreement(tables.beside_published(metrics, ["A", "B"]), metrics, ["A", "B"])

    paper = {name: known["f1"] for name, known in sweep.PUBLISHED.items()}
    same = rows(paper)
    assert "in the paper's order" in same
    assert "about as much as the paper's +0.232" in same
    assert "F1 is highest at Both for 2 of our 2 predictors (A, B), and in the paper's order" in same
    assert "over all four conditions for 2 (A, B)" in same
    turned = rows({**paper, "Both": 0.1})
    assert "3 of 6 pairs in another order" in turned
    assert "less than the paper's" in turned
    assert "F1 is highest at Both for 0 of our 2 predictors (none)" in turned


def test_words_say_where_people_who_ignore_obstacles_cost_more_than_they_gain() -> None:
    table = pd.DataFrame(
        {
            "predictor": "A",
            "crossing": [0.0, 0.5, 1.0],
            "Virtual Obstacle": [0.9, 0.8, 0.7],
            "Both": [0.95, 0.92, 0.91],
            "Placement": 0.85,
        }
    )
    text = narrative.about_compliance(table)
    assert "Virtual Obstacle goes from 0.900 to 0.700, below Placement from 50 % on" in text
    assert "Both goes from 0.950 to 0.910, never below Placement" in text


def test_a_robot_without_prediction_is_known_in_earlier_results(results: tables.Results, tmp_path: Path) -> None:
    for name in ("layouts", "curves", "spreads"):
        getattr(results, name).to_csv(tmp_path / f"{name}.csv", index=False)
    stacked(results.readings, "table").to_csv(tmp_path / "readings.csv", index=False)
    results.teams.replace({"reader": {sweep.ALONE: "reads nothing"}}).to_csv(tmp_path / "teams.csv", index=False)
    assert set(tables.load_results(tmp_path).teams["reader"]) == {"Eq. 1", sweep.NO_PREDICTION}


def test_an_analysis_without_results_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="legible reproduce tabletop"):
        sections(tmp_path)
    with pytest.raises(ValueError, match="2 or more per condition"):
        reproduce(tmp_path, quick=True, seeds=1)


def test_means_are_of_layouts_and_spread_is_between_them() -> None:
    names = ("f1", "precision", "recall", "log_loss", "calibration_error")
    values = {("A", 0): (0.2, 0.4), ("A", 1): (0.7,), ("B", 0): (0.5,), ("B", 1): (0.5,)}
    rows = pd.DataFrame(
        [
            {"condition": condition, "layout": layout, "accuracy": value, **dict.fromkeys(names, 1 - value)}
            for (condition, layout), each in values.items()
            for value in each
        ]
    )
    table = figures_of_merit(rows, {"condition": ["B", "A"]})
    assert table["condition"].tolist() == ["B", "A"]
    assert table["accuracy"].tolist() == pytest.approx([0.5, 0.5])
    assert table["accuracy_sd"].tolist() == pytest.approx([0, np.std([0.3, 0.7], ddof=1)])
    beside = beside_published({"A": {"f1": 0.9, "recall": 0.8}}, {"ours": table})
    assert beside.to_dict("records") == [
        {"condition": "A", "f1, paper": 0.9, "f1, ours": 0.5, "recall, paper": 0.8, "recall, ours": 0.5}
    ]
    assert stacked({"x": rows, "y": rows}, "who")["who"].tolist() == ["x"] * len(rows) + ["y"] * len(rows)


def test_what_is_said_below_a_figure_stands_in_it(results: tables.Results) -> None:
    each, _ = compare_layouts(tables.accuracy_rows(results), results.predictors[0])
    plain, noted = (accuracy_by_condition(each, sweep.CONDITIONS, 0.2, "T", "S", note) for note in ("", "Look here."))
    assert "Look here." in [text.get_text() for text in noted.texts]
    assert "Look here." not in [text.get_text() for text in plain.texts]


def test_pieces_of_figures() -> None:
    assert slug("Gaussian (paper's index)", "Both") == "gaussian_paper_s_index_both"
    table = pd.DataFrame({"a": ["y", "x", "y"], "b": [1, 2, 0]})
    assert in_order(table, a=["x", "y"], b=[0, 1, 2])["b"].tolist() == [2, 0, 1]
    bars = pd.DataFrame({"condition": ["A", "B"], "p": [0.001, 0.0042], "q": [float("nan"), 0.002]})
    figure = bars_by_condition(bars, {"p": "paper", "q": "ours"}, "T", "S", "N", ".4f")
    (axes,) = figure.axes
    assert [bar.get_height() for bar in axes.patches] == [0.001, 0.0042, 0.002]  # none for what is not a number
    assert [round(bar.get_x() + bar.get_width() / 2) for bar in axes.patches] == [0, 1, 1]
    assert [text.get_text() for text in axes.texts] == [".0010", ".0042", ".0020"]
    assert axes.get_ylim() == pytest.approx((0, 0.005))
    assert [label.get_text() for label in axes.get_xticklabels()] == ["A", "B"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["paper", "ours"]
    assert {text.get_text() for text in figure.texts} == {"T", "S", "N"}
    assert "nan" not in figure._repr_svg_()
    shares = bars_by_condition(bars.assign(p=[0.4, 0.97]), {"p": "paper"}, "T", "S", "N")
    assert shares.axes[0].get_ylim() == (0, 1)
