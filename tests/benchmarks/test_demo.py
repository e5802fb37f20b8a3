"""The demonstration, end to end on a tiny budget, with and without recordings."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from benchmarks.cli.demo import RANDOM_LAYOUTS, make_panels, recorded_play, run_demo
from legible_envs.datasets.overcooked_2019 import RecordingsError
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace

TINY = {"shape": (5, 5), "evaluations": 3000, "efficient_evaluations": 2000}


def run_it(folder: Path, **settings: object) -> str:
    stream = io.StringIO()
    run_demo(folder, console=Console(file=stream, width=120), **{**TINY, **settings})  # type: ignore[arg-type]
    return stream.getvalue()


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A demonstration without recordings: what it wrote and what it printed."""
    folder = tmp_path_factory.mktemp("demo")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LEGIBLE_DATA", str(folder / "nothing"))
        return folder / "run", run_it(folder / "run", offline=True)


def test_it_leaves_everything_a_user_was_promised(demo: tuple[Path, str]) -> None:
    files = {path.name for path in demo[0].iterdir()}
    assert {"best.png", "boards.png", "best.txt", "archive.npz", "config.json", "metrics.csv", "report.html"} <= files
    best = OvercookedLayout.from_ascii((demo[0] / "best.txt").read_text())
    workspace = OvercookedWorkspace(shape=(5, 5))
    config = json.loads((demo[0] / "config.json").read_text())
    assert workspace.legibility(workspace.encode(best)) == pytest.approx(config["result"]["best_objective"])


def test_it_prints_panels_scores_and_where_the_report_is(demo: tuple[Path, str]) -> None:
    folder, text = demo
    config = json.loads((folder / "config.json").read_text())
    row = next(line for line in text.splitlines() if line.startswith("random"))
    assert row.split() == ["random", "efficient", "legible"]
    assert f"legibility {config['result']['best_objective']:.2f}" in text
    assert "distance" in text
    assert str(folder / "report.html") in text
    assert "Recorded play was left out" in text, "one line says what is missing"


def test_the_report_compares_the_three_panels(demo: tuple[Path, str]) -> None:
    page = (demo[0] / "report.html").read_text()
    start = page.index(">", page.index('id="data"')) + 1
    data = json.loads(page[start : page.index("</script>", start)])
    assert [c["name"] for c in data["panels"]] == ["random", "efficient", "legible"]
    assert data["recorded_play"]["curves"] == []


def test_panels_are_what_they_say() -> None:
    workspace = OvercookedWorkspace(shape=(5, 5))
    rng = np.random.default_rng(0)
    best = workspace.sample(1, rng)[0]
    random, efficient, legible = make_panels(workspace, best, seed=3, evaluations=3000)
    drawn = workspace.sample(RANDOM_LAYOUTS, np.random.default_rng(3))
    scores = workspace.legibility(drawn)
    assert random.score in scores or np.isclose(scores, random.score).any()
    assert (scores < random.score - 1e-9).mean() <= 0.5 <= (scores <= random.score + 1e-9).mean()
    assert efficient.distance <= workspace.distance(drawn).min()
    assert legible.layout == workspace.decode(best)
    for panel in (random, efficient, legible):
        genome = workspace.encode(panel.layout)
        assert panel.score == pytest.approx(workspace.legibility(genome))
        assert panel.distance == pytest.approx(workspace.distance(genome))


def test_it_replaces_an_earlier_demonstration(demo: tuple[Path, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LEGIBLE_DATA", str(demo[0].parent / "nothing"))
    archive = np.load(demo[0] / "archive.npz")["solution"]
    run_it(demo[0], offline=True)
    assert np.array_equal(np.load(demo[0] / "archive.npz")["solution"], archive), "the same seed, the same archive"


def test_no_network_is_one_line_not_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from legible_envs.datasets import overcooked_2019 as recordings

    def refuse(*_: object, **__: object) -> None:
        raise RecordingsError("no package index\ncan be reached")

    monkeypatch.setattr(recordings, "fetch_recordings", refuse)
    assert recorded_play(tmp_path) == {"note": "Recorded play was left out: no package index can be reached"}


@pytest.mark.slow
@pytest.mark.data
def test_recorded_play_agrees_with_every_walk_scored_by_itself() -> None:
    from benchmarks.experiments.prediction.run import score_every_trajectory
    from benchmarks.experiments.prediction.sweep import UNTRAINED

    walks = score_every_trajectory(predictors=UNTRAINED, repeats=1)
    summary = recorded_play(fetch=False)
    for curve in summary["curves"]:
        own = walks[walks["predictor"] == curve["label"]]
        for fraction, value in zip(summary["fractions"], curve["values"], strict=True):
            assert value == pytest.approx(own[np.isclose(own["fraction"], fraction)]["correct"].mean())
    table = pd.DataFrame(summary["table"]["rows"], columns=summary["table"]["columns"])
    assert (
        table["trajectories"].sum()
        == walks["trajectory"].groupby([walks["layout"], walks["predictor"]]).nunique().sum() / 2
    )
    for _, row in table.iterrows():
        own = walks[(walks["layout"] == row["kitchen"].replace(" ", "_")) & (walks["predictor"] == "Eq. 1")]
        assert row["Eq. 1"] == pytest.approx(own["correct"].mean())
