"""Typed models: right data pass, wrong data are refused in the words of the other checks."""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

import numpy as np
import pytest
from pydantic import Field

from legible_envs.errors import TaskError
from legible_envs.support.models import (
    Checked,
    Choice,
    FileModel,
    Flag,
    Length,
    OneOrMore,
    Real,
    Text,
    Whole,
    YamlModel,
    as_plain,
    problems_of,
    validated,
)
from legible_envs.support.validation import integer


class Part(FileModel):
    name: Annotated[str, Text(20)]
    count: Annotated[int, Whole(1, 1000)] = 1
    at: Annotated[list[Annotated[float, Real(0, 1)]], Length(2, 2)] = Field(default=[0.0, 0.0])


class Content(FileModel):
    parts: Annotated[list[Part], Length(1, 3)]
    groups: dict[str, list[str]] = Field(default={})
    most: Annotated[int, Whole(1)] | None = None
    shared: Part | None = None
    kind: Annotated[str, Choice("a", "b")] = "a"
    on: Annotated[bool, Flag()] = True


PART = {"name": "x"}


def test_right_data_pass_with_defaults():
    content = validated(Content, {"parts": [PART, {"name": "y", "count": 2, "at": [0, 1]}], "groups": {"g": ["x"]}})
    assert [(part.name, part.count, part.at) for part in content.parts] == [("x", 1, [0, 0]), ("y", 2, [0, 1])]
    assert (content.groups, content.most, content.shared, content.on) == ({"g": ["x"]}, None, None, True)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (5, "the file must be a mapping, got 5"),
        ({}, "the file lacks the key `parts`"),
        ({"parts": []}, "the file: `parts` must have at least 1 entry, got 0"),
        ({"parts": [PART] * 4}, "the file: `parts` must have at most 3 entries, got 4"),
        ({"parts": 3}, "the file: `parts` must be a list, got 3"),
        ({"parts": [3]}, "the file: `parts[0]` must be a mapping, got 3"),
        ({"parts": [{}]}, "the file: `parts[0]` lacks the key `name`"),
        ({"parts": [PART | {"count": 0}]}, "the file: `parts[0].count` must be an integer from 1 to 1000, got 0"),
        ({"parts": [PART | {"count": True}]}, "the file: `parts[0].count` must be an integer from 1 to 1000, got True"),
        ({"parts": [PART | {"count": "1"}]}, "the file: `parts[0].count` must be an integer from 1 to 1000, got '1'"),
        (
            {"parts": [PART | {"at": [0, 2.0]}]},
            "the file: `parts[0].at[1]` must be a finite number from 0 to 1, got 2.0",
        ),
        ({"parts": [PART | {"at": [0]}]}, "the file: `parts[0].at` must have at least 2 entries, got 1"),
        ({"parts": [{"name": ""}]}, "the file: `parts[0].name` must be a non-empty text, got ''"),
        (
            {"parts": [{"name": "x" * 21}]},
            "the file: `parts[0].name` must be a text of at most 20 characters, got one of 21",
        ),
        (
            {"parts": [PART], "shared": PART | {"coutn": 1}},
            "the file: `shared` has the unknown key 'coutn' (did you mean `count`?); known: name, count, at",
        ),
        ({"parts": [PART], "groups": {"g": -1}}, "the file: `groups.g` must be a list, got -1"),
        ({"parts": [PART], "groups": {"g": [1]}}, "the file: `groups.g[0]` must be a text, got 1"),
        ({"parts": [PART], "most": 2**63}, f"the file: `most` must be an integer from 1 to {2**63 - 1}, got {2**63}"),
        ({"parts": [PART], "kind": "c"}, "the file: `kind` must be 'a' or 'b', got 'c'"),
        ({"parts": [PART], "on": 1}, "the file: `on` must be True or False, got 1"),
        ({"parts": [3, {}], "on": 1}, "the file: `parts[0]` must be a mapping, got 3 (2 more are wrong)"),
    ],
)
def test_wrong_data_are_refused_in_our_words(data, message):
    with pytest.raises(TaskError) as refusal:
        validated(Content, data, "the file", error=TaskError)
    assert str(refusal.value) == message


class Task(YamlModel):
    names: Annotated[list[Annotated[str, Text()]], Length(0, 3), OneOrMore()] = []
    even: Annotated[int, Checked(lambda name, value: integer(name, value, 0, 8))] = 0


def test_all_problems_are_told_with_their_places():
    class Keyed(Content):
        named: dict[Annotated[str, Choice("a", "b")], int] = Field(default={})

    data = {"parts": [{"count": 0}, PART | {"coutn": 1}], "kind": "c", "named": {"z": 1}}
    found = dict(problems_of(Keyed, data, "the file"))
    assert found.keys() == {("parts", 0), ("parts", 0, "count"), ("parts", 1, "coutn"), ("kind",), ("named", "z")}
    assert found["parts", 0] == "`parts[0]` lacks the key `name`"
    assert found["named", "z"] == "`named.z` must be 'a' or 'b', got 'z'"
    assert problems_of(Content, {"parts": [PART]}) == []


def test_one_text_stands_for_a_list_and_null_for_nothing_said():
    assert validated(Task, {"names": "a", "even": None}) == Task(names=["a"])
    with pytest.raises(ValueError, match=r"^`names` must be a text or a list of texts, got \{\}$"):
        validated(Task, {"names": {}})
    with pytest.raises(ValueError, match=r"^`even` must be an integer from 0 to 8, got 9$"):
        validated(Task, {"even": 9})
    with pytest.raises(
        ValueError, match=r"^it has the unknown key 'name' \(did you mean `names`\?\); known: names, even$"
    ):
        validated(Task, {"name": "a"})


def test_data_of_a_program_become_those_of_a_file():
    data = as_plain({"a": (1, np.int8(2), {"b": np.zeros((1, 2))}), "c": MappingProxyType({"d": None})})
    assert data == {"a": [1, 2, {"b": [[0.0, 0.0]]}], "c": {"d": None}}
    endless: list[object] = []
    endless.append(endless)
    with pytest.raises(ValueError, match="nested too deeply"):
        as_plain(endless)
