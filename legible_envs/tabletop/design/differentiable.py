"""The legibility of a table without obstacles, and continuous measures of it, with gradients by PyTorch.

Without obstacles every shortest path is a straight line, and Eq. 1 to 3 are compositions of distances, exponentials,
quotients and minima. What :class:`.TabletopScorer` computes is therefore *piecewise* smooth in the centres of the
objects. It has a kink wherever two goals are equally likely second choices (the margin of Eq. 2 goes over to the
other). It jumps where another goal ties with the true one (objects in one place, or one straight behind another as seen
from the start), because errors cost what was observed. On kinks the gradient is one of the slopes or a mean of them; at
ties it is that of the value there. Gradients know nothing of a layout's rules: a step along one may make objects
overlap or leave the region, so check the result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.support.optional import import_torch
from legible_envs.support.validation import choice
from legible_envs.tabletop.scoring.exact_kernels import ReachTables
from legible_envs.tabletop.scoring.scorer import TabletopScorer
from legible_envs.tabletop.task import TabletopTask
from legible_envs.workspace import ObjectiveName

if TYPE_CHECKING:
    from collections.abc import Sequence

    import torch

    from legible_envs.tabletop.design.workspace import TabletopWorkspace

__all__ = ["DifferentiableTable", "genome_gradients", "require_torch"]

Floats = npt.NDArray[np.float64]

_GREATEST_EXPONENT = 40.0
"""Evidence against a goal beyond this (4e-18) is cut off, as in the compiled score."""


def require_torch() -> Any:
    """PyTorch, an optional dependency.

    Raises:
        ImportError: It is not installed; the message says how to.
    """
    return import_torch("gradients of a table need", "scores and searches without gradients do without it")


class DifferentiableTable:
    """Legibility (Eq. 3), distance and two continuous measures of tables without obstacles, as functions of tensors.

    Every function takes ``(n, M, 2)`` centres of the ``M`` movable objects, in metres and in the order of the task
    (that of a genome), in float64 on any device, and returns ``(n,)``; rows that are not finite give NaN. Values are
    those of :class:`.TabletopScorer`; where gradients have kinks is said at the top of
    :mod:`legible_envs.tabletop.design.differentiable`.

    Args:
        scorer: What is scored and how: a scorer, a task, or the name of a task that comes with the package.
        ranked: Objects whose mean x is a measure. Default: all movable ones.

    Raises:
        ImportError: PyTorch is not installed.
        TaskError: The task is unknown.
        ValueError: An object to be ranked is unknown.

    Example:
        >>> import torch
        >>> table = DifferentiableTable("tea")
        >>> centres = torch.tensor(table.home[None], requires_grad=True)
        >>> table.legibility(centres).sum().backward()
        >>> centres.grad.shape
        torch.Size([1, 5, 2])
    """

    def __init__(
        self, scorer: TabletopScorer | TabletopTask | str = "columns", *, ranked: Sequence[str] | None = None
    ) -> None:
        self._torch = require_torch()
        self.scorer = scorer if isinstance(scorer, TabletopScorer) else TabletopScorer(scorer)
        layout = self.scorer.task.layout
        movable = [o.movable for o in layout.objects]
        self._movable = np.flatnonzero(movable)
        unknown = [name for name in ranked or () if name not in layout.goals]
        if unknown:
            raise ValueError(f"ranked must name objects of the task, {list(layout.goals)}; it names {unknown}")
        names = [o.name for o in layout.objects if o.movable] if ranked is None else list(ranked)
        self._ranked = [layout.index(name) for name in names]
        i, j = np.triu_indices(len(movable), 1)
        counts = np.array(movable)[i] | np.array(movable)[j]
        self._pairs = i[counts], j[counts]
        self._template = layout.points

    @property
    def home(self) -> Floats:
        """``(M, 2)`` centres of the movable objects in the task's own arrangement."""
        return self._template[self._movable]

    # -- functions of tensors ------------------------------------------------------------------------------------------

    def legibility(self, centres: torch.Tensor) -> torch.Tensor:
        """Eq. 3 per valid sequence, exactly as the scorer has it, to 1e-9."""
        points = self._points(centres)
        tables = self.scorer.tables
        return sum(self._group(points, q, tables) for q in range(len(tables.group_start)))  # type: ignore[return-value]

    def distance(self, centres: torch.Tensor) -> torch.Tensor:
        """Expected metres of one whole task, fetching and carrying."""
        points, tables = self._points(centres), self.scorer.tables
        legs = points[:, tables.targets[tables.leg_target]] - points[:, tables.leg_from]
        return self._norm(legs) @ self._like(tables.leg_weight, points)

    def least_distance(self, centres: torch.Tensor) -> torch.Tensor:
        """Metres between the two nearest objects, pairs that both stay left out; 0 where there is no pair."""
        points = self._points(centres)
        i, j = self._pairs
        if not len(i):
            return points[:, 0, 0] * 0.0
        return self._norm(points[:, i] - points[:, j]).amin(dim=1)

    def mean_x(self, centres: torch.Tensor) -> torch.Tensor:
        """Mean ``x`` of the ranked objects, in metres."""
        return self._points(centres)[:, self._ranked, 0].mean(dim=1)

    # -- arrays in, arrays out -----------------------------------------------------------------------------------------

    def gradients(self, centres: npt.ArrayLike, *names: str) -> tuple[Floats, Floats]:
        """Values and gradients of several functions at ``(n, M, 2)`` centres.

        Args:
            centres: An array.
            *names: ``"legibility"``, ``"distance"``, ``"least_distance"`` or ``"mean_x"``.

        Returns:
            ``(n, len(names))`` values and ``(n, len(names), M, 2)`` gradients.
        """
        torch = self._torch
        tensor = torch.tensor(np.asarray(centres, dtype=np.float64), requires_grad=True)
        values, slopes = [], []
        for name in names:
            value = getattr(self, name)(tensor)
            # Rows do not depend on one another: the gradient of the sum holds that of each.
            (slope,) = torch.autograd.grad(value.sum(), tensor, allow_unused=True)
            values.append(value.detach())
            slopes.append(torch.zeros_like(tensor) if slope is None else slope)
        return torch.stack(values, dim=1).numpy(), torch.stack(slopes, dim=1).numpy()

    # -- the pieces ----------------------------------------------------------------------------------------------------

    def _like(self, array: npt.NDArray[Any], points: torch.Tensor) -> torch.Tensor:
        return self._torch.as_tensor(array, dtype=points.dtype, device=points.device)

    def _norm(self, steps: torch.Tensor) -> torch.Tensor:
        # Unlike the root of a sum of squares it has the gradient 0 at 0.
        return self._torch.linalg.vector_norm(steps, dim=-1)

    def _points(self, centres: torch.Tensor) -> torch.Tensor:
        """``(n, N, 2)`` objects, then starts."""
        if centres.ndim != 3 or centres.shape[1:] != (len(self._movable), 2):
            raise ValueError(
                f"expected centres of shape (n, {len(self._movable)}, 2): {len(self._movable)} movable objects; "
                f"got {tuple(centres.shape)}"
            )
        centres = centres.to(self._torch.float64)
        points = self._like(self._template, centres).expand(len(centres), -1, -1).clone()
        points[:, self._movable] = centres
        return points

    def _group(self, points: torch.Tensor, q: int, tables: ReachTables) -> torch.Tensor:
        """``(n,)`` what all stages of one group add: weights of stages and goals times E[EnvLegibility] (Eq. 2)."""
        torch = self._torch
        first, last = tables.group_offset[q], tables.group_offset[q + 1]
        goals = points[:, tables.targets[tables.goal_target[first:last]]]
        start, fractions = points[:, tables.group_start[q]], self._like(tables.fractions, points)
        num_goals, num_points = last - first, (last - first) * len(fractions)
        lines = goals - start[:, None]
        lengths = self._norm(lines)
        at = (start[:, None, None] + fractions[:, None] * lines[:, :, None]).flatten(1, 2)
        seen = (fractions * lengths[:, :, None]).flatten(1, 2)
        own = self._like(np.repeat(np.eye(num_goals), len(fractions), axis=0), points)
        excess = self._norm(goals[:, None] - at[:, :, None]) + seen[:, :, None] - lengths[:, None]
        evidence = torch.exp(-(tables.beta * excess).clamp(0.0, _GREATEST_EXPONENT)) * (1.0 - own)
        share = _shares(torch, evidence)
        is_tied = (excess <= tables.tie_tolerance) & (own == 0)
        if bool(is_tied.any()):
            others = _sums(torch, is_tied.to(points.dtype))
            wrong = torch.ones_like(others) if tables.strict else others / (others + 1.0)
            share = torch.where(others > 0, -tables.penalty * seen[:, None] * wrong, share)
        weights = tables.stage_weights[q, : (1 << num_goals) * num_points].reshape(-1, num_points)
        # Where a weight is 0 the point's true goal is no candidate, and the number there means nothing.
        return (share * self._like(weights, points)).sum(dim=(1, 2))


