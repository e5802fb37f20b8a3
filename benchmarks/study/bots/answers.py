"""Random answers to questionnaires, valid for their items."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np

__all__ = ["ATTENTION", "random_answers"]

ATTENTION: Final = 0.95
"""How often an attention check is answered rightly."""

_WORDS: Final = (
    "The kitchen was clear.", "I walked round the blue tiles.", "Nothing to add.", "Naïve question: why “virtual”?",
    "=1+1", "<b>bold</b> & 'quotes'", "第二个更容易", "",
)  # fmt: skip
"""Comments, those among them that a careless program would trip over."""


def random_answers(
    items: Sequence[Mapping[str, Any]],
    rng: np.random.Generator,
    *,
    expected: Mapping[str, str] | None = None,
    attention: float = ATTENTION,
) -> dict[str, Any]:
    """An answer to every item, and to some of those that may be left out.

    Args:
        items: As the page gets them.
        rng: Source of the answers.
        expected: Right answers of attention checks by name of item.
        attention: How often these are given.

    Returns:
        ``{name: value}``, as the page sends it.
    """
    values: dict[str, Any] = {}
    for item in items:
        if not item["required"] and rng.random() < 0.25:
            continue
        if item["kind"] == "matrix":
            rows = range(1, len(item["rows"]) + 1)
            values |= {f"{item['name']}/{row}": int(rng.integers(1, item["points"] + 1)) for row in rows}
        else:
            right = (expected or {}).get(item["name"]) if rng.random() < attention else None
            values[item["name"]] = right or _answer(item, rng)
    return values


def _answer(item: Mapping[str, Any], rng: np.random.Generator) -> Any:
    if item["kind"] == "likert":
        return int(rng.integers(1, item["points"] + 1))
    if item["kind"] == "slider":
        steps = int((item["high"] - item["low"]) / item["step"] + 1e-9)
        return item["low"] + item["step"] * int(rng.integers(steps + 1))
    if item["kind"] == "text":
        words = [text for text in _WORDS if text or not item["required"]]
        return words[int(rng.integers(len(words)))][: item["most"]]
    options = list(item["options"])
    if item["kind"] == "choice" and item["several"]:
        chosen = [option for option in options if rng.random() < 0.5]
        return chosen or options[:1]
    return options[int(rng.integers(len(options)))]
