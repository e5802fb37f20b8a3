"""Output of ``legible score`` and ``legible show`` about one layout."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.console import number, plural, table
from benchmarks.presenters.losses import explains_stages, loss_row, losses_and_gains
from legible_envs.support.names import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from benchmarks.presenters.base import Design
    from benchmarks.reports.prediction_report import PredictionResults
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["evaluation_folder", "print_predictions", "save_evaluation", "score_lines", "show_design", "trajectories_in"]

WORST_ROWS, BEST_ROWS = 10, 3
"""Rows of the tables of losses and gains that the terminal shows."""


def score_lines(design: Design) -> list[str]:
    """The score of a layout as lines of ``name value``, for users and for ``grep``."""
    return [f"{printable(name):<15} {printable(value)}" for name, value in design.facts()]


def show_design(console: Console, design: Design, picture: Path | None) -> None:
    """Print a layout, its score and its losses; write its picture if a path is given, and the panels of a run."""
    from rich.columns import Columns
    from rich.text import Text

    lines = Text("\n".join(score_lines(design)))
    console.print(Columns([design.text(console), lines], padding=(1, 4)))
    _print_explanation(console, design)
    if compared := design.compared():
        console.print("\nCompared", style="bold")
        console.print(table(compared))
    written = design.write_picture(picture)
    if written is not None:
        console.print(f"{written[0]}: {written[1]}", soft_wrap=True, markup=False)
    elif design.picture:
        console.print(f"{design.picture}, as a picture: add --out FILE.png", style="dim", markup=False)


def _print_explanation(console: Console, design: Design) -> None:
    """Print where the score comes from."""
    rows = design.explain()
    if not explains_stages(rows):
        if rows:
            console.print("\nWhere the score comes from", style="bold")
            console.print(table([loss_row(row) for row in rows[: WORST_ROWS + BEST_ROWS]]))
        return
    worst, best, title = losses_and_gains(rows, WORST_ROWS, BEST_ROWS)
    console.print(f"\n{title} (contributions sum to the score)", style="bold")
    console.print(table([loss_row(row) for row in worst]))
    if rest := rows[len(worst) : len(rows) - len(best)]:
        total = math.fsum(row["contribution"] for row in rest)
        console.print(f"and {plural(len(rest), 'more reach')}, together {number(total)}", style="dim")
    if best:
        console.print("\nReaches that win most", style="bold")
        console.print(table([loss_row(row) for row in best]))


def print_predictions(console: Console, design: Design, recorded: Sequence[Trajectory]) -> None:
    """Print how well the design's predictors predict goals on trajectories recorded here, by share observed.

    Raises:
        ValueError: The workspace comes with no predictors.
    """
    from legible_envs.rollouts.trajectory import CUTS

    if not (predictors := design.predictors()):
        raise ValueError(f"no predictor comes with this {design.noun}; name one with --predictor")
    fractions = (0.1, 0.3, 0.5, 0.7, 0.9)
    rows = []
    for name, predictor in predictors:
        predictor.fit(recorded)
        scores = [predictor.score(recorded, fractions=(fraction,)) for fraction in fractions]
        rows.append({"predictor": name, **{f"{f:.0%}": s for f, s in zip(fractions, scores, strict=True)}})
    console.print(
        f"\n{plural(len(recorded), 'trajectory')}: goals predicted correctly, by share observed", style="bold"
    )
    console.print(table(rows))
    console.print(f"definition: fraction f observed means {CUTS['steps']}; ties fractional", style="dim", markup=False)


def trajectories_in(design: Design, source: str) -> list[Trajectory]:
    """The trajectories of a file or Minari data set that were recorded in this layout; a CSV that names none means it.

    Raises:
        FileNotFoundError: There is no such file or data set.
        ValueError: It holds no trajectories, or none recorded here.
    """
    from legible_envs.rollouts import load_trajectories

    recorded = [each for each in load_trajectories(source, layout=design.layout) if design.recorded_here(each)]
    if not recorded:
        named = getattr(design.layout, "layout_id", None)
        about = f" (layout id {named})" if named is not None else ""
        raise ValueError(f"{source} has no trajectory recorded on this {design.noun}{about}")
    return recorded


def evaluation_folder(layout: str, out: Path | None) -> Path | None:
    """Where an evaluation is written: ``out``, or a folder within a run; None for neither."""
    from benchmarks.reports.prediction_report import FOLDER
    from optimizers import is_run_folder

    if out is None and layout != "-" and is_run_folder(layout):
        return Path(layout) / FOLDER
    return out


def save_evaluation(results: PredictionResults, layout: str, out: Path | None) -> list[str]:
    """Write results into ``out``, or into the folder and report of a run, and say where.

    Args:
        results: What :func:`.evaluate_trajectories` found.
        layout: The layout as the command line names it; may be a run's folder.
        out: The folder to write into; None takes the run's, and writes nothing without a run.
    """
    from benchmarks.reports.prediction_report import write_evaluation
    from benchmarks.reports.search_report import write_report

    folder = evaluation_folder(layout, out)
    if folder is None:
        return []
    write_evaluation(results, folder)
    lines = [f"tables, figures, page: {folder}"]
    if out is None:
        lines.append(f"report: {write_report(layout)}")
    return lines
