"""Output of the command line: kitchens and tables in colour, and rows of numbers.

Names in what is printed come from strangers. Nothing that is printed through :func:`say` or :func:`tell` is markup, and
characters that steer a terminal or are not seen are written out (:func:`legible_envs.support.names.printable`).
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Context, Decimal
from functools import cache
from typing import TYPE_CHECKING, Any

from legible_envs.support.names import printable

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.tabletop import TabletopLayout

__all__ = ["kitchen_text", "number", "plural", "say", "table", "table_text", "tell"]

_PLAIN = {"X": "##", "V": "[]", " ": "  "}
_FANCY = {"X": "▒▒", "V": "[]", " ": "  "}


def say() -> Console:
    """The console that commands print to: standard output, wide enough for panels when it is not a terminal.

    ``COLUMNS`` sets another width.
    """
    console = _console_class()(**_PLAIN_TEXT)
    return console if console.is_terminal or "COLUMNS" in os.environ else _console_class()(**_PLAIN_TEXT, width=120)


def tell(text: str, *, err: bool = False) -> None:
    """Print lines of text to standard output, or to standard error."""
    import click

    click.echo(printable(text, lines=True), err=err)


_PLAIN_TEXT: Any = {"markup": False, "emoji": False, "highlight": False, "soft_wrap": False}


@cache
def _console_class() -> type[Console]:
    """Rich's console, but that no text in whatever it prints reaches the terminal as more than text."""
    from rich.console import Console
    from rich.segment import Segment

    class SafeConsole(Console):
        def render(self, *args: Any, **kwargs: Any) -> Any:
            for segment in super().render(*args, **kwargs):
                if segment.control or segment.text.isprintable() or segment.text == "\n":
                    yield segment
                else:
                    yield Segment(printable(segment.text, lines=True), segment.style)

        def status(self, status: Any, **options: Any) -> Any:
            return super().status(_line(status), **options)

    return SafeConsole


def _line(text: Any) -> Any:
    """A text that rich, which reads markup in some places whatever its console says, takes as it is."""
    from rich.text import Text

    return Text(printable(text)) if isinstance(text, str) else text


def kitchen_text(console: Console, layout: OvercookedLayout) -> Text:
    """A kitchen in the colours of its drawings and the characters that this console can show."""
    from rich.text import Text

    from legible_envs.overcooked.layout import STATION_TYPES, SYMBOLS
    from legible_envs.overcooked.rendering.palette import PALETTE

    styles = {
        " ": f"on {PALETTE['floor']}",
        "X": f"{PALETTE['counter_line']} on {PALETTE['counter']}",
        "V": f"bold {PALETTE['obstacle_edge']} on {PALETTE['obstacle']}",
    }
    for number, kind in enumerate(STATION_TYPES):
        styles[SYMBOLS[3 + number]] = f"bold {_ink(PALETTE[kind])} on {PALETTE[kind]}"
    glyphs = _FANCY if console.encoding.lower().startswith("utf") else _PLAIN
    text = Text(no_wrap=True)
    for i, row in enumerate(layout.cells):
        text.append("\n" if i else "")
        for code in row:
            symbol = SYMBOLS[code]
            text.append(glyphs.get(symbol, f" {symbol}"), style=styles[symbol])
    return text


def _ink(ground: str) -> str:
    """Black or white, whichever can be read on a ``#rrggbb`` ground."""
    red, green, blue = (int(ground[i : i + 2], 16) for i in (1, 3, 5))
    return "#1d120a" if 0.299 * red + 0.587 * green + 0.114 * blue > 130 else "#ffffff"


_ON_TOP = {"circle": "●", "triangle": "▲", "square": "■", "star": "★", "diamond": "◆", "heart": "♥", "plus": "✚"}
_COLUMN, _LINE = 0.02, 0.04  # metres of a character of a table
_WIDEST = 240  # characters; larger tables are drawn to a smaller scale


