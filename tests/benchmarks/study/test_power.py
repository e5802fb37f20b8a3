"""Power: right where a formula knows it, honest where nothing is there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.study.analysis.power import (
    Effect,
    PowerPoint,
    needed,
    power_at,
    power_curve,
    wide_table,
    wilson,
)
from benchmarks.study.analysis.power import _repeated_measures as repeated_measures
from benchmarks.study.analysis.power_data import measures_of, simulated_values
from predictors.evaluation.statistics import repeated_measures_anova
from tests.support.recorded_study import kitchen_study

NUMBERS = (8, 16, 32)
unhurried = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
"""The first example may wait for a busy machine, and for Hypothesis to read the loaded sources."""


def _normal(effect: float, count: int = 4000) -> pd.DataFrame:
    """Participants whose differences are normal with mean ``effect`` and deviation 1, to rounding."""
    rng = np.random.default_rng(0)
    difference = rng.normal(size=count)
    difference = (difference - difference.mean()) / difference.std(ddof=1) + effect
    person = rng.normal(size=count)
    return pd.DataFrame({"control": person, "treatment": person + difference})


@pytest.mark.parametrize("effect", [0.3, 0.6])
def test_power_of_normal_pairs_is_that_of_the_noncentral_t(effect: float) -> None:
    from statsmodels.stats.power import TTestPower

    found = power_curve(
        _normal(effect), Effect("treatment", "control"), NUMBERS, np.random.default_rng(1), draws=20_000
    )
    assert found.standardised == pytest.approx(effect)
    for point in found.points:
        exact = TTestPower().power(effect, point.participants, 0.05)
        error = (exact * (1 - exact) / 20_000) ** 0.5
        assert abs(point.power - exact) < 4 * error + 0.005  # 4,000 people are no normal distribution
        assert point.low < point.power < point.high


def test_a_small_pilot_is_not_taken_for_less_varied_than_people_are() -> None:
    """The mean power over many pilots of the same size lies near the true one, where none scales its draws up."""
    from statsmodels.stats.power import TTestPower

    rng = np.random.default_rng(2)
    powers = []
    for _ in range(300):
        difference = rng.normal(size=12)
        wide = pd.DataFrame({"control": np.zeros(12), "treatment": difference})
        effect = Effect("treatment", "control", difference=0.6)
        powers.append(power_curve(wide, effect, (16,), rng, draws=300).points[0].power)
    assert np.mean(powers) == pytest.approx(TTestPower().power(0.6, 16, 0.05), abs=0.06)


@pytest.mark.parametrize("count", [2, 4])
@pytest.mark.parametrize("alpha", [0.05, 0.2])
def test_without_an_effect_as_many_are_significant_as_the_level_says(count: int, alpha: float) -> None:
    rng = np.random.default_rng(3)
    wide = pd.DataFrame(rng.normal(size=(2000, count)) + 0.5 * np.arange(count), columns=[*"abcd"[:count]])
    effect = Effect("b", "a", scale=0.0) if count == 2 else Effect(scale=0.0)
    found = power_curve(wide, effect, (10, 30), rng, alpha=alpha, draws=8000)
    for point in found.points:
        # Greenhouse and Geisser's correction is a little too strict for data that do not need it.
        assert alpha * (0.7 if count > 2 else 1) - 0.012 < point.power < alpha + 0.012


def test_many_analyses_of_variance_at_once_are_the_one_of_the_analysis() -> None:
    rng = np.random.default_rng(4)
    samples = rng.normal(size=(50, 9, 4)) @ rng.normal(size=(4, 4)) + 0.4 * np.arange(4)
    expected = [repeated_measures_anova(sample).row["p_corrected"] for sample in samples]
    np.testing.assert_allclose(repeated_measures(samples), expected, rtol=1e-9)


def test_effects_are_scaled_or_set() -> None:
    wide, rng = _normal(0.5, 200), np.random.default_rng(5)
    at = {
        name: power_curve(wide, effect, (20,), rng, draws=4000).points[0].power
        for name, effect in {
            "observed": Effect("treatment", "control"),
            "set": Effect("treatment", "control", difference=0.5),
            "half": Effect("treatment", "control", scale=0.5),
            "turned": Effect("control", "treatment"),
        }.items()
    }
    assert at["observed"] == pytest.approx(at["set"], abs=0.04)
    assert at["observed"] == pytest.approx(at["turned"], abs=0.04)
    assert at["half"] < at["observed"] - 0.2


@unhurried
@given(st.lists(st.integers(0, 10), min_size=1, max_size=8), st.integers(1, 9))
def test_enough_is_the_first_number_after_which_all_are_enough(tenths: list[int], tenth: int) -> None:
    points = [PowerPoint(2 + i, power / 10, 0, 1) for i, power in enumerate(tenths)]
    wanted = tenth / 10
    found = needed(points, wanted)
    enough = [point.participants for point in points if all(p.power >= wanted for p in points[points.index(point) :])]
    assert found == (min(enough) if enough else None)


@unhurried
@given(st.integers(0, 200), st.integers(1, 200))
def test_intervals_are_wilsons(successes: int, trials: int) -> None:
    from statsmodels.stats.proportion import proportion_confint

    successes = min(successes, trials)
    np.testing.assert_allclose(
        wilson(successes, trials), proportion_confint(successes, trials, method="wilson"), atol=1e-12
    )


def test_what_power_cannot_be_told_of_is_refused() -> None:
    rng = np.random.default_rng(6)
    same = pd.DataFrame({"a": [1.0, 2.0, 3.0], "b": [2.0, 3.0, 4.0]})
    with pytest.raises(ValueError, match="the same for all participants"):
        power_curve(same, Effect("a", "b"), (8,), rng)
    with pytest.raises(ValueError, match="there is no condition 'z'"):
        power_curve(same, Effect("z", "b"), (8,), rng)
    with pytest.raises(ValueError, match="name both"):
        power_curve(_normal(0.1, 20), Effect(difference=0.2), (8,), rng)
    with pytest.raises(ValueError, match="two participants or more"):
        power_at(np.zeros((4, 2)), 1, rng)
    rows = pd.DataFrame({"participant": ["p", "p", "q"], "condition": ["a", "b", "a"], "value": [1.0, 2.0, 3.0]})
    with pytest.raises(ValueError, match=r"1 participant\(s\) have values in all of a, b"):
        wide_table(rows, "value", ["a", "b"])


def test_power_can_be_told_before_anybody_takes_part(tmp_path: Path) -> None:
    study = kitchen_study(tmp_path)
    assert measures_of(study)[0] == "accuracy"
    assert {"tlx:workload", "seconds"} <= set(measures_of(study))
    rng = np.random.default_rng(0)
    values = simulated_values(study, 4, "seconds", rng)
    found = power_curve(wide_table(values, "value", study.conditions), Effect("Legible", "Efficient"), (6, 40), rng)
    assert found.pilot == 4
    assert found.points[0].power <= found.points[1].power
    with pytest.raises(ValueError, match="simulated people have no 'tlx:workload'"):
        simulated_values(study, 2, "tlx:workload", rng)
    with pytest.raises(ValueError, match="there is no measure 'speed'; there are accuracy, seconds"):
        simulated_values(study, 2, "speed", rng)
