"""The analysis of a study: what is there is found, what is not is not, and few participants are no crash."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.predictor_settings import PredictorSetting
from benchmarks.experiments.trial_rows import accuracy_rows
from benchmarks.study.analysis.data import read_export
from benchmarks.study.analysis.export import export
from benchmarks.study.analysis.findings import find, settings_of
from benchmarks.study.analysis.measures import compare_family, trend_rows
from benchmarks.study.analysis.report import analyse
from benchmarks.study.analysis.settings import AnalysisSettings, Claim, claims_of, published_for, settings_for
from benchmarks.study.analysis.simulating import simulate_people
from benchmarks.study.design.study import Study
from legible_envs.rollouts import record_episode
from tests.support.recorded_study import (
    BOLTZMANN,
    Recorder,
    kitchen_study,
    new_database,
    person_of,
    player_of,
    record_study,
    table_study,
)

NEAREST = PredictorSetting("shortest distance", "shortest-distance", learns=False)
NEIGHBOURS = PredictorSetting("k-NN", "grid-knn")
FAST = AnalysisSettings((NEAREST, NEIGHBOURS), repeats=1, curve_repeats=4, shares=(0.25, 1.0))
TWO = ("Random", "Legible")


def workload(item: Any, condition: str, rng: np.random.Generator) -> Any:
    """Answers of people whom Random costs more."""
    if item.kind == "slider":
        return float(np.clip(5 * rng.integers(6, 11) + (30 if condition == "Random" else 0), 0, 100))
    return {"likert": 4, "attention": "blue", "text": "fine"}.get(item.kind)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    """Ten participants in two kitchens."""
    study = kitchen_study(tmp_path_factory.mktemp("study"), conditions=TWO)
    return study, record_study(study, 10, answer=workload)


@pytest.fixture(scope="module")
def analysed(recorded: tuple[Study, Path]) -> Any:
    study, path = recorded
    return analyse(study, path, study.folder / "analysis", settings=FAST, treatment="Legible")


def _direct(study: Study, number: int) -> list[Any]:
    """The same person at play without a study: the environment and the same source of randomness."""
    import gymnasium as gym

    import legible_envs  # noqa: F401
    from benchmarks.study.timeline import timeline

    order = [TWO[(i + number) % 2] for i in range(2)]
    found = []
    for index, screen in enumerate(timeline(study, order)):
        if screen.kind != "round":
            continue
        rng = np.random.default_rng((number, index))
        seed = int(rng.integers(2**31))
        settings = {"recipes": study.content.kitchen.soups, "layout": study.layout_of(screen.condition)}
        env = gym.make("LegibleOvercooked-v0", max_episode_steps=5000, **settings)
        player = player_of(study, env, person_of(study, number), rng)
        labels = {"participant": f"P{number:03d}", "condition": screen.condition, "layout_name": screen.condition}
        found += record_episode(env, player, seed=seed, **labels)
    return [each for each in found if len(each.candidates) > 1]


def test_accuracy_is_that_of_the_same_people_simulated_directly(recorded: tuple[Study, Path], analysed: Any) -> None:
    study, _ = recorded
    direct = [each for number in range(1, 11) for each in _direct(study, number)]
    rows = analysed.findings.readings.tables["accuracy"]
    for condition in TWO:
        own = [each for each in direct if each.condition == condition]
        made = accuracy_rows(NEAREST.make(), own, folds=4, repeats=1, seed=0, starts=False)
        table = pd.DataFrame([row for row in made if row["table"] == "accuracy"])
        ours = rows[(rows["predictor"] == NEAREST.label) & (rows["condition"] == condition)]
        keys = ["participant", "fraction"]
        both = ours.merge(table, on=keys, suffixes=("", "_direct"))
        assert len(both) == len(ours) == len(table) == 90
        np.testing.assert_array_equal(both["correct"], both["correct_direct"])


def test_accuracy_is_within_sampling_error_of_other_people_of_the_same_kind(
    recorded: tuple[Study, Path], analysed: Any
) -> None:
    """Two samples of one population: their means differ by less than 3.5 standard errors in every condition."""
    study, _ = recorded
    others = simulate_people(study, 20, np.random.default_rng(5), people=BOLTZMANN)
    rows = analysed.findings.readings.tables["accuracy"]
    ours = rows[rows["predictor"] == NEAREST.label].groupby(["condition", "participant"])["correct"].mean()
    for condition in TWO:
        own = [each for each in others.trajectories if each.condition == condition]
        made = accuracy_rows(NEAREST.make(), own, folds=4, repeats=1, seed=0, starts=False)
        table = pd.DataFrame([row for row in made if row["table"] == "accuracy"])
        theirs = table.groupby("participant")["correct"].mean()
        error = (ours[condition].var() / len(ours[condition]) + theirs.var() / len(theirs)) ** 0.5
        assert 0 < error < 0.1
        assert abs(ours[condition].mean() - theirs.mean()) < 3.5 * error


def test_what_participants_answered_is_found_and_nothing_else(analysed: Any) -> None:
    scales = analysed.findings.scales.tests.set_index("measure")
    assert scales["p_holm"]["tlx: workload"] < 0.001
    pairs = analysed.findings.scales.pairs.set_index("measure").loc["tlx: workload"]
    assert (pairs["a"], pairs["b"]) == TWO
    assert 20 < pairs["difference"] < 40
    assert "tlx: ease" not in scales.index  # everybody answered 4 everywhere: there is nothing to test
    assert analysed.findings.trends["p_holm"].min() > 0.01


def test_tables_figures_and_page_are_written(recorded: tuple[Study, Path], analysed: Any) -> None:
    folder = analysed.report.parent
    tables = {path.stem for path in (folder / "tables").glob("*.csv")}
    wanted = {"metrics", "anova", "published", "verdicts", "hypotheses", "work_means", "scale_tests", "participants"}
    assert wanted <= tables
    figures = {path.name for path in (folder / "figures").iterdir()}
    assert {"layouts.png", "accuracy_shortest_distance.svg", "learning_k_nn.svg", "published.svg", "work.svg",
            "questionnaires.svg", "confusion_legible.svg"} <= figures  # fmt: skip
    page = analysed.report.read_text()
    for title in ("Participants", "Beside the paper", "Hypotheses", "Questionnaires", "What cannot be said"):
        assert f">{title}<" in page
    assert "worker-secret" not in page
    assert json.loads((folder / "data" / "manifest.json").read_text())["counts"]["included"] == 10


def test_participants_are_the_units_within_which_conditions_are_compared(analysed: Any) -> None:
    found = analysed.findings.comparisons[NEAREST.label]
    assert (found.overall.design, found.overall.unit) == ("within", "participant")
    row = found.overall.anova.iloc[0]
    assert (row["df1"], row["df2"]) == (1, 9)
    hypotheses = analysed.findings.hypotheses["Legible"]
    assert hypotheses.unit == "participant"
    assert set(hypotheses.tests["hypothesis"]) == {"H1", "H2", "H3"}
    first = hypotheses.tests[
        (hypotheses.tests["predictor"] == NEAREST.label) & (hypotheses.tests["hypothesis"] == "H1")
    ]
    pair = found.overall.pairs.iloc[0]
    assert first["difference"].iloc[0] == pytest.approx(-pair["difference"])
    assert first["p"].iloc[0] == pytest.approx(pair["p"])


# -- few participants, and those who do not count ---------------------------------------------------------------------


@pytest.mark.parametrize("make", [kitchen_study, table_study])
@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_participants_still_make_a_report(make: Any, count: int, tmp_path: Path) -> None:
    study = make(tmp_path)
    path = record_study(study, count)
    predictors = (
        NEAREST if study.content.domain == "overcooked" else PredictorSetting("nearest", "shortest-distance",
                                                                              {"metric": "euclidean"}, learns=False),
        NEIGHBOURS if study.content.domain == "overcooked" else PredictorSetting("k-NN", "reach-knn"),
    )  # fmt: skip
    found = analyse(study, path, tmp_path / "out", settings=replace(FAST, predictors=predictors))
    page = found.report.read_text()
    assert "What cannot be said" in page
    assert found.findings.unsaid
    if count < 2:
        assert "nothing can be said about people in general" in page
        assert not found.findings.comparisons
    else:
        assert "intervals are wide" in page


def test_who_does_not_count_is_listed_with_the_reason(tmp_path: Path) -> None:
    study = kitchen_study(tmp_path, conditions=TWO)
    path = tmp_path / "data" / "live.sqlite"
    connection = new_database(path)
    recorder = Recorder(study, connection)
    for number in (1, 2, 3):
        recorder.record(number)
    recorder.record(4, until=6, state="withdrawn")
    connection.close()
    export(study, path, tmp_path / "out")
    data = read_export(tmp_path / "out", exclude=["P002"])
    assert data.participants == ["P001", "P003"]
    assert data.excluded.to_dict("records") == [
        {"participant": "P002", "state": "complete", "why": "excluded by hand"},
        {"participant": "P004", "state": "withdrawn", "why": "not complete"},
    ]
    assert {each.participant for each in data.trajectories} == {"P001", "P003"}
    assert min(len(each.candidates) for each in data.trajectories) == 2
    with pytest.raises(ValueError, match="no participant 'P009' to exclude"):
        read_export(tmp_path / "out", exclude=["P009"])
    export(study, path, tmp_path / "all", include_incomplete=True)
    assert read_export(tmp_path / "all").participants == ["P001", "P002", "P003", "P004"]


def test_sittings_with_and_without_obstacles_are_told_apart(tmp_path: Path) -> None:
    sittings = [{"name": "on"}, {"name": "off", "obstacles": False}, {"name": "again"}]
    study = kitchen_study(tmp_path, conditions=TWO, sittings=sittings)
    assert settings_of(study)["Legible / off"] == ("Legible", "off")
    path = record_study(study, 3)
    export(study, path, tmp_path / "out")
    data = read_export(tmp_path / "out")
    assert {each.layout_name for each in data.trajectories} == set(settings_of(study))
    bare = next(each for each in data.trajectories if each.layout_name == "Random / off")
    assert "V" not in bare.layout.to_ascii()
    found = find(study, data, replace(FAST, predictors=(NEAREST,)), [Claim("Legible", ("Random",))])
    assert found.sittings is not None
    assert {"Legible: completion time, s", "Random: accuracy of shortest distance"} <= set(
        found.sittings.tests["measure"]
    )
    assert set(found.sittings.means["condition"]) == {"on", "off", "again"}
    by_hand = data.tables["rounds"].query("counts == 1 and condition == 'Legible' and sitting != 'off'")
    own = found.work.means.set_index(["measure", "condition"])["mean"]
    expected = by_hand.groupby("participant")["seconds"].mean().mean()
    assert own["completion time, s", "Legible"] == pytest.approx(expected)  # of sittings with obstacles


# -- measures ---------------------------------------------------------------------------------------------------------


def _measured(shift: float, seed: int, people: int = 12) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        habit = rng.normal(0, 3)
        for number, condition in enumerate("abc"):
            rows.append((f"P{person}", condition, "m", habit + shift * number + rng.normal()))
    return pd.DataFrame(rows, columns=["participant", "condition", "measure", "value"])


def test_a_difference_within_people_is_found_under_larger_ones_between_them() -> None:
    found = compare_family(_measured(1.5, 0), list("abc"))
    assert found.tests["p_holm"].iloc[0] < 0.001
    assert found.pairs["difference"].lt(0).all()
    assert (found.tests["df1"].iloc[0], found.tests["df2"].iloc[0]) == (2, 22)


def test_nothing_is_found_where_nothing_is() -> None:
    p = [compare_family(_measured(0.0, seed), list("abc")).tests["p_corrected"].iloc[0] for seed in range(200)]
    assert 0.01 < np.mean(np.array(p) < 0.05) < 0.10


def test_holm_corrects_over_all_measures() -> None:
    parts = [_measured(0.7, seed).assign(measure=f"m{seed}") for seed in range(4)]
    found = compare_family(pd.concat(parts), list("abc")).tests
    smallest = found["p_corrected"].idxmin()
    assert found["p_holm"][smallest] == pytest.approx(min(1.0, 4 * found["p_corrected"][smallest]))


def test_people_who_lack_a_condition_do_not_count_in_tests() -> None:
    table = _measured(1.0, 1)
    table = table[~((table["participant"] == "P3") & (table["condition"] == "b"))]
    found = compare_family(table, list("abc"))
    assert found.tests["participants"].tolist() == [11]
    assert found.means["participants"].tolist() == [12, 11, 12]


def test_a_slope_over_positions_is_found() -> None:
    rng = np.random.default_rng(0)
    rows = [(f"P{p}", "c", at, 50 - 2 * at + rng.normal(), 1.0) for p in range(8) for at in (1, 2, 3, 4)]
    table = pd.DataFrame(rows, columns=["participant", "condition", "position", "seconds", "done"])
    (found,) = trend_rows(table, "position", {"seconds": "time", "done": "done", "other": "other"})
    assert found["measure"] == "time"
    assert found["low"] < -2 < found["high"]
    assert found["p"] < 0.001


# -- what is known of the paper ---------------------------------------------------------------------------------------


def test_the_papers_claims_are_tested_as_far_as_the_study_has_its_conditions() -> None:
    assert claims_of("overcooked", ["Legible", "Random"]) == [Claim("Legible", ("Random",))]
    assert claims_of("overcooked", ["A", "B"]) == []
    assert [claim.treatment for claim in claims_of("tabletop", ["Baseline", "Both", "Placement"])] == [
        "Placement",
        "Both",
    ]
    assert claims_of("overcooked", ["A", "B", "C"], "B") == [Claim("B", ("A", "C"))]
    with pytest.raises(ValueError, match="no condition 'Z'"):
        claims_of("overcooked", ["A", "B"], "Z")
    with pytest.raises(ValueError, match="needs other conditions"):
        claims_of("overcooked", ["A", "B"], "A", ["A"])
    assert published_for("tabletop", ["Both", "Mine"])["Both"]["f1"] == 0.936
    assert settings_for("overcooked").predictors[0].label == settings_for("overcooked", quick=True).predictors[0].label
