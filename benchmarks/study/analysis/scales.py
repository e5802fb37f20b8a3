"""Questionnaires scored: the mean of each scale's items, reversed items turned round, and attention checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from benchmarks.study.design.questionnaires import Item, Questionnaire, answered_names

__all__ = ["ScaleScore", "attention", "score"]

LEAST: float = 0.5
"""Share of a scale's items that must be answered for its mean to count."""


class ScaleScore(NamedTuple):
    """A scale of one participant.

    Attributes:
        scale: Its name.
        value: Mean over the answered items, in their unit; NaN where fewer than half of them are answered.
        answered: How many items are.
        items: How many the scale has.
    """

    scale: str
    value: float
    answered: int
    items: int


def score(questionnaire: Questionnaire, answers: Mapping[str, Any]) -> list[ScaleScore]:
    """The scales of a questionnaire: each the mean of its items. Of sliders 0 to 100 this is the raw TLX.

    Args:
        questionnaire: What was asked.
        answers: ``{name: value}`` as stored; a row of a matrix is ``NAME/1``, ….
    """
    values: dict[str, list[float]] = {}
    for item in questionnaire.items:
        if item.scale:
            values.setdefault(item.scale, []).extend(_number(item, answers.get(name)) for name in _names(item))
    found = []
    for scale, numbers in values.items():
        known = [value for value in numbers if not math.isnan(value)]
        enough = known and len(known) >= LEAST * len(numbers)
        found.append(ScaleScore(scale, sum(known) / len(known) if enough else math.nan, len(known), len(numbers)))
    return found


def attention(questionnaire: Questionnaire, answers: Mapping[str, Any]) -> tuple[int, int]:
    """How many attention checks were answered rightly, and how many there were."""
    checks = [item for item in questionnaire.items if item.kind == "attention"]
    return sum(answers.get(item.name) == item.expected for item in checks), len(checks)


def _names(item: Item) -> list[str]:
    return answered_names(Questionnaire.model_construct(title=item.name, items=[item]))


def _number(item: Item, value: Any) -> float:
    """The value of an item on its scale; NaN for none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return math.nan
    low, high = (item.low, item.high) if item.kind == "slider" else (1, item.points)
    if not low <= value <= high:
        return math.nan
    return float(low + high - value) if item.reverse else float(value)
