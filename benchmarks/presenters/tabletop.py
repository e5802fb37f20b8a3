"""Tables on the command line and in reports: how one is named, scored, printed and drawn."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from benchmarks.console import number, table_text
from benchmarks.presenters.base import (
    WANTED,
    Design,
    Part,
    Presenter,
    ReportTexts,
    as_genome,
    refuse,
    template,
    workspace_of_run,
)
from benchmarks.presenters.panels import price_of
from benchmarks.presenters.registry import load_design, read_source
from benchmarks.presenters.tabletop_panels import CONDITIONS, LIST, beta_of, listed, panels_of, write_panels
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout_kind import is_kitchen
from legible_envs.support.files import write_text
from legible_envs.support.plain_data import parse_json
from legible_envs.tabletop import TabletopLayout, TabletopTask
from optimizers.runs.folder import is_run_folder

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from benchmarks.presenters.base import Panel
    from legible_envs.drawing import Image
    from legible_envs.tabletop.scoring.scorer import TabletopScorer
    from optimizers import SearchResult
    from predictors import GoalPredictor

__all__ = ["TableDesign", "TablePresenter", "is_table", "load_table", "table_from"]


@dataclass(frozen=True)
class TableDesign(Design):
    """A table named on the command line.

    Attributes:
        task: What is built there.
        run: The search that found it, or None.
    """

    noun: ClassVar[str] = "table"
    picture: ClassVar[str] = "where goals are confused"

    task: TabletopTask | None = None
    run: SearchResult | None = None

    @property
    def _scorer(self) -> TabletopScorer:
        from legible_envs.observer import ObserverModel
        from legible_envs.tabletop.scoring.scorer import TabletopScorer

        if self.workspace is not None:
            return self.workspace.scorer  # type: ignore[no-any-return]
        assert self.task is not None
        return TabletopScorer(self.task, observer=ObserverModel.in_metres(prefix=self.settings.get("prefix", "mean")))

    def _summary_outside(self) -> dict[str, Any]:
        assert self.task is not None
        scorer = self._scorer
        scores = scorer.score_layouts([self.layout])
        legibility = float(scores.legibility[0])
        return {
            "score": legibility,
            "distance": float(scores.distance[0]),
            "normalised": legibility / scorer.best_possible,
            "single_goal_score": math.fsum(r["contribution"] for r in self.explain() if len(r["goals"]) == 1),
            "mean_detour": float(scores.mean_detour[0]),
            "max_detour": float(scores.max_detour[0]),
            "num_obstacles": len(self.layout.obstacles),
            "candidate_set": "task",
            "num_sequences": self.task.graph.num_sequences,
            "layout_id": self.layout.layout_id,
        }

    def _explain_outside(self) -> list[dict[str, Any]]:
        if np.isnan(self._scorer.score_layouts([self.layout]).legibility[0]):
            return []
        return self._scorer.explain_layout(self.layout)

    def facts(self) -> list[tuple[str, str]]:
        """Score, distance, detours, task, and the rule it breaks."""
        assert self.task is not None
        summary = self.summary()
        part, whole = summary["single_goal_score"], summary["score"]
        share = part / whole if whole else math.nan
        robots = self.task.graph.reserved_for("robot")
        return [
            ("legibility", number(whole, 4)),
            ("distance", f"{number(summary['distance'], 4)} m"),
            ("mean detour", number(summary["mean_detour"], 4)),
            ("max detour", number(summary["max_detour"], 4)),
            ("normalised", number(summary["normalised"], 4)),
            ("single-goal", number(part, 4) + (f" ({share:.1%} of the score)" if 0 <= share <= 1 else "")),
            ("obstacles", str(summary["num_obstacles"])),
            ("task", self.task.name),
            *([("robot alone", ", ".join(s.name for s in robots))] if robots else []),
            ("candidate set", summary["candidate_set"]),
            ("sequences", f"{summary['num_sequences']:,}"),
            ("layout id", summary["layout_id"]),
            *([("design rules", f"outside: {self.broken_rule}")] if self.broken_rule else []),
        ]

    def text(self, console: Console) -> RenderableType:
        """The table as a map of characters."""
        return table_text(console, self.layout)

    def draw(self) -> Image:
        """The table with its shortest reaches, coloured by how unsure an observer is of their goal."""
        from legible_envs.tabletop.rendering import draw_table

        title = "Shortest reaches, by how ambiguous their goal is"
        if self.layout.obstacles:
            title += "; pale: the middle of the hand keeps out"
        beta = beta_of(self.workspace)
        return draw_table(self.layout, task=self.task, width=960, ambiguity=True, beta=beta, grown=True, title=title)

    def write_picture(self, path: Path | None) -> tuple[str, Path] | None:
        """For a run the figure of its panels, into its folder unless told otherwise; else the table."""
        if self.run is None:
            return super().write_picture(path)
        return "panels", write_panels(self.run, path)

    def compared(self) -> list[dict[str, Any]]:
        """The baseline and every condition of a run: score, mean detour and metres of one task."""
        if self.run is None:
            return []
        return [
            {
                "condition": panel.name,
                "legibility": panel.score,
                "normalised": panel.normalised,
                "mean detour": panel.detour,
                "metres": panel.distance,
                "obstacles": len(panel.layout.obstacles),
            }
            for panel in panels_of(self.run)
        ]

    def predictors(self) -> list[tuple[str, GoalPredictor]]:
        """The heuristic, and Bayesian goal inference."""
        from predictors import StraightLineBayesian

        beta = beta_of(self.workspace)
        straight = StraightLineBayesian(beta, obstacles=False)
        return [("straight lines", straight), ("Eq. 1, shortest paths", StraightLineBayesian(beta))]


# -- reading tables ----------------------------------------------------------------------------------------------------


def is_table(text: str, source: str) -> bool:
    """Whether a text is meant as the JSON of a table."""
    if text.lstrip().startswith(("{", "[")) and is_kitchen(text):
        return False
    try:
        data = parse_json(text)
    except ValueError:
        return source.endswith(".json")
    return isinstance(data, dict)


def table_from(text: str, name: str, asked: Mapping[str, Any]) -> TableDesign:
    """A table from its JSON.

    Raises:
        LayoutError: It is malformed, or its objects are of no task that comes with the package and none was named.
        TaskError: The task named is unknown or malformed.
    """
    from legible_envs.workspace import make_workspace

    refuse(asked, "pots", "table")
    refuse(asked, "player", "table")
    try:
        layout = TabletopLayout.from_json(text + "\n")
    except LayoutError as error:
        raise LayoutError(f"{name}: {error}", rule=error.rule) from error
    task = _task_of(layout, asked.get("task"))
    settings = {key: value for key, value in asked.items() if key == "prefix"}
    workspace = make_workspace("tabletop", task=task, **settings)
    if (layout.table, len(layout.objects)) != (task.layout.table, len(task.layout.objects)):
        genome, broken_rule = None, f"its table is not that of the task {task.name!r}"
    else:
        genome, broken_rule = as_genome(workspace, layout)
    return TableDesign(layout, None if genome is None else workspace, genome, broken_rule, settings, task)


def load_table(source: str, task: str | None = None) -> TableDesign:
    """Read a table; see :func:`benchmarks.presenters.registry.load_design`.

    Raises:
        LayoutError: It is malformed, or a kitchen.
        SearchError: The folder of the search lacks something, or a file there is damaged.
        OSError: The file cannot be read.
    """
    if source != "-" and is_run_folder(source):
        design = load_design(source)
    else:
        name, text = read_source(source)
        if not is_table(text, source):
            raise LayoutError(f"{source} is not the JSON of a table; expected a table", rule="type")
        design = table_from(text, name, {} if task is None else {"task": task})
    if not isinstance(design, TableDesign):
        raise LayoutError(f"{source} is a {design.noun}; expected a table", rule="type")
    return design


def _task_of(layout: TabletopLayout, named: str | None) -> TabletopTask:
    if named is not None:
        return TabletopTask.from_yaml(named) if named.endswith((".yaml", ".yml")) else TabletopTask.named(named)
    try:
        return TabletopTask.for_layout(layout)
    except LayoutError as error:
        raise LayoutError(f"{error} with --task NAME or --task FILE.yaml", rule=error.rule) from error


class TablePresenter(Presenter):
    """Presents the workspace ``"tabletop"``."""

    name = "tabletop"
    noun = "table"
    options = frozenset({"task", "condition"})
    own_files = frozenset({LIST})
    texts = ReportTexts(
        axes={
            "least distance": "least distance of two objects, m",
            "order": "order of the first objects, left to right",
            "mean x": "mean x of the first objects, m",
            "obstacles": "virtual obstacles",
            "mean detour": "mean detour",
        },
        archive="at that place of the two measures",
        panels="The same objects and the same task. Lines are the shortest reaches: the darker, the less an observer "
        "who has seen the hand come so far believes in its true goal.",
        distance="expected metres of one task",
        distance_unit="m",
        distance_digits=2,
        made="over observed shares of all shortest reaches and all valid orders of the task",
        measured="the expected length, in metres, of all paths of the hand in one task, fetching and carrying",
        costs="virtual obstacles",
    )

    def recognises(self, text: str, source: str) -> bool:
        """Whether it is meant as JSON."""
        return is_table(text, source)

    def read_design(self, text: str, name: str, asked: Mapping[str, Any]) -> TableDesign:
        """A table from its JSON."""
        return table_from(text, name, asked)

    def design(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Task, prefix, and the table to start from; the condition is chosen by :meth:`parts`."""
        found = {key: settings[key] for key in ("task", "prefix") if settings.get(key) is not None}
        if settings.get("start_from") is not None:
            found["start_from"] = load_table(settings["start_from"], settings.get("task")).layout.to_dict()
        return found

    def folder_name(self, settings: Mapping[str, Any]) -> str:
        """Task, condition and objective."""
        condition = "" if settings["condition"] == "all" else f"-{settings['condition']}"
        return f"{Path(settings['task']).stem}{condition}-{settings['objective']}"

    def parts(self, config: Mapping[str, Any], settings: Mapping[str, Any], out: Path) -> list[Part]:
        """A search for every condition, or for one.

        The search for ``both`` lies in the folder itself, the others in folders within; a list of them tells a resumed
        search, the report and ``legible show`` that they belong together.
        """
        from legible_envs.workspace import make_workspace

        asked = settings.get("condition")
        together = listed(out) if settings["resume"] else {}
        if asked == "all" or (asked is None and together):
            together = together or {"both": ".", "placement": "placement", "obstacles": "obstacles"}
            parts = [
                Part(out / folder, make_workspace({**config, "condition": name}), CONDITIONS[name])
                for name, folder in together.items()
            ]
            text = json.dumps(together, indent=1) + "\n"
            out.mkdir(parents=True, exist_ok=True)
            write_text(out / LIST, text)
            return parts
        chosen = config if asked is None else {**config, "condition": asked}
        part = Part(out, make_workspace(chosen))
        if not settings["resume"]:
            (out / LIST).unlink(missing_ok=True)
        return [part]

    def text(self, console: Console, layout: TabletopLayout) -> RenderableType:
        """The table as a map of characters."""
        return table_text(console, layout)

    def draw(self, layout: TabletopLayout, workspace: Any) -> Image:
        """The table with its shortest reaches and where their goals are ambiguous."""
        from legible_envs.tabletop.rendering import draw_table

        return draw_table(layout, task=workspace.task, width=960, ambiguity=True, beta=beta_of(workspace))

    def write_panels(self, run: SearchResult, path: Path | None = None) -> Path:
        """Write the panels of the paper's figure."""
        return write_panels(run, path)

    def design_of_run(self, run: SearchResult, asked: Mapping[str, Any]) -> Design:
        """The best table of a run."""
        refuse(asked, "pots", "table")
        refuse(asked, "player", "table")
        refuse(asked, "task", "run, which has its own task")
        workspace: Any = workspace_of_run(run, asked)
        genome = run.require_genome()
        return TableDesign(run.best_layout, workspace, genome, "", dict(asked), workspace.task, run)

    # -- the page of a report --------------------------------------------------------------------------------------

    def script(self) -> str:
        """Draws boxes, obstacles and reaches."""
        return template("table.js")

    def place(self, workspace: Any) -> dict[str, Any]:
        """Table, objects with outlines of their shapes, and slots; lengths in millimetres, y away from the person."""
        from legible_envs.tabletop.rendering.glyphs import GLYPHS
        from legible_envs.tabletop.rendering.objects import colour_of
        from legible_envs.tabletop.rendering.palette import TABLE, ink_on

        task: TabletopTask = workspace.task
        top = task.layout.table
        shapes = {o.shape for o in task.layout.objects}
        return {
            "size": _mm(top.size),
            "region": _mm(top.region),
            "assembly": _mm(top.assembly),
            "starts": [_mm(at) for at in top.starts.values()],
            "hand": _mm([top.hand])[0],
            "obstacle": _mm(workspace.scorer.obstacle_size),
            "objects": [
                {
                    "name": o.name,
                    "colour": (colour := colour_of(o)),
                    "ink": ink_on(colour),
                    "shape": o.shape,
                    "size": _mm(o.size),
                    "angle": round(math.degrees(o.angle), 1),
                    "slot": _mm(task.configuration[o.name]) if o.name in task.configuration else None,
                }
                for o in task.layout.objects
            ],
            "table": top.to_dict(),
            "boxes": task.layout.to_dict()["objects"],
            "glyphs": {
                name: " ".join(f"{x:.3g},{y:.3g}" for x, y in points)
                for name, points in GLYPHS.items()
                if name in shapes
            },
            "colours": TABLE,
            "ranked": list(workspace.ranked),
        }

    def encode(self, layout: TabletopLayout) -> list[list[int]]:
        """``[x, y]`` of every object, then ``[x, y, angle]`` of every obstacle, as whole numbers.

        Lengths are in tenths of a millimetre, angles in hundredths of a degree.
        """
        return [
            *([round(1e4 * x) for x in o.at] for o in layout.objects),
            *([*(round(1e4 * x) for x in o.at), round(100 * math.degrees(o.angle))] for o in layout.obstacles),
        ]

    def carried(self, workspace: Any, room: int) -> int:
        """How many layouts fit into that many bytes."""
        return room // (12 * len(workspace.task.layout.objects) + 19 * workspace.rules.max_obstacles + 4)

    def title(self, data: Mapping[str, Any]) -> str:
        """What was wanted, and of what."""
        task = data["config"]["workspace"]["task"]
        name = task if isinstance(task, str) else task["name"]
        return f"A search for {WANTED.get(data['objective']['name'], 'good')} tables: {name}"

    def panels(self, run: SearchResult) -> Sequence[Panel]:
        """The baseline and what every condition found."""
        return panels_of(run)

    def about_panels(self, panels: Sequence[Panel]) -> str:
        """What the colours mean, and what the most legible table costs in metres."""
        first, best = panels[0], max(panels, key=lambda panel: panel.score)
        if best is first:
            return self.texts.panels
        baseline = replace(first, name=first.name.lower())
        price = price_of(best, baseline, unit="m", digits=self.texts.distance_digits)
        return f"{self.texts.panels} {best.name} scores highest. {price}"

    def paths(self, workspace: Any, layout: TabletopLayout) -> list[list[list[int]]]:
        """Shortest reaches as ``[x, y, per cent of ambiguity]`` of points along each, in millimetres."""
        from legible_envs.tabletop.rendering.ambiguity import ambiguous_reaches

        return [
            [
                [*_mm(point), round(100 * share)]
                for point, share in zip(reach.points, [*reach.ambiguity, 0.0], strict=True)
            ]
            for reach in ambiguous_reaches(layout, workspace.task, beta=beta_of(workspace), pieces=24)
        ]


def _mm(metres: Sequence[float] | Any) -> list[int]:
    return [round(1000 * float(value)) for value in metres]
