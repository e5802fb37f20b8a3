"""Typed models of what files hold, and their refusals in the words of :mod:`legible_envs.support.validation`.

A model says once which keys a file has, of which type and in which range; pydantic checks the file against it::

    class Entry(FileModel):
        name: Annotated[str, Text()]
        count: Annotated[int, Whole(1, 1000)] = 1

    class Content(FileModel):
        entries: Annotated[list[Entry], Length(1, 64)]

    validated(Content, {"entries": [{"name": "dish", "count": 0}]}, "the list")
    # ValueError: the list: `entries[0].count` must be an integer from 1 to 1000, got 0
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, Final, TypeVar

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from legible_envs.support.validation import Closed, MakeError, choice, flag, integer, real, shown

__all__ = [
    "Checked",
    "Choice",
    "FileModel",
    "Flag",
    "Length",
    "OneOrMore",
    "Real",
    "Text",
    "Whole",
    "YamlModel",
    "as_path",
    "as_plain",
    "problems_of",
    "validated",
]

Model = TypeVar("Model", bound=BaseModel)

_LEVELS: Final = 100
_HERE: Final = "`\0`"  # stands for the path of a value until it is known


class FileModel(BaseModel):
    """A mapping with known keys and values of exact types: no number is made of a text, no key ignored."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class YamlModel(FileModel):
    """A mapping in which null means left out: YAML reads ``after:`` with nothing behind it as null."""

    @model_validator(mode="before")
    @classmethod
    def _without_nulls(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        return {key: value for key, value in data.items() if value is not None}


def Checked(check: Callable[[str, object], Any]) -> BeforeValidator:
    """What a function of the house makes of a value; called with how messages name the value, and the value.

    Its ValueErrors become those of :func:`validated`, with the path of the value in place of the name.
    """
    return BeforeValidator(lambda value: check(_HERE, value))


def Whole(low: float = -math.inf, high: float = 2**63 - 1) -> BeforeValidator:
    """A whole number in a range."""
    return Checked(lambda name, value: integer(name, value, low, high))


def Real(low: float = -math.inf, high: float = math.inf, closed: Closed = "both") -> BeforeValidator:
    """A finite number in a range."""
    return Checked(lambda name, value: real(name, value, low, high, closed=closed))


def Flag() -> BeforeValidator:
    """True or False."""
    return Checked(flag)


def Choice(*options: object) -> BeforeValidator:
    """One of several values."""
    return Checked(lambda name, value: choice(name, value, options))


def Text(most: int = 1000, *, empty: bool = False) -> BeforeValidator:
    """A text of limited length."""

    def check(name: str, value: object) -> str:
        if not isinstance(value, str) or not (value or empty):
            raise ValueError(f"{name} must be a {'' if empty else 'non-empty '}text, got {shown(value)}")
        if len(value) > most:
            raise ValueError(f"{name} must be a text of at most {most:,} characters, got one of {len(value):,}")
        return value

    return Checked(check)


def OneOrMore() -> BeforeValidator:
    """A list, for which a single text may stand."""

    def check(name: str, value: object) -> Any:
        if isinstance(value, str):
            return [value]
        if not isinstance(value, list):
            raise ValueError(f"{name} must be a text or a list of texts, got {shown(value)}")
        return value

    return Checked(check)


def Length(least: int, most: int) -> Any:
    """How many entries a list or mapping may have."""
    return Field(min_length=least, max_length=most)


def validated(model: type[Model], data: object, what: str = "", *, error: MakeError = ValueError) -> Model:
    """Check plain data against a model.

    Args:
        model: What is expected.
        data: What a file holds (:mod:`legible_envs.support.plain_data`).
        what: Begins the message, such as the name of the file.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: says which value is wrong first, what was expected, and how many others
            are wrong.
    """
    try:
        return model.model_validate(data)
    except ValidationError as refusal:
        found = _telling_first(refusal.errors(include_url=False))
        more = f" ({len(found) - 1} more {'is' if len(found) == 2 else 'are'} wrong)" if len(found) > 1 else ""
        said = _said(model, found[0], what)
        is_placed = not what or said.startswith(what) or not said.startswith("`")
        raise error(f"{said}{more}" if is_placed else f"{what}: {said}{more}") from None


def problems_of(model: type[BaseModel], data: object, what: str = "") -> list[tuple[tuple[str | int, ...], str]]:
    """Everything that is wrong with plain data, where :func:`validated` says what is wrong first.

    Args:
        model: What is expected.
        data: What a file holds.
        what: What messages call the whole, such as the name of the file.

    Returns:
        Keys and positions of each value that is wrong (of an unknown key: of the mapping and the key; of a missing one:
        of the mapping), and what was expected and what came; empty where nothing is wrong.
    """
    try:
        model.model_validate(data)
    except ValidationError as refusal:
        found = []
        for problem in refusal.errors(include_url=False):
            location = _place_of(problem)
            found.append((location[:-1] if problem["type"] == "missing" else location, _said(model, problem, what)))
        return found
    return []


def as_plain(data: object) -> Any:
    """Data of a program as a file would hold them: lists for tuples and arrays, dictionaries for other mappings.

    Raises:
        ValueError: They are nested more than 100 levels deep.

    Example:
        >>> as_plain({"size": (1, np.float64(0.5)), "at": np.zeros(2)})
        {'size': [1, 0.5], 'at': [0.0, 0.0]}
    """
    return _as_plain(data, 0)


def _as_plain(data: object, level: int) -> Any:
    if level > _LEVELS:
        raise ValueError(f"it is nested too deeply; at most {_LEVELS} levels are read")
    if isinstance(data, np.ndarray | np.generic):
        data = data.tolist()
    if isinstance(data, Mapping):
        return {key: _as_plain(value, level + 1) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_as_plain(value, level + 1) for value in data]
    return data


def as_path(location: Iterable[str | int]) -> str:
    """Keys and positions as one path.

    Example:
        >>> as_path(("subtasks", 2, "goals"))
        'subtasks[2].goals'
    """
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".")


