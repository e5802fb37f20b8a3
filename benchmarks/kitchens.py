"""What ``LAYOUT`` means on the command line, and how one kitchen is scored."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from benchmarks.runs import is_run_folder, read_run
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import OvercookedLayout

if TYPE_CHECKING:
    from legible_envs.overcooked.recipes import Recipe

__all__ = ["Kitchen", "load_kitchen"]


@dataclass(frozen=True)
class Kitchen:
    """A kitchen named on the command line.

    Attributes:
        layout: The kitchen.
        workspace: The design problem it belongs to, or None where it breaks the design rules (a recorded kitchen).
        genome: ``(d,)`` the kitchen in that workspace, or None.
        broken_rule: Why it has no genome, in a sentence.
        settings: Settings of the score that were asked for (``prefix``, ``pots``).
    """

    layout: OvercookedLayout
    workspace: Any
    genome: npt.NDArray[Any] | None
    broken_rule: str
    settings: dict[str, Any]

    def summary(self) -> dict[str, Any]:
        """Score, distance and what belongs beside them."""
        if self.genome is not None:
            return dict(self.workspace.summary(self.genome))
        from legible_envs.overcooked.scoring import score_layout

        return dict(score_layout(self.layout, **self._score_settings()))

    def explain(self) -> list[dict[str, Any]]:
        """A row per stage and goal, the greatest loss first."""
        if self.genome is not None:
            return list(self.workspace.explain(self.genome))
        from legible_envs.overcooked.scoring import explain_layout

        return explain_layout(self.layout, **self._score_settings())

    def ambiguity(self) -> npt.NDArray[np.float64]:
        """``(H, W)`` how often an observer would name a wrong goal, NaN where nobody walks."""
        if self.genome is not None:
            return np.asarray(self.workspace.ambiguity(self.genome))
        from legible_envs.overcooked.scoring import ambiguity

        return ambiguity(self.layout, **self._score_settings())

    def _score_settings(self) -> dict[str, Any]:
        """What was asked for, in the words of :mod:`legible_envs.overcooked.scoring`."""
        from legible_envs.overcooked.recipes import soup_task

        settings = dict(self.settings)
        return {"task": soup_task(self.soups, settings.pop("pots", None)), **settings}

    @property
    def soups(self) -> tuple[Recipe, ...]:
        """The soups that the scored task cooks."""
        if self.genome is not None:
            return tuple(self.workspace.recipes)
        from legible_envs.overcooked.play import recipes_for

        return recipes_for(self.layout)


def load_kitchen(source: str, *, prefix: str | None = None, pots: int | None = None) -> Kitchen:
    """Read a kitchen from a drawing, ``-`` (standard input), an Overcooked-AI ``.layout`` file or a run folder.

    Args:
        source: The path.
        prefix: Which prefixes count; None means the run's own setting, or ``"mean"``.
        pots: Soups in progress at once; None means the run's own setting, or no limit.

    Raises:
        LayoutError: The drawing is malformed; the message names row, column and rule.
        RunError: The run folder lacks something.
        OSError: The file cannot be read.
    """
    from legible_envs.workspace import make_workspace

    asked = {key: value for key, value in (("prefix", prefix), ("pots", pots)) if value is not None}
    if source != "-" and is_run_folder(source):
        run = read_run(source)
        workspace: Any = make_workspace({**run.config["workspace"], **asked}) if asked else run.workspace
        return Kitchen(run.workspace.decode(run.best_genome), workspace, run.best_genome, "", asked)
    layout = _read_drawing(source)
    try:
        workspace = make_workspace("overcooked", shape=layout.shape, **asked)
        return Kitchen(layout, workspace, np.asarray(workspace.encode(layout)), "", asked)
    except LayoutError as error:
        return Kitchen(layout, None, None, str(error), asked)


def _read_drawing(source: str) -> OvercookedLayout:
    if source != "-" and Path(source).is_dir():
        raise LayoutError(f"{source} is a folder without a config.json: neither a run nor a layout", rule="type")
    try:
        text = sys.stdin.read() if source == "-" else Path(source).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise LayoutError(
            f"{source} is not a text file; expected an ASCII drawing of a kitchen", rule="type"
        ) from error
    name = "standard input" if source == "-" else source
    try:
        if text.lstrip().startswith("{") or source.endswith(".layout"):
            return OvercookedLayout.from_overcooked_ai(text)
        return OvercookedLayout.from_ascii(text)
    except LayoutError as error:
        raise LayoutError(f"{name}: {error}", rule=error.rule, cell=error.cell) from error
