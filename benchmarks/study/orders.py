"""Orders of conditions: Williams squares, simple random, fixed, or a plug-in; the least filled order comes next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np

from benchmarks.study.errors import StudyError
from legible_envs.support.plugins import import_target
from legible_envs.support.validation import shown

__all__ = ["POLICIES", "OrderPolicy", "make_policy", "next_order", "williams"]

POLICIES: Final = ("williams", "random", "fixed")
"""Those that come with the package."""
_MOST: Final = 10_000
"""Orders of a plug-in."""


class OrderPolicy(Protocol):
    """In which orders participants meet the conditions.

    Attributes:
        name: What the study's settings call it.
        num_orders: How many orders there are, to be met equally often; 0 where each is drawn.
    """

    name: str
    num_orders: int

    def order(self, number: int, rng: np.random.Generator) -> list[str]:
        """All conditions in one order.

        Args:
            number: From 0, below ``num_orders``; 0 where orders are drawn.
            rng: Source of randomness of policies that draw.
        """


class _Listed:
    """Orders in a list.

    Args:
        name: Of the policy.
        orders: All orders.
    """

    def __init__(self, name: str, orders: Sequence[Sequence[str]]) -> None:
        self.name = name
        self._orders = [list(order) for order in orders]
        self.num_orders = len(self._orders)

    def order(self, number: int, rng: np.random.Generator) -> list[str]:
        return list(self._orders[number])


class _Random:
    """Simple random: every order is equally likely for everyone, whatever others have met."""

    name = "random"
    num_orders = 0

    def __init__(self, conditions: Sequence[str]) -> None:
        self._conditions = list(conditions)

    def order(self, number: int, rng: np.random.Generator) -> list[str]:
        return [self._conditions[i] for i in rng.permutation(len(self._conditions))]


def williams(names: Sequence[str]) -> list[list[str]]:
    """The orders of a Williams design, balanced for first-order carry-over.

    Every condition is at every place equally often, and follows every other one equally often. An even number of
    conditions needs as many orders, an odd number twice as many (E. J. Williams, Experimental designs balanced for the
    estimation of residual effects of treatments, Australian Journal of Scientific Research A 2, 1949).

    Args:
        names: ``n`` conditions, all different.

    Returns:
        ``n`` orders for an even ``n`` and for 1, else ``2n``.

    Example:
        >>> ["".join(order) for order in williams("ABCD")]
        ['ABDC', 'BCAD', 'CDBA', 'DACB']
    """
    count = len(names)
    first = [0]
    low, high = 1, count - 1
    while low <= high:
        first.append(low)
        if low < high:
            first.append(high)
        low, high = low + 1, high - 1
    rows = [[names[(place + shift) % count] for place in first] for shift in range(count)]
    return rows if count % 2 == 0 or count == 1 else [*rows, *(row[::-1] for row in rows)]


def make_policy(policy: str, conditions: Sequence[str]) -> OrderPolicy:
    """An order policy by name.

    Args:
        policy: ``"williams"``, ``"random"``, ``"fixed"`` (the order of the file for all), or ``"module:function"``. The
            function is called with the names of the conditions as a tuple and returns all orders, each a sequence of
            all names; it returns the same ones whenever it is called. Each order comes as often as every other, as with
            a square.
        conditions: Names, in the order of the file, all different.

    Raises:
        StudyError: There is no such policy, or the plug-in cannot be used; says why.
    """
    if policy == "williams":
        return _Listed(policy, williams(conditions))
    if policy == "random":
        return _Random(conditions)
    if policy == "fixed":
        return _Listed(policy, [conditions])
    if ":" not in policy:
        raise StudyError(
            f"an order policy is one of {', '.join(map(repr, POLICIES))}, or 'module:function'; got {policy!r}"
        )
    return _Listed(policy, _checked(policy, tuple(conditions)))


def _checked(policy: str, conditions: tuple[str, ...]) -> list[list[str]]:
    """The orders of a plug-in."""
    try:
        function: Any = import_target(policy)
        found, again = ([list(order) for order in function(conditions)] for _ in range(2))
    except Exception as error:  # whatever a stranger's module raises
        raise StudyError(f"{policy!r} cannot be used: {type(error).__name__}: {error}") from error
    if not 1 <= len(found) <= _MOST:
        raise StudyError(f"{policy!r} must return 1 to {_MOST:,} orders, got {len(found):,}")
    for number, order in enumerate(found, 1):
        if any(not isinstance(name, str) for name in order) or sorted(order) != sorted(conditions):
            raise StudyError(
                f"{policy!r} must return orders of all of {', '.join(conditions)}; order {number} is {shown(order)}"
            )
    if found != again:
        raise StudyError(f"{policy!r} must return the same orders whenever it is called; the second time it did not")
    return found


def next_order(
    policy: str | OrderPolicy, conditions: Sequence[str], counts: Mapping[int, int], rng: np.random.Generator
) -> tuple[int, list[str]]:
    """The order of the next participant: one that the fewest have met, so that drop-outs are refilled.

    Args:
        policy: A policy, or its name.
        conditions: Names, in the order of the file.
        counts: By number of the order, how many participants have finished it or are on their way. Who dropped out
            does not count. Numbers that the policy does not have are ignored.
        rng: Decides among orders that equally few have met, and draws those of ``"random"``.

    Returns:
        The number of the order, 0 where orders are drawn; and all conditions in this order.

    Raises:
        StudyError: As of :func:`make_policy`.
    """
    chosen = make_policy(policy, conditions) if isinstance(policy, str) else policy
    if not chosen.num_orders:
        return 0, chosen.order(0, rng)
    filled = np.array([counts.get(number, 0) for number in range(chosen.num_orders)])
    number = int(rng.choice(np.flatnonzero(filled == filled.min())))
    return number, chosen.order(number, rng)
