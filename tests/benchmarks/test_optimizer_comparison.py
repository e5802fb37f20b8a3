"""The comparison of optimisers: its trials, its statistics against definitions, a whole small run from files."""

import dataclasses
import shutil

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.optimizers import FULL, QUICK, Settings, reproduce, sections
from benchmarks.experiments.optimizers.analysis import (
    anytime,
    beside_local_search,
    beside_published,
    gaps,
    leaderboard,
    ours_against,
    pairwise,
    summary,
)
from benchmarks.experiments.optimizers.run import run_search
from benchmarks.experiments.optimizers.sweep import LEARNED, METHODS, OPTIMUM_5X5, PUBLISHED, trials_of
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from optimizers import list_emitters

TINY = Settings(grids=((5, 5),), seeds=2, budgets=(300,), large=((400, (5, 5), 1),), learned_budgets=())


def test_the_full_comparison_is_that_of_the_issue():
    trials = trials_of(FULL)
    assert {tuple(trial["workspace"]["shape"]) for trial in trials} == {(5, 5), (7, 7), (9, 9), (5, 9)}
    assert {trial["budget"] for trial in trials} == {"paper", "2000", "20000", "200000", "1000000"}
    assert {trial["method"] for trial in trials} == {*METHODS, *LEARNED} <= set(list_emitters())
    assert {trial["budget"] for trial in trials if trial["method"] in LEARNED} == {"2000", "20000"}
    assert {trial["seed"] for trial in trials if trial["budget"] != "200000"} == set(range(10))
    assert {trial["method"] for trial in trials if trial["budget"] == "200000" and trial["seed"] < 10} == set(METHODS)
    assert {trial["method"] for trial in trials if trial["seed"] >= 10} == {"annealing", "improve"}
    assert all(trial["workspace"]["prefix"] == "sum" for trial in trials)
    paper = {trial["method"]: trial["iterations"] for trial in trials if trial["budget"] == "paper"}
    assert paper == {"improve": [100, 100], "nslc": [20, 180], "differential-evolution": [20, 200]}
    assert len(trials) == len({str(trial) for trial in trials})
    assert len(trials_of(QUICK)) < len(trials) / 4
    fewer = FULL.with_seeds(7)
    assert {trial["seed"] for trial in trials_of(fewer)} == set(range(7))
    assert [own for _, _, own in fewer.large] == [7, 7, 7, 7]


def test_nslc_in_the_papers_budget_is_ten_generations_of_twenty():
    (trial,) = [c for c in trials_of(TINY) if c["method"] == "nslc" and c["budget"] == "paper" and c["seed"] == 0][:1]
    rows = run_search(trial)
    assert rows[-1]["scored"] == 200


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("comparison")
    reproduce(folder, settings=TINY, workers=1)
    sections(folder)
    return folder


def test_a_small_run_leaves_results_tables_and_figures(folder):
    rows = pd.read_csv(folder / "searches.csv", dtype={"budget": str})
    ends = rows[rows["moment"] == "end"]
    assert len(ends) == len(trials_of(TINY)) == 2 * 3 + 2 * len(METHODS) + 2
    for _, row in ends.head(6).iterrows():
        shape = tuple(int(side) for side in row["grid"].split("x"))
        workspace = OvercookedWorkspace(shape=shape, prefix="sum")
        layout = OvercookedLayout.from_ascii(row["drawing"])
        assert workspace.legibility(workspace.encode(layout)) == pytest.approx(row["best"])
    assert {path.name for path in (folder / "tables").iterdir()} == {
        f"{name}.csv"
        for name in ("summary", "leaderboard", "pairs", "ours", "gaps", "published", "local_search", "anytime")
    }
    assert {path.name for path in (folder / "figures").iterdir()} == {
        "anytime_5x5_300.svg",
        "anytime_5x5_400.svg",
    }


def test_analysis_reads_files_alone_and_says_what_came_out(folder, monkeypatch):
    monkeypatch.setattr("optimizers.search", None)
    before = {path.name: path.read_bytes() for path in (folder / "tables").iterdir()}
    parts = sections(folder)
    assert {path.name: path.read_bytes() for path in (folder / "tables").iterdir()} == before
    words = " ".join(part.text for part in parts)
    assert "no difference shown in 2 of 2" in words
    assert "shows 300 evaluations" in words
    assert "rank as published on" in words
    assert all(path.exists() for part in parts for path in part.figures)


