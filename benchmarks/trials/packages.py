"""Which packages decide over the results of trials: the workers of a cluster must have the same files of them."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from benchmarks.trials.store import Trial

__all__ = ["packages_of"]

_OURS: Final = ("legible_envs", "optimizers", "predictors", "benchmarks")


def packages_of(function: str, trials: Iterable[Trial]) -> list[str]:
    """This project's, the function's, and those of workspaces, emitters and predictors that the trials name.

    Args:
        function: ``"module:name"`` of what runs a trial.
        trials: Their texts may be names of plug-ins, or ``"module:Class"``.
    """
    from legible_envs.workspace import list_workspaces
    from optimizers.emitters.registry import list_emitters
    from predictors.registry import list_predictors

    plugins = {**list_workspaces(), **list_emitters(), **list_predictors()}
    targets = {name: plugin.target for name, plugin in plugins.items()}
    named = {targets.get(text, text) for trial in trials for text in _texts(trial)}
    found = {package for target in (function, *named) if (package := _package(target))}
    return sorted(found.union(_OURS))


def _package(target: str) -> str:
    """The package in ``"package.module:Class"``; empty where the text means something else, or Python itself."""
    module, colon, _ = target.partition(":")
    package = module.partition(".")[0]
    if not colon or not all(part.isidentifier() for part in module.split(".")) or package in sys.stdlib_module_names:
        return ""
    return package if importlib.util.find_spec(package) is not None else ""


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        yield from _texts(list(value.values()))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _texts(part)
