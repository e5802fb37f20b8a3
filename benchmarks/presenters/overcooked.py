"""Kitchens on the command line and in reports: how one is named, scored, printed and drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

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
from benchmarks.presenters.panels import median_of_random, panel_of, price_of
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

__all__ = ["DOUBT", "RANDOM_LAYOUTS", "Kitchen", "KitchenPresenter", "kitchen_from", "load_kitchen", "panels_text"]

DOUBT: Final = ("never wrong", "always wrong")
"""What the ends of the scale of doubt mean, in pictures."""
RANDOM_LAYOUTS: Final = 1_000
"""Random layouts whose median the best one is shown beside."""


@dataclass(frozen=True)
class Kitchen(Design):
    """A kitchen named on the command line; ``settings`` are ``prefix``, ``pots`` and ``player``.

    Attributes:
        file: What the file says that it was read from, or None.
    """

    noun: ClassVar[str] = "kitchen"
    picture: ClassVar[str] = "where goals are confused"

    file: KitchenFile | None = None

    @property
    def player(self) -> int:
        """Whose score it is, by the number of their start."""
        return int(self.settings.get("player", 1))

    def summary(self) -> dict[str, Any]:
        """Score, distance and what belongs beside them, of one player."""
        if self.genome is not None:
            return dict(self.workspace.summary(self.layout, player=self.player))
        return dict(self._scorer.score_layout(self.layout, player=self.player))

    def explain(self) -> list[dict[str, Any]]:
        """Where the score of one player comes from: a row per stage and goal, the greatest loss first."""
        return list(self._scorer.explain_layout(self.layout, player=self.player))

    def ambiguity(self) -> npt.NDArray[np.float64]:
        """``(H, W)`` how often an observer would predict a wrong goal; NaN on cells that no path crosses."""
        return np.asarray(self._scorer.ambiguity(self.layout, player=self.player))

    @property
    def _scorer(self) -> OvercookedScorer:
        if self.genome is not None:
            return self.workspace.scorer
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

        return recipes_for(self.layout, self.player)

    def facts(self) -> list[tuple[str, str]]:
        """Score, distance, task, and the rule it breaks."""
        summary = self.summary()
        part, share = summary["single_goal_score"], summary["single_goal_share"]
        robots = self._scorer.task.reserved_for("robot")
        return [
            ("legibility", number(summary["score"], 4)),
            ("distance", number(summary["distance"], 4)),
            ("normalised", number(summary["normalised"], 4)),
            ("single-goal", number(part, 4) + (f" ({share:.1%} of the score)" if 0 <= share <= 1 else "")),
            ("obstacles", str(summary["num_obstacles"])),
            ("task", "; ".join(" + ".join(soup) for soup in self.soups)),
            *([("robot alone", ", ".join(s.name for s in robots))] if robots else []),
            ("candidate set", summary["candidate_set"]),
            ("sequences", f"{summary['num_sequences']:,}"),
            ("layout id", summary["layout_id"]),
            *([("player", str(self.player))] if "player" in self.settings or summary["out_of_reach"] else []),
            *([("out of reach", ", ".join(summary["out_of_reach"]))] if summary["out_of_reach"] else []),
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

        title = "How often a wrong goal is predicted"
        return draw_ambiguity(self.layout, self.ambiguity(), tile=72, legend=DOUBT, title=title)

    def predictors(self) -> list[tuple[str, GoalPredictor]]:
        """The heuristic, and Bayesian goal inference."""
        from predictors import BayesianGoalPredictor, ShortestDistance

        return [("shortest distance", ShortestDistance()), ("Eq. 1", BayesianGoalPredictor())]

    def recorded_here(self, trajectory: Trajectory) -> bool:
        """Whether the trajectory's layout has this kitchen's cells, wherever players started."""
        layout = trajectory.layout
        return isinstance(layout, OvercookedLayout) and bool(np.array_equal(layout.cells, self.layout.cells))


def load_kitchen(source: str, *, prefix: Any = None, pots: int | None = None, player: int | None = None) -> Kitchen:
    """Read a kitchen; see :func:`benchmarks.presenters.registry.load_design`.

    Raises:
        LayoutError: It is malformed, or a table.
        SearchError: The folder of the search lacks something, or a file there is damaged.
        OSError: The file cannot be read.
    """
    design = load_design(source, prefix=prefix, pots=pots, player=player)
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
    of_score = {key: value for key, value in asked.items() if key != "player"}
    try:
        file = KitchenFile.from_text(text)
    except LayoutError as error:
        raise LayoutError(f"{name}: {error}", rule=error.rule, cell=error.cell) from error
    try:
        orders = {} if file.recipes is None else {"recipes": file.recipes}
        workspace = make_workspace("overcooked", shape=file.layout.shape, **orders, **of_score)
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
        panels="The same room and the same task. The darker a floor cell, the more often an observer who sees the cook "
        "there predicts a wrong goal; cells without colour are on no path. A legible kitchen gives the goal away "
        "early.",
        distance="expected steps of one task",
        distance_unit="steps",
        distance_digits=1,
        made="over all shortest paths, prefixes and valid orders of the task",
        measured="the expected number of floor moves of the whole task",
        costs="moved stations",
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
        workspace = workspace_of_run(run, {key: value for key, value in asked.items() if key != "player"})
        genome = run.require_genome()
        return Kitchen(run.best_layout, workspace, genome, "", dict(asked))

    # -- the page of a report --------------------------------------------------------------------------------------

    def script(self) -> str:
        """Draws tiles of the icons."""
        return template("kitchen.js")

    def icons(self) -> str:
        """A symbol for every part of a kitchen: the art of the environment's own pictures."""
        from legible_envs.overcooked.rendering.symbols import kitchen_symbols

        return "\n".join(kitchen_symbols().values())

    def place(self, workspace: Any) -> dict[str, Any]:
        """Rows and columns."""
        return {"shape": list(workspace.shape)}

    def encode(self, layout: OvercookedLayout) -> str:
        """The drawing without line breaks and players: ``H * W`` symbols."""
        from legible_envs.overcooked.layout import SYMBOLS

        return "".join(SYMBOLS[code] for code in layout.cells.ravel())

    def paths(self, workspace: Any, layout: OvercookedLayout) -> list[int | None]:
        """In how many per cent of visits to each cell an observer would predict a wrong goal; None off all paths."""
        wrong = workspace.scorer.ambiguity(layout)  # also of kitchens outside the design rules
        return [None if np.isnan(share) else round(100 * float(share)) for share in wrong.ravel()]

    def panels(self, run: SearchResult) -> Sequence[Panel]:
        """A middle one of random kitchens (or that the search began with), the shortest one, and the best one."""
        workspace: Any = run.workspace
        best = run.require_genome()
        name = WANTED.get(run.config["objective"]["name"], "best")
        found = [_first_panel(workspace)]  # drawn anew: a run keeps no random layouts
        elites = run.elites()
        if name == "efficient":
            legible = elites.solution[int(np.argmax(workspace.legibility(elites.solution)))]
            found.append(panel_of(workspace, "legible", legible, "the most legible layout in the archive"))
        else:
            shortest = elites.solution[int(np.argmin(workspace.distance(elites.solution)))]
            found.append(panel_of(workspace, "shortest", shortest, "the shortest task in the archive"))
        return [*found, panel_of(workspace, name, best, "the best layout of this search")]

    def about_panels(self, panels: Sequence[Panel]) -> str:
        """What the colours mean, and what legibility costs in steps."""
        named = {panel.name: panel for panel in panels}
        legible = named.get("legible", named.get("legible and efficient"))
        other = named.get("efficient", named.get("shortest"))
        if legible is None or other is None:
            return self.texts.panels
        unit, digits = self.texts.distance_unit, self.texts.distance_digits
        price = price_of(legible, other, unit=unit, digits=digits)
        if "random" in named:
            price += f" In the random one it takes {named['random'].distance:.{digits}f} {unit}."
        return f"{self.texts.panels} {price}"

    def carried(self, workspace: Any, room: int) -> int:
        """How many drawings fit into that many bytes."""
        height, width = workspace.shape
        return room // (height * width + 3)

    def title(self, data: Mapping[str, Any]) -> str:
        """What was wanted, and the size of the room."""
        rows, columns = data["place"]["shape"]
        return f"A search for {WANTED.get(data['objective']['name'], 'good')} kitchens, {rows} × {columns}"


def _first_panel(workspace: Any) -> Panel:
    """What the best kitchen is compared with: the one that the search began with, or else a random one."""
    if workspace.start_from is not None:
        return panel_of(
            workspace, "start", workspace.encode(workspace.start_from), "the kitchen that the search began with"
        )
    middle = median_of_random(workspace, RANDOM_LAYOUTS, np.random.default_rng(0))
    return panel_of(workspace, "random", middle, f"the median of {RANDOM_LAYOUTS:,} random layouts by legibility")


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
    grid.add_row(*(Text.assemble("legibility ", (number(p.score), "bold cyan")) for p in panels))
    grid.add_row(*(Text.assemble("distance   ", (number(p.distance, 1), "bold")) for p in panels))
    grid.add_row(*(Text(p.note, style="dim") for p in panels))
    return grid
