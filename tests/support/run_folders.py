"""Run folders made without a search, for the tests of what reads them."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from legible_envs.overcooked import OvercookedWorkspace

COLUMNS = ["iteration", "phase", "evaluations", "seconds", "best", "qd_score", "coverage", "elites"]
COLUMNS += ["evaluations_per_second"]


def write_run(folder: Path, workspace: OvercookedWorkspace, elites: int, *, rows: int = 40, **config: Any) -> Path:
    """A run whose archive holds up to ``elites`` random layouts, one per cell, and made-up curves."""
    rng = np.random.default_rng(0)
    genomes = np.concatenate([workspace.sample(4 * elites, rng, obstacle_rate=rate) for rate in (0.05, 0.2, 0.35)])
    measures = workspace.measures(genomes)
    index = (measures[:, 0] * workspace.archive_dims[1] + measures[:, 1]).astype(np.int64)
    _, first = np.unique(index, return_index=True)
    kept = rng.permutation(first)[:elites]
    return write_run_of(folder, workspace, genomes[kept], index[kept], rows=rows, **config)


def write_full_run(folder: Path, workspace: OvercookedWorkspace) -> Path:
    """A run with something in every cell; the genomes repeat, only their number and size matter."""
    cells = workspace.archive_dims[0] * workspace.archive_dims[1]
    genomes = workspace.sample(cells, np.random.default_rng(0), obstacle_rate=0.3)
    return write_run_of(folder, workspace, genomes, np.arange(cells), rows=2000)


def write_run_of(
    folder: Path, workspace: OvercookedWorkspace, genomes: Any, index: Any, *, rows: int = 40, **config: Any
) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    objective = workspace.legibility(genomes)
    columns = workspace.archive_dims[1]
    measures = np.column_stack([index // columns, index % columns]).astype(float)
    np.savez(folder / "archive.npz", solution=genomes, objective=objective, measures=measures, index=index)
    best = int(np.argmax(objective))
    manifest = {
        "schema": 1,
        "versions": {"python": "3.12.0", "legible-envs": "0.1.0"},
        "created": "2026-01-02T03:04:05+00:00",
        "git_revision": None,
        "platform": "a machine",
        "workspace": workspace.to_config(),
        "objective": {"name": "legibility", "max_distance": None},
        "emitter": {"name": "improve", "options": {}, "settings": {"climbs": 64}},
        "archive": {
            "dims": list(workspace.archive_dims),
            "ranges": workspace.archive_ranges,
            "measure_names": list(workspace.measure_names),
            "score_floor": workspace.score_floor,
        },
        "seed": 0,
        "evaluations": 1000,
        "calibration": None,
        "result": {
            "best_objective": float(objective[best]),
            "best_genome": genomes[best].tolist(),
            "evaluations": 1000,
        },
        **config,
    }
    (folder / "config.json").write_text(json.dumps(manifest), encoding="utf-8")
    with (folder / "metrics.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        for i in range(rows):
            writer.writerow([i, "search", 1000 + 500 * i, i / 10, 1 - 1 / (i + 1), 10 * i, i / rows, i, 5000])
    return folder
