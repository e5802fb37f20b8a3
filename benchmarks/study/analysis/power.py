"""How many participants a study needs: the analysis's own test on participants drawn again and again.

Participants of a pilot (or simulated ones) are drawn with replacement, each with all their values, and the test that
the analysis makes is made on them; the share of significant results is the power. It takes no normal distribution and
no equal variances, but a pilot of few participants knows little of others: with fewer than ten or so, the answer is a
guess about a guess.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Effect", "Power", "PowerPoint", "needed", "power_at", "power_curve", "wide_table", "wilson"]

Floats = npt.NDArray[np.float64]
DEFAULT_DRAWS: Final = 2000


@dataclass(frozen=True)
class Effect:
    """What is to be found.

    Attributes:
        treatment: Column whose mean should be another; None: that any condition differs (repeated-measures analysis of
            variance, corrected by Greenhouse and Geisser).
        control: Column that it is compared with (Student's paired t).
        scale: Multiplies the observed differences; 1 takes them as they are, 0 takes them away.
        difference: The true mean difference in its place; None to scale.
    """

    treatment: str | None = None
    control: str | None = None
    scale: float = 1.0
    difference: float | None = None


@dataclass(frozen=True)
class PowerPoint:
    """The power of one number of participants.

    Attributes:
        participants: How many.
        power: Share of draws in which the test is significant.
        low, high: 95 % interval of Wilson.
    """

    participants: int
    power: float
    low: float
    high: float


@dataclass(frozen=True)
class Power:
    """What :func:`power_curve` found.

    Attributes:
        points: By number of participants, rising.
        needed: The smallest of these numbers from which on the power is reached; None where none is.
        wanted: That power.
        alpha: Level of the test.
        effect: What is to be found.
        observed: Mean difference in the data: treatment less control; None without these.
        standardised: The same in standard deviations of the differences (Cohen's d_z).
        pilot: How many participants the data are of.
    """

    points: tuple[PowerPoint, ...]
    needed: int | None
    wanted: float
    alpha: float
    effect: Effect
    observed: float | None
    standardised: float | None
    pilot: int


def wide_table(table: pd.DataFrame, value: str, conditions: Sequence[str]) -> pd.DataFrame:
    """A row per participant, a column per condition: means of a value; participants with a gap are left out.

    Raises:
        ValueError: Fewer than two participants have values in all conditions.
    """
    wide = table.groupby(["participant", "condition"], sort=False)[value].mean().unstack("condition")
    wide = wide.reindex(columns=list(conditions)).dropna()
    if len(wide) < 2:
        raise ValueError(f"{len(wide)} participant(s) have values in all of {', '.join(conditions)}; 2 are needed")
    return wide


def power_curve(
    wide: pd.DataFrame,
    effect: Effect,
    participants: Sequence[int],
    rng: np.random.Generator,
    *,
    wanted: float = 0.8,
    alpha: float = 0.05,
    draws: int = DEFAULT_DRAWS,
) -> Power:
    """The power of several numbers of participants.

    Args:
        wide: As of :func:`wide_table`.
        effect: What is to be found.
        participants: Their numbers, two or more each.
        rng: Source of randomness.
        wanted: Power to be reached.
        alpha: Level of the test.
        draws: Samples for each number.

    Raises:
        ValueError: There is no such condition, or values that do not vary, whose power would be 0 or 1 by chance.
    """
    values, observed, standardised = _with_effect(wide, effect)
    points = tuple(power_at(values, number, rng, alpha=alpha, draws=draws) for number in sorted(set(participants)))
    return Power(points, needed(points, wanted), wanted, alpha, effect, observed, standardised, len(wide))


def needed(points: Sequence[PowerPoint], wanted: float) -> int | None:
    """The smallest number of participants from which on all powers are at least as wanted."""
    found = None
    for point in reversed(points):
        if point.power < wanted:
            break
        found = point.participants
    return found


def _with_effect(wide: pd.DataFrame, effect: Effect) -> tuple[Floats, float | None, float | None]:
    """``(n, k)`` values with the differences that are to be found, and what was observed."""
    values = wide.to_numpy(dtype=np.float64)
    # Draws with replacement vary by (n - 1) / n less than the people behind a sample of n: this takes it back.
    wider = math.sqrt(len(values) / (len(values) - 1))
    if effect.treatment is None or effect.control is None:
        if effect.difference is not None:
            raise ValueError("a difference is of a treatment and a control; name both, or scale the effect")
        means = values.mean(axis=0) - values.mean()
        residual = values - values.mean(axis=1, keepdims=True) - means
        _check_varying(residual)
        return wider * residual + effect.scale * means, None, None
    for name in (effect.treatment, effect.control):
        if name not in wide:
            raise ValueError(f"there is no condition {name!r}; there are {', '.join(map(repr, wide.columns))}")
    difference = wide[effect.treatment].to_numpy(dtype=np.float64) - wide[effect.control].to_numpy(dtype=np.float64)
    _check_varying(difference[:, None])
    residual = wider * (difference - difference.mean())
    observed, spread = float(difference.mean()), float(difference.std(ddof=1))
    target = effect.scale * observed if effect.difference is None else effect.difference
    return np.column_stack([residual + target, np.zeros(len(difference))]), observed, observed / spread


def _check_varying(values: Floats) -> None:
    if np.ptp(values, axis=0).max() < 1e-12:
        raise ValueError("the differences between conditions are the same for all participants: no power can be told")


def power_at(
    values: Floats, participants: int, rng: np.random.Generator, *, alpha: float = 0.05, draws: int = DEFAULT_DRAWS
) -> PowerPoint:
    """The share of samples in which the test is significant.

    Args:
        values: ``(n, k)``: participants by conditions. Two conditions are compared by Student's paired t, which is what
            the repeated-measures analysis of variance comes to; more by that analysis, corrected.
        participants: Drawn in each sample, with replacement.
        rng: Source of randomness.
        alpha: Level of the test.
        draws: Samples.
    """
    if participants < 2:
        raise ValueError(f"a test needs two participants or more, got {participants}")
    test: Callable[[Floats], Floats] = _paired if values.shape[1] == 2 else _repeated_measures
    significant, block = 0, max(1, 2_000_000 // (participants * values.shape[1]))
    for first in range(0, draws, block):
        count = min(block, draws - first)
        chosen = rng.integers(len(values), size=(count, participants))
        significant += int(np.count_nonzero(test(values[chosen]) < alpha))
    low, high = wilson(significant, draws)
    return PowerPoint(participants, significant / draws, low, high)


def _paired(samples: Floats) -> Floats:
    """``(m,)`` p-values of ``(m, n, 2)`` samples.

    One whose differences do not vary is not significant: so many draws of the same participant say nothing.
    """
    from scipy import stats

    difference = samples[:, :, 0] - samples[:, :, 1]
    count = difference.shape[1]
    spread = difference.std(axis=1, ddof=1) / math.sqrt(count)
    varies = spread > 1e-12
    t = np.divide(difference.mean(axis=1), spread, out=np.zeros(len(samples)), where=varies)
    return np.where(varies, 2 * stats.t.sf(np.abs(t), count - 1), 1.0)


def _repeated_measures(samples: Floats) -> Floats:
    """``(m,)`` p-values of ``(m, n, k)`` samples, corrected by Greenhouse and Geisser.

    The formulas of :func:`predictors.evaluation.statistics.repeated_measures_anova`, for many samples at once.
    """
    from scipy import stats

    _, number, count = samples.shape
    grand = samples.mean(axis=(1, 2), keepdims=True)
    of_condition, of_person = samples.mean(axis=1, keepdims=True), samples.mean(axis=2, keepdims=True)
    between = number * ((of_condition - grand) ** 2).sum(axis=(1, 2)) / (count - 1)
    residual = samples - of_person - of_condition + grand
    freedom = (number - 1) * (count - 1)
    error = (residual**2).sum(axis=(1, 2)) / freedom
    varies = error > 1e-12
    value = np.divide(between, error, out=np.zeros(len(samples)), where=varies)
    centred = samples - of_condition
    covariance = np.einsum("mni,mnj->mij", centred, centred) / (number - 1)
    centre = np.eye(count) - 1 / count
    covariance = centre @ covariance @ centre
    square = (covariance**2).sum(axis=(1, 2))
    trace = np.trace(covariance, axis1=1, axis2=2)
    epsilon = np.divide(trace**2, (count - 1) * square, out=np.ones(len(samples)), where=square > 0)
    epsilon = np.clip(epsilon, 1 / (count - 1), 1.0)
    p = stats.f.sf(value, epsilon * (count - 1), epsilon * freedom)
    return np.where(varies, p, 1.0)


def wilson(successes: int, trials: int, level: float = 0.95) -> tuple[float, float]:
    """The interval of Wilson (1927) of a share."""
    from scipy import stats

    z = float(stats.norm.ppf(0.5 + level / 2))
    share = successes / trials
    middle = (share + z * z / (2 * trials)) / (1 + z * z / trials)
    reach = z / (1 + z * z / trials) * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    return max(0.0, middle - reach), min(1.0, middle + reach)


def as_rows(power: Power) -> list[dict[str, Any]]:
    """The points as rows of a table."""
    return [{"participants": p.participants, "power": p.power, "low": p.low, "high": p.high} for p in power.points]