def test_a_designer_that_learns_joins_and_leaves_other_results_as_they_are(folder, tmp_path):
    pytest.importorskip("torch")
    with_learned = dataclasses.replace(TINY, learned_budgets=(300,))
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    reproduce(tmp_path, settings=with_learned, workers=1)
    parts = sections(tmp_path)
    rows = pd.read_csv(tmp_path / "searches.csv", dtype={"budget": str})
    before = pd.read_csv(folder / "searches.csv", dtype={"budget": str})
    learned = rows["method"] == "ppo"
    assert (rows[learned & (rows["moment"] == "end")]["scored"] >= 300).all()
    pd.testing.assert_frame_equal(rows[~learned].reset_index(drop=True), before, check_dtype=False)
    for name in ("leaderboard", "pairs", "ours", "published", "local_search"):
        path = f"tables/{name}.csv"
        assert (tmp_path / path).read_bytes() == (folder / path).read_bytes()
    assert set(pd.read_csv(tmp_path / "tables" / "learned.csv")["method"]) == {*METHODS, "ppo"}
    assert "`ppo` has place" in parts[-1].text


def test_a_designer_that_learns_is_left_out_without_torch(folder, tmp_path, monkeypatch):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    monkeypatch.setattr("benchmarks.experiments.optimizers.run.find_spec", lambda name: None)
    with pytest.warns(UserWarning, match="left out of the comparison: ppo, which needs PyTorch"):
        reproduce(tmp_path, settings=dataclasses.replace(TINY, learned_budgets=(300,)), workers=1)
    assert (tmp_path / "searches.csv").read_bytes() == (folder / "searches.csv").read_bytes()


def test_running_it_again_runs_nothing(folder, monkeypatch):
    monkeypatch.setattr("optimizers.search", None)
    written = (folder / "searches.csv").read_bytes()
    reproduce(folder, settings=TINY, workers=1)
    assert (folder / "searches.csv").read_bytes() == written


def test_one_seed_is_refused(tmp_path):
    with pytest.raises(ValueError, match="2 seeds or more"):
        reproduce(tmp_path, quick=True, seeds=1)


# -- tables from made-up results ---------------------------------------------------------------------------------------


def ends_of(scores, grid="5x5", budget="2000"):
    rows = [
        {"grid": grid, "budget": budget, "method": m, "seed": i, "scored": 2000, "best": b, "qd_score": 1.0}
        for m, bests in scores.items()
        for i, b in enumerate(bests)
    ]
    return pd.DataFrame(rows).assign(coverage=0.5, moment="end")


def test_tests_and_effect_sizes_are_those_of_their_definitions():
    rng = np.random.default_rng(0)
    scores = {"annealing": rng.normal(2, 1, 10), "improve": rng.normal(0, 1, 10), "random": rng.normal(-3, 1, 10)}
    table = pairwise(ends_of(scores))
    assert list(zip(table["a"], table["b"], strict=True)) == [
        ("annealing", "improve"),
        ("annealing", "random"),
        ("improve", "random"),
    ]
    for row in table.to_dict("records"):
        a, b = scores[row["a"]], scores[row["b"]]
        wins = (a[:, None] > b).mean() + 0.5 * (a[:, None] == b).mean()
        assert row["superiority"] == pytest.approx(wins)
        assert row["difference"] == pytest.approx(a.mean() - b.mean())
        pooled = np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 2)
        assert row["hedges_g"] == pytest.approx((a.mean() - b.mean()) / pooled * (1 - 3 / (4 * 18 - 1)))
    p = np.sort(table["p"])
    assert np.sort(table["p_holm"]) == pytest.approx(np.maximum.accumulate(np.minimum(p * [3, 2, 1], 1)))
    same = pairwise(ends_of({"annealing": [1.0] * 4, "improve": [1.0] * 4}))
    assert same["p"].item() == 1.0
    assert same["superiority"].item() == 0.5
    assert same["hedges_g"].item() == 0.0
    apart = pairwise(ends_of({"annealing": [2.0] * 4, "improve": [1.0] * 4}))
    assert apart["hedges_g"].item() == np.inf


