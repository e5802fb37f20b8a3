"""Questionnaires as data: what is asked, and which answers are answers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final

from benchmarks.study.design.names import Slug
from legible_envs.support.models import Choice, FileModel, Flag, Length, Real, Text, Whole
from legible_envs.support.validation import shown

__all__ = [
    "AnswersError",
    "Item",
    "Questionnaire",
    "answered_names",
    "item_problems",
    "read_answers",
]


class Item(FileModel):
    """One item of a questionnaire.

    Attributes:
        name: Unique in the questionnaire.
        kind: ``"likert"`` (``points`` buttons between two labels), ``"slider"`` (``low`` to ``high`` by ``step``
            between two labels), ``"choice"`` (one of ``options``, or several with ``several``), ``"text"``,
            ``"matrix"`` (a likert for each of ``rows``), ``"attention"`` (a choice whose right answer is ``expected``).
        text: What is asked; plain text.
        help: Below it, smaller.
        labels: Of the two ends of a likert or slider, or of each point of a likert or matrix.
        points: Of a likert or matrix.
        low, high, step: Of a slider.
        options: Of a choice or attention check.
        several: Whether several options may be chosen.
        rows: Of a matrix; each is answered as ``NAME/ROW-NUMBER``.
        required: Whether the page goes on without an answer.
        most: Characters of a text.
        reverse: Whether the score of a likert is turned round in scales.
        scale: The scale whose mean (or sum) it counts to in the analysis; empty: none.
        expected: Right answer of an attention check.
    """

    name: Annotated[str, Slug()]
    kind: Annotated[str, Choice("likert", "slider", "choice", "text", "matrix", "attention")]
    text: Annotated[str, Text(2000)]
    help: Annotated[str, Text(2000, empty=True)] = ""
    labels: Annotated[list[Annotated[str, Text(200, empty=True)]], Length(0, 21)] = []
    points: Annotated[int, Whole(2, 21)] = 7
    low: Annotated[float, Real()] = 0
    high: Annotated[float, Real()] = 100
    step: Annotated[float, Real(0, closed="right")] = 5
    options: Annotated[list[Annotated[str, Text(500)]], Length(0, 100)] = []
    several: Annotated[bool, Flag()] = False
    rows: Annotated[list[Annotated[str, Text(500)]], Length(0, 50)] = []
    required: Annotated[bool, Flag()] = True
    most: Annotated[int, Whole(1, 20_000)] = 2000
    reverse: Annotated[bool, Flag()] = False
    scale: Annotated[str, Text(80, empty=True)] = ""
    expected: Annotated[str, Text(500, empty=True)] = ""


class Questionnaire(FileModel):
    """A questionnaire.

    Attributes:
        title: Heading of its page.
        text: Markdown above the items.
        source: Where it comes from: a reference.
        items: In the order to be asked.
    """

    title: Annotated[str, Text(200)]
    text: Annotated[str, Text(5000, empty=True)] = ""
    source: Annotated[str, Text(1000, empty=True)] = ""
    items: Annotated[list[Item], Length(1, 200)]


def answered_names(questionnaire: Questionnaire) -> list[str]:
    """The names under which answers are stored: of items, and ``NAME/1``, ``NAME/2``, … of the rows of a matrix."""
    return [name for item in questionnaire.items for name in _names_of(item)]


class AnswersError(ValueError):
    """Answers that are none.

    Args:
        message: What is wrong first: which item, what was expected and what came.
        problems: By the name of the answer, the key of the study's words that says to the participant what is wrong:
            ``answer_missing``, ``answer_not_valid`` or ``answer_too_long``. Empty where it is no participant's fault.
    """

    def __init__(self, message: str, problems: Mapping[str, str] | None = None) -> None:
        super().__init__(message)
        self.problems = dict(problems or {})


class _Refused(Exception):
    """An answer that is none: the word for the participant, and what was expected."""

    def __init__(self, word: str, expected: str) -> None:
        super().__init__(expected)
        self.word = word


def read_answers(questionnaire: Questionnaire, values: object) -> dict[str, Any]:
    """The answers of a participant, checked: every value one that its item has, required ones there.

    Args:
        questionnaire: What was asked.
        values: ``{name: value}`` as the page sends them: numbers for likerts, sliders and rows of a matrix, a text or
            list of texts for choices, texts. Left out or None: not answered. A text of blanks and an empty list are no
            answers either.

    Returns:
        ``{name: value}`` of all :func:`answered_names` in order; None where nothing was answered. Likerts are integers
        from 1, sliders floats on one of their steps; of several options, those chosen in the order of the item. What
        in a text is no character (halves of pairs, zeros) is replaced by U+FFFD.

    Raises:
        AnswersError: A ``ValueError`` that says which item, what was expected and what came; its ``problems`` name
            every answer that is wrong.
    """
    if not isinstance(values, dict):
        raise AnswersError(f"answers are a mapping of names to values, got {shown(values)}")
    names = answered_names(questionnaire)
    unknown = [key for key in values if key not in names]
    if unknown:
        raise AnswersError(f"there is no item {shown(unknown[0])}; expected {', '.join(names)}")
    found: dict[str, Any] = {}
    problems: dict[str, str] = {}
    first = ""
    for item in questionnaire.items:
        for name in _names_of(item):
            try:
                found[name] = _read(item, values.get(name))
            except _Refused as refusal:
                problems[name] = refusal.word
                first = first or f"`{name}` must be {refusal}, got {shown(values.get(name))}"
    if problems:
        raise AnswersError(first, problems)
    return found


def _names_of(item: Item) -> list[str]:
    return [f"{item.name}/{n}" for n in range(1, len(item.rows) + 1)] if item.kind == "matrix" else [item.name]


def _read(item: Item, value: object) -> Any:
    """One answer, None for none."""
    if value is None or value == [] or (isinstance(value, str) and not value.strip() and item.kind == "text"):
        if item.required:
            raise _Refused("answer_missing", "answered")
        return None
    if item.kind in ("likert", "matrix"):
        if type(value) is not int or not 1 <= value <= item.points:
            raise _Refused("answer_not_valid", f"an integer from 1 to {item.points}")
        return value
    if item.kind == "slider":
        return _read_slider(item, value)
    if item.kind == "text":
        return _read_text(item, value)
    return _read_choice(item, value)


def _read_slider(item: Item, value: object) -> float:
    expected = f"a number from {item.low:g} to {item.high:g} in steps of {item.step:g}"
    if type(value) not in (int, float) or not item.low <= value <= item.high:  # type: ignore[operator]
        raise _Refused("answer_not_valid", expected)  # not a number is in no range
    steps = round((float(value) - item.low) / item.step)  # type: ignore[arg-type]
    nearest = item.low + steps * item.step
    if not math.isclose(nearest, value, rel_tol=0, abs_tol=1e-6 * item.step):  # type: ignore[arg-type]
        raise _Refused("answer_not_valid", expected)
    return float(nearest)


_NO_CHARACTER: Final = re.compile(r"[\ud800-\udfff\x00]")


def _read_text(item: Item, value: object) -> str:
    if not isinstance(value, str):
        raise _Refused("answer_not_valid", "a text")
    if len(value) > item.most:
        raise _Refused("answer_too_long", f"a text of at most {item.most:,} characters")
    return _NO_CHARACTER.sub("\ufffd", value)


def _read_choice(item: Item, value: object) -> Any:
    if item.several:
        is_list = isinstance(value, list) and all(isinstance(each, str) for each in value)
        if not is_list or len(set(value)) < len(value) or not set(value) <= set(item.options):  # type: ignore
            raise _Refused("answer_not_valid", f"a list of some of {shown(item.options)}")
        return [option for option in item.options if option in value]  # type: ignore[operator]
    if not isinstance(value, str) or value not in item.options:
        raise _Refused("answer_not_valid", f"one of {shown(item.options)}")
    return value


# -- whether what is asked can be answered ----------------------------------------------------------------------------


def item_problems(questionnaire: Questionnaire) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """What is wrong with items beyond the types of their settings.

    Yields:
        Where, as keys and positions, and what was expected and what came.
    """
    seen: set[str] = set()
    for number, item in enumerate(questionnaire.items):
        if item.name in seen:
            yield ("items", number, "name"), f"the name {item.name!r} is taken by an item before; names must be unique"
        seen.add(item.name)
        for key, message in _problems_of(item):
            yield ("items", number, key), f"item {item.name!r}: {message}"


def _problems_of(item: Item) -> Iterator[tuple[str, str]]:
    given = item.model_fields_set
    for key in sorted(given & _ABOUT.keys()):
        if item.kind not in _ABOUT[key]:
            yield key, f"`{key}` is about items of kind {' or '.join(_ABOUT[key])}, not about a {item.kind}"
    for key in ("options", "rows"):
        texts = getattr(item, key)
        if item.kind in _ABOUT[key]:
            least = 1 if key == "rows" else 2
            if len(texts) < least:
                yield key, f"a {item.kind} needs {least} or more `{key}`, got {len(texts)}"
            if len(set(texts)) < len(texts):
                yield key, f"`{key}` must differ from each other, got {shown(texts)}"
    if item.labels and item.kind in _ABOUT["labels"]:
        fitting = (2,) if item.kind == "slider" else (2, item.points)
        if len(item.labels) not in fitting:
            wanted = " or ".join(str(n) for n in dict.fromkeys(fitting))
            yield (
                "labels",
                f"`labels` must have {wanted} entries (of the ends, or of every point), got {len(item.labels)}",
            )
    if item.kind == "slider":
        yield from _slider_problems(item)
    if item.kind == "attention" and item.expected not in item.options:
        yield "expected", f"`expected` must be one of the options {shown(item.options)}, got {item.expected!r}"


def _slider_problems(item: Item) -> Iterator[tuple[str, str]]:
    if not item.low < item.high:
        yield "high", f"`high` must be greater than `low`, got {item.high:g} and {item.low:g}"
        return
    steps = (item.high - item.low) / item.step
    if steps > 10_000 or not math.isclose(steps, round(steps), abs_tol=1e-6):
        yield "step", f"`step` must divide {item.low:g} to {item.high:g} in 1 to 10,000 equal parts, got {item.step:g}"


_ABOUT: Final[Mapping[str, tuple[str, ...]]] = {
    "expected": ("attention",),
    "high": ("slider",),
    "labels": ("likert", "slider", "matrix"),
    "low": ("slider",),
    "most": ("text",),
    "options": ("choice", "attention"),
    "points": ("likert", "matrix"),
    "rows": ("matrix",),
    "several": ("choice",),
    "step": ("slider",),
}
"""Settings that only some kinds of items have."""
