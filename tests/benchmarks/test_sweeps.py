"""Sweeps: a file becomes trials, trials become tables; the same ones on any number of workers."""

from __future__ import annotations

import json
import math
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from benchmarks.cli.app import main
from benchmarks.sweeps import Sweep, SweepError, run_sweep
from benchmarks.sweeps.analysis import for_reading
from benchmarks.sweeps.run import run_search
from legible_envs.workspace import make_workspace

KITCHEN = {"workspace": "overcooked", "shape": [5, 5], "prefix": "sum"}
SMALL = {"workspaces": [KITCHEN], "emitters": ["improve", "random"], "evaluations": 400, "seeds": 2}


def test_every_combination_is_one_trial() -> None:
    plan = Sweep.from_dict(
        {
            "workspaces": ["overcooked", KITCHEN],
            "emitters": ["improve", {"emitter": "improve", "fanout": 8, "label": "narrow"}, "random"],
            "objectives": ["legibility", "efficiency"],
            "evaluations": [100, 200],
            "seeds": [3, 5],
        }
    )
    variants = list(plan.variants())
    assert len(variants) == 2 * 3 * 2 * 2 * 2
    assert len({json.dumps(variant.trial, sort_keys=True) for variant in variants}) == len(variants)
    assert {variant.labels["workspace"] for variant in variants} == {"overcooked", "overcooked shape=5x5 prefix=sum"}
    assert {variant.labels["emitter"] for variant in variants} == {"improve", "narrow", "random"}
    assert [variant.labels["seed"] for variant in variants[:4]] == [3, 5, 3, 5]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"workspaces": []}, "`workspaces` must have at least 1 entry, got 0"),
        ({"workspaces": 3}, "`workspaces` must be a name, a table or a list of these, got 3"),
        ({"emitters": 0.5}, "`emitters` must be a name, a table or a list of these, got 0.5"),
        ({"seeds": True}, "`seeds` must be a list or an integer .* got True"),
        ({"grid": 1}, "unknown key 'grid'; known: name, workspaces, emitters"),
        ({"workspaces": [{"shape": [5, 5]}]}, "key `workspace`"),
        ({"workspaces": ["kitchen"]}, "kitchen"),
        ({"workspaces": [{"workspace": "overcooked", "shape": [2, 2]}]}, "workspace 'overcooked shape=2x2'"),
        ({"workspaces": [KITCHEN, KITCHEN]}, "more than once"),
        ({"emitters": ["nobody"]}, "emitter 'nobody'"),
        ({"emitters": [{"emitter": "improve", "speed": 3}]}, "no option speed"),
        ({"objectives": ["beauty"]}, r"`objectives\[0\]` must be .* got 'beauty'"),
        ({"evaluations": 0}, r"`evaluations\[0\]` must be an integer >= 1, got 0"),
        ({"evaluations": "many"}, r"`evaluations\[0\]` must be an integer"),
        ({"seeds": []}, "empty"),
        ({"predictors": ["crystal-ball"]}, "crystal-ball"),
        ({"people": 3}, "`people` must be a mapping, got 3"),
        ({"people": {"participants": 0}}, "`people.participants` must be an integer from 1 to 100000, got 0"),
        ({"people": {"participants": "a"}}, "`people.participants` must be .*got 'a'"),
        ({"predictors": ["bayesian", "bayesian"]}, "`predictors` .*more than once"),
        ({"predictors": 3}, "`predictors` must be a text or a list of texts, got 3"),
        ({"workspaces": [KITCHEN | {"predictors": []}], "predictors": ["crystal-ball"]}, "crystal-ball"),
        (
            {"workspaces": [KITCHEN | {"people": {}, "predictors": []}], "people": 3},
            "`people` must be a mapping, got 3",
        ),
        ({"workspaces": [KITCHEN | {"label": 3}]}, r"`workspaces\[0\].label` must be a non-empty text, got 3"),
        (
            {"workspaces": [KITCHEN | {"shape": date(2020, 1, 1)}]},
            r"`workspaces\[0\]\.shape` must be .* date or time 2020-01-01",
        ),
        ({"workspaces": [KITCHEN | {"beta": math.nan}]}, r"`workspaces\[0\]\.beta` must be a finite number, got nan"),
        ({"workspaces": [KITCHEN | {"beta": "a"}]}, "`beta` must be"),
        ({"workspaces": [KITCHEN | {"a b": 1}]}, "a b"),
        ({"workspaces": [[]]}, r"`workspaces\[0\]` must be a name or a table .* got \[\]"),
        ({"emitters": [{"emitter": "improve", "climbs": "a"}]}, "`climbs` must be an integer"),
        ({"emitters": [{"emitter": "ribs.emitters:GaussianEmitter"}]}, "sigma"),
        ({"emitters": [{"emitter": "ribs.emitters:GaussianEmitter", "sigma": "a"}]}, "GaussianEmitter sigma=a"),
        ({"emitters": [3]}, r"`emitters\[0\]` must be a name or a table"),
        ({"evaluations": [5, 5]}, "`evaluations` has 5 more than once"),
        ({"evaluations": 10**30}, r"`evaluations\[0\]` must be an integer from 1 to"),
        ({"seeds": 10**200}, "`seeds` must be a number of at most 128 bits, got 1000"),
        ({"workspaces": 2**63}, "`workspaces` must be a name, a table or a list of these, got 9223372036854775808"),
        (
            {"emitters": [{"emitter": "improve", "batch_size": math.inf}]},
            r"`emitters\[0\].batch_size` must be a finite",
        ),
        ({"objectives": [3]}, r"`objectives\[0\]` must be "),
        ({"seeds": 10**9}, "`seeds` must be a list or an integer from 1"),
        ({"seeds": [1, -1]}, "`seeds` must be an integer >= 0, got -1"),
        ({"seeds": 900_000, "evaluations": [1, 2]}, "that makes 3,600,000 searches"),
        ({"name": "a/b"}, "`name` must be the name of a file"),
        ({"name": 3}, "`name` must be the name of a file .* got 3"),
        ({"workspace": ["overcooked"]}, "unknown key 'workspace' \\(did you mean `workspaces`\\?\\)"),
        ({"predictors": ["bayesian"], "people": {"population": "nobody"}}, "people of .*`population` must be one of"),
        (
            {"workspaces": ["overcooked", "tabletop"], "predictors": ["bayesian"]},
            "'bayesian', people of workspace 'tabletop' .*is for trajectories in kitchens",
        ),
    ],
)
def test_what_cannot_be_run_is_named_before_anything_runs(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SweepError, match=message):
        Sweep.from_dict(SMALL | change)


