"""The picture and the table of rooms on the page "Architecture", made from the import rules and the docstrings.

    python docs/_ext/architecture.py    # writes docs/images/architecture.svg and docs/_rooms.md

A box may import the boxes below it: the floors are those of `[tool.importlinter]` in pyproject.toml, so
that the picture tells what `make lint` enforces. The sentence of a room is the first of its docstring.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[2]
PICTURE, ROOMS = ROOT / "docs/images/architecture.svg", ROOT / "docs/_rooms.md"

WIDTH, MARGIN, GAP, LEAF, TITLE = 1080, 12, 8, 30, 28
COLOURS = {"benchmarks": "#e8e1f5", "predictors": "#dcebf7", "optimizers": "#dcebf7", "legible_envs": "#e3f2e1"}
STYLE = """
text { font: 14px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; fill: #1f2328 }
.title { font-weight: 600 }
.room { fill: #ffffff; fill-opacity: .75; stroke: #57606a; stroke-width: .8 }
.box { stroke: #57606a; stroke-width: 1 }
"""


@dataclass
class Box:
    """A package or room: a name, and rows of the boxes inside, the highest floor first."""

    module: str
    rows: list[list[Box]] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.module.rpartition(".")[2]

    @property
    def height(self) -> float:
        if not self.rows:
            return LEAF
        return TITLE + sum(max(box.height for box in row) + GAP for row in self.rows) + 2

    @property
    def weight(self) -> float:
        """How much of a row's width it needs: its longest name, or its widest row."""
        rows = [sum(box.weight + 1 for box in row) for row in self.rows]
        return max([len(self.name) + 1, *rows])


def floors() -> dict[str, list[list[str]]]:
    """Modules by container, a list per floor, the highest first; the container of the packages is ``""``."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    found: dict[str, list[list[str]]] = {}
    for contract in contracts:
        if contract["type"] == "layers":
            (container,) = contract.get("containers", [""])
            found[container] = [re.findall(r"\w+", layer) for layer in contract["layers"]]
    return found


def house() -> list[list[Box]]:
    """The packages in rows; where no rule orders the rooms of a package, its folders stand side by side."""
    rules = floors()

    def box_of(module: str) -> Box:
        if module in rules:
            return Box(module, [[box_of(f"{module}.{name}") for name in row] for row in rules[module]])
        return Box(module, [] if "." in module else [[Box(f"{module}.{name}") for name in _folders(module)]])

    return [[box_of(name) for name in row] for row in rules[""]]


def _folders(module: str) -> list[str]:
    folder = ROOT / module.replace(".", "/")
    return sorted(path.parent.name for path in folder.glob("*/__init__.py"))


def draw() -> str:
    """The house as SVG."""
    parts: list[str] = []
    bottom = _draw_rows(house(), MARGIN, MARGIN, WIDTH - 2 * MARGIN, parts)
    label = "The packages and their rooms in floors; each may import what lies below it."
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {bottom + MARGIN:.0f}" role="img" '
            f'aria-label="{label}">',
            f"<title>{label}</title>",
            f"<style>{STYLE}</style>",
            f'<rect width="{WIDTH}" height="{bottom + MARGIN:.0f}" fill="#fff"/>',
            *parts,
            "</svg>\n",
        ]
    )


def _draw_rows(rows: list[list[Box]], left: float, top: float, width: float, parts: list[str]) -> float:
    """Draw rows of boxes below one another; returns where the last one ends."""
    for number, row in enumerate(rows):
        top += GAP if number else 0
        room, total = width - GAP * (len(row) - 1), sum(box.weight for box in row)
        height, x = max(box.height for box in row), left
        for box in row:
            _draw_box(box, x, top, room * box.weight / total, height, parts)
            x += room * box.weight / total + GAP
        top += height
    return top


def _draw_box(box: Box, x: float, y: float, width: float, height: float, parts: list[str]) -> None:
    kind = "box" if box.rows else "room"
    fill = f' fill="{COLOURS[box.module]}"' if box.module in COLOURS else ' fill="#ffffff" fill-opacity=".5"'
    parts.append(
        f'<rect class="{kind}"{fill if box.rows else ""} x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" '
        f'height="{height:.1f}" rx="5"/>'
    )
    if box.rows:
        parts.append(f'<text class="title" x="{x + 10:.1f}" y="{y + 19:.1f}">{escape(box.name)}</text>')
        _draw_rows(box.rows, x + GAP, y + TITLE, width - 2 * GAP, parts)
    else:
        parts.append(
            f'<text x="{x + width / 2:.1f}" y="{y + height / 2 + 5:.1f}" text-anchor="middle">{escape(box.name)}</text>'
        )


def rooms() -> str:
    """A table per package: each room, and the first sentence of its docstring."""
    lines: list[str] = []
    for row in house():
        for package in row:
            lines += [
                f"**{package.name}**: {sentence(package.module)}",
                "",
                "| room | what is in it |",
                "| --- | --- |",
            ]
            lines += [f"| `{path}` | {sentence(module)} |" for module, path in _rooms_in(package)]
            lines.append("")
    return "\n".join(lines)


def _rooms_in(box: Box) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for row in box.rows:
        for room in row:
            path = room.module.replace(".", "/")
            found.append((room.module, f"{path}/" if (ROOT / path).is_dir() else f"{path}.py"))
            found += _rooms_in(room)
    return found


def sentence(module: str) -> str:
    """The first sentence of a module's docstring, without Sphinx roles."""
    path = ROOT / module.replace(".", "/")
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = " ".join((ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0].split())
    text = re.sub(r":\w+:`~?\.?([^`]*)`", lambda match: f"`{match[1].rpartition('.')[2] or match[1]}`", text)
    return text.replace("``", "`").replace("|", "\\|")


def main() -> None:
    """Write both files."""
    PICTURE.write_text(draw(), encoding="utf-8")
    ROOMS.write_text(rooms(), encoding="utf-8")
    sys.stdout.write(f"{PICTURE}\n{ROOMS}\n")


if __name__ == "__main__":
    main()
