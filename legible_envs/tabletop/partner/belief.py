"""Bayesian goal inference along a reach, with shortest paths among obstacles as costs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.support.validation import real
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.partner.belief_kernels import reach_lengths, reach_posterior

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["BayesianIntent", "GoalBelief"]

Floats = npt.NDArray[np.float64]

BETA = 20.0


class _PathTables(NamedTuple):
    """The first arguments of the kernels: shortest paths to the goals of one belief."""

    boxes: Floats
    size: tuple[float, float]
    corners: Floats
    goals: Floats
    lengths: Floats


class GoalBelief:
    r"""The probability of each goal of one reach, updated as the hand moves (Bayesian goal inference).

    ``P(G | S->Q) ∝ P(G) exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))``, Eq. 1 of Tung et al. (HRI 2024) after Dragan and
    Srinivasa (2013), with ``C*`` the length of the shortest path of the hand (see
    :class:`~legible_envs.tabletop.layout.TabletopLayout`). The cost so far, ``C(S->Q)``, is the same for every goal
    and cancels: only where the reach began and where the hand is now matter. At the start the belief is the prior.

    A hand inside a grown obstacle counts as being at the nearest free point. A goal that no path leads to,
    such as a cube pushed behind obstacles, counts by its straight line. So every cost is finite.

    Args:
        layout: The table.
        beta: Rationality per metre, >= 0.
        start: ``(2,)`` where the reach begins, or the name of one of the table's starts. None: at the first point of
            :meth:`update`, which then leaves the prior.
        goals: Names of the objects the person may reach for; all of the layout if None.
        positions: ``(len(goals), 2)`` where these are now; where the layout has them if None.
        prior: ``{goal: weight}``, not negative and not all zero; uniform if None.

    Raises:
        LayoutError: Unknown goals or start, or points that are not finite.
        ValueError: Another argument out of range, or no or repeated goals.

    Example:
        >>> from legible_envs.tabletop import TableObject, TabletopLayout
        >>> layout = TabletopLayout([TableObject("cup", (0.4, 0.5)), TableObject("milk", (0.8, 0.5))])
        >>> belief = GoalBelief(layout, start="home")
        >>> {goal: round(p, 3) for goal, p in belief.update((0.55, 0.15)).items()}
        {'cup': 0.728, 'milk': 0.272}
    """

    def __init__(
        self,
        layout: TabletopLayout,
        beta: float = BETA,
        *,
        start: npt.ArrayLike | str | None = None,
        goals: Sequence[str] | None = None,
        positions: npt.ArrayLike | None = None,
        prior: Mapping[str, float] | None = None,
    ) -> None:
        self._beta = real("beta", beta, 0)
        self.goals = layout.goals if goals is None else tuple(goals)
        if not self.goals or len(set(self.goals)) != len(self.goals):
            raise ValueError(f"`goals` must name at least one object, each once, got {self.goals!r}")
        self._prior = _checked_prior(prior, self.goals)
        paths, rows = _paths_to(layout, self.goals, positions)
        self._tables = _PathTables(paths.boxes, paths.size, paths.corners, paths.goals[rows], paths.tables[rows])
        self._optimal: Floats | None = None
        self._row = self._prior.copy()
        if isinstance(start, str):
            start = layout.place(start)
        if start is not None:
            self._optimal = self._lengths(*_checked_point(start))

    @property
    def belief(self) -> dict[str, float]:
        """``{goal: probability}`` now; the prior before the first point."""
        return dict(zip(self.goals, self._row.tolist(), strict=True))

    def update(self, point: npt.ArrayLike, time: float | None = None) -> dict[str, float]:
        """Move the hand and return the belief.

        Args:
            point: ``(2,)`` where the hand is now, in metres.
            time: Ignored: this belief does not depend on speed.

        Raises:
            LayoutError: Not a finite point; the belief stays as it was.
        """
        x, y = _checked_point(point)
        if self._optimal is None:
            self._optimal = self._lengths(x, y)
        reach_posterior(*self._tables, self._optimal, self._prior, self._beta, x, y, self._row)
        return self.belief

    def _lengths(self, x: float, y: float) -> Floats:
        lengths = np.empty(len(self.goals))
        reach_lengths(*self._tables, x, y, lengths)
        return lengths


class BayesianIntent:
    """Bayesian goal inference in the form of a predictor: it opens a :class:`GoalBelief` for each reach.

    On the table it is known by the name ``"bayesian"``. It has no parameters to learn.

    Args:
        beta: Rationality per metre.
    """

    def __init__(self, beta: float = BETA) -> None:
        self.beta = beta

    def __repr__(self) -> str:
        return f"BayesianIntent(beta={self.beta!r})"

    def stream(self, context: Trajectory) -> GoalBelief:
        """Follow one reach.

        Args:
            context: A trajectory with a ``layout`` of the table, ``candidates``, and ``goal_positions`` where the
                objects were moved. Its states do not matter: the reach begins at the first point of ``update``.
        """
        layout: TabletopLayout = context.layout  # type: ignore[assignment]
        return GoalBelief(layout, self.beta, goals=context.candidates, positions=context.goal_positions)


def _paths_to(
    layout: TabletopLayout, goals: tuple[str, ...], positions: npt.ArrayLike | None
) -> tuple[ShortestPaths, list[int]]:
    """Path tables, and the rows in them of the goals; tables of the layout itself where nothing was moved."""
    rows = [layout.index(goal) for goal in goals]
    if positions is None:
        return layout.paths, rows
    points = np.array(positions, dtype=np.float64)
    if points.shape != (len(goals), 2) or not np.isfinite(points).all():
        raise LayoutError(f"`positions` must be {len(goals)} finite points, got {positions!r}", rule="point")
    if np.array_equal(points, layout.centres[rows]):
        return layout.paths, rows
    return ShortestPaths.of(layout, points, goals), list(range(len(goals)))


def _checked_point(point: npt.ArrayLike) -> tuple[float, float]:
    try:
        x, y = map(float, point)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        x, y = math.nan, math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise LayoutError(f"expected a finite point (x, y) in metres, got {point!r}", rule="point")
    return x, y


def _checked_prior(prior: Mapping[str, float] | None, goals: tuple[str, ...]) -> Floats:
    if prior is None:
        return np.full(len(goals), 1.0 / len(goals))
    if set(prior) != set(goals):
        raise ValueError(f"`prior` must weigh the goals {list(goals)}, got those of {list(prior)}")
    weights = np.array([prior[goal] for goal in goals], dtype=np.float64)
    if not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
        raise ValueError(f"`prior` must be finite weights >= 0, not all 0, got {dict(prior)!r}")
    return weights / weights.sum()
