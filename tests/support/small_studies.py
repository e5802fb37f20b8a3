"""Studies of a few rounds, as folders."""

from __future__ import annotations

import re
from pathlib import Path

from benchmarks.study.design.new import new_study

__all__ = ["small_study"]

ONE_SOUP = '[["onion", "onion", "onion"]]'
_LESS = {
    "overcooked": {r"attempts = 3": "attempts = 2"},
    "tabletop": {r"reaches = 3 ": "reaches = 2 ", r"reaches = 8 ": "reaches = 3 "},
}


def small_study(folder: Path, domain: str, *, conditions: int = 2, soups: str = ONE_SOUP, **settings: str) -> Path:
    """Write the paper's study with fewer conditions and shorter rounds.

    Args:
        folder: Where.
        domain: ``"overcooked"`` or ``"tabletop"``.
        conditions: How many of the four are kept.
        soups: Kitchens: what is cooked in a round, as TOML.
        **settings: TOML values that replace those of keys, wherever they stand.

    Returns:
        The folder.
    """
    file = new_study(folder, domain=domain)
    text = file.read_text(encoding="utf-8")
    for pattern, replacement in _LESS[domain].items():
        text, count = re.subn(pattern, replacement, text)
        assert count, pattern
    text = re.sub(r"soups = \[\[\"tomato.*", f"soups = {soups}", text)
    entries = re.findall(r"\[\[conditions\]\]\nname = .*\nlayout = .*\n\n", text)
    for entry in entries[conditions:]:
        text = text.replace(entry, "")
    for key, value in settings.items():
        text, count = re.subn(rf"(?m)^{key} = [^#\n]*", f"{key} = {value} ", text)
        assert count, key
    file.write_text(text, encoding="utf-8")
    return folder
