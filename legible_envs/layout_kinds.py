"""Kinds of layouts by name: how a trajectory file keeps the layout that a trajectory happened in.

A kind joins the class of a layout to its text. Trajectory files store the kind's name beside the text. So they hold
layouts of every workspace, including those of other packages, and no file format names an environment:

>>> kind_named("overcooked").layout.__name__
'OvercookedLayout'

A package adds its own with one line of ``pyproject.toml``, which names a :class:`LayoutKind`::

    [project.entry-points."legible.layouts"]
    aisle = "my_package.layout:AISLE"
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from legible_envs.errors import LayoutError
from legible_envs.support.plugins import Registry

__all__ = ["GROUP", "LayoutKind", "kind_named", "kind_of", "kind_of_line", "list_layout_kinds", "register_layout_kind"]

GROUP: Final = "legible.layouts"
"""Entry point group of layout kinds that other packages bring."""


@dataclass(frozen=True)
class LayoutKind:
    """How layouts of one class are written as text and read back.

    Layouts are values: hashable, and equal where their content is. ``from_text(to_text(layout)) == layout``, and the
    same holds for lines.

    Attributes:
        name: The name that files keep.
        layout: The class of its layouts; subclasses count.
        to_text: The text of a layout, any number of lines.
        from_text: Reads it; raises :class:`~legible_envs.errors.LayoutError` where it is malformed.
        to_line: A text without line breaks, for CSV; None takes ``to_text``, whose line breaks CSV quotes.
        from_line: Reads that.
        recognises: Whether a line is meant as a layout of this kind where a CSV file names no kind. Only what the line
            itself says counts; the default claims nothing, and files then name the kind.
        schema: First schema of ``.npz`` files that may hold this kind.
    """

    name: str
    layout: type
    to_text: Callable[[Any], str]
    from_text: Callable[[str], Any]
    to_line: Callable[[Any], str] | None = None
    from_line: Callable[[str], Any] | None = None
    recognises: Callable[[str], bool] = lambda line: False
    schema: int = 3

    def line(self, layout: Any) -> str:
        """The layout as the cell of a CSV file."""
        return (self.to_line or self.to_text)(layout)

    def read_line(self, line: str) -> Any:
        """The layout that :meth:`line` wrote.

        Raises:
            LayoutError: The line is malformed.
        """
        return (self.from_line or self.from_text)(line)


_registry = Registry(
    "layout kind",
    GROUP,
    {
        "overcooked": "legible_envs.overcooked.layout_kind:KITCHEN",
        "tabletop": "legible_envs.tabletop.layout_kind:TABLE",
    },
    partial(LayoutError, rule="kind"),
    accepts=LayoutKind,
)


def register_layout_kind(kind: LayoutKind, *, overwrite: bool = False) -> None:
    """Make a layout kind known by its name for the rest of this process.

    Args:
        kind: The kind.
        overwrite: Whether it may replace an earlier registration of that name.

    Raises:
        LayoutError: It is no :class:`LayoutKind`, or its name is taken.
    """
    _registry.register(getattr(kind, "name", "?"), kind, overwrite=overwrite)


def list_layout_kinds() -> list[str]:
    """Names of all kinds: built in, of installed packages, and registered in this process."""
    return list(_registry.list())


def kind_named(name: str) -> LayoutKind:
    """The kind of that name.

    Raises:
        LayoutError: There is none, and the message names the known ones and the entry point group; or it cannot be
            imported.
    """
    if name not in _registry:
        raise LayoutError(
            f"no layout kind named {name!r}; known: {list_layout_kinds()}. A package adds one under the entry point "
            f"group {GROUP!r}, a program with `register_layout_kind`",
            rule="kind",
        )
    kind: LayoutKind = _registry.resolve(name)
    return kind


def kind_of(layout: object) -> LayoutKind:
    """The kind whose class a layout has.

    Raises:
        LayoutError: No kind has this class.
    """
    for kind in _usable():
        if isinstance(layout, kind.layout):
            return kind
    raise LayoutError(
        f"layouts of the class {type(layout).__name__} have no kind, so that no file can hold them; known: "
        f"{list_layout_kinds()}. A package adds one under the entry point group {GROUP!r}, a program with "
        "`register_layout_kind`",
        rule="kind",
    )


def kind_of_line(line: str) -> LayoutKind | None:
    """The first kind that recognises a line of text, or None."""
    return next((kind for kind in _usable() if kind.recognises(line)), None)


def _usable() -> Iterator[LayoutKind]:
    """All kinds that can be imported, built-in ones first: a broken plug-in spoils nothing that is not its own."""
    first = _registry.built_in()
    yield from map(_registry.resolve, first)
    for name in _registry.list():
        try:
            if name not in first:
                yield _registry.resolve(name)
        except LayoutError:
            continue
