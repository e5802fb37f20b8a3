"""The command line on tables: searches of every condition, panels, scores, and bad input in one line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.console import number
from benchmarks.presenters.tabletop_panels import CONDITIONS, panels_of
from legible_envs.tabletop import TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.design.workspace import TabletopWorkspace
from legible_envs.tabletop.scoring.scorer import TabletopScorer
from optimizers import load_run
from tests.support.command_line import legible, page_data, values

SMALL = ("--evaluations", 1200, "--quiet", "--emitter", "improve")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A search of all conditions."""
    folder = tmp_path_factory.mktemp("tables") / "run"
    result = legible("optimize", "tabletop", *SMALL, "--seed", 3, "--out", folder)
    assert result.exit_code == 0, result.output
    return folder


# -- searches ----------------------------------------------------------------------------------------------------------


def test_every_condition_is_a_whole_run(run: Path) -> None:
    files = {"config.json", "metrics.csv", "archive.npz", "best.json", "best.png", "boards.png", "report.html"}
    for condition, folder in (("both", run), ("placement", run / "placement"), ("obstacles", run / "obstacles")):
        assert files <= {path.name for path in folder.iterdir()}
        config = json.loads((folder / "config.json").read_text())
        assert config["workspace"]["condition"] == condition
        assert config["seed"] == 3
        workspace = TabletopWorkspace(condition=condition)  # type: ignore[arg-type]
        layout = TabletopLayout.from_json(folder / "best.json")
        best = config["result"]["best_objective"]
        assert float(workspace.objective("legibility")(workspace.encode(layout)[None])[0]) == pytest.approx(best)
    assert not TabletopLayout.from_json(run / "placement" / "best.json").obstacles
    baseline = TabletopTask.named("columns").layout
    assert TabletopLayout.from_json(run / "obstacles" / "best.json").objects == baseline.objects


def test_show_draws_the_four_panels_and_the_desired_configuration(run: Path, tmp_path: Path) -> None:
    (run / "boards.png").unlink()
    result = legible("show", run)
    assert result.exit_code == 0, result.output
    with Image.open(run / "boards.png") as image:
        width, height = image.size
    assert width > height > 600
    titles = ["Baseline", "Placement Optimized", "Virtual Obstacle Optimized", "Both Optimized"]
    assert [c.name for c in panels_of(load_run(run))] == titles
    for title in titles:
        assert title in result.output
    elsewhere = legible("show", run, "--out", tmp_path / "figure.png")
    assert elsewhere.exit_code == 0
    assert (tmp_path / "figure.png").read_bytes() == (run / "boards.png").read_bytes()


def test_panels_are_the_layouts_of_the_runs_with_their_scores(run: Path) -> None:
    found = {c.name: c for c in panels_of(load_run(run))}
    for condition, title in CONDITIONS.items():
        folder = run if condition == "both" else run / condition
        assert found[title].layout == TabletopLayout.from_json(folder / "best.json")
        workspace = TabletopWorkspace(condition=condition)  # type: ignore[arg-type]
        summary = workspace.summary(found[title].layout)
        assert found[title].score == pytest.approx(summary["score"])
        assert found[title].detour == pytest.approx(summary["mean_detour"])
    assert found["Baseline"].layout == TabletopTask.named("columns").layout
    assert found["Baseline"].score == pytest.approx(TabletopScorer().score_layout(found["Baseline"].layout)["score"])


def test_the_report_shows_map_panels_and_reaches(run: Path) -> None:
    data, source = page_data(run), load_run(run)
    assert len(data["cells"]) == data["archive_size"] == len(source.elites())
    genome = source.elites().solution[0]
    layout = source.workspace.decode(genome)
    drawn = np.array(data["cells"][0][5][: len(layout.objects)]) / 1e4
    np.testing.assert_allclose(drawn, layout.centres, atol=1e-4)
    assert len(data["cells"][0][5]) == len(layout.objects) + len(layout.obstacles)
    assert [c["name"] for c in data["panels"]] == ["Baseline", *CONDITIONS.values()]
    assert all(c["paths"] for c in data["panels"])
    assert data["axes"][1]["labels"] == list(source.workspace.order_names)
    assert data["axes"][0]["labels"][0] == "0.080"
    text = (run / "report.html").read_text(encoding="utf-8")
    assert "Where the best layout loses and wins" in text
    assert len(text) < 300_000
    assert "http://" not in text
    assert "https://" not in text
    obstacles = page_data(run / "obstacles")["axes"]
    assert obstacles[0]["labels"] == ["0", "1", "2", "3", "4"][: obstacles[0]["count"]]
    assert obstacles[1]["labels"][:2] == ["1.00", "1.01"]


