"""How much an analysis does, and what it knows of the paper's experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.experiments.predictor_settings import PredictorSetting

__all__ = ["AnalysisSettings", "Claim", "claims_of", "published_for", "settings_for"]


@dataclass(frozen=True)
class AnalysisSettings:
    """How much is done.

    Attributes:
        predictors: Which predictors to compare, the paper's first.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        shares: Of the trajectories not held out, learned from in learning curves.
        curve_repeats: Splits of the learning curves; 0: none.
        share: Of the training data, in the hypothesis that less of it is enough.
        samples: Steps of a mean reach, for covariances.
        seed: Of the splits.
        alpha: Level of all tests and intervals.
    """

    predictors: tuple[PredictorSetting, ...]
    folds: int = 4
    repeats: int = 3
    shares: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0)
    curve_repeats: int = 4
    share: float = 0.25
    samples: int = 50
    seed: int = 0
    alpha: float = 0.05


def settings_for(domain: str, *, quick: bool = False, alpha: float = 0.05) -> AnalysisSettings:
    """The settings of the domain's experiment: its predictors, folds and repeats.

    Args:
        domain: ``"overcooked"`` or ``"tabletop"``.
        quick: No neural predictor, one repeat, and learning curves of two points.
        alpha: Level of all tests and intervals.
    """
    if domain == "overcooked":
        from benchmarks.experiments.overcooked import sweep as kitchens

        found = AnalysisSettings((*kitchens.PREDICTORS, kitchens.NEURAL), alpha=alpha)
    else:
        from benchmarks.experiments.tabletop import sweep as tables

        own = (*tables.PREDICTORS, tables.NEURAL)
        found = AnalysisSettings(own, share=0.3, shares=(0.3, 0.5, 0.75, 1.0), alpha=alpha)
    if quick:
        found = replace(found, predictors=found.predictors[:-1], repeats=1, curve_repeats=2, shares=(found.share, 1.0))
    return found


@dataclass(frozen=True)
class Claim:
    """Where goals should be predicted better.

    Attributes:
        treatment: In this condition.
        controls: Than in these.
    """

    treatment: str
    controls: tuple[str, ...]


def claims_of(
    domain: str, conditions: Sequence[str], treatment: str | None = None, controls: Sequence[str] = ()
) -> list[Claim]:
    """The claims to test: those asked for, or the reproduction's as far as the study has its conditions.

    Args:
        domain: ``"overcooked"`` or ``"tabletop"``.
        conditions: Of the study.
        treatment: The condition in which goals should be predicted better; None for the reproduction's.
        controls: The conditions to beat; all others where none is given.

    Raises:
        ValueError: There is no such condition, or nothing to compare it with.
    """
    if treatment is not None:
        others = tuple(controls) or tuple(name for name in conditions if name != treatment)
        unknown = [name for name in (treatment, *others) if name not in conditions]
        if unknown:
            raise ValueError(f"there is no condition {unknown[0]!r}; there are {', '.join(map(repr, conditions))}")
        if not others or treatment in others:
            raise ValueError(f"the treatment {treatment!r} needs other conditions as controls")
        return [Claim(treatment, others)]
    if domain == "overcooked":
        tests: Mapping[str, Sequence[str]] = {"Legible": ["Random", "Efficient"]}
    else:
        from benchmarks.experiments.tabletop.tables import TESTS

        tests = TESTS
    found = []
    for name, against in tests.items():
        there = tuple(control for control in against if control in conditions)
        if name in conditions and there:
            found.append(Claim(name, there))
    return found


def published_for(domain: str, conditions: Sequence[str]) -> dict[str, Mapping[str, float]]:
    """The paper's weighted F1, precision and recall, of the conditions that the study has."""
    if domain == "overcooked":
        from benchmarks.experiments.overcooked.sweep import PUBLISHED
    else:
        from benchmarks.experiments.tabletop.sweep import PUBLISHED
    return {name: known for name, known in PUBLISHED.items() if name in conditions}
