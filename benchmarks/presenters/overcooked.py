"""Kitchens on the command line and in reports: how one is named, scored, printed and drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import click
import numpy as np
import numpy.typing as npt

from benchmarks.console import kitchen_text, number
from benchmarks.presenters.base import (
    WANTED,
    Design,
    Panel,
    Presenter,
    ReportTexts,
    as_genome,
    refuse,
    template,
    workspace_of_run,
)
from benchmarks.presenters.registry import load_design
from legible_envs.errors import LayoutError
from legible_envs.overcooked.kitchen_file import KitchenFile
from legible_envs.overcooked.layout import OvercookedLayout

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table

    from legible_envs.drawing import Image
    from legible_envs.overcooked.recipes import Recipe
    from legible_envs.overcooked.scoring.scorer import OvercookedScorer
    from legible_envs.rollouts.trajectory import Trajectory
    from optimizers import SearchResult
    from predictors import GoalPredictor

__all__ = ["Kitchen", "KitchenPresenter", "kitchen_from", "load_kitchen", "panels_text"]


@dataclass(frozen=True)
class Kitchen(Design):
    """A kitchen named on the command line; ``settings`` are ``prefix`` and ``pots``.

    Attributes:
        file: What the file says that it was read from, or None.
    """

    noun: ClassVar[str] = "kitchen"
    picture: ClassVar[str] = "where goals are confused"

    file: KitchenFile | None = None

    def _summary_outside(self) -> dict[str, Any]:
        return self._scorer.score_layout(self.layout)

    def _explain_outside(self) -> list[dict[str, Any]]:
        return self._scorer.explain_layout(self.layout)

    def ambiguity(self) -> npt.NDArray[np.float64]:
        """``(H, W)`` how often an observer would predict a wrong goal; NaN on cells that no path crosses."""
        if self.genome is not None:
            return np.asarray(self.workspace.ambiguity(self.genome))
        return self._scorer.ambiguity(self.layout)

    @property
    def _scorer(self) -> OvercookedScorer:
        from legible_envs.observer import ObserverModel
        from legible_envs.overcooked.recipes import soup_task
        from legible_envs.overcooked.scoring.scorer import OvercookedScorer

        observer = ObserverModel(prefix=self.settings.get("prefix", "mean"))
        return OvercookedScorer(soup_task(self.soups, self.settings.get("pots")), observer=observer)

    @property
    def soups(self) -> tuple[Recipe, ...]:
        """The soups that the scored task cooks."""
        if self.genome is not None:
            return tuple(self.workspace.recipes)
        if self.file is not None and self.file.recipes is not None:
            return self.file.recipes
        from legible_envs.overcooked.human_play import recipes_for

        return recipes_for(self.layout)

    def facts(self) -> list[tuple[str, str]]:
        """Score, distance, task, and the rule it breaks."""
        summary = self.summary()
        part, share = summary["single_goal_score"], summary["single_goal_share"]
        return [
            ("legibility", number(summary["score"], 4)),
            ("distance", number(summary["distance"], 4)),
            ("normalised", number(summary["normalised"], 4)),
            ("single-goal", number(part, 4) + (f" ({share:.1%} of the score)" if 0 <= share <= 1 else "")),
            ("obstacles", str(summary["num_obstacles"])),
            ("task", "; ".join(" + ".join(soup) for soup in self.soups)),
            ("candidate set", summary["candidate_set"]),
            ("sequences", f"{summary['num_sequences']:,}"),
            ("layout id", summary["layout_id"]),
            *self._notes(),
            *([("design rules", f"outside: {self.broken_rule}")] if self.broken_rule else []),
        ]

    def _notes(self) -> list[tuple[str, str]]:
        """In which form the file was, where that is not plain, and which of its orders are left out."""
        if self.file is None:
            return []
        notes = [] if self.file.form == "drawing" else [("read as", self.file.form)]
        if self.file.left_out:
            soups = "; ".join(" + ".join(soup) for soup in self.file.left_out)
            notes.append(("left out", f"{soups} (ordered too, but part of another order, where a pot goes on)"))
        return notes

    def text(self, console: Console) -> RenderableType:
        """The kitchen in the characters that this console can show."""
        return kitchen_text(console, self.layout)

    def draw(self) -> Image:
        """The kitchen with, on each cell, how often an observer would predict a wrong goal."""
        from legible_envs.overcooked.rendering import draw_ambiguity

        return draw_ambiguity(self.layout, self.ambiguity(), tile=72, title="Where goals are confused")

    def predictors(self) -> list[tuple[str, GoalPredictor]]:
        """The heuristic, and Bayesian goal inference."""
        from predictors import BayesianGoalPredictor, ShortestDistance

        return [("shortest distance", ShortestDistance()), ("Eq. 1", BayesianGoalPredictor())]

    def recorded_here(self, trajectory: Trajectory) -> bool:
        """Whether the trajectory's layout has this kitchen's cells, wherever players started."""
        layout = trajectory.layout
        return isinstance(layout, OvercookedLayout) and bool(np.array_equal(layout.cells, self.layout.cells))


def load_kitchen(source: str, *, prefix: Any = None, pots: int | None = None) -> Kitchen:
    """Read a kitchen; see :func:`benchmarks.presenters.registry.load_design`.

    Raises:
        LayoutError: It is malformed, or a table.
        SearchError: The folder of the search lacks something, or a file there is damaged.
        OSError: The file cannot be read.
    """
    design = load_design(source, prefix=prefix, pots=pots)
    if not isinstance(design, Kitchen):
        raise LayoutError(f"{source} is a {design.noun}; expected a kitchen", rule="type")
    return design


def kitchen_from(text: str, name: str, asked: Mapping[str, Any]) -> Kitchen:
    """A kitchen from the text of a file in any form that :class:`.KitchenFile` reads, with the orders in it.

    Raises:
        LayoutError: The text is malformed; the message names row, column and rule.
    """
    from legible_envs.workspace import make_workspace

    refuse(asked, "task", "kitchen")
    try:
        file = KitchenFile.from_text(text)
    except LayoutError as error:
        raise LayoutError(f"{name}: {error}", rule=error.rule, cell=error.cell) from error
    try:
        orders = {} if file.recipes is None else {"recipes": file.recipes}
        workspace = make_workspace("overcooked", shape=file.layout.shape, **orders, **asked)
    except LayoutError as error:
        return Kitchen(file.layout, None, None, str(error), dict(asked), file)
    genome, broken_rule = as_genome(workspace, file.layout)
    return Kitchen(file.layout, None if genome is None else workspace, genome, broken_rule, dict(asked), file)


class KitchenPresenter(Presenter):
    """Presents the workspace ``"overcooked"``."""

    name = "overcooked"
    noun = "kitchen"
    options = frozenset({"shape", "pots", "lock", "relocation_cost"})
    texts = ReportTexts(
        axes={"obstacles": "virtual obstacles", "order": "reading order of the ingredients"},
        archive="with that many virtual obstacles (up) and its ingredients in that reading order (across)",
        panels="The same room and the same task. A legible kitchen gives the cook's goal away early; its price is the "
        "distance walked.",
        best="The best layout of each reading order, for the highest-scoring orders.",
        distance="expected steps of one task",
        distance_unit="steps",
        distance_digits=1,
        made="over all shortest paths, prefixes and valid orders of the task",
        measured="the expected number of floor moves of the whole task",
    )

    def recognises(self, text: str, source: str) -> bool:
        """Always: a text that no other presenter recognises is read as a drawing, whose errors name row and column."""
        return True

    def read_design(self, text: str, name: str, asked: Mapping[str, Any]) -> Kitchen:
        """A kitchen from the text of a file; see :func:`kitchen_from`."""
        return kitchen_from(text, name, asked)

    def design(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Shape, prefix, pots, and the kitchen to start from."""
        found = {key: settings[key] for key in ("shape", "prefix", "pots") if settings.get(key) is not None}
        if settings.get("start_from") is not None:
            named = load_kitchen(settings["start_from"])
            kitchen = named.layout
            if named.file is not None and named.file.recipes is not None:
                found["recipes"] = [list(soup) for soup in named.file.recipes]
            found |= {"shape": kitchen.shape, "start_from": kitchen.to_ascii()}
            found |= {"relocation_cost": settings.get("relocation_cost", 0.0), "locked": list(settings.get("lock", ()))}
        elif settings.get("lock") or settings.get("relocation_cost"):
            raise click.UsageError("--lock and --relocation-cost need --start-from, the kitchen they are about")
        return found

    def folder_name(self, settings: Mapping[str, Any]) -> str:
        """Shape and objective."""
        rows, columns = settings["shape"]
        return f"{rows}x{columns}-{settings['objective']}"

    def text(self, console: Console, layout: OvercookedLayout) -> RenderableType:
        """The kitchen in colour."""
        return kitchen_text(console, layout)

    def draw(self, layout: OvercookedLayout, workspace: Any, *, tile: int = 64) -> Image:
        """The kitchen without players."""
        from legible_envs.overcooked.rendering import draw_layout

        return draw_layout(layout, tile=tile)

    def design_of_run(self, run: SearchResult, asked: Mapping[str, Any]) -> Design:
        """The best kitchen of a run."""
        refuse(asked, "task", "kitchen")
        workspace = workspace_of_run(run, asked)
        genome = run.require_genome()
        return Kitchen(run.best_layout, workspace, genome, "", dict(asked))

    # -- the page of a report --------------------------------------------------------------------------------------

    def script(self) -> str:
        """Draws tiles of the icons."""
        return template("kitchen.js")

    def icons(self) -> str:
        """A symbol for every kind of cell."""
        return template("kitchen_icons.html")

    def place(self, workspace: Any) -> dict[str, Any]:
        """Rows and columns."""
        return {"shape": list(workspace.shape)}

    def encode(self, layout: OvercookedLayout) -> str:
        """The drawing without line breaks and players: ``H * W`` symbols."""
        from legible_envs.overcooked.layout import SYMBOLS

        return "".join(SYMBOLS[code] for code in layout.cells.ravel())

    def carried(self, workspace: Any, room: int) -> int:
        """How many drawings fit into that many bytes."""
        height, width = workspace.shape
        return room // (height * width + 3)

    def title(self, data: Mapping[str, Any]) -> str:
        """What was wanted, and the size of the room."""
        rows, columns = data["place"]["shape"]
        return f"A search for {WANTED.get(data['objective']['name'], 'good')} kitchens, {rows} × {columns}"


def panels_text(console: Console, panels: Sequence[Panel]) -> Table:
    """Kitchens side by side, each over its name, its scores and how it was chosen."""
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 4))
    for _ in panels:
        grid.add_column(max_width=32)
    grid.add_row(*(kitchen_text(console, p.layout) for p in panels))
    grid.add_row()
    grid.add_row(*(Text(p.name, style="bold") for p in panels))
    grid.add_row(*(f"legibility [bold cyan]{number(p.score)}[/]" for p in panels))
    grid.add_row(*(f"distance   [bold]{number(p.distance, 1)}[/]" for p in panels))
    grid.add_row(*(Text(p.note, style="dim") for p in panels))
    return grid