def test_score_and_objective_are_told_apart() -> None:
    from types import SimpleNamespace
    from typing import Any

    from benchmarks.cli.optimize import found_lines
    from benchmarks.presenters.registry import presenter_of

    workspace = TabletopWorkspace()
    rng = np.random.default_rng(0)
    genomes = workspace.perturb(workspace.sample(20, rng), 8, rng, phase=1)  # moves and adds obstacles
    genome = genomes[int(np.argmax(workspace.penalty(genomes)))]
    legibility, costs = float(workspace.legibility(genome)), float(workspace.penalty(genome[None])[0])
    assert costs > 0
    objective = float(workspace.objective("legibility")(genome[None])[0])
    assert objective == pytest.approx(legibility - costs)
    found: Any = SimpleNamespace(
        workspace=workspace, config={"objective": {"name": "legibility"}}, require_genome=lambda: genome,
        best_objective=objective, evaluations=1, seconds=0.25,
    )  # fmt: skip
    lines = found_lines(found, presenter_of("tabletop"))
    assert lines[0].startswith(f"legibility {number(legibility)}, distance ")
    assert lines[0].endswith("after 1 evaluation in 0.2 s")
    assert lines[1] == (
        f"objective  {number(objective)}: legibility, net of costs of {number(costs)} (virtual obstacles)"
    )


def test_report_is_written_anew(run: Path) -> None:
    before = (run / "report.html").read_bytes()
    assert legible("report", run).exit_code == 0
    assert (run / "report.html").read_bytes() == before