def test_files_are_named_in_errors(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text("seeds = = 3")
    with pytest.raises(SweepError, match=r"broken\.toml: not valid TOML"):
        Sweep.from_toml(broken)
    broken.write_text("seeds = 3")
    with pytest.raises(SweepError, match=r"broken\.toml: the sweep lacks the key `workspaces`"):
        Sweep.from_toml(broken)


def test_results_hold_what_was_searched_and_do_not_depend_on_workers(tmp_path: Path) -> None:
    plan = Sweep.from_dict(SMALL)
    alone = run_sweep(plan, tmp_path / "a", workers=1)
    many = run_sweep(plan, tmp_path / "b", workers=2)
    pd.testing.assert_frame_equal(alone, many)
    assert alone["seed"].tolist() == [0, 1, 0, 1]
    workspace = make_workspace(KITCHEN)
    for row in alone.to_dict("records"):
        genome = np.array(json.loads(row["best_genome"]), dtype=workspace.genome_dtype)
        assert workspace.legibility(genome) == row["legibility"] == row["best"]
        assert workspace.distance(genome) == row["distance"]
    written = pd.read_csv(tmp_path / "a" / "results.csv")
    np.testing.assert_allclose(written["best"], alone["best"], rtol=1e-15)
    summary = pd.read_csv(tmp_path / "a" / "summary.csv")
    assert summary["seeds"].tolist() == [2, 2]
    np.testing.assert_allclose(summary["best_mean"][0], alone["best"][:2].mean())


def test_predictors_are_evaluated_in_the_best_layouts(tmp_path: Path) -> None:
    people = {"predictors": ["shortest-distance", "bayesian"], "people": {"participants": 2, "executions": 1}}
    plan = Sweep.from_dict(SMALL | people | {"emitters": "random", "seeds": 1})
    table = run_sweep(plan, tmp_path, workers=1)
    for name in ("accuracy.shortest-distance", "accuracy.bayesian"):
        assert 0.1 < table[name][0] <= 1


def test_what_was_not_measured_is_a_dash() -> None:
    settings = {"objective": "legibility", "emitter": "improve", "evaluations": 300}
    table = pd.DataFrame(
        [settings | {"workspace": name, "seed": 0, "best": 1.5, "distance": 2.0, "coverage": 0.5} for name in "ab"]
    ).assign(**{"accuracy.bayesian": [0.75, np.nan]})
    assert [row["accuracy.bayesian"] for row in for_reading(table)] == ["0.75", "–"]


def test_predictors_that_cannot_be_evaluated_are_named_with_their_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trajectories of few participants may all have one goal: a fact of the data, and no reason to lose the search."""
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace

    simulate = OvercookedWorkspace.simulate

    def one_goal(self, genome, num_participants, rng, **settings):
        trajectories = simulate(self, genome, num_participants, rng, **settings)
        return [each for each in trajectories if each.goal == trajectories[0].goal]

    monkeypatch.setattr(OvercookedWorkspace, "simulate", one_goal)
    trial = next(Sweep.from_dict(SMALL | {"emitters": "random", "seeds": 1}).variants()).trial
    for predictors, missing in ((["shortest-distance", "grid-logistic"], ["grid-logistic"]), (["grid-logistic"],) * 2):
        row = run_search({**trial, "predictors": predictors, "people": {"participants": 3}})
        assert row["best"] is not None
        assert [name for name in predictors if row[f"accuracy.{name}"] is None] == missing
        assert all("nothing to tell apart" in row[f"omitted.{name}"] for name in missing)
    labels = {"workspace": "a", "objective": "b", "emitter": "c", "evaluations": 1}
    rows = pd.DataFrame([labels | {"seed": seed} | row for seed in (0, 1)])
    rows.loc[1, "accuracy.grid-logistic"] = 0.5
    assert for_reading(rows)[0]["accuracy.grid-logistic"] == "0.5 (1 of 2 seeds)"


def test_workspaces_may_have_predictors_of_their_own() -> None:
    table = {"workspace": "tabletop", "predictors": ["reach-knn"], "people": {"participants": 3}}
    plan = Sweep.from_dict(SMALL | {"workspaces": [KITCHEN, table], "predictors": ["bayesian"], "seeds": 1})
    trials = {variant.labels["workspace"]: variant.trial for variant in plan.variants()}
    assert set(trials) == {"overcooked shape=5x5 prefix=sum", "tabletop"}
    assert trials["overcooked shape=5x5 prefix=sum"]["predictors"] == ["bayesian"]
    assert trials["tabletop"]["predictors"] == ["reach-knn"]
    assert trials["tabletop"]["people"] == {"participants": 3}
    assert trials["tabletop"]["workspace"] == {"workspace": "tabletop"}


def test_the_command_runs_what_is_missing_and_tells_of_failures(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    lines = ['workspaces = [{workspace = "overcooked", shape = [5, 5], label = "small"}]', "evaluations = 300"]
    file.write_text("\n".join(lines))
    arguments = ["sweep", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]
    first = CliRunner().invoke(main, arguments)
    assert first.exit_code == 0, first.output
    assert "small" in first.output
    trial = next((tmp_path / "out" / "cells").glob("*.json"))
    stamp = trial.stat().st_mtime_ns
    assert CliRunner().invoke(main, arguments).exit_code == 0
    assert trial.stat().st_mtime_ns == stamp
    file.write_text(
        "\n".join([lines[0], "evaluations = 3000", 'emitters = ["tests.benchmarks.trial_functions:stuck"]'])
    )
    failed = CliRunner().invoke(main, arguments)
    assert failed.exit_code == 1
    assert "1 of 1 trial failed 2 times" in failed.output
    assert "nowhere to go" in failed.output
    wrong = CliRunner().invoke(main, ["sweep", str(tmp_path / "none.toml")])
    assert wrong.exit_code == 2
