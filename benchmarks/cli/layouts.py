"""What ``legible score`` and ``legible show`` say about one layout."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.console import number, table
from benchmarks.presenters.base import loss_row

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.presenters.base import Design
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["read_people", "score_lines", "show_design", "walks_in"]

WORST_ROWS, BEST_ROWS = 10, 3
"""Rows of the tables of losses and gains that the terminal shows."""


def score_lines(design: Design) -> list[str]:
    """The score of a layout as lines of ``name value``, for people and for ``grep``."""
    return [f"{name:<15} {value}" for name, value in design.facts()]


def show_design(console: Console, design: Design, picture: Path | None) -> None:
    """Print a layout, its score and its losses; write a picture of it if asked to, and of a run what it has."""
    from rich.columns import Columns

    lines = "\n".join(score_lines(design))
    console.print(Columns([design.text(console), lines], padding=(1, 4)))
    rows = design.explain()
    worst, best = rows[:WORST_ROWS], rows[WORST_ROWS:][: -BEST_ROWS - 1 : -1]
    if worst:
        console.print("\nReaches that lose most (contributions sum to the score)", style="bold")
        console.print(table([loss_row(row) for row in worst]))
    if rest := rows[WORST_ROWS : len(rows) - len(best)]:
        total = math.fsum(row["contribution"] for row in rest)
        console.print(f"and {len(rest)} more reaches, together {number(total)}", style="dim")
    if best:
        console.print("\nReaches that win most", style="bold")
        console.print(table([loss_row(row) for row in best]))
    if compared := design.compared():
        console.print("\nCompared", style="bold")
        console.print(table(compared))
    written = design.write_picture(picture)
    if written is None:
        console.print("where goals are in doubt, as a picture: add --out FILE.png", style="dim")
    else:
        console.print(f"{written[0]}: {written[1]}", soft_wrap=True)


def read_people(console: Console, design: Design, trajectories: Path) -> None:
    """Print how well the heuristic and Eq. 1 read recorded walks made here, by share observed.

    Raises:
        ValueError: The file holds no walks, or none made here.
    """
    from legible_envs.rollouts.trajectory import CUTS

    walks = walks_in(design, trajectories)
    fractions = (0.1, 0.3, 0.5, 0.7, 0.9)
    rows = []
    for name, predictor in design.readers():
        predictor.fit(walks)
        scores = [predictor.score(walks, fractions=(fraction,)) for fraction in fractions]
        rows.append({"predictor": name, **{f"{f:.0%}": s for f, s in zip(fractions, scores, strict=True)}})
    console.print(f"\n{len(walks):,} walks: goals read correctly, by share of the walk observed", style="bold")
    console.print(table(rows))
    console.print(f"definition: fraction f observed means {CUTS['steps']}; ties fractional", style="dim", markup=False)


def walks_in(design: Design, trajectories: Path) -> list[Trajectory]:
    """The walks of a file that were made in this layout; a CSV that names none is taken to mean it.

    Raises:
        ValueError: The file holds no walks, or none made here.
    """
    from legible_envs.rollouts import read_any

    walks = [walk for walk in read_any(trajectories, layout=design.layout) if design.was_walked(walk)]
    if not walks:
        raise ValueError(
            f"{trajectories} has no walk recorded on this {design.thing} (layout id {design.layout.layout_id})"
        )
    return walks