def test_resume_goes_on_with_every_condition(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(run, out)
    shutil.rmtree(out / "obstacles")  # as if interrupted before the last one
    assert [c.name for c in panels_of(load_run(out))] == ["Baseline", "Placement Optimized", "Both Optimized"]
    result = legible("optimize", "tabletop", "--resume", "--quiet", "--out", out)
    assert result.exit_code == 0, result.output
    for folder in ("obstacles", "placement", "."):
        with np.load(run / folder / "archive.npz") as a, np.load(out / folder / "archive.npz") as b:
            for name in a.files:
                np.testing.assert_array_equal(a[name], b[name])
    refused = legible("optimize", "tabletop", "--resume", "--seed", 9, "--out", out)
    assert refused.exit_code == 2
    assert "seed" in refused.output
    assert legible("optimize", "overcooked", "--resume", "--out", out).exit_code == 2
    assert legible("optimize", "tabletop", *SMALL, "--out", out).exit_code == 2


def test_one_condition_of_another_task_by_the_papers_budget(run: Path, tmp_path: Path) -> None:
    task = tmp_path / "mine.yaml"
    TabletopTask.named("tea").to_yaml(task)
    out = tmp_path / "one"
    one = ("optimize", "tabletop", "--task", task, "--condition", "placement", "--quiet", "--out", out)
    result = legible(*one, "--iterations", 20, 3)
    assert result.exit_code == 0, result.output
    assert not (out / "conditions.json").exists()
    assert [c.name for c in panels_of(load_run(out))] == ["Baseline", "Placement Optimized"]
    assert json.loads((out / "config.json").read_text())["iterations"] == [20, 3]
    again = legible("optimize", "tabletop", "--resume", "--quiet", "--out", out)
    assert again.exit_code == 0, again.output
    assert values(legible("score", out))["task"] == "tea"


def test_a_search_can_start_from_a_table(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "from"
    result = legible(
        "optimize", "tabletop", *SMALL, "--condition", "both", "--start-from", run / "best.json", "--out", out
    )
    assert result.exit_code == 0, result.output
    before = json.loads((run / "config.json").read_text())["result"]["best_objective"]
    assert json.loads((out / "config.json").read_text())["result"]["best_objective"] >= before - 1e-9


# -- single tables -----------------------------------------------------------------------------------------------------


def test_score_says_what_the_workspace_says(run: Path) -> None:
    layout, workspace = TabletopLayout.from_json(run / "best.json"), TabletopWorkspace()
    summary = workspace.summary(layout)
    for source, text in ((run / "best.json", None), (run, None), ("-", layout.to_json())):
        found = values(legible("score", source, text=text))
        assert float(found["legibility"]) == pytest.approx(summary["score"], abs=1e-3)
        assert float(found["mean detour"]) == pytest.approx(summary["mean_detour"], abs=1e-3)
        assert found["distance"] == f"{summary['distance']:.4f} m"
        assert "design rules" not in found
    quarter = values(legible("score", run / "best.json", "--prefix", "0.25"))
    expected = TabletopWorkspace(prefix=(0.25,)).legibility(workspace.encode(layout))
    assert float(quarter["legibility"]) == pytest.approx(expected, abs=1e-3)


def test_a_score_of_a_team_says_what_the_robot_does_alone(tmp_path: Path) -> None:
    task = TabletopTask.named("tea")
    given = {**task.to_dict(), "name": "tea for two"}
    given["task"]["subtasks"][2]["agents"] = "robot"
    team, layout = TabletopTask.from_dict(given), task.layout
    team.to_yaml(tmp_path / "team.yaml")
    found = values(legible("score", "-", "--task", tmp_path / "team.yaml", text=layout.to_json()))
    assert (found["task"], found["robot alone"]) == ("tea for two", "kettle")
    assert float(found["legibility"]) == pytest.approx(TabletopScorer(team).score_layout(layout)["score"], abs=1e-3)
    assert "robot alone" not in values(legible("score", "-", text=layout.to_json()))


def test_tables_outside_the_design_rules_are_scored_and_said_to_be(tmp_path: Path) -> None:
    layout = TabletopTask.named("columns").layout.with_obstacles([VirtualObstacle((0.45, 0.2), 0.3, (0.2, 0.02))])
    layout.to_json(tmp_path / "mine.json")
    result = legible("score", tmp_path / "mine.json")
    assert result.exit_code == 0, result.output
    found = values(result)
    assert float(found["legibility"]) == pytest.approx(TabletopScorer().score_layout(layout)["score"], abs=1e-3)
    assert found["design rules"].startswith("outside: ")
    shown = legible("show", tmp_path / "mine.json", "--out", tmp_path / "mine.png")
    assert shown.exit_code == 0, shown.output
    assert "Reaches that lose most" in shown.output
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")


def test_show_draws_a_table_of_characters(run: Path) -> None:
    result = legible("show", run / "best.json")
    assert result.exit_code == 0, result.output
    assert "--out FILE.png" in result.output
    for mark in ("●r", "▲g", "●b", "▲y"):
        assert mark in result.output


def test_goals_of_recorded_reaches_are_predicted(run: Path, tmp_path: Path) -> None:
    from legible_envs.rollouts import save_trajectories
    from legible_envs.tabletop.humans import sample_person, simulate_task

    layout, rng = TabletopLayout.from_json(run / "best.json"), np.random.default_rng(0)
    reaches = simulate_task(layout, sample_person(rng), rng, task=TabletopTask.named("columns"))
    save_trajectories(tmp_path / "reaches.npz", reaches)
    result = legible("score", run / "best.json", "--trajectories", tmp_path / "reaches.npz")
    assert result.exit_code == 0, result.output
    assert "Eq. 1, shortest paths" in result.output
    TabletopTask.named("columns").layout.to_json(tmp_path / "sorted.json")
    elsewhere = legible("score", tmp_path / "sorted.json", "--trajectories", tmp_path / "reaches.npz")
    assert elsewhere.exit_code == 2
    assert "on this table" in elsewhere.output


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "text", "message"),
    [
        (("score", "-"), "{}", "schema"),
        (("score", "-"), '{"schema": 1, "objects": []}', "object"),
        (("score", "-"), '{"schema": 1, "objects": [{"name": "x", "at": [0.3, 0.3]}]}', "--task"),
        (("score", "-", "--task", "dinner"), '{"schema": 1, "objects": [{"name": "x", "at": [0.3, 0.3]}]}', "dinner"),
        (("score", "broken.json"), None, "not valid JSON"),
        (("score", "best.json", "--pots", "1"), None, "--pots does not apply"),
        (("play", "best.json"), None, "expected a kitchen"),
        (("optimize", "tabletop", "--shape", "7", "7"), None, "--shape is about a kitchen"),
        (("optimize", "overcooked", "--condition", "both"), None, "--condition is about a table"),
        (("optimize", "tabletop", "--condition", "neither"), None, "neither"),
        (("optimize", "tabletop", "--task", "dinner"), None, "dinner"),
        (("optimize", "tabletop", "--task", "no.yaml"), None, "no.yaml"),
        (("optimize", "tabletop", "--prefix", "sum"), None, "sum"),
        (("optimize", "tabletop", "--evaluations", "5", "--iterations", "2", "2"), None, "not both"),
        (("optimize", "tabletop", "--start-from", "kitchen.txt"), None, "expected a table"),
        (("optimize", "overcooked", "--start-from", "best.json"), None, "expected a kitchen"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], text: str | None, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "kitchen.txt").write_text("XTXPXXX\nX     O\nX V   X\nC     X\nX   V F\nX     X\nXXDXSXX\n")
    TabletopTask.named("columns").layout.to_json(tmp_path / "best.json")
    result = legible(*arguments, text=text)
    assert result.exit_code == 2, result.output
    errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert "Traceback" not in result.output
    assert not (tmp_path / "runs").exists(), "nothing is written where a search cannot begin"