def genome_gradients(workspace: TabletopWorkspace, genomes: Floats, objective: ObjectiveName) -> Floats:
    """See :meth:`legible_envs.tabletop.design.workspace.TabletopWorkspace.gradients`."""
    if workspace.second_measure != "mean x":
        raise ValueError(
            "the rank of an order has no gradient; give the workspace condition='placement' and second_measure='mean x'"
        )
    choice("objective", objective, get_args(ObjectiveName))
    table = DifferentiableTable(workspace.scorer, ranked=workspace.ranked)
    movable = table.home.size
    centres = genomes[:, :movable].reshape(len(genomes), *table.home.shape)
    _, slopes = table.gradients(centres, "legibility", "distance", "least_distance", "mean_x")
    legibility, distance, *measures = np.moveaxis(slopes.reshape(len(genomes), slopes.shape[1], movable), 1, 0)
    slope = legibility if objective == "legibility" else -distance
    if objective == "legible-efficient":
        scale = workspace.calibration
        slope = legibility / scale["legibility_sd"] - distance / scale["distance_sd"]
    found = np.zeros((len(genomes), 1 + len(measures), genomes.shape[1]))
    found[:, :, :movable] = np.stack([slope, *measures], axis=1)
    return found


def _shares(torch: Any, evidence: torch.Tensor) -> torch.Tensor:
    """``(n, 2^G, P)`` margins of the true goals for every set of candidates, if none ties.

    ``(1 - greatest) / (1 + sum)`` of the ``(n, P, G)`` evidence for other candidates, that for the true goal being 1.
    """
    margin = torch.ones_like(evidence[:, None, :, 0])
    for g in range(evidence.shape[2]):
        margin = torch.cat([margin, torch.minimum(margin, 1.0 - evidence[:, None, :, g])], dim=1)
    return margin / (1.0 + _sums(torch, evidence))


def _sums(torch: Any, terms: torch.Tensor) -> torch.Tensor:
    """``(n, 2^G, P)`` sums over every subset of the last axis of ``(n, P, G)`` terms; bit g of a row has term g in."""
    sums = torch.zeros_like(terms[:, None, :, 0])
    for g in range(terms.shape[2]):
        sums = torch.cat([sums, sums + terms[:, None, :, g]], dim=1)
    return sums
