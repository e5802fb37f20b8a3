"""Random numbers in kernels are those of numpy's generator, draw by draw, compiled and as plain Python."""

from __future__ import annotations

import copy
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from legible_envs.support.compiled import kernel
from legible_envs.support.random_bits import call_drawing
from legible_envs.support.random_kernels import Bits, below, normal, random, uniform
from tests.support.plain_python import printed_both_ways

GENERATORS = [np.random.PCG64, np.random.PCG64DXSM, np.random.MT19937, np.random.Philox, np.random.SFC64]
LIMITS = [1, 2, 3, 4, 7, 100, 2**16, 2**31 - 1, 2**31]


def draw_both(rng: np.random.Generator, numpys: np.random.Generator, pick: np.random.Generator) -> tuple[Any, Any]:
    """One draw of either: which, and of what, is drawn by a third generator."""
    kind, a, b = int(pick.integers(4)), *pick.normal(size=2).tolist()
    if kind == 0:
        return call_drawing(rng, random), numpys.random()
    if kind == 1:
        return call_drawing(rng, uniform, a, b + 5), numpys.uniform(a, b + 5)
    if kind == 2:
        return call_drawing(rng, normal, a, abs(b)), numpys.normal(a, abs(b))
    n = int(pick.choice(LIMITS)) if a > 0 else int(pick.integers(2**30, 2**31))
    return call_drawing(rng, below, n), numpys.integers(0, n)


def same_state(a: Any, b: Any) -> bool:
    if isinstance(a, Mapping):
        return a.keys() == b.keys() and all(same_state(a[key], b[key]) for key in a)
    return np.array_equal(a, b)


@pytest.mark.parametrize("kind", GENERATORS)
def test_every_draw_is_numpys(kind):
    rng, numpys, pick = np.random.Generator(kind(3)), np.random.Generator(kind(3)), np.random.default_rng(5)
    for number in range(5_000):
        ours, theirs = draw_both(rng, numpys, pick)
        assert ours == theirs, f"draw {number}"
    assert same_state(rng.bit_generator.state, numpys.bit_generator.state)


@kernel
def fill_normal(bits: Bits, values: np.ndarray) -> None:
    for i in range(len(values)):
        values[i] = normal(bits, 0.0, 1.0)


def test_normal_numbers_of_the_tail_and_of_every_layer():
    """A million: 3 of 1,000 take the slow ways, 260 of them the tail."""
    rng, values = np.random.default_rng(1), np.empty(1_000_000)
    call_drawing(rng, fill_normal, values)
    np.testing.assert_array_equal(values, np.random.default_rng(1).normal(size=len(values)))
    assert np.abs(values).max() > 4.5


@pytest.mark.slow
def test_plain_python_draws_the_same():
    code = (
        "import numpy as np\n"
        "from legible_envs.support.random_bits import call_drawing\n"
        "from legible_envs.support.random_kernels import below, normal, random, uniform\n"
        "rng = np.random.Generator(np.random.SFC64(4))\n"
        "for _ in range(1000):\n"
        "    print(call_drawing(rng, random), call_drawing(rng, below, 10), call_drawing(rng, below, 2**31 - 5))\n"
        "    print(call_drawing(rng, uniform, -1.5, 0.3), call_drawing(rng, normal, 1.5, 0.3))\n"
    )
    compiled, plain = printed_both_ways(code)
    assert compiled == plain
    assert len(plain.splitlines()) == 2000


@pytest.mark.parametrize("n", [0, -1, 2**31 + 1, -(2**63)])
def test_no_number_below_a_bad_limit(n):
    rng = np.random.default_rng(0)
    before = copy.deepcopy(rng.bit_generator.state)
    with pytest.raises(ValueError, match="1 <= n <= 2"):
        call_drawing(rng, below, n)
    assert rng.bit_generator.state == before


def test_a_generator_in_use_elsewhere_is_waited_for():
    rng, done = np.random.default_rng(0), threading.Event()

    def draw() -> None:
        call_drawing(rng, random)
        done.set()

    with rng.bit_generator.lock:
        thread = threading.Thread(target=draw)
        thread.start()
        assert not done.wait(0.05)
    assert done.wait(60)
    thread.join()


def test_the_generator_is_free_again_after_an_error():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="1 <= n"):
        call_drawing(rng, below, 0)
    assert "unlocked" in repr(rng.bit_generator.lock)
