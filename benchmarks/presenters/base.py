"""How the command line and the report show a workspace: how its layouts are named, printed and drawn.

A presenter knows one workspace; everything else that ``legible`` does is the same for all of them. A workspace without
a presenter of its own is presented by :class:`Presenter` itself: its layouts as text, its summary as facts, no picture.

A package brings a presenter for its workspace, under the same name, with one line of ``pyproject.toml``::

    [project.entry-points."legible.presenters"]
    aisle = "my_package.presenter:AislePresenter"
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np
import numpy.typing as npt

from benchmarks.console import number
from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import kind_named, kind_of, list_layout_kinds
from legible_envs.workspace import make_workspace

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from legible_envs.drawing import Image
    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.workspace import Workspace
    from optimizers import SearchResult
    from predictors import GoalPredictor

__all__ = [
    "WANTED",
    "Design",
    "Panel",
    "Part",
    "Presenter",
    "ReportTexts",
    "as_genome",
    "refuse",
    "summary_of",
    "template",
    "text_of",
    "workspace_of_run",
]

WANTED: Final = {"legibility": "legible", "efficiency": "efficient", "legible-efficient": "legible and efficient"}
"""Objectives as adjectives."""


@dataclass(frozen=True)
class Panel:
    """One layout of those that a report shows side by side.

    Attributes:
        name: Its title, such as ``"random"``.
        layout: The layout.
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
class ReportTexts:
    """Texts of a report that depend on the workspace.

    Attributes:
        axes: Measures in words, by their names.
        archive: Ends the sentence "Each square is the best layout found …".
        panels: What the layouts side by side have in common, and what to look for.
        best: Anything to add to how "Good layouts that differ" were chosen.
        distance: Name of the distance.
        distance_unit: Its unit; empty where it has none.
        distance_digits: Decimals of a distance.
        made: Over what the legibility (Eq. 2 and 3) is averaged; empty where it is not that of the equations.
        measured: How the distance is measured.
        costs: What an objective may lose to, beside what it is named after.
    """

    axes: Mapping[str, str] = field(default_factory=dict)
    archive: str = "at that place of the two measures"
    panels: str = "The same task in other layouts."
    best: str = ""
    distance: str = "of one task"
    distance_unit: str = ""
    distance_digits: int = 2
    made: str = ""
    measured: str = ""
    costs: str = "the workspace's penalty"


@dataclass(frozen=True)
class Design:
    """One layout named on the command line.

    Attributes:
        layout: The layout.
        workspace: The design problem it belongs to, or None where it breaks the design rules.
        genome: ``(d,)`` the layout in that workspace, or None.
        broken_rule: Why it has no genome, in a sentence.
        settings: Settings of the score that were asked for.
        presenter: The presenter that prints and draws it, unless a subclass does.
    """

    layout: Any
    workspace: Any
    genome: npt.NDArray[Any] | None
    broken_rule: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    presenter: Presenter | None = field(default=None, kw_only=True)

    @property
    def noun(self) -> str:
        """The word for a layout."""
        return "layout" if self.presenter is None else self.presenter.noun

    @property
    def picture(self) -> str:
        """What its picture shows, in a few words; empty where there is no picture."""
        draws = self.presenter is not None and type(self.presenter).draw is not Presenter.draw
        return f"the {self.noun}" if draws else ""

    def summary(self) -> dict[str, Any]:
        """Score, distance and what belongs beside them."""
        return dict(self.workspace.summary(self.genome)) if self.genome is not None else self._summary_outside()

    def explain(self) -> list[dict[str, Any]]:
        """Where the score comes from: a row per stage and goal, the greatest loss first."""
        return list(self.workspace.explain(self.genome)) if self.genome is not None else self._explain_outside()

    def _summary_outside(self) -> dict[str, Any]:
        """The summary of a layout outside the design rules.

        Raises:
            LayoutError: This workspace scores no such layouts.
        """
        raise LayoutError(self.broken_rule, rule="design")

    def _explain_outside(self) -> list[dict[str, Any]]:
        """The rows of a layout outside the design rules."""
        return []

    def facts(self) -> list[tuple[str, str]]:
        """Names and values that ``legible score`` prints, a line each."""
        values = self.summary() if self.genome is None else summary_of(self.workspace, self.genome)
        named = {"score": "legibility"}
        return [(named.get(key, key.replace("_", " ")), _shown(value)) for key, value in values.items()]

    def text(self, console: Console) -> RenderableType:
        """The layout for a terminal."""
        return (self.presenter or Presenter()).text(console, self.layout)

    def draw(self) -> Image | None:
        """The layout as ``legible show --out`` writes it, best with an observer's confusion; None without a picture."""
        return None if self.presenter is None else self.presenter.draw(self.layout, self.workspace)

    def write_picture(self, path: Path | None) -> tuple[str, Path] | None:
        """Write the picture of ``legible show``: what it shows, and where it is; None without a path.

        Raises:
            ValueError: Layouts of this workspace have no picture.
        """
        if path is None:
            return None
        from legible_envs.drawing import save_png

        picture = self.draw()
        if picture is None:
            raise ValueError(f"this {self.noun} has no picture: a presenter of its workspace can draw one")
        return self.picture, save_png(path, picture)

    def compared(self) -> list[dict[str, Any]]:
        """Rows about this layout and those that its run compares it with; none where there are none."""
        return []

    def predictors(self) -> list[tuple[str, GoalPredictor]]:
        """Predictors without parameters to learn, by name, that ``legible score --trajectories`` evaluates."""
        return []

    def recorded_here(self, trajectory: Trajectory) -> bool:
        """Whether a trajectory was recorded in this layout."""
        return bool(trajectory.layout == self.layout)


