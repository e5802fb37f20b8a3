"""The paper's kitchens, from searches to words: people, trials, tables, and a whole run made small."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.overcooked import analysis, narrative, run, tables
from benchmarks.experiments.overcooked.sweep import (
    CONDITIONS,
    FITTED,
    FULL,
    PREDICTORS,
    PUBLISHED,
    QUICK,
    WALKERS,
    Settings,
    accuracy_trials,
    layout_trials,
    people_of,
)
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.humans import BoltzmannWalker, PlannerWalker
from legible_envs.overcooked.humans.fitting import goal_field
from legible_envs.overcooked.humans.kernels import step_probabilities
from legible_envs.overcooked.humans.planner_fitting import best_slip, draw_person, fit_planner

ROOM = OvercookedLayout.from_ascii("XOXXTXX\nX     X\nX  X  X\nX     D\nXXPXXSX")
TINY = Settings(
    layouts=2,
    participants=3,
    initial=60,
    improvements=4,
    predictors=PREDICTORS[:2],
    folds=2,
    repeats=1,
    shares=(0.6, 1.0),
    curve_repeats=1,
    shape=(5, 5),
    team_participants=0,  # they play for minutes; see test_overcooked_teams
)


# -- people -----------------------------------------------------------------------------------------------------------


def planned_walks(person: PlannerWalker, number: int, name: str, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    goals = ("onion", "tomato", "dish")
    return [
        walk
        for start in ("pot", "serving")
        for walk in person.sample(ROOM, start, goals, number, rng, participant=name)
    ]


def test_steps_are_as_likely_as_they_are_taken() -> None:
    """The share of each first step among many walks, against its likelihood."""
    person = PlannerWalker(depth=2, turn_cost=1.0, slip=0.3)
    rng = np.random.default_rng(0)
    field = goal_field(ROOM, ROOM.stations["onion"])
    paths = [np.array([7 * r + c for r, c in person.walk(ROOM, (3, 2), "onion", rng)]) for _ in range(1500)]
    numbers = np.array([2, 1.0, person.recency, person.fade, 0.0])
    for first in {int(path[1]) for path in paths}:
        taken = [path for path in paths if path[1] == first]
        planned, slipped = np.empty(len(taken[0]) - 1), np.empty(len(taken[0]) - 1)
        step_probabilities(taken[0], field, numbers, planned, slipped)
        expected = 0.7 * planned[0] + 0.3 * slipped[0]
        assert len(taken) / len(paths) == pytest.approx(expected, abs=4 * math.sqrt(0.25 / len(paths)))


def test_the_rate_of_slips_is_found() -> None:
    rng = np.random.default_rng(0)
    planned, slipped = rng.choice([0.0, 1.0], 4000, p=[0.2, 0.8]), np.full(4000, 1 / 3)
    slip, value = best_slip(planned, slipped)
    tried = [float(np.log((1 - s) * planned + s * slipped).sum()) for s in np.linspace(0.05, 0.95, 91)]
    assert value >= max(tried) - 1e-6
    assert slip == pytest.approx(np.linspace(0.05, 0.95, 91)[int(np.argmax(tried))], abs=0.011)


def test_a_planner_is_fitted_to_its_own_walks() -> None:
    rng = np.random.default_rng(1)
    walks = [
        walk
        for name, slip in (("careful", 0.05), ("careless", 0.4))
        for walk in planned_walks(
            PlannerWalker(depth=2, turn_cost=1.0, recency=1.0, fade=0.8, slip=slip), 60, name, rng
        )
    ]
    grid = {"depth": (2,), "turn_cost": (0.0, 1.0), "recency": (0.0, 1.0), "fade": (0.8,)}
    fit = fit_planner(walks, grid)
    assert (fit.turn_cost, fit.recency) == (1.0, 1.0)
    assert fit.people["careful"][1] == pytest.approx(0.05, abs=0.04)
    assert fit.people["careless"][1] == pytest.approx(0.4, abs=0.08)
    assert fit.num_steps == sum(len(walk.states) - 1 for walk in walks)


def test_people_differ_as_the_numbers_say() -> None:
    rng = np.random.default_rng(0)
    drawn = draw_person(people_of(pd.DataFrame())["boltzmann"])
    rational = [drawn((5, 7), rng) for _ in range(400)]
    assert all(isinstance(person, BoltzmannWalker) for person in rational)
    logs = np.log([person.rationality for person in rational])  # type: ignore[attr-defined]
    assert np.exp(logs.mean()) == pytest.approx(FITTED["boltzmann"]["rationality"], rel=0.03)
    assert logs.std() == pytest.approx(FITTED["boltzmann"]["spread"], rel=0.15)
    planner = draw_person(people_of(pd.DataFrame())["planner"])
    pairs = {(p.turn_cost, p.slip) for p in (planner((5, 7), rng) for _ in range(50))}  # type: ignore[attr-defined]
    assert pairs <= {tuple(pair) for pair in FITTED["planner"]["people"]}
    assert len(pairs) > 10
    with pytest.raises(ValueError, match="'boltzmann' or 'planner'"):
        draw_person({"walker": "crowd", "preference": 0.2})


def test_fits_replace_the_numbers_kept_as_data() -> None:
    rows = [
        {"walker": "boltzmann", "participant": "", "rationality": 2.0, "spread": 0.5},
        {"walker": "boltzmann", "participant": "a", "rationality": 2.1},
        {"walker": "planner", "participant": "", "depth": 3, "recency": 1.0, "fade": 0.9},
        {"walker": "planner", "participant": "a", "turn_cost": 0.5, "slip": 0.1},
    ]
    found = people_of(pd.DataFrame(rows))
    assert (found["boltzmann"]["rationality"], found["boltzmann"]["spread"]) == (2.0, 0.5)
    assert (found["planner"]["depth"], found["planner"]["people"]) == (3, [[0.5, 0.1]])


# -- trials ------------------------------------------------------------------------------------------------------------


def test_cells_cover_every_combination_once() -> None:
    for settings in (FULL, QUICK):
        layouts = layout_trials(settings)
        assert len(layouts) == 4 * settings.layouts
        places = [{**trial, "drawing": "X"} for trial in layouts]
        trials = accuracy_trials(settings, places, people_of(pd.DataFrame()))
        keys = {(c["condition"], c["layout"], c["walker"], c["predictor"]) for c in trials}
        assert len(keys) == len(trials) == len(layouts) * len(WALKERS) * len(settings.predictors)
        seeds = {(c["condition"], c["layout"], c["walker"]): c["seed"] for c in trials}
        assert len(set(seeds.values())) == len(seeds)
        assert all(c["seed"] == seeds[c["condition"], c["layout"], c["walker"]] for c in trials)
    assert FULL.layouts >= 5
    assert FULL.participants == 20
    assert (FULL.initial, FULL.improvements) == (1000, 1000)


def test_random_is_the_median_of_random_layouts() -> None:
    trial = {"condition": "Random", "layout": 3, "shape": [5, 5], "initial": 101, "improvements": 0}
    (row,) = run.find_layout(trial)
    workspace = OvercookedWorkspace((5, 5))
    scores = workspace.legibility(workspace.sample(101, np.random.default_rng(3)))
    assert row["score"] == pytest.approx(float(np.median(scores)))


# -- a whole run ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run made small, without recordings."""
    place = tmp_path_factory.mktemp("conditions")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "_num_recorded", lambda: 0)
        run.reproduce(place, workers=1, settings=TINY)
    return place


