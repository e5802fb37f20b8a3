"""How shells hand a random generator to kernels: as numbers, so that Ctrl-C is an exception and never a crash."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np

from legible_envs.support.random_kernels import Bits

__all__ = ["call_drawing"]

_P = ParamSpec("_P")
_R = TypeVar("_R")


def call_drawing(
    rng: np.random.Generator, kernel: Callable[Concatenate[Bits, _P], _R], *args: _P.args, **kwargs: _P.kwargs
) -> _R:
    """Call a kernel that draws random numbers: ``kernel(bits, *args)``, with ``rng`` as their source.

    Meanwhile the generator is kept alive, and locked against other threads.

    Example:
        >>> from legible_envs.support.random_kernels import below
        >>> rng, same = np.random.default_rng(0), np.random.default_rng(0)
        >>> [call_drawing(rng, below, 6) for _ in range(5)] == same.integers(6, size=5).tolist()
        True
    """
    source = rng.bit_generator
    with source.lock:
        return kernel(_bits(source), *args, **kwargs)


def _bits(source: np.random.BitGenerator) -> Bits:
    """Where a bit generator keeps its state, and the functions that advance it."""
    interface = source.ctypes
    return Bits(
        interface.state_address,
        _address(interface.next_uint64),
        _address(interface.next_uint32),
        _address(interface.next_double),
    )


def _address(function: object) -> int:
    address = ctypes.cast(function, ctypes.c_void_p).value  # type: ignore[arg-type]
    assert address is not None  # a bit generator's functions are there
    return address
