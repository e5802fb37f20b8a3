"""Questionnaires as data: what is asked, and which answers are answers."""

from __future__ import annotations

from typing import Annotated, Any

from benchmarks.study.design.names import Slug
from legible_envs.support.models import Choice, FileModel, Flag, Length, Real, Text, Whole

__all__ = ["Item", "Questionnaire"]


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
    return [
        name
        for item in questionnaire.items
        for name in (
            [f"{item.name}/{n}" for n in range(1, len(item.rows) + 1)] if item.kind == "matrix" else [item.name]
        )
    ]


def read_answers(questionnaire: Questionnaire, values: object) -> dict[str, Any]:
    """The answers of a participant, checked: every value one that its item has, required ones there.

    Args:
        questionnaire: What was asked.
        values: ``{name: value}`` as the page sends them: numbers for likerts, sliders and rows of a matrix, a text or
            list of texts for choices, texts. Left out or None: not answered.

    Returns:
        ``{name: value}`` of all :func:`answered_names` in order; None where nothing was answered.

    Raises:
        ValueError: Says which item, what was expected and what came.
    """
    raise NotImplementedError
