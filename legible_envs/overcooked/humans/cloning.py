r"""People whose steps are learned from play: behaviour cloning of how they walk to a goal.

From floor cell ``a`` a person on the way to ``G`` takes the next step to ``b`` with probability
``P(b | a, heading, G) ∝ exp(weights . features(b))``, a conditional logit (McFadden, *Conditional logit analysis of
qualitative choice behavior*, 1974) over the neighbouring cells that are free and, where it is beside ``a``, the goal
station. Its log-likelihood is concave, so the fit is the only one. The features speak of directions and distances and
not of this or that cell, so what was learned in some kitchens holds in others:

=============== =====================================================================================================
``progress``    0 on a cheapest path, minus the excess cost elsewhere: -2 for a step away, where cells cost 1
``far``         the same, but 0 where the goal is at most 3 steps away
``straight``    1 if the step goes on in the direction of the step before
``back``        1 if it goes back
``beeline``     1 if it comes nearer to the goal as if there were no walls (Manhattan distance)
``longer_side`` 1 if, of rows and columns, it does so along those of which more are left
``arrive``      1 for the step into the goal station
``walls``       share of the cells around ``b`` that are no floor
=============== =====================================================================================================

With ``progress`` alone this is :class:`~legible_envs.overcooked.humans.BoltzmannWalker`, and its weight the
rationality.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.humans.fitting import walked_paths
from legible_envs.overcooked.humans.kernels import CLONED
from legible_envs.overcooked.humans.policy_kernels import NUM_FEATURES, path_features
from legible_envs.overcooked.humans.walker import Walker, draw_preferences
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import entries, real, shown

__all__ = ["FEATURES", "RECORDED_WEIGHTS", "ClonedWalker", "PolicyFit", "check_features", "fit_policy"]

Floats = npt.NDArray[np.float64]
Feature = Literal["progress", "far", "straight", "back", "beeline", "longer_side", "arrive", "walls"]

FEATURES: Final[tuple[Feature, ...]] = (
    "progress", "far", "straight", "back", "beeline", "longer_side", "arrive", "walls",
)  # fmt: skip
"""Names of the features, in the order of weights."""
assert len(FEATURES) == NUM_FEATURES

RECORDED_WEIGHTS: Final = (1.05, -0.66, 1.08, -1.59, 0.36, -0.11, -0.15, -1.23)
"""Weights of the features in the 2,406 trajectories of real people that
:func:`legible_envs.datasets.overcooked_2019.recorded_trajectories` finds in four kitchens together."""


@dataclass(frozen=True)
class PolicyFit:
    """Maximum likelihood estimate of the weights of a learned policy.

    Attributes:
        weights: By feature; 0 for those that were left out.
        standard_errors: By feature, from the observed information (with the penalty), steps independent; 0 for those
            that were left out.
        log_likelihood: Of all steps, without the penalty.
        num_steps: Steps taken, the one into the station included.
        num_trajectories: Trajectories.
    """

    weights: dict[str, float]
    standard_errors: dict[str, float]
    log_likelihood: float
    num_steps: int
    num_trajectories: int

    @property
    def params(self) -> Floats:
        """``(8,)`` weights in the order of :data:`FEATURES`."""
        return np.array([self.weights[name] for name in FEATURES])


@dataclass(frozen=True)
class _Choices:
    """``features [m, 4, k]``, ``options [m, 4]`` true where a step is possible, ``taken [m]`` the direction taken."""

    features: Floats
    options: npt.NDArray[np.bool_]
    taken: npt.NDArray[np.int64]

    def probabilities(self, weights: Floats) -> tuple[Floats, float]:
        """``(m, 4)`` of each step, and the log-likelihood of those taken."""
        scores = np.where(self.options, self.features @ weights, -np.inf)
        scores -= scores.max(axis=1, keepdims=True)
        odds = np.exp(scores)
        totals = odds.sum(axis=1)
        chosen = scores[np.arange(len(self.taken)), self.taken] - np.log(totals)
        return odds / totals[:, None], float(chosen.sum())

    def loss(self, weights: Floats, l2: float) -> tuple[float, Floats]:
        """Negative penalised log-likelihood per step, and its gradient."""
        probabilities, likelihood = self.probabilities(weights)
        expected = np.einsum("md,mdk->k", probabilities, self.features)
        found = self.features[np.arange(len(self.taken)), self.taken].sum(axis=0)
        count = len(self.taken)
        value = -likelihood + 0.5 * l2 * float(weights @ weights)
        return value / count, (expected - found + l2 * weights) / count

    def information(self, weights: Floats, l2: float) -> Floats:
        """``(k, k)`` second derivative of the penalised negative log-likelihood."""
        probabilities, _ = self.probabilities(weights)
        means = np.einsum("md,mdk->mk", probabilities, self.features)
        second = np.einsum("md,mdj,mdk->jk", probabilities, self.features, self.features)
        return second - means.T @ means + l2 * np.eye(len(weights))


def fit_policy(
    trajectories: Iterable[Trajectory], *, l2: float = 1.0, features: Sequence[Feature] = FEATURES
) -> PolicyFit:
    r"""Fit the weights of :class:`ClonedWalker` by maximum likelihood.

    Every step counts, from floor cell to floor cell and into the goal station; where people stand first, and how long,
    does not.

    Args:
        trajectories: With a layout and a goal, each ending in its goal's station; of any number of kitchens.
        l2: Strength of the pull of all weights toward 0, above 0: ``l2 / 2`` times the sum of their squares is added to
            the negative log-likelihood of all steps.
        features: Names of :data:`FEATURES` to use; the weights of the others are 0.

    Raises:
        ValueError: No step with a choice; a trajectory without layout or goal, that does not fit its layout, or
            that jumps; a feature of another name, or ``l2`` that is not positive.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> kitchen = OvercookedLayout.from_ascii("XOXXX\nX   X\nXXXSX")
        >>> cells = [(1, 3), (1, 2), (1, 1), (0, 1)]
        >>> fit = fit_policy([Trajectory(cells, goal="onion", candidates=("onion",), layout=kitchen)] * 9)
        >>> fit.weights["progress"] > 0, fit.num_steps
        (True, 27)
    """
    from scipy.optimize import minimize

    listed = list(trajectories)
    for number, trajectory in enumerate(listed):
        if not isinstance(trajectory, Trajectory):
            raise ValueError(f"expected trajectories, got {shown(trajectory)} at index {number}")
    l2 = real("l2", l2, 0, closed="neither")
    used = [FEATURES.index(name) for name in check_features(features)]
    choices = _choices(listed, used)
    found = minimize(
        choices.loss, np.zeros(len(used)), args=(l2,), jac=True, method="L-BFGS-B",
        options={"maxiter": 1000, "gtol": 1e-9, "ftol": 1e-15},
    )  # fmt: skip
    best = np.asarray(found.x, dtype=np.float64)
    errors = np.sqrt(np.diag(np.linalg.inv(choices.information(best, l2))))
    weights, spread = dict.fromkeys(FEATURES, 0.0), dict.fromkeys(FEATURES, 0.0)
    for column, weight, error in zip(used, best.tolist(), errors.tolist(), strict=True):
        weights[FEATURES[column]], spread[FEATURES[column]] = weight, error
    likelihood = choices.probabilities(best)[1]
    return PolicyFit(
        {str(name): value for name, value in weights.items()},
        {str(name): value for name, value in spread.items()},
        likelihood,
        len(choices.taken),
        len(listed),
    )


def check_features(features: Sequence[Feature]) -> tuple[Feature, ...]:
    """Names of features, each once, in the order of :data:`FEATURES`.

    Raises:
        ValueError: None at all, one twice, or a name that no feature has.
    """
    names = tuple(entries(features))
    unknown = [name for name in names if name not in FEATURES]
    if isinstance(features, str) or not names or unknown or len(set(names)) < len(names):
        raise ValueError(f"`features` must be some of {list(FEATURES)}, each once, got {shown(features)}")
    return tuple(name for name in FEATURES if name in names)


def _choices(trajectories: Sequence[Trajectory], used: Sequence[int]) -> _Choices:
    """All choices on the way, those without an alternative left out: nothing is learned from them."""
    features, options, taken = [], [], []
    for cells, field in walked_paths(trajectories):
        count = max(len(cells) - 1, 0)
        like, free, step = np.empty((count, 4, NUM_FEATURES)), np.empty((count, 4)), np.empty(count, dtype=np.int64)
        path_features(np.array(cells, dtype=np.int64), field, like, free, step)
        features.append(like[:, :, used])
        options.append(free > 0)
        taken.append(step)
    if not taken or not any((free.sum(axis=1) > 1).any() for free in options):
        raise ValueError(f"{len(trajectories)} trajectories have no step at which there was a choice")
    return _Choices(np.concatenate(features), np.concatenate(options), np.concatenate(taken))


class ClonedWalker(Walker):
    r"""A person who walks as people were seen to: each step is drawn from a policy that was learned from play.

    Unlike :class:`~legible_envs.overcooked.humans.BoltzmannWalker`, this person keeps their direction and seldom turns
    back, as people do. :func:`fit_policy` learns the weights; see there and
    :mod:`legible_envs.overcooked.humans.cloning` for what they weigh.

    Args:
        weights: ``(8,)`` in the order of :data:`FEATURES`, or by name, others 0; None takes
            :data:`RECORDED_WEIGHTS`, of real people in four kitchens.
        **arguments: Of every :class:`~legible_envs.overcooked.humans.Walker`: ``preferences``, ``idle``, ``turn``,
            ``tick``.

    Raises:
        ValueError: Weights that are not finite, of another number, or of features that are none.

    Example:
        >>> import numpy as np
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> kitchen = OvercookedLayout.from_ascii("XOXXTX\nX    X\nXXXXSX")
        >>> ClonedWalker({"progress": 9}).walk(kitchen, "serving", "onion", np.random.default_rng(0))
        [(1, 4), (1, 3), (1, 2), (1, 1), (0, 1)]
    """

    kind = CLONED

    def __init__(self, weights: npt.ArrayLike | dict[str, float] | None = None, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.weights = _checked_weights(RECORDED_WEIGHTS if weights is None else weights)

    @property
    def params(self) -> Floats:
        """``(8,)`` the weights."""
        return self.weights

    def _parameters(self) -> tuple[str, ...]:
        return ("weights", *super()._parameters())

    @classmethod
    def fit(cls, trajectories: Iterable[Trajectory], *, l2: float = 1.0, **arguments: Any) -> Self:
        """A person who walks as in trajectories; see :func:`fit_policy` for what these must be.

        Args:
            trajectories: To learn from.
            l2: Strength of the pull of all weights toward 0.
            **arguments: Of every walker: ``preferences``, ``idle``, ``turn``, ``tick``.
        """
        return cls(fit_policy(trajectories, l2=l2).params, **arguments)

    @classmethod
    def draw(
        cls,
        shape: tuple[int, int],
        rng: np.random.Generator,
        *,
        weights: npt.ArrayLike | dict[str, float] | None = None,
        spread: float = 0.35,
        preference: float = 0.2,
        **arguments: Any,
    ) -> Self:
        """A random person: all weights are scaled by one factor, as participants differ in rationality.

        Args:
            shape: Of the kitchens the person has preferences in.
            rng: Source of randomness.
            weights: Of the median person; see the class.
            spread: Standard deviation of the logarithm of the factor.
            preference: Standard deviation of the log cost of each cell; 0 for a person without preferences.
            **arguments: Of every walker: ``idle``, ``turn``, ``tick``.
        """
        known = _checked_weights(RECORDED_WEIGHTS if weights is None else weights)
        factor = math.exp(real("spread", spread, 0) * rng.normal())
        return cls(factor * known, preferences=draw_preferences(shape, rng, preference), **arguments)

    def __repr__(self) -> str:
        parts = [f"{name}={weight:g}" for name, weight in zip(FEATURES, self.weights, strict=True) if weight]
        return f"ClonedWalker({', '.join(parts)})"


def _checked_weights(weights: npt.ArrayLike | dict[str, float]) -> Floats:
    if isinstance(weights, dict):
        if unknown := [name for name in weights if name not in FEATURES]:
            raise ValueError(f"no features {unknown}; there are {list(FEATURES)}")
        weights = [weights.get(name, 0.0) for name in FEATURES]
    try:
        array = np.array(weights, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"`weights` must be {NUM_FEATURES} numbers, got {shown(weights)}") from error
    if array.shape != (NUM_FEATURES,) or not np.isfinite(array).all():
        raise ValueError(f"`weights` must be {NUM_FEATURES} finite numbers, of {list(FEATURES)}, got {shown(weights)}")
    array.flags.writeable = False
    return array