def test_gaps_count_who_reaches_the_proven_optimum():
    table = gaps(ends_of({"improve": [OPTIMUM_5X5, OPTIMUM_5X5 - 2.0], "random": [OPTIMUM_5X5 - 1.0] * 2}))
    assert table["gap"].tolist() == pytest.approx([1.0, 1.0])
    assert table["reached"].tolist() == [0.5, 0.0]
    assert table["largest_gap"].tolist() == pytest.approx([2.0, 1.0])
    assert gaps(ends_of({"improve": [0.0]}, grid="7x7")).empty


def test_ranks_beside_the_published_ones():
    ends = ends_of({"improve": [1.0, 1.0], "nslc": [2.0, 2.0], "differential-evolution": [0.0, 0.0], "random": [9.0]})
    table = beside_published(ends).set_index("paper")
    assert table["rank"].to_dict() == {"MAP-Elites": 2.0, "NSLC": 1.0, "DE": 3.0}
    assert table["published_rank"].to_dict() == {"MAP-Elites": 1.0, "NSLC": 2.0, "DE": 3.0}
    assert table.loc["DE", "published"] == PUBLISHED["DE"]["5x5"] == -129.28
    assert beside_published(ends_of({"improve": [1.0], "nslc": [2.0]})).empty


def test_verdicts_on_our_emitter():
    clear = ends_of({"annealing": [float(i) for i in range(10, 20)], "improve": [float(i) for i in range(10)]})
    unclear = ends_of({"annealing": [1.0, 2.0], "improve": [0.0, 3.0]}, grid="7x7")
    reverse = ends_of({"annealing": [0.0] * 10, "improve": [1.0] * 10, "random": [9.0] * 10}, grid="9x9")
    table = ours_against(pairwise(pd.concat([clear, unclear, reverse])), "improve")
    assert table.set_index("grid")["verdict"].to_dict() == {
        "5x5": "better",
        "7x7": "no difference shown",
        "9x9": "worse",
    }


def test_the_leaderboard_shows_the_largest_budget_of_all_methods():
    parts = [
        ends_of({"annealing": [3.0, 5.0], "random": [1.0, 1.0]}, grid=grid, budget=budget)
        for grid in ("5x5", "7x7")
        for budget in ("2000", "20000", "paper")
    ]
    large = ends_of({"annealing": [9.0, 9.0]}, grid="7x7", budget="200000")
    table = leaderboard(summary(pd.concat([*parts, large])))
    assert table.columns.tolist() == ["method", "budget", "5x5", "7x7"]
    assert table.iloc[0].tolist() == ["annealing", "20000", "4.0 (1.4)", "4.0 (1.4)"]
    assert table["method"].tolist() == ["annealing", "random"]


def test_our_searches_beside_a_plain_local_search():
    table = beside_local_search(ends_of({"annealing": [70.846, 70.84, 71.0], "improve": [99.0]}, grid="7x7"))
    assert table["local_search"].item() == 70.85
    assert table["reached"].item() == pytest.approx(2 / 3)
    assert table["lowest"].item() == 70.84
    assert beside_local_search(ends_of({"annealing": [0.0]}, grid="5x5")).empty


def test_summary_and_curves_over_seeds():
    table = summary(ends_of({"improve": [1.0, 3.0, 8.0]}))
    assert table["best"].item() == 4.0
    assert table["best_sd"].item() == pytest.approx(np.std([1, 3, 8], ddof=1))
    assert table["best_of_all"].item() == 8.0
    logged = [(0, 100, 1.0), (0, 200, 5.0), (0, 400, 6.0), (1, 100, 3.0), (1, 350, 4.0), (1, 410, 8.0)]
    rows = pd.DataFrame(logged, columns=["seed", "scored", "best"]).assign(
        grid="5x5", budget="400", method="improve", moment="running"
    )
    curve = anytime(rows, points=3).set_index("scored")["best"]
    assert curve.to_dict() == {100.0: 2.0, 200.0: 4.0, 400.0: 5.0}
