"""The settings of the experiment, as data."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

__all__ = [
    "FULL",
    "LEARNED",
    "LOCAL_SEARCH",
    "METHODS",
    "OPTIMUM_5X5",
    "OURS",
    "PAPER_METHODS",
    "PUBLISHED",
    "QUICK",
    "Settings",
    "grid_name",
    "trials_of",
]

Shape = tuple[int, int]

METHODS: Final = (
    "annealing",
    "improve",
    "mutation",
    "nslc",
    "differential-evolution",
    "cma-me",
    "cma-mae",
    "random",
)
"""Emitters compared, by their registered names; the first is our own, ``improve`` is the paper's MAP-Elites."""

LEARNED: Final = ("ppo",)
"""Designers that learn as they search, beside the emitters above. They need PyTorch, and are left out without it."""

OURS: Final = "annealing"

PAPER_METHODS: Final = {"improve": "MAP-Elites", "nslc": "NSLC", "differential-evolution": "DE"}
"""The three of the paper, by what it calls them."""

PUBLISHED: Final[Mapping[str, Mapping[str, float]]] = {
    "MAP-Elites": {"5x5": -86.37, "7x7": -167.88, "9x9": -173.52, "5x9": -162.97},
    "NSLC": {"5x5": -95.44, "7x7": -175.43, "9x9": -190.54, "5x9": -169.63},
    "DE": {"5x5": -129.28, "7x7": -202.52, "9x9": -229.22, "5x9": -186.31},
}
"""Published mean best scores by method and grid. The unit differs from ours: ranks can be compared, values cannot."""

OPTIMUM_5X5: Final = -11.684924681147868
"""Best score of all valid 5x5 kitchens with ``prefix="sum"``, by exhaustive search."""

LOCAL_SEARCH: Final[Mapping[str, float]] = {"7x7": 70.85, "5x9": 49.4, "9x9": 166.6}
"""What a plain local search reaches in a million evaluations, to two or one decimals: values to pass, same unit."""


@dataclass(frozen=True)
class Settings:
    """What is run.

    Attributes:
        grids: Rows and columns of the kitchens.
        seeds: Searches of each kind.
        budgets: Equal numbers of evaluations, the random layouts every search begins with included. Each is a search of
            its own, as emitters plan with their budget.
        large: Larger budgets, or more seeds at one of ``budgets``, each with its grid and number of seeds; few methods
            run them, as they take time.
        large_methods: These methods.
        learned_budgets: Those of ``budgets`` that designers that learn are given too: they take much longer.
        iterations: Whether the paper's budgets in iterations are run too.
        prefix: Which prefixes count in the score; see ``OvercookedWorkspace``.
    """

    grids: tuple[Shape, ...] = ((5, 5), (7, 7), (9, 9), (5, 9))
    seeds: int = 10
    budgets: tuple[int, ...] = (2_000, 20_000, 200_000)
    large: tuple[tuple[int, Shape, int], ...] = (
        # Two wide valleys compete on this grid: a search ends in one or the other, and to tell shares takes many.
        (200_000, (5, 9), 60),
        (1_000_000, (7, 7), 10),
        (1_000_000, (9, 9), 10),
        (1_000_000, (5, 9), 10),
    )
    large_methods: tuple[str, ...] = (OURS, "improve")
    learned_budgets: tuple[int, ...] = (2_000, 20_000)
    iterations: bool = True
    prefix: str = "sum"

    def with_seeds(self, seeds: int) -> Settings:
        """The same with ``seeds`` searches of each kind, at most as many as planned for large budgets."""
        large = tuple((evaluations, shape, min(seeds, own)) for evaluations, shape, own in self.large)
        return dataclasses.replace(self, seeds=seeds, large=large)


FULL: Final = Settings()
"""About an hour on two idle cores, half of it for designers that learn, which need PyTorch; a million evaluations only
for our emitter and the paper's."""

QUICK: Final = Settings(grids=((5, 5), (7, 7)), seeds=3, budgets=(2_000, 8_000), large=(), learned_budgets=())
"""A minute or two on two idle cores: small grids, three seeds, no large budgets."""

PAPER_BUDGETS: Final[Mapping[str, dict[str, Any]]] = {
    "improve": {"iterations": [100, 100], "options": {}},
    "nslc": {"iterations": [20, 180], "options": {"population": 20}},
    "differential-evolution": {"iterations": [20, 200], "options": {"population": 20}},
}
"""The paper's budgets: 100 random layouts and 100 climbs; ten generations of 20; 200 generations (of 20, which the
paper does not say)."""


def grid_name(shape: Shape) -> str:
    """``"5x9"``: rows by columns."""
    return f"{shape[0]}x{shape[1]}"


class _Job(NamedTuple):
    """Every method on every grid, with so many seeds, at one budget; ``evaluations`` is None for the paper's."""

    budget: str
    evaluations: int | None
    seeds: int
    grids: tuple[Shape, ...]
    methods: tuple[str, ...]


def trials_of(settings: Settings) -> list[dict[str, Any]]:
    """One trial per grid, budget, method and seed; those of small budgets first, so that a stop leaves whole tables."""
    jobs: list[_Job] = []
    if settings.iterations:
        jobs.append(_Job("paper", None, settings.seeds, settings.grids, tuple(PAPER_BUDGETS)))
    jobs += [_Job(f"{n}", n, settings.seeds, settings.grids, METHODS) for n in settings.budgets]
    learned = [n for n in settings.budgets if n in settings.learned_budgets]
    jobs += [_Job(f"{n}", n, settings.seeds, settings.grids, LEARNED) for n in learned]
    jobs += [_Job(f"{n}", n, seeds, (shape,), settings.large_methods) for n, shape, seeds in settings.large]
    trials: dict[str, dict[str, Any]] = {}
    for budget, evaluations, seeds, grids, methods in jobs:
        for shape, seed, method in itertools.product(grids, range(seeds), methods):
            how = PAPER_BUDGETS[method] if evaluations is None else {"iterations": None, "options": {}}
            workspace = {"workspace": "overcooked", "shape": list(shape), "prefix": settings.prefix}
            trial = {"grid": grid_name(shape), "budget": budget, "method": method, "seed": seed}
            trials[str(trial)] = {**trial, "workspace": workspace, "evaluations": evaluations, **how}
    return list(trials.values())
