"""What a process computes with: digests of packages, and versions that decide over digits.

Two processes with the same fingerprint give the same scores; a cluster's workers are asked for theirs.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import platform
import sys
import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

__all__ = [
    "Fingerprint",
    "OtherCodeError",
    "differences",
    "expect",
    "fingerprint",
    "fingerprint_here",
    "package_of",
    "remarks",
]

_LIBRARIES: Final = ("numpy", "numba", "scipy", "ribs", "scikit-learn", "gymnasium", "pymunk")
"""Their arithmetic and random streams may differ between minor versions."""

_SUFFIXES: Final = (".py", ".yaml")
"""Of files that are code, or read as tasks."""

_DIGITS: Final = 12

_CLOCKS: Final = 2.0
"""Seconds by which the beginning of a process and the time of a file may be off."""


class OtherCodeError(RuntimeError):
    """A worker runs other code than the process that gave it work."""


@dataclass(frozen=True)
class Fingerprint:
    """What a process computes with.

    Attributes:
        version: Of legible-envs.
        digests: Of every package asked for, the beginning of the SHA-256 of its files; empty where it is absent.
        python: Version of Python.
        libraries: Versions of the libraries that compute; empty where one is absent.
        machine: Operating system and processor.
        changed: Loaded modules of these packages whose files are newer than this process, which runs what they held.
    """

    version: str
    digests: dict[str, str]
    python: str
    libraries: dict[str, str]
    machine: str
    changed: tuple[str, ...] = ()

    @classmethod
    def from_plain(cls, data: Mapping[str, Any]) -> Fingerprint:
        """From what :func:`fingerprint_here` gave.

        Raises:
            TypeError: The data are of another version of this class.
        """
        return cls(**{**data, "changed": tuple(data.get("changed", ()))})


def fingerprint(*packages: str) -> Fingerprint:
    """What this process computes with; read from disk once per process.

    Args:
        packages: Names of packages or modules that can be imported, such as ``"legible_envs"``.
    """
    return _fingerprint(tuple(sorted({name for name in packages if name})))


def package_of(thing: object) -> str:
    """The package that a function or an object's class comes from; empty for Python's own and for scripts."""
    module = getattr(thing, "__module__", None) or type(thing).__module__
    package = str(module).partition(".")[0]
    return "" if package in sys.stdlib_module_names or package.startswith("__") else package


def fingerprint_here(packages: Collection[str]) -> dict[str, Any]:
    """The same as plain data, for a process that may know :class:`Fingerprint` in another version."""
    return asdict(fingerprint(*packages))


def expect(digests: Mapping[str, str]) -> None:
    """Make sure that this process runs the code with these digests; costs microseconds from the second time on.

    Raises:
        OtherCodeError: It runs another.
    """
    found = fingerprint(*digests).digests
    if found != dict(digests):
        others = ", ".join(name for name in digests if found[name] != digests[name])
        raise OtherCodeError(f"this worker has other files of {others} than the process that gave it work")


def differences(ours: Fingerprint, theirs: Fingerprint) -> list[str]:
    """Why scores of two processes may differ, in clauses about the other one; empty if they cannot.

    Python counts by its minor version (3.12 changed how floats are summed), and so do the libraries.
    """
    found = []
    for name, digest in ours.digests.items():
        other = theirs.digests.get(name, "")
        if not digest:  # nothing to compare with, such as a package inside a zip file
            continue
        if not other:
            found.append(f"it lacks the package {name}")
        elif other != digest:
            versions = f"version {theirs.version}, ours {ours.version}; " if theirs.version != ours.version else ""
            found.append(f"its files of {name} are others ({versions}digest {other}, ours {digest})")
    if theirs.changed:
        more = f" and {len(theirs.changed) - 1} more" if len(theirs.changed) > 1 else ""
        found.append(f"{theirs.changed[0]}{more} changed on its disk since it was started: start it again")
    if _minor(theirs.python) != _minor(ours.python):
        found.append(f"it runs Python {theirs.python}, we {ours.python}")
    for name, version in ours.libraries.items():
        other = theirs.libraries.get(name, "")
        if version and _minor(other) != _minor(version):
            found.append(f"it has {name} {other}, we {version}" if other else f"it lacks {name}")
    return found


def remarks(ours: Fingerprint, theirs: Fingerprint) -> list[str]:
    """Smaller differences, which may show in the last digits at most."""
    found = [] if theirs.machine == ours.machine else [f"it is a {theirs.machine}, we a {ours.machine}"]
    for name, version in ours.libraries.items():
        other = theirs.libraries.get(name, "")
        if version and other and other != version and _minor(other) == _minor(version):
            found.append(f"it has {name} {other}, we {version}")
    return found


def _minor(version: str) -> tuple[str, ...]:
    return tuple(version.split(".")[:2])


@cache
def _fingerprint(packages: tuple[str, ...]) -> Fingerprint:
    return Fingerprint(
        version=_version("legible-envs"),
        digests={name: _digest(name) for name in packages},
        python=platform.python_version(),
        libraries={name: _version(name) for name in _LIBRARIES},
        machine=f"{platform.system()} {platform.machine()}",
        changed=tuple(_changed_modules(packages)),
    )


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return ""


def _digest(package: str) -> str:
    """The beginning of the SHA-256 over names and contents of a package's files, in sorted order."""
    files = sorted(_files(package))
    if not files:
        return ""
    digest = hashlib.sha256()
    for name, path in files:
        source = path.read_bytes().replace(b"\r\n", b"\n")  # a checkout on Windows is the same code
        digest.update(f"{name}\0{len(source)}\0".encode())
        digest.update(source)
    return digest.hexdigest()[:_DIGITS]


def _files(package: str) -> Iterator[tuple[str, Path]]:
    """The files of a package or module that make up its code, with their names inside it."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return
    if spec is None:
        return
    if spec.submodule_search_locations is None:
        if spec.origin is not None and Path(spec.origin).is_file():
            yield Path(spec.origin).name, Path(spec.origin)
        return
    for folder in map(Path, spec.submodule_search_locations):
        for path in folder.rglob("*"):
            inside = path.relative_to(folder)
            if path.suffix in _SUFFIXES and not any(part.startswith(".") for part in inside.parts) and path.is_file():
                yield inside.as_posix(), path


def _changed_modules(packages: Collection[str]) -> Iterator[str]:
    """Loaded modules of the packages whose files were written after this process began."""
    began = _began() + _CLOCKS
    for name, module in sorted(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file is None or name.partition(".")[0] not in packages:
            continue
        try:
            if Path(file).stat().st_mtime > began:
                yield name
        except OSError:
            yield name


def _began() -> float:
    """When this process began, in seconds since the epoch; now where that cannot be known."""
    try:
        import psutil  # comes with Dask

        return psutil.Process().create_time()
    except Exception:
        return time.time()
