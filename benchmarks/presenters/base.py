"""What the command line and the report need to know about a workspace: how its layouts are named, drawn and told.

Each built-in workspace has one presenter; everything else that ``legible`` does is the same for all of them.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from optimizers.runs.folder import is_run_folder

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from legible_envs.drawing import Image
    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.workspace import Workspace
    from optimizers import SearchResult
    from predictors import GoalPredictor

__all__ = [
    "DOMAINS",
    "Condition",
    "Design",
    "Part",
    "Presenter",
    "load_design",
    "loss_row",
    "presenter_of",
    "read_source",
]

DOMAINS = ("overcooked", "tabletop")
"""Workspaces that ``legible optimize`` searches."""


@dataclass(frozen=True)
class Condition:
    """One way of making a layout, to be shown beside the others.

    Attributes:
        name: What it is called, such as ``"random"``.
        layout: A layout that stands for it.
        score: Its legibility.
        distance: Expected floor moves, or metres, of the whole task.
        normalised: Legibility as a share of the highest conceivable, at most 1.
        note: One sentence on how the layout was chosen.
        detour: Mean length of a reach over its straight line, on a table.
    """

    name: str
    layout: Any
    score: float
    distance: float
    normalised: float | None = None
    note: str = ""
    detour: float | None = None


@dataclass(frozen=True)
class Design(ABC):
    """One layout named on the command line.

    Attributes:
        layout: The layout.
        workspace: The design problem it belongs to, or None where it breaks the design rules.
        genome: ``(d,)`` the layout in that workspace, or None.
        broken_rule: Why it has no genome, in a sentence.
        settings: Settings of the score that were asked for.
    """

    thing: ClassVar[str]

    layout: Any
    workspace: Any
    genome: npt.NDArray[Any] | None
    broken_rule: str
    settings: dict[str, Any] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """Score, distance and what belongs beside them."""
        return dict(self.workspace.summary(self.genome)) if self.genome is not None else self._summary_outside()

    def explain(self) -> list[dict[str, Any]]:
        """A row per stage and goal, the greatest loss first."""
        return list(self.workspace.explain(self.genome)) if self.genome is not None else self._explain_outside()

    @abstractmethod
    def _summary_outside(self) -> dict[str, Any]:
        """The summary of a layout outside the design rules."""

    @abstractmethod
    def _explain_outside(self) -> list[dict[str, Any]]:
        """The rows of a layout outside the design rules."""

    @abstractmethod
    def facts(self) -> list[tuple[str, str]]:
        """Names and values that ``legible score`` prints, a line each."""

    @abstractmethod
    def text(self, console: Console) -> RenderableType:
        """The layout for a terminal."""

    @abstractmethod
    def draw(self) -> Image:
        """The layout with what is in doubt where, as ``legible show --out`` writes it."""

    def write_picture(self, path: Path | None) -> tuple[str, Path] | None:
        """Write the picture of ``legible show``: what it shows, and where it is; None where nobody asked for one."""
        if path is None:
            return None
        from legible_envs.drawing import save_png

        return "where goals are in doubt", save_png(path, self.draw())

    def compared(self) -> list[dict[str, Any]]:
        """Rows about this layout and those that its run compares it with; none where there are none."""
        return []

    @abstractmethod
    def readers(self) -> list[tuple[str, GoalPredictor]]:
        """Predictors without parameters to learn that walks made here are read with, by name."""

    @abstractmethod
    def was_walked(self, walk: Trajectory) -> bool:
        """Whether a recorded walk (or reach) was made here."""


@dataclass(frozen=True)
class Part:
    """One search of those that one ``legible optimize`` makes.

    Attributes:
        folder: Where it is written.
        workspace: What it searches.
        title: What it is called where there are several; else empty.
    """

    folder: Path
    workspace: Workspace
    title: str = ""


class Presenter(ABC):
    """How the layouts of a workspace are asked for, printed, drawn, and put on the page of a report.

    Attributes:
        name: Name of the workspace.
        thing: What one layout is called.
        options: Options of ``legible optimize`` that only this workspace has.
        words: Texts of the report, by where they stand; see :func:`benchmarks.reports.search_report.report_data`.
        script: Template file that draws layouts on the page.
        icons: Template file of pictures the script uses, or None.
    """

    name: ClassVar[str]
    thing: ClassVar[str]
    options: ClassVar[frozenset[str]]
    words: ClassVar[dict[str, Any]]
    script: ClassVar[str]
    icons: ClassVar[str | None] = None

    @abstractmethod
    def design(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of the workspace from options of the command line; options that are absent say nothing."""

    @abstractmethod
    def folder_name(self, settings: Mapping[str, Any]) -> str:
        """Where a search is written that names no folder, without its seed."""

    @abstractmethod
    def parts(self, config: Mapping[str, Any], settings: Mapping[str, Any], out: Path) -> list[Part]:
        """The searches to make for a workspace's settings; the first is that of the folder itself."""

    @abstractmethod
    def text(self, console: Console, layout: Any) -> RenderableType:
        """A layout for a terminal."""

    @abstractmethod
    def draw(self, layout: Any, workspace: Any) -> Image:
        """A layout as a picture."""

    @abstractmethod
    def design_of_run(self, run: SearchResult, asked: Mapping[str, Any]) -> Design:
        """The best layout of a run; ``asked`` are settings of the score given on the command line."""

    def write_boards(self, run: SearchResult, path: Path | None = None) -> Path | None:
        """Write the figure of what a run compares into its folder; None where there is no such figure."""
        return None

    # -- the page of a report --------------------------------------------------------------------------------------

    @abstractmethod
    def place(self, workspace: Any) -> dict[str, Any]:
        """What the script must know to draw layouts; plain data."""

    @abstractmethod
    def encode(self, layout: Any) -> Any:
        """A layout as the script reads it; plain data, small."""

    @abstractmethod
    def title(self, data: Mapping[str, Any]) -> str:
        """The title of the page."""

    def carried(self, workspace: Any, room: int) -> int:
        """How many layouts fit into that many bytes."""
        return room

    def ways(self, workspace: Any, layout: Any) -> list[Any]:
        """How people move in a layout, as the script reads it; nothing unless a workspace has such."""
        return []

    def conditions(self, run: SearchResult) -> Sequence[Condition]:
        """Layouts to show side by side, found in the run's folder; none unless a workspace has such."""
        return ()


