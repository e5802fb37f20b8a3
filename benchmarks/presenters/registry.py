"""Which presenter a workspace has, and which layout the command line means.

Built-in presenters are named, not imported, until one of their layouts is asked for.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.presenters.base import Design, Presenter
from legible_envs.errors import LayoutError
from legible_envs.support.plugins import Registry
from legible_envs.support.text import clean_text, decode_text, read_text
from legible_envs.workspace import workspace_class
from optimizers.errors import SearchError
from optimizers.runs.folder import is_run_folder

if TYPE_CHECKING:
    from optimizers import SearchResult

__all__ = [
    "GROUP",
    "list_presenters",
    "load_design",
    "presenter_of",
    "presenter_of_run",
    "read_source",
    "register_presenter",
    "usable_presenters",
]

GROUP: Final = "legible.presenters"
"""Entry point group of presenters that other packages bring."""

_registry = Registry(
    "presenter",
    GROUP,
    {
        "tabletop": "benchmarks.presenters.tabletop:TablePresenter",
        # Asked last: what no other presenter recognises is read as a drawing, whose errors name row and column.
        "overcooked": "benchmarks.presenters.overcooked:KitchenPresenter",
    },
    ValueError,
)


def register_presenter(name: str, presenter: type[Presenter], *, overwrite: bool = False) -> None:
    """Make a presenter known for the workspace of that name, for the rest of this process.

    Args:
        name: Name of the workspace.
        presenter: The class, which is called without arguments.
        overwrite: Whether it may replace an earlier registration of that name.

    Raises:
        ValueError: The name is taken, or the presenter cannot be called.
    """
    _registry.register(name, presenter, overwrite=overwrite)


def list_presenters() -> list[str]:
    """Names of the workspaces that have a presenter of their own, in the order in which they are asked for a text."""
    known = _registry.list()
    return sorted(known, key=lambda name: known[name].origin == "built in")


def presenter_of(name: str) -> Presenter:
    """The presenter of a workspace: its own, or the plain one.

    Args:
        name: Any name that :func:`legible_envs.workspace.make_workspace` takes.

    Raises:
        ValueError: No such workspace, or its presenter cannot be made.
    """
    own = _own_name(name)
    if own not in _registry.list():
        return Presenter(name)
    presenter = _registry.resolve(own)()
    if not isinstance(presenter, Presenter):
        raise ValueError(f"presenter {own!r} must be a Presenter, got {type(presenter).__name__}")
    return presenter


def _own_name(name: str) -> str:
    """The short name of a workspace that is given as ``module:Class``, where it has one."""
    cls = workspace_class(name)
    short = getattr(cls, "name", name)
    if ":" not in name or short not in _registry.list():
        return name
    try:
        return short if workspace_class(short) is cls else name
    except ValueError:
        return name


def usable_presenters() -> Iterator[Presenter]:
    """Every presenter that can be made, in the order of :func:`list_presenters`; a broken plug-in is left out."""
    for name in list_presenters():
        try:
            yield presenter_of(name)
        except ValueError:
            continue


def load_design(
    source: str,
    *,
    workspace: str | None = None,
    prefix: Any = None,
    pots: int | None = None,
    task: str | None = None,
    player: int | None = None,
) -> Design:
    """Read what LAYOUT names: the text of a layout, ``-`` (standard input), or the folder of a search.

    Args:
        source: The path.
        workspace: The workspace that a text is a layout of; None asks every presenter whether it recognises the text.
        prefix: Which prefixes count; None means the run's own setting, or ``"mean"``.
        pots: Soups in progress at once, in a kitchen; None means the run's own setting, or no limit.
        task: What is built on a table: a name, or the path of a YAML file. None means the run's own, or the one task
            of the package that has the table's objects.
        player: Whose score it is, in a kitchen, by the number of their start. None means player 1.

    Raises:
        LayoutError: The layout is malformed; the message says where.
        SearchError: The run folder lacks something.
        OSError: The file cannot be read.
    """
    given = {"prefix": prefix, "pots": pots, "task": task, "player": player}
    asked = {key: value for key, value in given.items() if value is not None}
    if source != "-" and is_run_folder(source):
        from optimizers import load_run

        run = load_run(source)
        return presenter_of_run(run).design_of_run(run, asked)
    name, text = read_source(source)
    if workspace is not None:
        return presenter_of(workspace).read_design(text, name, asked)
    for presenter in usable_presenters():
        if presenter.recognises(text, source):
            return presenter.read_design(text, name, asked)
    raise LayoutError(f"{name} is no layout that a presenter recognises; name its --workspace", rule="type")


def presenter_of_run(run: SearchResult) -> Presenter:
    """The presenter of the workspace that a run searched.

    Raises:
        SearchError: Its manifest names no workspace.
        ValueError: No such workspace, or its presenter cannot be made.
    """
    name = run.config["workspace"].get("workspace")
    if not isinstance(name, str):
        raise SearchError(f"{run.folder}: its manifest names no workspace")
    return presenter_of(name)


def read_source(source: str) -> tuple[str, str]:
    """What to call a source in messages, and its text.

    Raises:
        LayoutError: It is a folder, or not a text file.
        OSError: The file cannot be read.
    """
    if source != "-" and Path(source).is_dir():
        raise LayoutError(f"{source} is a folder without a config.json: neither a run nor a layout", rule="type")
    try:
        if source != "-":
            return source, read_text(source)
        name, data = "standard input", getattr(sys.stdin, "buffer", sys.stdin).read()
        return name, decode_text(data, name) if isinstance(data, bytes) else clean_text(data)
    except ValueError as error:
        raise LayoutError(f"{error}; expected the text of a layout", rule="type") from error