@pytest.mark.slow
def test_a_run_writes_tables_figures_and_words(folder: Path) -> None:
    results = tables.load_results(folder)
    assert len(results.layouts) == 8
    sections = analysis.sections(folder)
    titles = [section.title for section in sections]
    assert "Hypotheses" in titles
    assert "Beside the paper" in titles
    participants = next(section for section in sections if section.title == "Participants")
    assert "The recordings are not there" in participants.text
    for section in sections:
        assert all(path.is_file() and path.stat().st_size > 500 for path in section.figures)
        assert all(len(table) for table in section.tables.values())
    names = {path.name for path in (folder / "figures").iterdir()}
    assert {"layouts.png", "rewards.png", "task.svg", "behaviour_map.svg", "published.svg"} <= names


@pytest.mark.slow
def test_accuracy_is_that_of_the_metrics(folder: Path) -> None:
    """Two ways through the results meet: rows per participant weighted by walks, and the figures of merit."""
    results = tables.load_results(folder)
    keys = ["walker", "predictor", "condition", "layout", "fraction"]
    rows = results.readings["accuracy"].assign(hits=lambda t: t["correct"] * t["walks"])
    sums = rows.groupby(keys)[["hits", "walks"]].sum()
    metrics = results.readings["metrics"].set_index(keys)["accuracy"]
    np.testing.assert_allclose((sums["hits"] / sums["walks"]).sort_index(), metrics.sort_index())
    place = results.layouts.iloc[0]
    matrix = tables.confusion_of(results, "boltzmann", results.predictors[0], place["condition"], place["layout"])
    one = rows[(rows["walker"] == "boltzmann") & (rows["predictor"] == results.predictors[0])]
    one = one[(one["condition"] == place["condition"]) & (one["layout"] == place["layout"])]
    assert matrix.to_numpy().sum() == pytest.approx(one["walks"].sum() / one["fraction"].nunique())
    assert np.trace(matrix) / matrix.to_numpy().sum() == pytest.approx(one["hits"].sum() / one["walks"].sum())


