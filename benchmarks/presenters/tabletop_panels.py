"""The panels of a search of tables: the sorted baseline and the best layout of every condition."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.runs import Run, RunError, read_run

if TYPE_CHECKING:
    from benchmarks.presenters.base import Panel

__all__ = ["CONDITIONS", "LIST", "beta_of", "listed", "panels_of", "write_panels"]

CONDITIONS: Final = {
    "placement": "Placement Optimized",
    "obstacles": "Virtual Obstacle Optimized",
    "both": "Both Optimized",
}
"""Conditions of the workspace and their titles, in the order of the paper's figure."""
LIST: Final = "conditions.json"
"""File in a run's folder that says which conditions were searched together."""


def panels_of(run: Run) -> list[Panel]:
    """The sorted baseline and the best layout of every condition searched in a run's folder.

    A condition whose search has not found anything yet is left out.
    """
    from benchmarks.presenters.base import Panel

    runs = {run.config["workspace"]["condition"]: run}
    for name, folder in listed(run.folder).items():
        if folder != ".":
            try:
                runs[name] = read_run(run.folder / folder)
                _ = runs[name].best_genome
            except RunError:
                runs.pop(name, None)
    baseline, scorer = run.workspace.baseline, run.workspace.scorer
    found = [("Baseline", baseline, "objects sorted by colour and shape")]
    for name, title in CONDITIONS.items():
        if name in runs:
            layout = runs[name].workspace.decode(runs[name].best_genome)
            count = len(layout.obstacles)
            note = f"the best layout found, with {count} virtual obstacle{'' if count == 1 else 's'}"
            found.append((title, layout, "the best layout found" if name == "placement" else note))
    panels = []
    for title, layout, note in found:
        scores = scorer.layout(layout)
        score = float(scores.legibility[0])
        panels.append(
            Panel(
                name=title,
                layout=layout,
                score=score,
                distance=float(scores.distance[0]),
                normalised=score / scorer.best_possible,
                note=note,
                detour=float(scores.mean_detour[0]),
            )
        )
    return panels


def write_panels(run: Run, path: Path | None = None) -> Path:
    """Write the figure of a run's panels and the desired configuration; ``boards.png`` in its folder if no path."""
    from legible_envs.tabletop.rendering import draw_boards, save_png

    workspace = run.workspace
    layouts = {panel.name: panel.layout for panel in panels_of(run)}
    picture = draw_boards(layouts, workspace.task, scorer=workspace.scorer, beta=beta_of(workspace))
    return save_png(path or run.folder / "boards.png", picture)


def listed(folder: Path) -> dict[str, str]:
    """Conditions searched together, each with its folder; empty where there is one only."""
    try:
        data = json.loads((folder / LIST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise RunError(f"{folder / LIST} is not valid JSON: {error}") from error
    if not isinstance(data, dict) or not set(data) <= set(CONDITIONS):
        raise RunError(f"{folder / LIST} must map conditions {list(CONDITIONS)} to folders")
    return {str(key): str(value) for key, value in data.items()}


def beta_of(workspace: Any) -> float:
    """Rationality per metre of a workspace; without one, the field's usual value."""
    return 20.0 if workspace is None else float(workspace.beta)
