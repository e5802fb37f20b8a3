"""What the command line prints: kitchens in colour, several side by side, and small tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

    from benchmarks.report import Condition
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["board", "board_for", "boards", "number", "say", "table"]

_PLAIN = {"X": "##", "V": "[]", " ": "  "}
_FANCY = {"X": "▒▒", "V": "[]", " ": "  "}


def say() -> Console:
    """The console that commands print to: standard output, wide enough for boards when it is not a terminal."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=False)
    return console if console.is_terminal else Console(highlight=False, width=120)


def board(layout: OvercookedLayout, *, fancy: bool = True) -> Text:
    """A kitchen in the colours of its drawings; legible without colour too.

    Args:
        layout: The kitchen.
        fancy: Whether the terminal can show block characters.
    """
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
    glyphs = _FANCY if fancy else _PLAIN
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


def board_for(console: Console, layout: OvercookedLayout) -> Text:
    """A kitchen in the characters that this console can show."""
    return board(layout, fancy=console.encoding.lower().startswith("utf"))


def boards(console: Console, conditions: Sequence[Condition]) -> Table:
    """Kitchens side by side, each over its name, its scores and how it was chosen."""
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 4))
    for _ in conditions:
        grid.add_column(max_width=32)
    grid.add_row(*(board_for(console, c.layout) for c in conditions))
    grid.add_row()
    grid.add_row(*(Text(c.name, style="bold") for c in conditions))
    grid.add_row(*(f"legibility [bold cyan]{number(c.score)}[/]" for c in conditions))
    grid.add_row(*(f"distance   [bold]{number(c.distance, 1)}[/]" for c in conditions))
    grid.add_row(*(Text(c.note, style="dim") for c in conditions))
    return grid


def table(rows: Sequence[dict[str, Any]]) -> Table:
    """A table of rows that share their keys; numbers to the right."""
    from rich import box
    from rich.table import Table

    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in rows[0] if rows else ():
        numeric = all(isinstance(row[name], int | float) for row in rows)
        shown.add_column(name.replace("_", " "), justify="right" if numeric else "left")
    for row in rows:
        shown.add_row(*(_text(value) for value in row.values()))
    return shown


def _text(value: Any) -> str | RenderableType:
    from rich.text import Text

    if isinstance(value, float):
        return number(value, 3 if abs(value) < 10 else 1)
    return Text(str(value))


def number(value: float | None, digits: int = 2) -> str:
    """A number for reading, a dash where there is none."""
    return "-" if value is None or value != value else f"{value:,.{digits}f}"
