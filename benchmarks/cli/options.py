"""Types of options and the options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import click

from benchmarks.cli.destinations import DestinationFolder
from legible_envs.support.plain_data import parse_json, parse_toml

__all__ = [
    "Assignment",
    "LayoutSource",
    "PositiveNumber",
    "Prefix",
    "SchedulerAddress",
    "given_options",
    "layout_argument",
    "of_one_layout",
    "out_folder",
    "pots_option",
    "scheduler_option",
    "settings_from",
    "typed_value",
    "worker_timeout_option",
    "workers_option",
]

Command = TypeVar("Command", bound=Callable[..., Any])


class Assignment(click.ParamType):
    """``NAME=VALUE``, the value typed as in a TOML or JSON file; what is neither is a text without its quotes."""

    name = "name=value"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, Any]:
        """Name and value."""
        if isinstance(value, tuple):
            return value[0], value[1]
        name, equals, text = str(value).partition("=")
        if not name.strip() or not equals:
            self.fail(f"{value!r} is not NAME=VALUE", param, ctx)
        return name.strip(), typed_value(text.strip())


def typed_value(text: str) -> Any:
    """A value as a TOML or JSON file has it, or the text itself where it is neither (or a date).

    Example:
        >>> [typed_value(text) for text in ("0.5", "true", "[7, 7]", "sum", "'7'", "null")]
        [0.5, True, [7, 7], 'sum', '7', None]
    """
    try:
        return parse_json(text, finite=False)
    except ValueError:
        pass
    try:
        found = parse_toml(f"value = {text}", finite=False)
    except ValueError:
        return text
    return text if found.keys() != {"value"} else found["value"]


def settings_from(assigned: Sequence[tuple[str, Any]], option: str) -> dict[str, Any]:
    """Settings from a repeatable ``NAME=VALUE`` option.

    Raises:
        click.UsageError: A name is given twice.
    """
    settings: dict[str, Any] = {}
    for name, value in assigned:
        if name in settings:
            raise click.UsageError(f"{option} {name} is given twice")
        settings[name] = value
    return settings


class Prefix(click.ParamType):
    """``mean``, ``sum``, or fractions such as ``0.25,0.5``."""

    name = "mean|sum|fractions"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The word, or the fractions as a tuple."""
        if value in ("mean", "sum") or isinstance(value, tuple):
            return value
        try:
            return tuple(float(part) for part in str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is neither 'mean', 'sum' nor fractions such as 0.25,0.5", param, ctx)


class PositiveNumber(click.ParamType):
    """A finite number above 0, or from 0 on.

    Args:
        zero: Whether 0 is one too.
    """

    name = "number"

    def __init__(self, *, zero: bool = False) -> None:
        self.zero = zero

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and (number > 0 or (self.zero and number == 0))):
            self.fail(f"{value!r} is not a finite number {'>= 0' if self.zero else '> 0'}", param, ctx)
        return number


class SchedulerAddress(click.ParamType):
    """The address of a Dask scheduler."""

    name = "address"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The address, which is one; whether anybody answers there is seen later."""
        from optimizers.cluster import check_address

        try:
            check_address(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)
        return str(value)


class LayoutSource(click.ParamType):
    """A file, the folder of a search, or ``-``."""

    name = "layout"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The source, which has a name."""
        if not str(value).strip():
            self.fail("the name of the layout is empty", param, ctx)
        return str(value)


def given_options(ctx: click.Context, names: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Those options that the user gave, in the order of ``names``; the others have their defaults."""
    return [name for name in names if ctx.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT]


out_folder = click.option("--out", type=DestinationFolder(), help="Folder to write to.")
layout_argument = click.argument("layout", metavar="LAYOUT", type=LayoutSource())
pots_option = click.option(
    "--pots", type=click.IntRange(min=1), help="Kitchens: soups in progress at once. [default: no limit]"
)
player_option = click.option(
    "--player", type=click.IntRange(min=1), help="Kitchens: whose score, by the number of the start. [default: 1]"
)
workspace_option = click.option(
    "--workspace", metavar="NAME", help="Workspace of the layout. [default: the one that recognises it]"
)
task_option = click.option(
    "--task", metavar="NAME|FILE.yaml", help="Tables: what is built. [default: the one that fits]"
)
workers_option = click.option(
    "--workers", type=click.IntRange(1, 1_024), help="Processes on this machine. [default: all cores]"
)
scheduler_option = click.option(
    "--scheduler", type=SchedulerAddress(), metavar="ADDRESS", help="Run on a Dask cluster, e.g. tcp://10.0.0.1:8786."
)
worker_timeout_option = click.option(
    "--worker-timeout", type=PositiveNumber(zero=True), default=60.0, show_default=True, metavar="SECONDS",
    help="How long to wait for a worker of the cluster where there is none.",
)  # fmt: skip


def of_one_layout(command: Command) -> Command:
    """The arguments of commands that score a layout: which one, and what its score is of."""
    prefix = click.option("--prefix", type=Prefix(), help="Which prefixes count. [default: mean, or the run's own]")
    for add in (task_option, player_option, pots_option, prefix, workspace_option, layout_argument):
        command = add(command)
    return command
