"""How a public name is retired: it works for at least one minor release, and says what to use instead."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

__all__ = ["deprecated", "renamed_argument"]

_F = TypeVar("_F", bound=Callable[..., Any])


def deprecated(instead: str, *, since: str, removed_in: str) -> Callable[[_F], _F]:
    """Mark a function, method or class as retired.

    Args:
        instead: What to use, as a user writes it, such as ``"simulate_participants(layout, n, rng)"``.
        since: Version that retires it.
        removed_in: Version that will no longer have it.

    Returns:
        A decorator. Calling what it decorates warns with :class:`DeprecationWarning`, at the caller's line.

    Example:
        >>> @deprecated("new()", since="0.2", removed_in="0.3")
        ... def old():
        ...     return 1
    """

    def decorate(function: _F) -> _F:
        message = f"{function.__qualname__} is deprecated since {since} and goes in {removed_in}; use {instead}"
        if isinstance(function, type):
            made = function.__init__  # type: ignore[misc]

            @functools.wraps(made)
            def init(self: Any, *args: Any, **kwargs: Any) -> None:
                warnings.warn(message, DeprecationWarning, stacklevel=2)
                made(self, *args, **kwargs)

            function.__init__ = init  # type: ignore[misc]
            return function

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            warnings.warn(message, DeprecationWarning, stacklevel=2)
            return function(*args, **kwargs)

        return call  # type: ignore[return-value]

    return decorate


def renamed_argument(old: str, new: str, *, since: str, removed_in: str) -> Callable[[_F], _F]:
    """Let a function take a keyword under its old name too.

    Args:
        old: The name that goes.
        new: The name that stays.
        since: Version that renamed it.
        removed_in: Version that will no longer know the old name.

    Returns:
        A decorator. The function warns where the old name is used, and raises :class:`TypeError` where both are.

    Example:
        >>> @renamed_argument("count", "n", since="0.2", removed_in="0.3")
        ... def draw(n):
        ...     return n
    """

    def decorate(function: _F) -> _F:
        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            if old in kwargs:
                name = function.__qualname__
                if new in kwargs:
                    raise TypeError(f"{name}() got both {new!r} and its old name {old!r}; give {new!r} alone")
                warnings.warn(
                    f"{name}({old}=) is deprecated since {since} and goes in {removed_in}; use {new}=",
                    DeprecationWarning,
                    stacklevel=2,
                )
                kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return call  # type: ignore[return-value]

    return decorate