@pytest.mark.slow
def test_a_second_run_does_nothing_and_changes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "_num_recorded", lambda: 0)
    analysis.sections(folder)
    before = {path: path.read_bytes() for path in sorted((folder / "tables").iterdir())}
    events = []
    run.reproduce(folder, workers=1, settings=TINY, progress=events.append)
    analysis.sections(folder)
    assert all(event.last is None for event in events)
    assert {path: path.read_bytes() for path in sorted((folder / "tables").iterdir())} == before


@pytest.mark.slow
def test_the_same_seeds_give_the_same_walks(folder: Path) -> None:
    places = tables.load_results(folder).layouts.to_dict("records")
    trials = accuracy_trials(TINY, places, people_of(pd.DataFrame()))  # type: ignore[arg-type]
    one, other = (run.simulate(trials[0]) for _ in range(2))
    assert [walk.states.tolist() for walk in one] == [walk.states.tolist() for walk in other]
    assert all(len(walk.candidates) > 1 for walk in one)
    assert len({walk.participant for walk in one}) == 3


def test_one_layout_per_condition_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="2 or more"):
        run.reproduce(tmp_path, seeds=1, settings=TINY)


def test_missing_results_say_how_to_get_them(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="legible reproduce overcooked"):
        analysis.sections(tmp_path)


# -- words ------------------------------------------------------------------------------------------------------------


def beside(ours: dict[str, float]) -> pd.DataFrame:
    rows = [{"condition": name, "f1, paper": PUBLISHED[name]["f1"], "f1, boltzmann": ours[name]} for name in CONDITIONS]
    return pd.DataFrame(rows)


def test_words_follow_the_figures() -> None:
    paper = {name: PUBLISHED[name]["f1"] for name in CONDITIONS}
    same = narrative.about_agreement(beside(paper))
    assert "the same order of conditions as in the paper" in same
    assert "about as much as the paper's +0.322" in same
    turned = dict(zip(CONDITIONS, reversed(paper.values()), strict=True))
    reverse = narrative.about_agreement(beside(turned))
    assert "6 of 6 pairs of conditions in another order" in reverse
    assert "by -0.322 over random ones, less than" in reverse
    for name, other in itertools.pairwise(CONDITIONS):
        swapped = {**paper, name: paper[other], other: paper[name]}
        assert "1 of 6 pairs of conditions in another order" in narrative.about_agreement(beside(swapped))


def test_settings_can_be_changed_by_users() -> None:
    assert dataclasses.replace(QUICK, layouts=7).layouts == 7
