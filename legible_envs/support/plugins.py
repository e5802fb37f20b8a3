"""Plug-ins of other packages: found by registered name, by an entry point, or as ``module:Class``."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

__all__ = ["Plugin", "Registry", "target_of"]


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plug-in that can be used by name.

    Attributes:
        name: What to call it by.
        origin: ``"built in"``, ``"registered"``, or ``"entry point of PACKAGE VERSION"``.
        target: Where it is defined, ``module:Name``.
        factory: The plug-in itself where it was registered, else None.
    """

    name: str
    origin: str
    target: str
    factory: Any = None

    def summary(self) -> str:
        """First line of its documentation; imports it. Says why where it cannot be imported."""
        try:
            found = self.factory or import_target(self.target)
        except (ImportError, AttributeError, ValueError) as error:
            return f"cannot be used: {error}"
        return (inspect.getdoc(found) or "").strip().split("\n")[0]


class Registry:
    """Names of one kind of plug-in.

    Args:
        kind: What a plug-in is, for messages: ``"emitter"``.
        group: Entry point group of installed plug-ins.
        built_in: ``{name: "module:Name"}`` of those that come with the project.
        error: Makes the exception raised for everything that is wrong, from its message.
        accepts: The class whose instances are plug-ins; None means that plug-ins are classes or functions.
    """

    def __init__(
        self,
        kind: str,
        group: str,
        built_in: Mapping[str, str],
        error: Callable[[str], Exception],
        *,
        accepts: type | None = None,
    ) -> None:
        self.kind = kind
        self.group = group
        self.error = error
        self.accepts = accepts
        self._built_in = dict(built_in)
        self._registered: dict[str, Any] = {}

    def _fits(self, plugin: object) -> bool:
        return callable(plugin) if self.accepts is None else isinstance(plugin, self.accepts)

    def register(self, name: str, factory: Any, *, overwrite: bool = False) -> None:
        """Make a plug-in available by name for the rest of this process.

        Built-in names are never replaced, others only with ``overwrite``.
        """
        if not isinstance(name, str) or not name or ":" in name:
            raise self.error(f"the name of a {self.kind} must be a non-empty string without ':', got {name!r}")
        if not self._fits(factory):
            expected = "callable" if self.accepts is None else f"a {self.accepts.__name__}"
            raise self.error(f"{self.kind} {name!r}: the factory must be {expected}, got {type(factory).__name__}")
        if name in self._built_in:
            raise self.error(f"the {self.kind} name {name!r} is built in; choose another")
        if name in self._registered and not overwrite:
            raise self.error(f"the {self.kind} name {name!r} is taken; choose another or pass overwrite=True")
        self._registered[name] = factory

    def list(self) -> dict[str, Plugin]:
        """Every plug-in known by name: built in, installed as an entry point, and registered in this process."""
        found = {name: Plugin(name, "built in", target) for name, target in self._built_in.items()}
        for name, point in sorted(self._installed().items()):
            package = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"
            found.setdefault(name, Plugin(name, f"entry point of {package}", point.value))
        for name, factory in self._registered.items():
            found[name] = Plugin(name, "registered", target_of(factory), factory)
        return found

    def built_in(self) -> tuple[str, ...]:
        """Names of those that are built in; installed packages are not searched for them."""
        return tuple(self._built_in)

    def __contains__(self, name: object) -> bool:
        """Whether there is a plug-in of this name; installed packages are searched where nothing else has it."""
        return name in self._registered or name in self._built_in or name in self._installed()

    def resolve(self, spec: Any) -> Any:
        """Find a plug-in by name or ``"module:Name"``, or return the plug-in given."""
        if not isinstance(spec, str):
            if self._fits(spec):
                return spec
            raise self.error(
                f"{_with_article(self.kind)} is a name, 'module:Class' or a callable, got {type(spec).__name__}"
            )
        if spec in self._registered:
            return self._registered[spec]
        target = self._built_in.get(spec)
        if target is None:
            installed = self._installed().get(spec)
            target = installed.value if installed else spec
        if ":" not in target:
            known = sorted(self.list())
            near = get_close_matches(spec, known, 1)
            meant = f"did you mean {near[0]!r}? " if near else ""
            raise self.error(f"no {self.kind} named {spec!r}; {meant}known: {', '.join(known)}; or use 'module:Class'")
        try:
            found = import_target(target)
        except (ImportError, AttributeError, ValueError) as error:
            where = "" if spec == target else f" ({target})"
            raise self.error(f"{self.kind} {spec!r}{where} cannot be imported: {error}") from error
        if not self._fits(found):
            expected = "class or function" if self.accepts is None else self.accepts.__name__
            raise self.error(f"{self.kind} {spec!r} is not a {expected} but a {type(found).__name__}")
        return found

    def _installed(self) -> dict[str, EntryPoint]:
        return {point.name: point for point in entry_points(group=self.group)}


def _with_article(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def target_of(factory: Any) -> str:
    """Where a class, function or instance's class is defined: ``module:Name``."""
    named = factory if hasattr(factory, "__qualname__") else type(factory)
    return f"{named.__module__}:{named.__qualname__}"


def import_target(target: str) -> Any:
    """Import what ``"module:Name"`` names."""
    module, _, name = target.partition(":")
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found