@dataclass(frozen=True)
class Part:
    """One search of those that one ``legible optimize`` makes.

    Attributes:
        folder: Where it is written.
        workspace: What it searches.
        title: Its name where there are several; else empty.
    """

    folder: Path
    workspace: Workspace
    title: str = ""


class Presenter:
    """How the layouts of a workspace are asked for, printed, drawn, and put on the page of a report.

    Every method has a plain default, so that a presenter says only what its workspace has of its own.

    Args:
        name: Name of the workspace; None takes that of the class.

    Attributes:
        name: Name of the workspace.
        noun: The word for one layout.
        options: Options of ``legible optimize`` that only this workspace has.
        own_files: Names of files that :meth:`parts` writes into the folder before its search begins.
        texts: Texts of the report.
    """

    name: str = ""
    noun: str = "layout"
    options: frozenset[str] = frozenset()
    own_files: frozenset[str] = frozenset()
    texts: ReportTexts = ReportTexts()

    def __init__(self, name: str | None = None) -> None:
        if name is not None:
            self.name = name

    # -- the command line ------------------------------------------------------------------------------------------

    def recognises(self, text: str, source: str) -> bool:
        """Whether a text is meant as a layout of this workspace; ``source`` is its path, or ``-``."""
        return False

    def read_design(self, text: str, name: str, asked: Mapping[str, Any]) -> Design:
        """A layout from its text.

        Args:
            text: The text, as the layout kind of the workspace's name writes it; without such a kind, the layout.
            name: What to call the source in messages.
            asked: Settings of the score given on the command line.

        Raises:
            LayoutError: It is malformed, or breaks the design rules.
            ValueError: The workspace does not know a setting.
        """
        workspace = make_workspace(self.name, **asked)
        layout: Any = text.strip("\r\n")
        if workspace.name in list_layout_kinds():
            layout = kind_named(workspace.name).from_text(text)
        return Design(layout, workspace, np.asarray(workspace.encode(layout)), "", dict(asked), presenter=self)

    def design_of_run(self, run: SearchResult, asked: Mapping[str, Any]) -> Design:
        """The best layout of a run; ``asked`` are settings of the score given on the command line."""
        workspace = workspace_of_run(run, asked)
        genome = run.require_genome()
        return Design(run.workspace.decode(genome), workspace, genome, "", dict(asked), presenter=self)

    def design(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of the workspace from options of the command line; options that are absent say nothing.

        Raises:
            click.UsageError: An option that this workspace does not offer.
        """
        if settings.get("start_from") is not None:
            raise click.UsageError(f"--start-from does not apply: {self.name} offers no layout to begin with")
        return {"prefix": settings["prefix"]} if settings.get("prefix") is not None else {}

    def folder_name(self, settings: Mapping[str, Any]) -> str:
        """Where a search is written that names no folder, without its workspace and seed."""
        return str(settings["objective"])

    def parts(self, config: Mapping[str, Any], settings: Mapping[str, Any], out: Path) -> list[Part]:
        """The searches to make for a workspace's settings; the first is that of the folder itself."""
        return [Part(out, make_workspace(config))]

    def text(self, console: Console, layout: Any) -> RenderableType:
        """A layout for a terminal."""
        from rich.text import Text

        return Text(text_of(layout))

    def draw(self, layout: Any, workspace: Any) -> Image | None:
        """A layout as a picture; None where this workspace has none."""
        return None

    def write_panels(self, run: SearchResult, path: Path | None = None) -> Path | None:
        """Write the figure of what a run compares into its folder; None where there is no such figure."""
        return None

    # -- the page of a report --------------------------------------------------------------------------------------

    def place(self, workspace: Any) -> dict[str, Any]:
        """Plain data with which the script draws layouts."""
        return {}

    def encode(self, layout: Any) -> Any:
        """A layout as the script reads it; plain data, small."""
        return text_of(layout)

    def title(self, data: Mapping[str, Any]) -> str:
        """The title of the page."""
        return f"A search for {WANTED.get(data['objective']['name'], 'good')} {self.noun}s: {self.name}"

    def carried(self, workspace: Workspace, room: int) -> int:
        """How many layouts fit into that many bytes."""
        sample = [self.encode(workspace.decode(g)) for g in workspace.sample(8, np.random.default_rng(0))]
        return room // max(len(json.dumps(layout)) + 1 for layout in sample)

    def paths(self, workspace: Any, layout: Any) -> list[Any]:
        """How people move in a layout and where their goal is in doubt, as the script reads it; by default nothing."""
        return []

    def panels(self, run: SearchResult) -> Sequence[Panel]:
        """Layouts to show side by side, found in the run's folder; none unless a workspace has such."""
        return ()

    def about_panels(self, panels: Sequence[Panel]) -> str:
        """What those layouts have in common, what to look for, and what their numbers say; by default the text."""
        return self.texts.panels

    def script(self) -> str:
        """JavaScript that defines ``makePlace(data, tools)``, which draws layouts on the page.

        ``data`` is the report's data, ``data.place`` being :meth:`place`; ``tools`` are ``svg``, ``el``, ``number``,
        ``plural`` and ``heat``, the colour of a share. It returns ``board(layout, paths)``, an element;
        ``asText(layout)``; ``inWords(label)`` of an axis; and optionally ``obstacles(layout)``, their number;
        ``codes``, what labels of axes are made of: ``[code, word, element]`` each; ``codesAbout``, how they are read;
        ``marks``, what is drawn on boards: ``[element, words]`` each; and ``doubt``, what the colours of :meth:`paths`
        mean: ``{title, low, high}``.
        """
        return template("plain.js")

    def icons(self) -> str:
        """SVG symbols that the script uses."""
        return ""


def template(name: str) -> str:
    """A template file of this package."""
    return (files("benchmarks") / "templates" / name).read_text(encoding="utf-8")


def text_of(layout: Any) -> str:
    """A layout as text: as its kind writes it, or else as it prints itself."""
    try:
        return kind_of(layout).to_text(layout)
    except LayoutError:
        return str(layout)


def summary_of(workspace: Workspace, genome: Any) -> dict[str, Any]:
    """The summary of a genome, with score and distance in any case."""
    own = workspace.summary(genome)
    missing = {"score": workspace.legibility, "distance": workspace.distance}
    return {**{key: float(of(genome)) for key, of in missing.items() if key not in own}, **own}


def workspace_of_run(run: SearchResult, asked: Mapping[str, Any]) -> Workspace:
    """The workspace that a run searched, with the settings asked for in place of its own."""
    return make_workspace({**run.config["workspace"], **asked}) if asked else run.workspace


def _shown(value: Any) -> str:
    return number(value, 4) if isinstance(value, float) else str(value)


def refuse(asked: Mapping[str, Any], option: str, noun: str) -> None:
    """Refuse an option that does not apply to this kind of layout.

    Raises:
        LayoutError: It was given.
    """
    if option in asked:
        raise LayoutError(f"--{option} does not apply: this is a {noun}", rule="type")


def as_genome(workspace: Workspace, layout: Any) -> tuple[npt.NDArray[Any] | None, str]:
    """A layout's genome, or None and the rule it breaks."""
    try:
        return np.asarray(workspace.encode(layout)), ""
    except LayoutError as error:
        return None, str(error)
