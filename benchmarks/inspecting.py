"""What ``legible score`` and ``legible show`` say about one kitchen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.console import board_for, number, table

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.kitchens import Kitchen
    from legible_envs.rollouts import Trajectory

__all__ = ["read_people", "score_lines", "show_kitchen", "walks_in"]

WORST_ROWS, BEST_ROWS = 10, 3
"""Rows of the tables of losses and gains that the terminal shows."""


def score_lines(kitchen: Kitchen) -> list[str]:
    """The score of a kitchen as lines of ``name value``, for people and for ``grep``."""
    summary = kitchen.summary()
    lines = [
        f"legibility      {number(summary['score'], 4)}",
        f"distance        {number(summary['distance'], 4)}",
        f"normalised      {number(summary['normalised'], 4)}",
        f"single-goal     {_single_goal(summary)}",
        f"obstacles       {summary['num_obstacles']}",
        f"task            {'; '.join(' + '.join(soup) for soup in kitchen.soups)}",
        f"candidate set   {summary['candidate_set']}",
        f"sequences       {summary['num_sequences']:,}",
        f"layout id       {summary['layout_id']}",
    ]
    if kitchen.broken_rule:
        lines.append(f"design rules    outside: {kitchen.broken_rule}")
    return lines


def _single_goal(summary: Mapping[str, Any]) -> str:
    """Part of the score from reaches that cannot be misread; a share only where it means something."""
    part, share = summary["single_goal_score"], summary["single_goal_share"]
    return number(part, 4) + (f" ({share:.1%} of the score)" if 0 <= share <= 1 else "")


def show_kitchen(console: Console, kitchen: Kitchen, picture: Path | None) -> None:
    """Print a kitchen, its score and its losses; write where goals are confused as a picture if asked to."""
    from rich.columns import Columns

    lines = "\n".join(score_lines(kitchen))
    console.print(Columns([board_for(console, kitchen.layout), lines], padding=(1, 4)))
    rows = kitchen.explain()
    worst, best = rows[:WORST_ROWS], rows[WORST_ROWS:][: -BEST_ROWS - 1 : -1]
    console.print("\nReaches that lose most (contributions sum to the score)", style="bold")
    console.print(table([_loss_row(row) for row in worst]))
    if rest := rows[WORST_ROWS : len(rows) - len(best)]:
        total = math.fsum(row["contribution"] for row in rest)
        console.print(f"and {len(rest)} more reaches, together {number(total)}", style="dim")
    if best:
        console.print("\nReaches that win most", style="bold")
        console.print(table([_loss_row(row) for row in best]))
    if picture is None:
        console.print("where goals are confused, as a picture: add --out FILE.png", style="dim")
    else:
        write_ambiguity(kitchen, picture)
        console.print(f"where goals are confused: {picture}")


def _loss_row(row: Mapping[str, Any]) -> dict[str, Any]:
    ties = sorted(row["ties_with"].items(), key=lambda item: -item[1])
    return {
        "from": row["start"],
        "to": row["goal"],
        "among": len(row["goals"]),
        "times": row["weight"],
        "score": row["score"],
        "contribution": row["contribution"],
        "confused with (share of the way)": ", ".join(f"{name} {share:.0%}" for name, share in ties if share > 0)
        or "-",
    }


def write_ambiguity(kitchen: Kitchen, path: Path) -> None:
    """Draw the kitchen with, on each cell, how often an observer would name a wrong goal."""
    from legible_envs.overcooked.rendering import draw_ambiguity, save_png

    heat = kitchen.ambiguity()
    save_png(path, draw_ambiguity(kitchen.layout, heat, tile=72, title="Where goals are confused"))


def read_people(console: Console, kitchen: Kitchen, trajectories: Path) -> None:
    """Print how well the heuristic and Eq. 1 read recorded walks in this kitchen, by share observed.

    Raises:
        ValueError: The file holds no walks, or none of this kitchen.
    """
    from legible_envs.rollouts import CUTS
    from predictors import BayesianGoalPredictor, ShortestDistance

    walks = walks_in(kitchen, trajectories)
    fractions = (0.1, 0.3, 0.5, 0.7, 0.9)
    rows = []
    for name, predictor in (("shortest distance", ShortestDistance()), ("Eq. 1", BayesianGoalPredictor())):
        predictor.fit(walks)
        scores = [predictor.score(walks, fractions=(fraction,)) for fraction in fractions]
        rows.append({"predictor": name, **{f"{f:.0%}": s for f, s in zip(fractions, scores, strict=True)}})
    console.print(f"\n{len(walks):,} walks: goals read correctly, by share of the walk observed", style="bold")
    console.print(table(rows))
    console.print(f"definition: fraction f observed means {CUTS['steps']}; ties fractional", style="dim", markup=False)


def walks_in(kitchen: Kitchen, trajectories: Path) -> list[Trajectory]:
    """The walks of a file that were made in this kitchen; a CSV that names no kitchen is taken to mean it.

    Raises:
        ValueError: The file holds no walks, or none of this kitchen.
    """
    from legible_envs.rollouts_io import read_any

    walks = [walk for walk in read_any(trajectories, layout=kitchen.layout) if _same_cells(walk, kitchen)]
    if not walks:
        raise ValueError(f"{trajectories} has no walk recorded in this kitchen (layout id {kitchen.layout.layout_id})")
    return walks


def _same_cells(walk: Trajectory, kitchen: Kitchen) -> bool:
    """Whether a walk was recorded in this kitchen, wherever players started."""
    cells = getattr(walk.layout, "cells", None)  # a table has none
    return cells is not None and bool(np.array_equal(cells, kitchen.layout.cells))
