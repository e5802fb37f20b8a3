"""Charts as bytes of a file: the same figure gives the same bytes, and an SVG that is small and can be read aloud."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final
from xml.dom import minidom

from legible_envs.support.names import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FORMATS", "render"]

# What would name the hour or the program that wrote the file.
_UNDATED: Final[dict[str, dict[str, None]]] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": {"Software": None},
}
FORMATS: Final = tuple(f".{kind}" for kind in _UNDATED)
"""Endings of files that charts are written to."""

_FONTS: Final = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
_MEASURED: Final = "'DejaVu Sans', sans-serif"
_DPI: Final = 200


def render(
    figure: Figure,
    kind: str,
    *,
    title: str = "",
    description: str = "",
    tips: Mapping[str, Sequence[str]] | None = None,
    font: str | None = None,
) -> bytes:
    """A figure as a file of some kind.

    Args:
        figure: To be drawn, in the style that is in force.
        kind: ``"svg"``, ``"pdf"`` or ``"png"``.
        title: For screen readers, in SVG.
        description: For screen readers, in SVG.
        tips: By the ``gid`` of an artist, what is said of each of its marks when it is pointed at, in SVG.
        font: Family that SVG viewers are to take before any other.
    """
    _write_out_names(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=_DPI, metadata=_UNDATED[kind])
    if kind != "svg":
        return stream.getvalue()
    return _readable_svg(stream.getvalue(), title, description, tips or {}, font)


def _write_out_names(figure: Figure) -> None:
    """Write out what is not seen in the texts of a figure: it has no glyph, and in an SVG it would be invalid XML."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):  # the texts of ticks come from their formatter whenever they are drawn
            formatter: Any = axis.get_major_formatter()
            if isinstance(formatter, FixedFormatter):
                formatter.seq = [printable(str(text), lines=True) for text in formatter.seq]
            elif isinstance(formatter, FuncFormatter) and not isinstance(formatter.func, _WrittenOut):
                formatter.func = _WrittenOut(formatter.func)
    for artist in figure.findobj(Text):
        if isinstance(artist, Text) and not (text := artist.get_text()).isprintable():
            artist.set_text(printable(text, lines=True))


class _WrittenOut:
    """A function that says what ticks are called, with what is not seen written out."""

    def __init__(self, of: Any) -> None:
        self.of = of

    def __call__(self, *args: Any) -> str:
        return printable(str(self.of(*args)), lines=True)


def _readable_svg(
    svg: bytes, title: str, description: str, tips: Mapping[str, Sequence[str]], font: str | None
) -> bytes:
    """One ``<svg>`` to be put into a page as it is: named, no wider than its place, without styles for all the page."""
    page = minidom.parseString(svg)
    root: Any = page.documentElement
    for name in ("metadata", "style"):
        for found in list(root.getElementsByTagName(name)):
            found.parentNode.removeChild(found)
    own = f"'{font}', " if font else ""
    family = f"font-family: {own}{_MEASURED}; "
    for text in root.getElementsByTagName("text"):  # nearly all have the one family, which is said once
        style = text.getAttribute("style").replace(family, "")
        text.setAttribute("style", style.replace(_MEASURED, _FONTS))  # matplotlib 3.9 puts all into one "font"
    for name, value in {
        "role": "img",
        "font-family": own + _FONTS,
        "stroke-linejoin": "round",
        "style": "max-width:100%;height:auto",
    }.items():
        root.setAttribute(name, value)
    for name, said in (("desc", description), ("title", title)):
        if said:
            root.insertBefore(_element(page, name, said), root.firstChild)
    groups = {group.getAttribute("id"): group for group in root.getElementsByTagName("g")}
    for name, tip in tips.items():
        for mark, said in zip(_marks(groups[name]), tip, strict=True):
            mark.appendChild(_element(page, "title", said))
    _shorten(root)
    return f"{root.toxml()}\n".encode()


def _element(page: minidom.Document, name: str, text: str) -> Any:
    element = page.createElement(name)
    element.appendChild(page.createTextNode(printable(text, lines=True)))
    return element


def _shorten(node: Any) -> None:
    """Drop what cannot be seen: white space, far decimals, turns by nothing, empty groups, and names of groups."""
    for child in list(node.childNodes):
        if child.nodeType == child.TEXT_NODE and not child.data.strip():
            node.removeChild(child)
        elif child.nodeType == child.ELEMENT_NODE and child.tagName not in ("text", "title", "desc"):
            _shorten(child)
    for child in list(node.childNodes):
        if child.nodeType != child.ELEMENT_NODE:
            continue
        for name in ("d", "x", "y"):
            if child.hasAttribute(name):
                child.setAttribute(name, _short(child.getAttribute(name)))
        if child.tagName == "text" and child.getAttribute("transform").startswith("rotate(-0 "):
            child.removeAttribute("transform")
        if child.tagName == "g":
            if child.hasAttribute("id"):
                child.removeAttribute("id")
            if not child.attributes.length:
                for inner in list(child.childNodes):
                    node.insertBefore(inner, child)
                node.removeChild(child)
        elif child.tagName == "defs" and not child.childNodes:
            node.removeChild(child)


def _short(numbers: str) -> str:
    """Coordinates to a hundredth of a point."""
    return " ".join(re.sub(r"(\.\d\d)\d+", r"\1", numbers).split())


def _marks(group: Any) -> list[Any]:
    """The elements that draw an artist's points, bars or squares: shapes used again, or else paths of their own."""
    used = group.getElementsByTagName("use")
    return list(used or [path for path in group.getElementsByTagName("path") if path.parentNode.tagName != "defs"])