def _telling_first(problems: list[Any]) -> list[Any]:
    """Problems with an unknown key before the missing one that it may have been meant as."""
    first = problems[0]
    if first["type"] == "missing":
        beside = [p for p in problems if p["type"] == "extra_forbidden" and p["loc"][:-1] == first["loc"][:-1]]
        return [*beside, *(p for p in problems if p not in beside)]
    return problems


def _place_of(problem: Mapping[str, Any]) -> tuple[str | int, ...]:
    """Keys and positions; pydantic adds one of its own for a key that is wrong."""
    location: tuple[str | int, ...] = problem["loc"]
    return location[:-1] if location[-1:] == ("[key]",) else location


def _said(model: type[BaseModel], problem: Mapping[str, Any], what: str) -> str:
    """One of pydantic's problems in our words."""
    kind, location, value = problem["type"], _place_of(problem), problem["input"]
    path = f"`{as_path(location)}`" if location else what or "it"
    if kind == "value_error":
        return str(problem["ctx"]["error"]).replace(_HERE, path)
    if kind == "missing":
        owner = f"`{as_path(location[:-1])}`" if location[:-1] else what or "it"
        return f"{owner} lacks the key `{location[-1]}`"
    if kind == "extra_forbidden":
        return _unknown(model, location, what)
    context = problem.get("ctx", {})
    if kind in ("too_short", "too_long"):
        bound = "at least" if kind == "too_short" else "at most"
        number = context["min_length" if kind == "too_short" else "max_length"]
        came = f"got {context['actual_length']:,}" if context.get("actual_length") is not None else "got more"
        return f"{path} must have {bound} {number:,} {'entry' if number == 1 else 'entries'}, {came}"
    wanted = _EXPECTED.get(kind)
    return f"{path} must be {wanted}, got {shown(value)}" if wanted else f"{path}: {problem['msg']}, got {shown(value)}"


_EXPECTED: Final = {
    "bool_type": "true or false",
    "dict_type": "a mapping",
    "float_type": "a number",
    "int_type": "an integer",
    "list_type": "a list",
    "mapping_type": "a mapping",
    "model_type": "a mapping",
    "none_required": "left out",
    "string_type": "a text",
}


def _unknown(model: type[BaseModel], location: Sequence[str | int], what: str) -> str:
    owner = f"`{as_path(location[:-1])}`" if location[:-1] else what or "it"
    known = _keys_at(model, location[:-1])
    near = get_close_matches(str(location[-1]), known, 1)
    meant = f" (did you mean `{near[0]}`?)" if near else ""
    listed = f"; known: {', '.join(known)}" if known else ""
    return f"{owner} has the unknown key {shown(location[-1])}{meant}{listed}"


def _keys_at(model: type[BaseModel], location: Sequence[str | int]) -> list[str]:
    """Keys of the model at a place inside another; empty where there is none."""
    here: Any = model
    for part in location:
        if isinstance(part, str) and isinstance(here, type) and issubclass(here, BaseModel):
            if part not in here.model_fields:
                return []
            here = here.model_fields[part].annotation
        here = _model_within(here)
    if not (isinstance(here, type) and issubclass(here, BaseModel)):
        return []
    return [field.alias or name for name, field in here.model_fields.items()]


def _model_within(annotation: Any) -> Any:
    """The first model in an annotation such as ``list[Model] | None``; the annotation where there is none."""
    if isinstance(annotation, type) and not hasattr(annotation, "__args__"):
        return annotation
    inner: Callable[[Any], Any] = _model_within
    found = [inner(argument) for argument in getattr(annotation, "__args__", ())]
    return next((each for each in found if isinstance(each, type) and issubclass(each, BaseModel)), annotation)
