"""What the file of a sweep may hold: keys, types and bounds; the options of workspaces and emitters stay open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final, get_args

from pydantic import BeforeValidator, ConfigDict

from legible_envs.support.models import Checked, Choice, FileModel, Length, OneOrMore, Text, Whole
from legible_envs.support.names import check_file_name
from legible_envs.support.validation import integer, shown
from legible_envs.workspace import ObjectiveName

__all__ = ["MOST", "SweepContent"]

MOST: Final = 1_000_000
"""Searches of a sweep."""

_MOST_ENTRIES: Final = 1000
_MOST_PARTICIPANTS: Final = 100_000


def _name(name: str, value: object) -> str:
    """The name of a sweep, which names its folder, too."""
    return check_file_name(name, value)


def _table_with(key: str) -> BeforeValidator:
    """A table with a key, for which the key's value may stand."""

    def check(name: str, value: object) -> Any:
        entry = {key: value} if isinstance(value, str) else value
        if not isinstance(entry, dict) or not isinstance(entry.get(key), str):
            raise ValueError(f"{name} must be a name or a table with the key `{key}`, got {shown(value)}")
        return entry

    return Checked(check)


def _names_or_tables(name: str, value: object) -> Any:
    if not isinstance(value, str | dict | list):
        raise ValueError(f"{name} must be a name, a table or a list of these, got {shown(value)}")
    return value if isinstance(value, list) else [value]


def _seeds(name: str, value: object) -> Sequence[int]:
    """That many seeds from 0, or those of a list."""
    if not isinstance(value, list):
        return range(integer(name, value, 1, MOST, also="a list"))
    if not value:
        raise ValueError(f"{name} is empty; nothing would be run")
    return [integer(name, seed, 0) for seed in value]


def _listed(value: object) -> list[Any]:
    return value if isinstance(value, list) else [value]


class People(FileModel):
    """How participants are simulated: what the workspace's ``simulate`` takes, too."""

    model_config = ConfigDict(extra="allow")

    participants: Annotated[int, Whole(1, _MOST_PARTICIPANTS)] = 8


Names = Annotated[list[Annotated[str, Text()]], Length(0, _MOST_ENTRIES), OneOrMore()]


class WorkspaceEntry(FileModel):
    """A workspace with any options of its own."""

    model_config = ConfigDict(extra="allow")

    workspace: Annotated[str, Text()]
    label: Annotated[str, Text()] | None = None
    predictors: Names = []
    people: People = People()


class EmitterEntry(FileModel):
    """An emitter with any options of its own."""

    model_config = ConfigDict(extra="allow")

    emitter: Annotated[str, Text()]
    label: Annotated[str, Text()] | None = None


class SweepContent(FileModel):
    """The file; see :class:`~benchmarks.sweeps.sweep.Sweep`."""

    name: Annotated[str, Checked(_name)] = "sweep"
    workspaces: Annotated[
        list[Annotated[WorkspaceEntry, _table_with("workspace")]], Length(1, _MOST_ENTRIES), Checked(_names_or_tables)
    ]
    emitters: Annotated[
        list[Annotated[EmitterEntry, _table_with("emitter")]], Length(1, _MOST_ENTRIES), Checked(_names_or_tables)
    ] = [EmitterEntry(emitter="improve")]
    objectives: Annotated[
        list[Annotated[str, Choice(*get_args(ObjectiveName))]], Length(1, _MOST_ENTRIES), OneOrMore()
    ] = ["legibility"]
    evaluations: Annotated[
        list[Annotated[int, Whole(1)]], Length(1, _MOST_ENTRIES), Checked(lambda _, value: _listed(value))
    ] = [100_000]
    seeds: Annotated[Any, Checked(_seeds)] = range(1)
    predictors: Names = []
    people: People = People()
