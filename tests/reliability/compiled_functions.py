"""All compiled functions of the project, and which of them have run in this process."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from typing import Any

from numba.core.dispatcher import Dispatcher
from numba.core.types import NumPyRandomGeneratorType

__all__ = ["called", "kernels", "takes_generator"]

PACKAGES = ("legible_envs", "predictors", "optimizers", "benchmarks")


@cache
def kernels() -> dict[str, Any]:
    """Compiled functions by name; those of modules that need something not installed are left out."""
    found = {}
    for package in PACKAGES:
        root = importlib.import_module(package)
        for info in pkgutil.walk_packages(root.__path__, f"{package}.", onerror=lambda name: None):
            if b"@kernel" not in _source(info):
                continue
            for name, value in vars(importlib.import_module(info.name)).items():
                if isinstance(value, Dispatcher) and value.py_func.__module__ == info.name:
                    found[f"{info.name}.{name}"] = value
    return found


def _source(info: pkgutil.ModuleInfo) -> bytes:
    spec = info.module_finder.find_spec(info.name, None)  # type: ignore[call-arg]
    if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
        return b""
    with open(spec.origin, "rb") as file:
        return file.read()


def called() -> set[str]:
    """Names of the kernels that were called from Python, and of those they call.

    What is called by a compiled function from the cache is not compiled again, so it is found by name.
    """
    names = {id(kernel): name for name, kernel in kernels().items()}
    found: set[str] = set()
    waiting = [kernel for kernel in kernels().values() if kernel.overloads]
    while waiting:
        kernel = waiting.pop()
        if names.get(id(kernel)) in found:
            continue
        found.add(names[id(kernel)])
        code = kernel.py_func.__code__
        there = kernel.py_func.__globals__
        waiting += [there[name] for name in code.co_names if id(there.get(name)) in names]
    return found


def takes_generator(kernel: Any) -> bool:
    """Whether it was compiled for a random generator: Ctrl-C while it is entered crashes Python."""
    return any(isinstance(kind, NumPyRandomGeneratorType) for signature in kernel.signatures for kind in signature)
