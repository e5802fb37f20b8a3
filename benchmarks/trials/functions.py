"""Functions that run trials: how workers find them, and the name under which their results are kept."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

__all__ = ["TrialName", "name_of", "path_of", "resolve", "trial_function"]

Function = TypeVar("Function", bound=Callable[[dict[str, Any]], Any])

_ATTRIBUTE: Final = "__trial_name__"


class TrialName(NamedTuple):
    """The name that results of a function are kept under.

    Attributes:
        name: It, or ``"module:function"`` for a function that was given none.
        former: Names under which results of the same function may have been kept before.
    """

    name: str
    former: tuple[str, ...] = ()


def trial_function(name: TrialName) -> Callable[[Function], Function]:
    """Give a function a name of its own: its finished trials stay valid when it moves or is renamed.

    A change of what the function computes needs a new name.
    """

    def give(function: Function) -> Function:
        setattr(function, _ATTRIBUTE, name)
        return function

    return give


def name_of(path: str) -> TrialName:
    """The name of the function at a path; the path itself where it has none of its own."""
    return getattr(resolve(path), _ATTRIBUTE, TrialName(path))


def path_of(function: Callable[[dict[str, Any]], Any] | str) -> str:
    """``"module:name"`` of a function, checked to lead to one.

    Raises:
        ValueError: It leads nowhere, or to something that is no function.
    """
    if isinstance(function, str):
        path = function
    else:
        path = f"{getattr(function, '__module__', None)}:{getattr(function, '__qualname__', None)}"
    try:
        found = resolve(path)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"workers cannot find {path!r}; give a function at the top of a module ({error})") from error
    if not callable(found):
        raise ValueError(f"{path!r} is {type(found).__name__}, not a function")
    return path


def resolve(path: str) -> Callable[[dict[str, Any]], Any]:
    """The function at ``"module:name"``."""
    module, _, name = path.partition(":")
    return getattr(importlib.import_module(module), name)
