"""Answers of participants: what is one, what is none, and that nothing hostile passes."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.study.design.package_files import default_words, read_file, scale_names
from benchmarks.study.design.questionnaires import (
    AnswersError,
    Item,
    Questionnaire,
    answered_names,
    item_problems,
    read_answers,
)
from legible_envs.support.models import validated
from legible_envs.support.plain_data import parse_toml

EVERY_KIND = Questionnaire(
    title="All",
    items=[
        Item(name="agree", kind="likert", text="?", points=5),
        Item(name="load", kind="slider", text="?"),
        Item(name="fine", kind="slider", text="?", low=-1, high=1, step=0.1, required=False),
        Item(name="one", kind="choice", text="?", options=["a", "b"]),
        Item(name="some", kind="choice", text="?", options=["a", "b", "c"], several=True, required=False),
        Item(name="words", kind="text", text="?", most=10, required=False),
        Item(name="grid", kind="matrix", text="?", rows=["x", "y"], points=3),
        Item(name="check", kind="attention", text="?", options=["a", "b"], expected="b"),
    ],
)
GOOD = {"agree": 5, "load": 35, "one": "b", "grid/1": 1, "grid/2": 3, "check": "a"}
NAMES = ["agree", "load", "fine", "one", "some", "words", "grid/1", "grid/2", "check"]


def test_answers_come_in_order_with_none_for_what_was_not_answered():
    found = read_answers(EVERY_KIND, {**GOOD, "some": ["c", "a"], "words": " hm "})
    assert list(found) == answered_names(EVERY_KIND) == NAMES
    assert found == {**GOOD, "fine": None, "some": ["a", "c"], "words": " hm "}
    assert isinstance(found["load"], float)


def test_a_wrong_answer_to_an_attention_check_is_an_answer():
    assert read_answers(EVERY_KIND, GOOD)["check"] == "a" != EVERY_KIND.items[-1].expected


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("agree", None, "answer_missing"),
        ("agree", 0, "answer_not_valid"),
        ("agree", 6, "answer_not_valid"),
        ("agree", True, "answer_not_valid"),
        ("agree", 3.0, "answer_not_valid"),
        ("agree", "3", "answer_not_valid"),
        ("agree", 10**400, "answer_not_valid"),
        ("load", True, "answer_not_valid"),
        ("load", math.nan, "answer_not_valid"),
        ("load", math.inf, "answer_not_valid"),
        ("load", 10**400, "answer_not_valid"),
        ("load", 33, "answer_not_valid"),
        ("load", -5, "answer_not_valid"),
        ("load", [35], "answer_not_valid"),
        ("fine", 0.05, "answer_not_valid"),
        ("one", "c", "answer_not_valid"),
        ("one", ["a"], "answer_not_valid"),
        ("one", [], "answer_missing"),
        ("one", {"a": 1}, "answer_not_valid"),
        ("some", "a", "answer_not_valid"),
        ("some", ["a", "a"], "answer_not_valid"),
        ("some", ["a", ["b"]], "answer_not_valid"),
        ("some", ["z"], "answer_not_valid"),
        ("words", "x" * 11, "answer_too_long"),
        ("words", 3, "answer_not_valid"),
        ("words", {}, "answer_not_valid"),
        ("grid/2", 4, "answer_not_valid"),
        ("grid/1", None, "answer_missing"),
        ("check", "c", "answer_not_valid"),
    ],
)
def test_what_is_no_answer_is_refused_by_name(name, value, word):
    with pytest.raises(AnswersError, match=f"`{name}` must be") as refusal:
        read_answers(EVERY_KIND, {**GOOD, name: value})
    assert refusal.value.problems == {name: word}
    assert word in default_words()
    assert len(str(refusal.value)) < 1000


def test_every_answer_that_is_wrong_is_named():
    with pytest.raises(AnswersError) as refusal:
        read_answers(EVERY_KIND, {"agree": 9, "words": "x" * 99})
    assert list(refusal.value.problems) == ["agree", "load", "one", "words", "grid/1", "grid/2", "check"]


@pytest.mark.parametrize(
    "values", [None, [], "agree", 3, {"agree": 5, "extra": 1}, {**GOOD, "grid": 1}, {**GOOD, 3: 1}]
)
def test_what_are_no_answers_at_all_is_refused_without_blaming_an_item(values):
    with pytest.raises(AnswersError) as refusal:
        read_answers(EVERY_KIND, values)
    assert refusal.value.problems == {}


def test_blanks_are_no_text_and_half_characters_become_whole_ones():
    assert read_answers(EVERY_KIND, {**GOOD, "words": " \n "})["words"] is None
    assert read_answers(EVERY_KIND, {**GOOD, "words": "a\ud800\0\U0001f600"})["words"] == "a\ufffd\ufffd\U0001f600"


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-2, 200)
    | st.floats()
    | st.text(max_size=12)
    | st.sampled_from(["a", "b", "\ud800", "\0", "x" * 10**5, 10**400, "</script>", "'; DROP TABLE answers; --"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from([*NAMES, "x"]), ANYTHING, max_size=3))
def test_whatever_comes_is_refused_or_can_be_stored_and_answered_again(values):
    try:
        found = read_answers(EVERY_KIND, {**GOOD, **values})
    except AnswersError as refusal:
        words = set(refusal.problems.values())
    else:
        stored = json.loads(json.dumps(found, allow_nan=False).encode("utf-8"))
        assert read_answers(EVERY_KIND, stored) == found
        words = set()
    assert words <= {"answer_missing", "answer_not_valid", "answer_too_long"}


@given(st.integers(0, 20), st.sampled_from([1, 5, 0.1, 0.3, 2.5]), st.floats(-100, 100))
def test_each_step_of_a_slider_is_an_answer_and_the_middle_between_two_is_none(number, step, low):
    asked = Questionnaire(
        title="t", items=[Item(name="s", kind="slider", text="?", low=low, high=low + 20 * step, step=step)]
    )
    assert list(item_problems(asked)) == []
    value = min(low + number * step, low + 20 * step)
    assert read_answers(asked, {"s": value})["s"] == pytest.approx(value)
    with pytest.raises(AnswersError):
        read_answers(asked, {"s": low + (number + 0.5) * step})


@pytest.mark.parametrize("name", scale_names())
def test_the_scales_of_the_package_can_be_asked_and_answered(name):
    asked = validated(Questionnaire, parse_toml(read_file(f"scales/{name}.toml")))
    assert list(item_problems(asked)) == []
    answers = {item.name: 4 if item.kind == "likert" else 50 for item in asked.items if item.kind != "text"}
    assert read_answers(asked, answers).keys() == {item.name for item in asked.items}
    assert asked.source or name == "comments"


def test_nasa_tlx_has_its_six_sliders_and_asks_performance_from_good_to_poor():
    asked = validated(Questionnaire, parse_toml(read_file("scales/nasa-tlx.toml")))
    assert [item.name for item in asked.items] == [
        "mental", "physical", "temporal", "performance", "effort", "frustration",
    ]  # fmt: skip
    assert {(item.kind, item.low, item.high, item.step, item.scale, item.reverse) for item in asked.items} == {
        ("slider", 0, 100, 5, "workload", False)
    }
    assert {item.name: item.labels for item in asked.items if item.labels != ["Low", "High"]} == {
        "performance": ["Good", "Poor"]
    }


@pytest.mark.parametrize(
    ("item", "key", "message"),
    [
        ({"kind": "choice", "options": ["a"]}, "options", "needs 2 or more"),
        ({"kind": "choice", "options": ["a", "a"]}, "options", "must differ"),
        ({"kind": "matrix"}, "rows", "needs 1 or more"),
        ({"kind": "likert", "labels": ["a"]}, "labels", "must have 2 or 7 entries"),
        ({"kind": "slider", "labels": ["a", "b", "c"]}, "labels", "must have 2 entries"),
        ({"kind": "slider", "low": 5, "high": 5}, "high", "greater than `low`"),
        ({"kind": "slider", "step": 7}, "step", "must divide"),
        ({"kind": "slider", "step": 1e-9}, "step", "must divide"),
        ({"kind": "attention", "options": ["a", "b"], "expected": "c"}, "expected", "one of the options"),
        ({"kind": "text", "points": 3}, "points", "is about items of kind likert or matrix"),
        ({"kind": "likert", "expected": "3"}, "expected", "is about items of kind attention"),
    ],
)
def test_items_that_cannot_be_answered_are_refused(item, key, message):
    asked = Questionnaire(title="t", items=[Item(**{"name": "i", "text": "?", **item})])
    [(path, said)] = item_problems(asked)
    assert path == ("items", 0, key)
    assert message in said
