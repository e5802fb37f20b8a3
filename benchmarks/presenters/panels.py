"""Layouts to be shown side by side, and what the legible one among them costs, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.presenters.base import Panel

if TYPE_CHECKING:
    import numpy.typing as npt

    from legible_envs.workspace import Workspace

__all__ = ["median_of_random", "panel_of", "price_of"]


def median_of_random(workspace: Workspace, count: int, rng: np.random.Generator) -> npt.NDArray[Any]:
    """``(d,)`` the genome that is the median by legibility of so many random layouts."""
    genomes = workspace.sample(count, rng)
    order = np.argsort(workspace.legibility(genomes), kind="stable")
    return np.asarray(genomes[order[len(order) // 2]])


def panel_of(workspace: Workspace, name: str, genome: npt.NDArray[Any], note: str) -> Panel:
    """A layout of a workspace as a panel.

    Args:
        workspace: The design problem.
        name: Title of the panel.
        genome: ``(d,)`` the layout.
        note: How it was chosen.
    """
    summary = workspace.summary(genome)
    return Panel(
        name=name,
        layout=workspace.decode(genome),
        score=summary["score"],
        distance=summary["distance"],
        normalised=summary["normalised"],
        note=note,
    )


def price_of(legible: Panel, other: Panel, *, unit: str, digits: int) -> str:
    """What one layout's distance is beside another's, as one sentence that says what the numbers say.

    Args:
        legible: The layout whose price is asked for.
        other: The one it is compared with.
        unit: Of distances.
        digits: Decimals of distances, as they stand below the panels.
    """

    def far(distance: float) -> str:
        return f"{distance:.{digits}f} {unit}"

    mine, theirs = far(legible.distance), far(other.distance)
    if mine == theirs:
        return f"Legibility costs no distance here: {mine} for one task, as in the {other.name} layout."
    share = 100 * abs(legible.distance / other.distance - 1) if other.distance else 0.0
    much = f"{share:.0f} %" if share >= 1 else "less than 1 %"
    if legible.distance < other.distance:
        return f"Legibility costs no distance here: {mine} for one task, {much} less than in the {other.name} layout."
    return f"Its price is distance: {mine} for one task, {much} more than the {theirs} in the {other.name} layout."
