"""The panels of a search of tables: the sorted baseline and the best layout of every condition."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from legible_envs.support.names import check_file_name
from legible_envs.support.plain_data import parse_json
from legible_envs.support.text import read_text
from optimizers.errors import SearchError

if TYPE_CHECKING:
    from benchmarks.presenters.base import Panel
    from optimizers import SearchResult

__all__ = ["CONDITIONS", "LIST", "beta_of", "listed", "panels_of", "write_panels"]

CONDITIONS: Final = {
    "placement": "Placement Optimized",
    "obstacles": "Virtual Obstacle Optimized",
    "both": "Both Optimized",
}
"""Conditions of the workspace and their titles, in the order of the paper's figure."""
LIST: Final = "conditions.json"
"""File in a run's folder that says which conditions were searched together."""


def panels_of(run: SearchResult) -> list[Panel]:
    """The sorted baseline and the best layout of every condition searched in a run's folder.

    A condition whose search has not found anything yet is left out.
    """
    from benchmarks.presenters.base import Panel
    from optimizers import load_run

    runs = {run.config["workspace"]["condition"]: run}
    root = _folder_of(run)
    for name, folder in listed(root).items():
        if folder != ".":
            try:
                found_there = load_run(root / folder)
            except SearchError:
                continue
            if found_there.best_genome is not None:
                runs[name] = found_there
    workspace: Any = run.workspace
    baseline, scorer = workspace.baseline, workspace.scorer
    found = [("Baseline", baseline, "objects sorted by colour and shape")]
    for name, title in CONDITIONS.items():
        if name in runs:
            layout = runs[name].workspace.decode(runs[name].require_genome())
            count = len(layout.obstacles)
            note = f"the best layout found, with {count} virtual obstacle{'' if count == 1 else 's'}"
            found.append((title, layout, "the best layout found" if name == "placement" else note))
    panels = []
    for title, layout, note in found:
        scores = scorer.score_layouts([layout])
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


def write_panels(run: SearchResult, path: Path | None = None) -> Path:
    """Write the figure of a run's panels and the desired configuration; ``boards.png`` in its folder if no path."""
    from legible_envs.tabletop.rendering import draw_panels, save_png

    workspace: Any = run.workspace
    layouts = {panel.name: panel.layout for panel in panels_of(run)}
    picture = draw_panels(layouts, workspace.task, scorer=workspace.scorer, beta=beta_of(workspace))
    return save_png(path or _folder_of(run) / "boards.png", picture)


def _folder_of(run: SearchResult) -> Path:
    """Where a search that was read back lies."""
    if run.folder is None:
        raise SearchError("a search without a folder has no conditions beside it: give search() a checkpoint folder")
    return run.folder


def listed(folder: Path) -> dict[str, str]:
    """Conditions searched together, each with its folder; empty where there is one only."""
    try:
        data = parse_json(read_text(folder / LIST))
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise SearchError(f"{folder / LIST} is not valid JSON: {error}") from error
    if not isinstance(data, dict) or not set(data) <= set(CONDITIONS) or not all(map(_is_name, data.values())):
        raise SearchError(f"{folder / LIST} must map conditions {list(CONDITIONS)} to folders")
    folders = dict(data)
    for key, name in folders.items():  # the file may come from a stranger, and searches write there
        if name != ".":
            check_file_name(f"the folder of `{key}` in {folder / LIST}", name, error=SearchError)
    return folders


def _is_name(value: object) -> bool:
    return isinstance(value, str) and bool(value)


def beta_of(workspace: Any) -> float:
    """Rationality per metre of a workspace; without one, the field's usual value."""
    return 20.0 if workspace is None else float(workspace.observer.beta)
