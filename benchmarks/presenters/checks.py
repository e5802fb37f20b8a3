"""Faults of a presenter of another package, in words."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.presenters.base import Presenter, ReportTexts, text_of
from benchmarks.presenters.registry import presenter_of
from legible_envs.support.contracts import ContractError, find_problems, refuse
from legible_envs.workspace import Workspace, make_workspace

__all__ = ["PresenterError", "check_presenter"]

_OPTIONS: Final = {
    "shape": (7, 7),
    "task": "columns",
    "condition": "all",
    "objective": "legibility",
    "seed": 0,
    "resume": False,
}
"""Options of ``legible optimize`` that say something by default."""
_OTHERS: Final = {"overcooked": "XOX\nX X\nXXX\n", "tabletop": '{"schema": 1, "objects": []}\n'}
"""Texts that belong to the presenters of the project."""
_ROOM: Final = 100_000
LAYOUTS: Final = 4


class PresenterError(ContractError):
    """A presenter breaks the contract of :class:`~benchmarks.presenters.Presenter`.

    Attributes:
        problems: One sentence for each problem.
    """


def check_presenter(presenter: Presenter | str, workspace: Workspace | None = None, *, seed: int = 0) -> None:
    """Check everything that the command line and the report rely on.

    Names and texts, terminal and picture, plain data on the page, the script, reading back what was written, settings,
    and that the global random state stays as it is.

    Args:
        presenter: The presenter, or the name of its workspace.
        workspace: The workspace whose layouts are presented; the one of the presenter's name if None.
        seed: Seed of the layouts that are tried.

    Raises:
        PresenterError: Something is wrong; ``problems`` lists each in a sentence.
        ValueError: No such workspace.
    """
    if isinstance(presenter, str):
        presenter = presenter_of(presenter)
    if not isinstance(presenter, Presenter):
        raise PresenterError(f"expected a Presenter, got {type(presenter).__name__}", ("not a Presenter",))
    if workspace is None:
        workspace = make_workspace(presenter.name)
    genomes = workspace.sample(LAYOUTS, np.random.default_rng(seed))
    checks = (_names, _terminal, _page, _reading, _settings)
    tried = {check.__name__.strip("_"): partial(check, presenter, workspace, genomes) for check in checks}
    refuse(presenter, "presenter", find_problems(tried), PresenterError)


def _names(presenter: Presenter, workspace: Workspace, genomes: Any) -> Iterator[str]:
    for name in ("name", "noun"):
        if not isinstance(getattr(presenter, name), str) or not getattr(presenter, name):
            yield f"{name} is {getattr(presenter, name)!r}; expected a word"
    if not isinstance(presenter.options, frozenset) or not all(isinstance(o, str) for o in presenter.options):
        yield f"options is {presenter.options!r}; expected a frozenset of names"
    if not isinstance(presenter.texts, ReportTexts):
        yield f"texts is a {type(presenter.texts).__name__}; expected ReportTexts"


def _terminal(presenter: Presenter, workspace: Workspace, genomes: Any) -> Iterator[str]:
    from rich.console import Console

    layout = workspace.decode(genomes[0])
    for encoding in ("utf-8", "ascii"):
        stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        console = Console(file=stream, width=120)
        console.print(presenter.text(console, layout))
        stream.flush()
    picture = presenter.draw(layout, workspace)
    if picture is not None and (np.asarray(picture).dtype != np.uint8 or np.shape(picture)[2:] != (3,)):
        found = np.asarray(picture)
        yield f"draw returned {found.dtype} of shape {found.shape}; expected uint8 (height, width, 3), or None"


def _page(presenter: Presenter, workspace: Workspace, genomes: Any) -> Iterator[str]:
    layouts = [workspace.decode(genome) for genome in genomes]
    data = {
        "place": presenter.place(workspace),
        "objective": {"name": "legibility"},
        "config": {"workspace": workspace.to_config()},
    }
    yield from _plain_problems("place", data["place"])
    for layout in layouts:
        encoded = presenter.encode(layout)
        yield from _plain_problems("encode", encoded)
        yield from _plain_problems("paths", presenter.paths(workspace, layout))
        if encoded != presenter.encode(layout):
            yield "encode gives different data for the same layout"
    if len({json.dumps(presenter.encode(layout)) for layout in layouts}) < len({text_of(each) for each in layouts}):
        yield "encode gives the same data for different layouts"
    carried = presenter.carried(workspace, _ROOM)
    if not isinstance(carried, int) or carried < 1:
        yield f"carried says that {carried!r} layouts fit into {_ROOM} bytes; expected at least 1"
    elif carried * len(json.dumps(presenter.encode(layouts[0]))) > 2 * _ROOM:
        yield f"carried says that {carried} layouts fit into {_ROOM} bytes, which they exceed twice over"
    title = presenter.title(data)
    if not isinstance(title, str) or not title:
        yield f"title is {title!r}; expected a sentence"
    if "function makePlace" not in presenter.script():
        yield "script does not define `function makePlace(data, tools)`"
    for name, text in (("script", presenter.script()), ("icons", presenter.icons())):
        if "</script" in text or "http://" in text.replace("http://www.w3.org", "") or "https://" in text:
            yield f"{name} ends its element or names an address; a report is one file that makes no request"


def _plain_problems(method: str, value: Any) -> Iterator[str]:
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError) as error:
        yield f"{method} is not plain data: {error}"


def _reading(presenter: Presenter, workspace: Workspace, genomes: Any) -> Iterator[str]:
    layout = workspace.decode(genomes[0])
    text = text_of(layout) + "\n"
    design = presenter.read_design(text, "layout.txt", {})
    if design.layout != layout:
        yield "read_design of a layout's text gives another layout"
    facts = design.facts()
    if not facts or not all(isinstance(part, str) for fact in facts for part in fact):
        yield f"facts of a layout are {facts!r}; expected pairs of name and value, both text"
    yield from _plain_problems("summary of a layout", design.summary())
    yield from _plain_problems("explain of a layout", design.explain())
    for other, foreign in _OTHERS.items():
        # Kitchens are read from what no other presenter recognises.
        if presenter.name not in (other, "overcooked") and presenter.recognises(foreign, "layout.txt"):
            yield f"it recognises a layout of {other!r} as its own"


def _settings(presenter: Presenter, workspace: Workspace, genomes: Any) -> Iterator[str]:
    found = presenter.design(_OPTIONS)
    if not isinstance(found, Mapping):
        yield f"design returned a {type(found).__name__}; expected settings of the workspace by name"
    else:
        make_workspace(presenter.name, **found)
    folder = presenter.folder_name(_OPTIONS)
    if not isinstance(folder, str) or not folder or "/" in folder:
        yield f"folder_name is {folder!r}; expected one name"
