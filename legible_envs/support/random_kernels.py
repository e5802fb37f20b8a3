"""Random numbers in compiled code: the draws of a :class:`numpy.random.Generator`, the same ones, from its addresses.

A kernel never takes the generator itself. To hand one over, numba calls Python code, and where that meets a pending
Ctrl-C the interpreter dies by a segmentation fault. Kernels take :class:`Bits` instead: plain numbers, which
:func:`~legible_envs.support.random_bits.call_drawing` reads from a generator. Every function here returns what the
method of the generator would return, to the last bit, and leaves the generator in the same state.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

# Tables of the ziggurat by which numpy draws normal numbers: no formula gives their last bits.
from numba.np.random.distributions import fi_double, ki_double, wi_double, ziggurat_nor_inv_r, ziggurat_nor_r

from legible_envs.support.compiled import kernel

__all__ = ["Bits", "below", "next_double", "next_uint32", "next_uint64", "normal", "random", "uniform"]

MOST_BELOW = 2**31
MANTISSA = 2**52 - 1


class Bits(NamedTuple):
    """Addresses of a generator's state and of the C functions that draw from it."""

    state: int
    next_uint64: int
    next_uint32: int
    next_double: int


def _calls(returns: types.Type) -> Any:
    """In compiled code: call the C function at an address with the state, and return what it returns."""

    @intrinsic
    def call(typingctx: Any, address: Any, state: Any) -> tuple[Any, Any]:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointer = ir.IntType(8).as_pointer()
            function = ir.FunctionType(context.get_value_type(returns), [pointer])
            at = builder.inttoptr(arguments[0], function.as_pointer())
            return builder.call(at, [builder.inttoptr(arguments[1], pointer)])

        return returns(types.intp, types.intp), codegen

    return call


_call_uint64, _call_uint32, _call_double = _calls(types.uint64), _calls(types.uint32), _calls(types.double)


@cache
def _plain(returns: Any, address: int) -> Callable[[int], Any]:
    """The C function at an address, for kernels that run as plain Python."""
    return ctypes.CFUNCTYPE(returns, ctypes.c_void_p)(address)


def next_uint64(bits: Bits) -> Any:
    """The next 64 random bits."""
    return _plain(ctypes.c_uint64, bits.next_uint64)(bits.state)


def next_uint32(bits: Bits) -> Any:
    """The next 32 random bits."""
    return _plain(ctypes.c_uint32, bits.next_uint32)(bits.state)


def next_double(bits: Bits) -> float:
    """The next number in [0, 1)."""
    return float(_plain(ctypes.c_double, bits.next_double)(bits.state))


@overload(next_uint64)
def _compiled_next_uint64(bits: Any) -> Any:
    def call(bits: Any) -> Any:
        return _call_uint64(bits.next_uint64, bits.state)

    return call


@overload(next_uint32)
def _compiled_next_uint32(bits: Any) -> Any:
    def call(bits: Any) -> Any:
        return _call_uint32(bits.next_uint32, bits.state)

    return call


@overload(next_double)
def _compiled_next_double(bits: Any) -> Any:
    def call(bits: Any) -> Any:
        return _call_double(bits.next_double, bits.state)

    return call


@kernel
def random(bits: Bits) -> float:
    """``rng.random()``: a number in [0, 1)."""
    return next_double(bits)


@kernel
def uniform(bits: Bits, low: float, high: float) -> float:
    """``rng.uniform(low, high)``."""
    return low + (high - low) * next_double(bits)


@kernel
def below(bits: Bits, n: int) -> int:
    """``rng.integers(n)``, for 1 <= n <= 2**31: a whole number in [0, n), by Lemire's method (arXiv:1805.10941).

    The high half of ``n`` times a random word is the number. The low half tells whether the word is one of the few that
    would favour some numbers; it is then drawn again.

    Raises:
        ValueError: ``n`` is out of range.
    """
    if n < 1 or n > MOST_BELOW:
        raise ValueError("a random number below n needs 1 <= n <= 2**31")
    if n == 1:
        return 0  # numpy draws nothing
    product = np.int64(next_uint32(bits)) * np.int64(n)
    if product & 0xFFFFFFFF < n:
        favouring = (2**32 - n) % n
        while product & 0xFFFFFFFF < favouring:
            product = np.int64(next_uint32(bits)) * np.int64(n)
    return int(product >> 32)


@kernel
def standard_normal_tail(bits: Bits) -> float:
    """A normal number known to be greater than the ziggurat's edge (Marsaglia 1964)."""
    while True:
        beyond = -ziggurat_nor_inv_r * math.log1p(-next_double(bits))
        height = -math.log1p(-next_double(bits))
        if height + height > beyond * beyond:
            return ziggurat_nor_r + beyond


@kernel
def standard_normal(bits: Bits) -> float:
    """``rng.standard_normal()``, by numpy's ziggurat of 256 layers (Marsaglia and Tsang 2000).

    A word of 64 bits gives a layer (8 bits), a sign (1) and a place in the layer (52). Nearly all places lie wholly
    under the density; the others draw a height, and those of layer 0 beyond its edge draw from the tail.
    """
    while True:
        word = np.uint64(next_uint64(bits))
        layer = np.int64(word & np.uint64(0xFF))
        place = np.int64((word >> np.uint64(9)) & np.uint64(MANTISSA))
        x = place * wi_double[layer]
        if (word >> np.uint64(8)) & np.uint64(1):
            x = -x
        if place < np.int64(ki_double[layer]):
            return x
        if layer == 0:
            # The sign of the tail is a bit of the place, not the one above: so does numpy.
            tail = standard_normal_tail(bits)
            return -tail if (place >> 8) & 1 else tail
        step = fi_double[layer - 1] - fi_double[layer]
        if step * next_double(bits) + fi_double[layer] < math.exp(-0.5 * x * x):
            return x


@kernel
def normal(bits: Bits, mean: float, sd: float) -> float:
    """``rng.normal(mean, sd)``."""
    return mean + sd * standard_normal(bits)