def presenter_of(name: str) -> Presenter:
    """The presenter of a workspace.

    Raises:
        ValueError: The command line cannot draw layouts of this workspace.
    """
    if name == "overcooked":
        from benchmarks.presenters.overcooked import KitchenPresenter

        return KitchenPresenter()
    if name == "tabletop":
        from benchmarks.presenters.tabletop import TablePresenter

        return TablePresenter()
    raise ValueError(
        f"layouts of the workspace {name!r} cannot be drawn here; known: {list(DOMAINS)}. "
        "`optimizers.load_run` reads its runs"
    )


def load_design(source: str, *, prefix: Any = None, pots: int | None = None, task: str | None = None) -> Design:
    """Read what LAYOUT names: a drawing, ``-`` (standard input), a layout's JSON, or the folder of a search.

    Args:
        source: The path.
        prefix: Which prefixes count; None means the run's own setting, or ``"mean"``.
        pots: Soups in progress at once, in a kitchen; None means the run's own setting, or no limit.
        task: What is built on a table: a name, or the path of a YAML file. None means the run's own, or the one task
            of the package that has the table's objects.

    Raises:
        LayoutError: The layout is malformed; the message says where.
        SearchError: The folder of the search lacks something, or a file there is damaged.
        OSError: The file cannot be read.
    """
    from benchmarks.presenters.overcooked import kitchen_from
    from benchmarks.presenters.tabletop import is_table, table_from

    asked = {k: v for k, v in (("prefix", prefix), ("pots", pots), ("task", task)) if v is not None}
    if source != "-" and is_run_folder(source):
        from optimizers import load_run

        run = load_run(source)
        return presenter_of(str(run.config["workspace"].get("workspace"))).design_of_run(run, asked)
    name, text = read_source(source)
    if is_table(text, source):
        return table_from(text, name, asked)
    return kitchen_from(text, name, asked)


def refuse(asked: Mapping[str, Any], option: str, thing: str) -> None:
    """Refuse an option that is not about this kind of layout.

    Raises:
        LayoutError: It was given.
    """
    if option in asked:
        raise LayoutError(f"--{option} does not apply: this is a {thing}", rule="type")


def read_source(source: str) -> tuple[str, str]:
    """What to call a source in messages, and its text.

    Raises:
        LayoutError: It is a folder, or not a text file.
        OSError: The file cannot be read.
    """
    if source != "-" and Path(source).is_dir():
        raise LayoutError(f"{source} is a folder without a config.json: neither a run nor a layout", rule="type")
    try:
        text = sys.stdin.read() if source == "-" else Path(source).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise LayoutError(
            f"{source} is not a text file; expected an ASCII drawing of a kitchen or the JSON of a table", rule="type"
        ) from error
    return "standard input" if source == "-" else source, text


def as_genome(workspace: Any, layout: Any) -> tuple[npt.NDArray[Any] | None, str]:
    """A layout's genome, or None and the rule it breaks."""
    try:
        return np.asarray(workspace.encode(layout)), ""
    except LayoutError as error:
        return None, str(error)


def loss_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of ``explain()`` in words, for people."""
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