def table_text(console: Console, layout: TabletopLayout) -> Text:
    """A table as a map of characters, 2 cm by 4 cm each, in the colours of its drawings.

    An object is its shape (or the initial of it, where the console shows plain characters only) and the initial of its
    colour; virtual obstacles are lines, starts of the hand ``o``.
    """
    from rich.text import Text

    from legible_envs.tabletop.rendering.palette import TABLE, hex_of

    fancy = console.encoding.lower().startswith("utf")
    width, depth = layout.table.size
    coarse = max(1.0, width / _COLUMN / _WIDEST, depth / _LINE / _WIDEST)
    across, up = _COLUMN * coarse, _LINE * coarse
    columns, lines = max(1, round(width / across)), max(1, round(depth / up))
    grounds = [[_ground(layout, (c + 0.5) * across, (r + 0.5) * up) for c in range(columns)] for r in range(lines)]
    cells = [[(" ", f"on {ground}") for ground in row] for row in reversed(grounds)]

    def put(x: float, y: float, text: str, style: str) -> None:
        row, column = lines - 1 - int(min(y / up, lines - 1)), round(x / across - len(text) / 2)
        for i, symbol in enumerate(text):
            if 0 <= column + i < columns and 0 <= row < lines:
                cells[row][column + i] = symbol, style

    for x, y in layout.table.starts.values():
        put(x, y, "o", f"bold {TABLE['start']} on {TABLE['top']}")
    for obstacle in layout.obstacles:
        for x, y in _along(obstacle.at, obstacle.angle, obstacle.size[0]):
            put(x, y, "▒" if fancy else "#", f"{TABLE['obstacle_edge']} on {TABLE['obstacle']}")
    for box in layout.objects:
        colour, letter = hex_of(box.colour), _initial(box.shape).upper()
        symbol = _ON_TOP.get(box.shape, letter) if fancy else letter
        put(*box.at, f"{symbol}{_initial(box.colour)}", f"bold {_ink(colour)} on {colour}")
    text = Text(no_wrap=True)
    for i, line in enumerate(cells):
        text.append("\n" if i else "")
        for symbol, style in line:
            text.append(symbol, style=style)
    return text


def _initial(name: str) -> str:
    """The first character of a name, where that is one character wide on the map; else a question mark."""
    from rich.cells import cell_len

    first = name[:1]
    return first if first.isprintable() and cell_len(first.upper()) == 1 == cell_len(first) else "?"


def _ground(layout: TabletopLayout, x: float, y: float) -> str:
    """The colour of the table at a point."""
    from legible_envs.tabletop.rendering.palette import TABLE

    for name in ("region", "assembly"):
        x0, y0, x1, y1 = getattr(layout.table, name)
        if x0 <= x <= x1 and y0 <= y <= y1:
            return TABLE[name]
    return TABLE["top"]


def _along(at: tuple[float, float], angle: float, length: float) -> list[tuple[float, float]]:
    """Points every centimetre along an obstacle."""
    import math

    count = max(2, round(length / 0.01))
    steps = [length * (i / (count - 1) - 0.5) for i in range(count)]
    return [(at[0] + s * math.cos(angle), at[1] + s * math.sin(angle)) for s in steps]


def table(rows: Sequence[dict[str, Any]]) -> Table:
    """A table of rows that share their keys; numbers to the right."""
    from rich import box
    from rich.table import Table

    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in rows[0] if rows else ():
        numeric = all(isinstance(row[name], int | float) for row in rows)
        heading = _line(name.replace("_", " "))
        shown.add_column(heading, justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        shown.add_row(*(_text(value) for value in row.values()))
    return shown


def _text(value: Any) -> str | RenderableType:
    if isinstance(value, float):
        return number(value, 3 if abs(value) < 10 else 1)
    return _line(str(value))  # type: ignore[no-any-return]


def number(value: float | None, digits: int = 2) -> str:
    """A number for reading, a dash where there is none; the one rule by which numbers are rounded here.

    The exact value is rounded once, halves away from zero, as the scripts of the reports do: whatever shows a number
    must be given it unrounded, or two places may differ in the last digit. Zero has no sign.

    Example:
        >>> number(-25.17499), number(0.125), number(1234.5, 0), number(-0.001), number(None)
        ('-25.17', '0.13', '1,235', '0.00', '-')
    """
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return str(value)
    exact = Decimal(float(value))
    rounded = exact.quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP, _AS_LONG_AS_IT_TAKES)
    return f"{rounded if rounded else abs(rounded):,f}"


_AS_LONG_AS_IT_TAKES = Context(prec=800)


def plural(count: int, noun: str) -> str:
    """A number of things, with the noun in the singular or the plural.

    Example:
        >>> plural(1, "evaluation"), plural(2_000, "evaluation"), plural(0, "trajectory"), plural(2, "search")
        ('1 evaluation', '2,000 evaluations', '0 trajectories', '2 searches')
    """
    if count == 1:
        return f"1 {noun}"
    if noun.endswith("y") and noun[-2] not in "aeiou":
        return f"{count:,} {noun[:-1]}ies"
    return f"{count:,} {noun}{'es' if noun.endswith(('s', 'x', 'ch', 'sh')) else 's'}"
