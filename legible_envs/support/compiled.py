"""How kernels are compiled: numba, cached in a per-user folder, the same code readable and runnable as plain Python.

Compiled code lies in ``$NUMBA_CACHE_DIR`` if the user set it, else in the user's cache folder (Linux:
``~/.cache/legible-envs/numba``), never beside the package. Deleting the folder is always safe. With
``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python; with ``NUMBA_BOUNDSCHECK=1`` an index outside an array is an
``IndexError``.

Three times numba would take wrong code from its cache without a word: code that does not check its indices where it
should, code that calls another file's kernel as it was before that file changed, and, where two processes compile one
kernel for different types at once, the code of the other type. So code that checks lies in a folder of its own, all of
it in a folder named after all kernels' sources, and every file in it is named after the types it was compiled for.
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
from numba.core.caching import IndexDataCacheFile
from platformdirs import user_cache_path

__all__ = ["cache_folder", "kernel"]

_F = TypeVar("_F", bound=Callable[..., Any])


@cache
def cache_folder(package: str = "legible_envs") -> Path | None:
    """Folder of a package's compiled code, created on first use; None where nothing can be written."""
    root = os.environ.get("NUMBA_CACHE_DIR")
    try:
        folder = (Path(root) if root else user_cache_path("legible-envs") / "numba") / _kernels_digest(package)
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
        compiled = numba.njit(cache=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = before
    files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if type(files) is IndexDataCacheFile:  # not where kernels run as plain Python
        files.__class__ = FilesByType
    return compiled


class FilesByType(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's files of a kernel's compiled code, each named after the types that it was compiled for.

    Numba numbers them. Of two processes that begin together, both may take the same number for different types, and the
    index of the one then names the code of the other.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep the code for some types, then the entry that names it: a reader never finds one without the other."""
        overloads = self._load_index()
        name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:15], 16))
        self._save_data(name, data)
        self._save_index({**overloads, key: name})
