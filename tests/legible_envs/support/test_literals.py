"""Plain data in files that people write: JSON, or a Python literal, nothing of which is run."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.support.literals import Expression, read_literal

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@given(PLAIN)
@settings(max_examples=200, deadline=None)
def test_json_and_python_literals_mean_what_they_say(data):
    assert read_literal(json.dumps(data)) == data
    assert read_literal(json.dumps(data, indent=2).replace("\n", "\r\n")) == data
    if "\\ud" not in repr(data):  # halves of characters: JSON can write them, a text cannot
        assert read_literal(repr(data)) == data
        assert read_literal(f"# of mine\n{data!r}  # and more") == data


def test_what_is_no_literal_keeps_its_place():
    data = read_literal("{'a': float('inf'), 'b': (1, [f(x)], {2}), 'c': -1.5, 'd': 1 + 2,\n 'e': null, **more, f: 1}")
    assert data == {
        "a": Expression("float('inf')", 1),
        "b": (1, [Expression("f(x)", 1)], [2]),
        "c": -1.5,
        "d": Expression("1 + 2", 1),
        "e": None,
    }
    assert repr(data["a"]) == "the expression float('inf') (line 1)"
    assert read_literal("['é', g('é', 'ü')]") == ["é", Expression("g('é', 'ü')", 1)]
    assert len(read_literal(f"[f('{'a' * 500}')]")[0].text) == 60
    assert read_literal("[f(\r1,\r2),\rh]")[0] == Expression("f(", 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\n\n {'a': [}", r"line 3, column 9: closing parenthesis '}' does not match"),
        ("{'a' 1}", "line 1, column"),
        ("", "invalid syntax"),
        ("[" * 100_000, "nested"),
        ("-" * 100_000 + "1", "nested too deeply"),
        ("x" * 500_001, "expected at most 500,000"),
        ("'\ud800'", "half a character"),
        ("'\0'", "null bytes"),
    ],
)
def test_what_is_neither_is_named_with_its_line(text, message):
    with pytest.raises(ValueError, match=message):
        read_literal(text)


@pytest.mark.filterwarnings("error")
def test_other_peoples_escapes_are_no_warnings():
    assert read_literal(r"{'a': '\d', 'b': 1 is 2}")["a"] == r"\d"
