"""Which predictors an experiment compares: a label, a name and parameters each, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from predictors.base import GoalPredictor

__all__ = ["PredictorSetting", "predictor_from"]


@dataclass(frozen=True)
class PredictorSetting:
    """One predictor of a comparison.

    Attributes:
        label: What tables call it.
        predictor: Its name, or ``"module:Class"``.
        parameters: Its parameters.
        learns: Whether more data can make it better, so that it has a learning curve.
        max_repeats: Most repeats of a cross-validation, for a predictor that takes minutes; None: no limit.
    """

    label: str
    predictor: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    learns: bool = True
    max_repeats: int | None = None

    @property
    def how(self) -> dict[str, Any]:
        """How to make it, as plain data for trials."""
        return {"name": self.predictor, "parameters": dict(self.parameters)}

    def make(self) -> GoalPredictor:
        """The predictor, unfitted."""
        return predictor_from(self.how)

    def repeats(self, wanted: int) -> int:
        """As many repeats as wanted, but no more than its limit."""
        return wanted if self.max_repeats is None else min(wanted, self.max_repeats)


def predictor_from(how: Mapping[str, Any]) -> GoalPredictor:
    """The predictor that :attr:`PredictorSetting.how` describes, unfitted."""
    from predictors.registry import make_predictor

    return make_predictor(how["name"], **how["parameters"])
