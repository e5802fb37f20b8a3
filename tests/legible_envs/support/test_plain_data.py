"""Plain data from files: what is read equals what the plain readers give; everything else is one kind of error."""

from __future__ import annotations

import json
import random
import tomllib

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.support.plain_data import parse_json, parse_toml, parse_yaml

SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**128) + 1, 2**128 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(),
)
PLAIN = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4))


@settings(deadline=None)
@given(PLAIN)
def test_json_and_yaml_of_plain_data_are_read_as_they_are(data):
    assert parse_json(json.dumps(data)) == data
    text = yaml.safe_dump(data)
    assert parse_yaml(text) == yaml.safe_load(text)


ALIASES = "a0: &a0 [1, 1, 1, 1]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]\n" for n in range(1, 20))

REFUSED = [
    (parse_json, "[1, 2", "not valid JSON"),
    (parse_json, '{"a": {"b": 1, "b": 2}}', "'b' stands twice"),
    (parse_json, '{"a": [0, NaN]}', r"`a\[1\]` must be a finite number, got nan"),
    (parse_json, '{"a": {"b": 1e999}}', "`a.b` must be a finite number, got inf"),
    (parse_json, f'{{"size": [{"9" * 400}]}}', r"`size\[0\]` must be a number of at most 128 bits"),
    (parse_json, f"[{'9' * 5000}]", "not valid JSON"),
    (parse_json, "[" * 101 + "]" * 101, "nested too deeply"),
    (parse_json, "[" * 200_000, "nested too deeply"),
    (parse_json, " " * 16_000_001, "16,000,001 characters"),
    (parse_toml, "a = ", "not valid TOML"),
    (parse_toml, "a = 2026-01-01", "`a` must be a text, number"),
    (parse_toml, "[a]\nb = [inf]", r"`a.b\[0\]` must be a finite number"),
    (parse_toml, "a." * 20_000 + "b = 1", "nested too deeply"),
    (parse_toml, f"a = '{'x' * 200_000}'\nb = inf", "`b` must be a finite number"),
    (parse_toml, "a = " + "[" * 200_000, "nested too deeply"),
    (parse_toml, "#" * 500_001, "500,001 characters"),
    (parse_yaml, "a: [1", "not valid YAML"),
    (parse_yaml, "a: 1\nb: 2\na: 3", "'a' stands twice in one mapping, again in line 3"),
    (parse_yaml, "1: 2", "must have texts as keys, got the key 1"),
    (parse_yaml, "a: {on: 2}", "`a` must have texts as keys, got the key True"),
    (parse_yaml, "a: 2026-01-01", "`a` must be a text, number"),
    (parse_yaml, "a: [.nan]", r"`a\[0\]` must be a finite number"),
    (parse_yaml, "!!python/object:os.system x", "not valid YAML"),
    (parse_yaml, "!!timestamp x", "not valid YAML"),
    (parse_yaml, "!!bool x", "not valid YAML"),
    (parse_yaml, "!!map [a]", "not valid YAML"),
    (parse_yaml, "? [1]\n: 2", "not valid YAML"),
    (parse_yaml, "a: &a [*a]", "line 1 holds itself"),
    (parse_yaml, ALIASES, "more than 100,000 values"),
    (parse_yaml, "[" * 5_000, "nested too deeply"),
    (parse_yaml, "[]," * 6_000, "18,000 brackets, commas, colons and such"),
    (parse_yaml, "- " * 5_000, "nested too deeply"),
    (parse_yaml, "a: 0x" + "f" * 10_000, "at most 128 bits"),
    (parse_yaml, "a" * 50_001, "50,001 characters"),
]


@pytest.mark.parametrize(("parse", "text", "message"), REFUSED, ids=range(len(REFUSED)))
def test_what_is_no_plain_data_is_refused_in_words(parse, text, message):
    with pytest.raises(ValueError, match=message) as refusal:
        parse(text)
    assert len(str(refusal.value)) < 400


def test_numbers_that_are_not_finite_can_be_asked_for():
    assert parse_json("[Infinity, -Infinity]", finite=False) == [float("inf"), float("-inf")]


def test_aliases_and_merged_mappings_are_read():
    assert parse_yaml("a: &a {x: 1}\nb: *a\nc:\n  <<: *a\n  y: 2") == {
        "a": {"x": 1},
        "b": {"x": 1},
        "c": {"x": 1, "y": 2},
    }


def test_a_long_key_is_no_long_text():
    text = 'a.b.c = "' + "x." * 30 + '"\nd = "' + "one two. " * 500 + '"'
    assert parse_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize("parse", [parse_json, parse_toml, parse_yaml])
def test_random_characters_give_data_or_a_value_error(parse):
    rng = random.Random(5)
    alphabet = "[]{}(),:=&*!?|>-'\"%@`#<~ \n\t0123456789.eabnx_\\/\u2028é\x00"
    refused = 0
    for _ in range(3000):
        text = "".join(rng.choices(alphabet, k=rng.randrange(1, 40)))
        try:
            parse(text)
        except ValueError:
            refused += 1
    assert refused > 1000
