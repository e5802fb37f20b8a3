"""The observer of Eq. 1 and 2: how a robot turns what it saw of a trajectory into a belief, and what errors cost.

The score of a layout depends on these few settings and on the layout; see :mod:`legible_envs.legibility`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

from legible_envs.support.validation import choice, entries, is_real, real, shown

__all__ = ["ObserverModel", "PrefixSpec", "Ties", "check_prefix"]

PrefixSpec = Literal["mean", "sum"] | tuple[float, ...]
Ties = Literal["expected", "strict"]


def check_prefix(prefix: str | float | Iterable[float]) -> PrefixSpec:
    """Return a valid ``prefix`` setting: ``"mean"``, ``"sum"`` or a tuple of fractions in (0, 1].

    Raises:
        ValueError: Anything else.
    """
    if isinstance(prefix, str):
        if prefix == "mean":
            return "mean"
        if prefix == "sum":
            return "sum"
        raise ValueError(f"`prefix` must be 'mean', 'sum' or a tuple of fractions in (0, 1], got {prefix!r}")
    fractions = entries(prefix) or [prefix]
    if not all(is_real(f) and 0 < f <= 1 for f in fractions):
        raise ValueError(f"`prefix` must be 'mean', 'sum' or a tuple of fractions in (0, 1], got {shown(prefix)}")
    return tuple(float(f) for f in fractions)


@dataclass(frozen=True)
class ObserverModel:
    """An observer who infers goals by Bayes' rule (Eq. 1) and pays for every error (Eq. 2).

    Costs are counted in steps on a grid and in metres on a table. The defaults are those of a grid;
    :meth:`in_metres` has those of a table.

    Attributes:
        beta: Assumed rationality of the person, per step or per metre (Eq. 1).
        c: Cost of every observed ``unit`` of a trajectory after which the predicted goal is wrong (Eq. 2).
        prefix: Which prefixes of a trajectory count: ``"mean"`` over all, their ``"sum"`` (grids only), or a tuple of
            observed fractions in (0, 1].
        ties: ``"expected"`` breaks ties at the top uniformly; ``"strict"`` counts every tie as an error.
        tie_tolerance: Goals whose excess costs differ by at most this much tie, in steps or metres.
        unit: Steps or metres that cost ``c``.

    Raises:
        ValueError: A setting is out of range; the message names it.

    Example:
        >>> ObserverModel(beta=2).beta, ObserverModel.in_metres().beta
        (2.0, 20.0)
    """

    beta: float = 1.0
    c: float = 1.0
    prefix: PrefixSpec = "mean"
    ties: Ties = "expected"
    tie_tolerance: float = 1e-9
    unit: float = 1.0

    def __post_init__(self) -> None:
        for name in ("beta", "c", "tie_tolerance"):
            object.__setattr__(self, name, real(name, getattr(self, name), 0))
        object.__setattr__(self, "unit", real("unit", self.unit, 0, closed="neither", unit="steps or metres"))
        object.__setattr__(self, "prefix", check_prefix(self.prefix))
        choice("ties", self.ties, get_args(Ties))

    @classmethod
    def in_metres(
        cls,
        beta: float = 20.0,
        c: float = 1.0,
        prefix: str | float | Iterable[float] = "mean",
        ties: Ties = "expected",
        tie_tolerance: float = 1e-9,
        unit: float = 0.05,
    ) -> ObserverModel:
        """An observer of reaches on a table: by default a rationality of 20 per metre, and ``c`` per 5 cm observed.

        Args:
            beta: Per metre.
            c: Per ``unit`` observed.
            prefix: ``"mean"`` (ten arc-length midpoints), or observed fractions in (0, 1].
            ties: ``"expected"`` or ``"strict"``.
            tie_tolerance: Metres.
            unit: Metres.
        """
        return cls(beta, c, check_prefix(prefix), ties, tie_tolerance, unit)
