"""What is designed, what is maximised, and where an episode starts: read from the arguments of the environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Final, cast, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import kind_named, list_layout_kinds
from legible_envs.support.plugins import import_target, target_of
from legible_envs.support.validation import is_real, real, shown
from legible_envs.workspace import ObjectiveName, Workspace, make_workspace

__all__ = ["DesignProblem", "read_workspace"]

SCALE_SEED: Final = 20240311
SCALE_SIZE: Final = 256
START_TRIES: Final = 1000

Genomes = npt.NDArray[Any]
Array = npt.NDArray[np.float64]
Scorer = Callable[[Genomes], Array]


def read_workspace(workspace: Any, settings: Mapping[str, Any]) -> Workspace:
    """The design problem that the arguments of an environment name.

    Args:
        workspace: An instance; or a name, ``"module:Class"`` or configuration that :func:`.make_workspace` takes.
        settings: Further settings of a workspace that is named.

    Raises:
        ValueError: Neither; or settings for an instance, which has its own.
    """
    if isinstance(workspace, Workspace):
        if settings:
            raise ValueError(
                f"settings {sorted(settings)} are for a workspace given by name, not for {shown(workspace)}"
            )
        return workspace
    if not isinstance(workspace, str | Mapping):
        raise ValueError(
            "`workspace` must be a name, 'module:Class', a configuration with the key 'workspace', or a Workspace, got "
            f"{shown(workspace)}"
        )
    return make_workspace(workspace, **settings)


class DesignProblem:
    """A workspace and what is maximised there.

    Args:
        workspace: The design problem.
        objective: Name known to ``workspace.objective``; ``"module:function"``; or a callable from ``(n, d)`` genomes
            to ``(n,)`` numbers. NaN and negative infinity mean that a layout is not allowed.
        max_distance: Layouts with a longer distance are not allowed; None means no cap.

    Attributes:
        workspace: The design problem.
        max_distance: The cap.
        objective_name: The objective as text: its name, or where it is defined.

    Raises:
        ValueError: An unknown objective, or a cap that is no positive number.
    """

    def __init__(self, workspace: Workspace, objective: str | Scorer, max_distance: float | None = None) -> None:
        self.workspace = workspace
        self.max_distance = None
        if max_distance is not None:
            self.max_distance = real("max_distance", max_distance, 0, closed="neither", also="None")
        self._score = _read_objective(workspace, objective)
        self.objective_name = objective if isinstance(objective, str) else target_of(objective)

    def scores(self, genomes: Genomes) -> Array:
        """``(n,)`` the objective of ``(n, d)`` valid genomes; NaN where it is not allowed.

        Raises:
            ValueError: The objective returned another shape, or positive infinity.
        """
        values = np.array(self._score(genomes), dtype=np.float64)
        if values.shape != (len(genomes),):
            raise ValueError(
                f"objective {self.objective_name!r} must return one number per genome, shape ({len(genomes)},); it "
                f"returned shape {values.shape}"
            )
        if np.isposinf(values).any():
            raise ValueError(f"objective {self.objective_name!r} returned +inf; expected a finite number, or NaN")
        values[np.isneginf(values)] = np.nan
        if self.max_distance is not None:
            values[~self._near(genomes)] = np.nan
        return values

    def allowed(self, genomes: Genomes) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes obey the rules of the workspace and the cap on distance."""
        valid = np.asarray(self.workspace.valid(genomes), dtype=np.bool_)
        if self.max_distance is not None and valid.any():
            valid[valid] = self._near(genomes[valid])
        return valid

    def _near(self, genomes: Genomes) -> npt.NDArray[np.bool_]:
        return np.asarray(self.workspace.distance(genomes)) <= self.max_distance

    @cached_property
    def scale(self) -> tuple[float, float]:
        """Mean and standard deviation of the objective over 256 random layouts drawn with a fixed seed.

        Raises:
            LayoutError: None of them has a score.
        """
        scores = self.scores(self.workspace.sample(SCALE_SIZE, np.random.default_rng(SCALE_SEED)))
        scores = scores[~np.isnan(scores)]
        if not scores.size:
            raise self._nowhere(SCALE_SIZE)
        spread = float(scores.std())
        return float(scores.mean()), spread if spread > 0 else 1.0

    def start(self, rng: np.random.Generator) -> tuple[Genomes, float]:
        """``(d,)`` a random layout that has a score, and its score.

        Raises:
            LayoutError: None of a thousand has one.
        """
        for count in (1, START_TRIES):
            genomes = self.workspace.sample(count, rng)
            scores = self.scores(genomes)
            scored = np.flatnonzero(~np.isnan(scores))
            if scored.size:
                return genomes[scored[0]], float(scores[scored[0]])
        raise self._nowhere(START_TRIES)

    def _nowhere(self, tried: int) -> LayoutError:
        return LayoutError(
            f"none of {tried:,} random layouts has a score under objective {self.objective_name!r}{self._capped()}",
            rule="objective",
        )

    def _capped(self) -> str:
        return "" if self.max_distance is None else f" with max_distance={self.max_distance:g}"

    # -- layouts of users ----------------------------------------------------------------------------------------------

    def read(self, layout: Any) -> Genomes:
        """``(d,)`` the genome of a layout to start from.

        Args:
            layout: A genome, a layout that ``workspace.encode`` takes, or the text of one.

        Raises:
            LayoutError: It is none, or breaks a rule of the workspace; or it is not allowed by objective or cap.
        """
        genome = self._encoded(layout)
        if np.isnan(self.scores(genome[None])[0]):
            raise LayoutError(
                f"the layout has no score under objective {self.objective_name!r}{self._capped()}; its distance is "
                f"{self.workspace.distance(genome):g}",
                rule="objective",
            )
        return genome

    def _encoded(self, layout: Any) -> Genomes:
        workspace = self.workspace
        if isinstance(layout, str) and workspace.name in list_layout_kinds():
            layout = kind_named(workspace.name).from_text(layout)
        numbers = as_numbers(layout)
        if numbers is None:
            try:
                return np.array(workspace.encode(layout), dtype=workspace.genome_dtype)
            except (AttributeError, TypeError) as error:
                raise LayoutError(
                    f"`layout` must be a layout of workspace {workspace.name!r}, its text, or a genome of "
                    f"{workspace.genome_size} numbers, got {shown(layout)}",
                    rule="type",
                ) from error
        if numbers.shape != (workspace.genome_size,):
            raise LayoutError(
                f"expected a genome of shape ({workspace.genome_size},), got {numbers.shape}", rule="shape"
            )
        workspace.decode(numbers)  # says which rule is broken
        return numbers.astype(workspace.genome_dtype)

    def entries(self, layout: Any) -> list[Any] | None:
        """The layouts of a list, tuple or ``(n, d)`` array with one for each environment of a vector; None for one."""
        if isinstance(layout, np.ndarray) and layout.ndim == 2:
            return list(layout)
        if isinstance(layout, list | tuple) and layout and not all(is_real(entry) for entry in layout):
            return list(layout)
        return None


def as_numbers(value: Any) -> npt.NDArray[Any] | None:
    """An array of real numbers, or a list or tuple of such; None for anything else."""
    if isinstance(value, list | tuple) and value and all(is_real(entry) for entry in value):
        return np.array(value)
    return value if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" else None


def _read_objective(workspace: Workspace, objective: str | Scorer) -> Scorer:
    if isinstance(objective, str) and ":" not in objective:
        return workspace.objective(cast("ObjectiveName", objective))
    found = objective
    if isinstance(objective, str):
        try:
            found = import_target(objective)
        except (ImportError, AttributeError, ValueError) as error:
            raise ValueError(f"objective {objective!r} cannot be imported: {error}") from error
    if not callable(found):
        raise ValueError(
            f"`objective` must be one of {list(get_args(ObjectiveName))}, 'module:function' or a callable on genomes, "
            f"got {shown(objective)}"
        )
    return found
