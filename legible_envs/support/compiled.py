"""How kernels are compiled: numba, cached in a per-user folder, the same code readable and runnable as plain Python.

Compiled code lies in ``$NUMBA_CACHE_DIR`` if the user set it, else in the user's cache folder (Linux:
``~/.cache/legible-envs/numba``), never beside the package. Deleting the folder is always safe. With
``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python; with ``NUMBA_BOUNDSCHECK=1`` an index outside an array is an
``IndexError``. Code that checks lies in a folder of its own: numba would take one for the other.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from platformdirs import user_cache_path

__all__ = ["cache_folder", "kernel"]

_F = TypeVar("_F", bound=Callable[..., Any])


@cache
def cache_folder(package: str = "legible_envs") -> Path | None:
    """Folder of a package's compiled code, created on first use; None where nothing can be written."""
    root = os.environ.get("NUMBA_CACHE_DIR")
    try:
        folder = Path(root) if root else user_cache_path("legible-envs") / "numba" / _kernels_digest(package)
        folder = folder / "boundscheck" if numba.config.BOUNDSCHECK else folder
        folder.mkdir(parents=True, exist_ok=True)
        return folder if os.access(folder, os.W_OK) else None
    except OSError:
        return None


def _kernels_digest(package: str) -> str:
    """Digest of all files with kernels: numba does not notice that a kernel called from another file changed."""
    ours = Path(__file__).parents[1]
    theirs = getattr(sys.modules.get(package), "__file__", None)
    digest = hashlib.sha256()
    for folder in sorted({ours, Path(theirs).parent if theirs else ours}):
        for path in sorted(folder.rglob("*.py")):
            source = path.read_bytes()
            if b"@kernel" in source:
                digest.update(source)
    return digest.hexdigest()[:16]


def kernel(function: _F) -> _F:
    """Compile a function of plain arrays and numbers; see the module's docstring for where the result is kept.

    Raises:
        TypeError: An argument is a random generator, by its annotation: Ctrl-C while such a function is entered crashes
            Python. Take :class:`~legible_envs.support.random_kernels.Bits` instead.
    """
    for name, annotation in function.__annotations__.items():
        if "Generator" in str(annotation):
            raise TypeError(
                f"kernel {function.__name__} takes a random generator, `{name}`: Ctrl-C while it is entered can crash "
                "Python; take `bits: Bits` (legible_envs.support.random_kernels) and call it by `call_drawing`"
            )
    folder = cache_folder(function.__module__.partition(".")[0])
    if folder is None:
        return numba.njit(error_model="numpy")(function)
    # Numba reads this setting when a function is decorated; other people's functions must not see ours.
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        return numba.njit(cache=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = before
