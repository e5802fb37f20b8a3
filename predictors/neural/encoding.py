"""The inputs of the networks: one row of numbers for every state, from that state and earlier ones only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory

if TYPE_CHECKING:
    from predictors.neural.checkpoints import EncodingConfig

__all__ = ["Encoding"]

_SMALLEST: Final = 1e-12
_MOST_CELLS: Final = 256 * 256


@dataclass(frozen=True)
class Encoding:
    """The inputs of a network, learned from the trajectories it is fitted to.

    Of every state a network sees where the person is and how they moved since the state before, and with it what was
    known beforehand: the start and, if several were seen in ``fit``, the kitchen. Cells are one-hot, and coordinates
    of the grid; positions are relative to the first one, so that nothing is learned from where a recording begins.
    A start, kitchen or cell that was not seen in ``fit`` is all zeros.

    Attributes:
        grid: Whether states are cells ``(row, col)``.
        dimension: Number of coordinates ``d`` of a state.
        shape: Rows and columns of the smallest grid that holds every cell; empty for positions.
        scale: Divisor of positions.
        stride: Divisor of the displacement between neighbouring states.
        starts: Names of the starts seen.
        layouts: Identifiers of the kitchens seen, if more than one.
    """

    grid: bool
    dimension: int
    shape: tuple[int, ...]
    scale: float
    stride: float
    starts: tuple[str, ...]
    layouts: tuple[str, ...]

    @classmethod
    def learn(cls, trajectories: Sequence[Trajectory]) -> Self:
        """Choose the encoding of trajectories of one kind, of which at least one is not empty.

        Raises:
            ValueError: Cells mixed with positions, different dimensions, or cells that are not ``(row, col)`` or of no
                grid that a network could be given.
        """
        seen = [trajectory for trajectory in trajectories if trajectory.num_states]
        if not seen:
            raise ValueError(f"expected trajectories with states; all {len(trajectories)} are empty")
        kinds = {(trajectory.is_grid, trajectory.states.shape[1]) for trajectory in seen}
        if len(kinds) > 1:
            names = sorted(f"{d}-d {'cells' if grid else 'positions'}" for grid, d in kinds)
            raise ValueError(f"expected trajectories of one kind, got {' and '.join(names)}")
        grid, dimension = kinds.pop()
        if grid and dimension != 2:
            raise ValueError(f"expected (row, col) cells, got {dimension}-d ones")
        states = np.concatenate([trajectory.states for trajectory in seen])
        if grid:
            _check_cells(states)
        offsets = np.concatenate([trajectory.states - trajectory.states[0] for trajectory in seen])
        moves = np.concatenate([np.diff(trajectory.states, axis=0) for trajectory in seen])
        layouts = {_layout_name(trajectory) for trajectory in seen}
        return cls(
            grid=grid,
            dimension=dimension,
            shape=tuple((states.max(axis=0) + 1).tolist()) if grid else (),
            scale=float(max(states.max(), 1)) if grid else _root_mean_square(offsets),
            stride=1.0 if grid else _root_mean_square(moves),
            starts=tuple(sorted({trajectory.start for trajectory in trajectories})),
            layouts=tuple(sorted(layouts)) if len(layouts) > 1 else (),
        )

    @property
    def width(self) -> int:
        """Numbers per state."""
        cells = self.shape[0] * self.shape[1] if self.grid else 0
        return 2 * self.dimension + cells + len(self.starts) + len(self.layouts)

    def check(self, trajectory: Trajectory) -> None:
        """Check that a trajectory is of the kind that was learned.

        Raises:
            ValueError: It is not.
        """
        if trajectory.num_states and (trajectory.is_grid, trajectory.states.shape[1]) != (self.grid, self.dimension):
            expected, got = (
                f"{d}-d {'cells' if grid else 'positions'}"
                for grid, d in ((self.grid, self.dimension), (trajectory.is_grid, trajectory.states.shape[1]))
            )
            raise ValueError(f"`fit` saw {expected}, this trajectory has {got}")

    def context(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(starts) + len(layouts),)`` what is known before the first state."""
        known = [trajectory.start == name for name in self.starts]
        if self.layouts:
            layout = _layout_name(trajectory)
            known += [layout == name for name in self.layouts]
        return np.array(known, dtype=np.float64)

    def encode(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(T, width)`` rows for all states of a trajectory."""
        if not trajectory.num_states:
            return np.zeros((0, self.width))
        previous = np.concatenate([trajectory.states[:1], trajectory.states[:-1]])
        return self.rows(self.context(trajectory), trajectory.states[0], previous, trajectory.states)

    def rows(
        self,
        context: npt.NDArray[np.float64],
        first: npt.NDArray[Any],
        previous: npt.NDArray[Any],
        states: npt.NDArray[Any],
    ) -> npt.NDArray[np.float64]:
        """``(T, width)`` rows for states ``(T, d)``, given the first state ``(d,)`` and those before ``(T, d)``."""
        count, d = states.shape
        rows = np.zeros((count, self.width))
        rows[:, :d] = (states if self.grid else states - first) / self.scale
        rows[:, d : 2 * d] = (states - previous) / self.stride
        if self.grid:
            inside = ((states >= 0) & (states < self.shape)).all(axis=1)
            index = states[:, 0] * self.shape[1] + states[:, 1]
            rows[np.flatnonzero(inside), 2 * d + index[inside]] = 1.0
        rows[:, self.width - len(context) :] = context
        return rows

    def to_config(self) -> dict[str, Any]:
        """As plain values that JSON can hold."""
        return asdict(self)

    @classmethod
    def from_config(cls, config: EncodingConfig) -> Self:
        """The encoding that :meth:`to_config` described.

        Raises:
            ValueError: The parts contradict each other.
        """
        if config.grid != bool(config.shape) or (config.grid and config.dimension != 2):
            raise ValueError(
                f"an encoding of {'cells' if config.grid else 'positions'} cannot have {config.dimension} dimensions "
                f"and a grid of shape {config.shape}"
            )
        return cls(
            grid=config.grid,
            dimension=config.dimension,
            shape=tuple(config.shape),
            scale=config.scale,
            stride=config.stride,
            starts=tuple(config.starts),
            layouts=tuple(config.layouts),
        )


def _check_cells(cells: npt.NDArray[np.int64]) -> None:
    """Refuse cells of no grid, or of one too large for a number per cell."""
    bad = cells[(cells < 0).any(axis=1)]
    if not len(bad) and np.prod(cells.max(axis=0) + 1.0) > _MOST_CELLS:
        bad = cells[cells.max(axis=1).argmax()][None]
    if len(bad):
        row, col = bad[0].tolist()
        raise ValueError(
            f"expected cells of a grid of at most {_MOST_CELLS} cells, rows and columns from 0 on; got row {row}, "
            f"column {col}"
        )


def _root_mean_square(vectors: npt.NDArray[Any]) -> float:
    """Typical length of vectors ``(n, d)``; 1 where all are zero."""
    length = float(np.sqrt((vectors.astype(np.float64) ** 2).sum(axis=1).mean())) if len(vectors) else 0.0
    return length if length > _SMALLEST else 1.0


def _layout_name(trajectory: Trajectory) -> str:
    return trajectory.layout.layout_id if trajectory.layout is not None else trajectory.layout_name
