"""Studies whose rounds take seconds: a kitchen of six cells, a table with two cubes to bring."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks.study.design.package_files import package_texts, read_file

KITCHENS = {
    "practice": "XPSX\nO1 D\nXXXX",
    "Legible": "XXPSX\nO1  D\nX V X\nXXXXX",
    "Baseline": "XPSX\nO1 D\nXXXX",
}
SOUP = ["onion", "onion"]
# From the start of "practice" and "Baseline": two onions into the pot, a dish, the soup, the serving hatch.
SMALL_WAY = list("WINIWINIEEIWNIENI")
# From the start of "Legible": one cell farther from the onions to the pot.
LEGIBLE_WAY = list("WIENIWIENIEIWNIENI")
ACTIONS = {"N": 0, "S": 1, "E": 2, "W": 3, ".": 4, "I": 5}
KEYS = {"N": "ArrowUp", "S": "ArrowDown", "E": "ArrowRight", "W": "ArrowLeft", "I": "Space", ".": "Period"}
BUTTONS = {"N": "north", "S": "south", "E": "east", "W": "west", "I": "interact", ".": "stay"}

TASK = """
schema: 1
name: two
table:
  size: [0.8, 0.5]
  region: [0.10, 0.15, 0.45, 0.40]
  assembly: [0.60, 0.10, 0.75, 0.45]
  starts: {home: [0.40, 0.06], assembly: [0.66, 0.25]}
  hand: 0.025
objects:
- {name: red-circle, at: [0.20, 0.30], colour: red, shape: circle}
- {name: blue-star, at: [0.35, 0.30], colour: blue, shape: star}
configuration:
  red-circle: [0.66, 0.35]
  blue-star: [0.66, 0.18]
task:
  start: home
  subtasks:
  - {name: red-circle, goals: [red-circle], then: [assembly]}
  - {name: blue-star, goals: [blue-star], then: [assembly]}
"""
PLACES = {"Baseline": ([0.20, 0.30], [0.35, 0.30]), "Legible": ([0.15, 0.20], [0.40, 0.34])}
BAR = {"at": [0.25, 0.19], "angle": 0.0, "size": [0.1, 0.01]}


def write_small_study(folder: Path, domain: str, settings: dict[str, Any], files: dict[str, str]) -> Path:
    """Write the folder of a study.

    Args:
        folder: Where to.
        domain: ``"overcooked"`` or ``"tabletop"``.
        settings: What differs from the small study, by dotted key; None leaves a key out.
        files: More files, or others, by path.
    """
    is_kitchen = domain == "overcooked"
    layouts = KITCHENS if is_kitchen else _tables()
    end = "txt" if is_kitchen else "json"
    content: dict[str, Any] = {
        "schema": 1,
        "name": "small",
        "title": "A small study",
        "domain": domain,
        "conditions": [{"name": name, "layout": f"layouts/{name}.{end}"} for name in ("Legible", "Baseline")],
        "practice": {"layout": f"layouts/practice.{end}", "attempts": 2, "max_steps": 60},
        "rounds": {"per_condition": 1, "max_steps": 120},
        "orders": {"policy": "fixed"},
    }
    if is_kitchen:
        content["practice"]["soups"] = [SOUP]
        content["kitchen"] = {"soups": [SOUP], "cook_time": 2, "waiting": 0.0}
    else:
        content["practice"] |= {"reaches": 1, "max_steps": 3600}
        content["rounds"] = {"per_condition": 1, "max_steps": 3600}
        content["table"] = {"task": "two.yaml"}
    for key, value in settings.items():
        *parents, last = key.split(".")
        place = content
        for parent in parents:
            place = place.setdefault(parent, {})
        place[last] = value
        if value is None:
            del place[last]
    texts = {f"texts/{name}.md": text for name, text in package_texts(domain).items()}
    texts["texts/words.toml"] = read_file("texts/common/words.toml")
    texts |= {f"layouts/{name}.{end}": text for name, text in layouts.items()}
    texts["study.toml"] = "".join(f"{key} = {_toml(value)}\n" for key, value in content.items())
    if not is_kitchen:
        texts["two.yaml"] = TASK
    for path, text in (texts | files).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


def small_table(places: str, obstacles: list[dict[str, Any]]) -> str:
    """The JSON of a table with the cubes in these :data:`PLACES`."""
    import yaml

    plain = yaml.safe_load(TASK)
    objects = [{**obj, "at": at} for obj, at in zip(plain["objects"], PLACES[places], strict=True)]
    return json.dumps({"schema": 1, "table": plain["table"], "objects": objects, "obstacles": obstacles})


def _tables() -> dict[str, str]:
    return {
        "practice": small_table("Baseline", []),
        "Baseline": small_table("Baseline", []),
        "Legible": small_table("Legible", [BAR]),
    }


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)
