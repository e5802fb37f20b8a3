"""The tests of significance against statsmodels and scipy, and against the null hypothesis itself."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from predictors.evaluation import compare_conditions
from predictors.evaluation.statistics import hedges_g, holm, tukey_half_width


def between(rng: np.random.Generator, sizes: tuple[int, ...], shift: float = 0.1, rows: int = 4) -> pd.DataFrame:
    """Several rows per participant, participants in one condition each."""
    parts = []
    for level, size in enumerate(sizes):
        mean = np.repeat(0.4 + shift * level + rng.normal(0, 0.1, size), rows)
        people = np.repeat([f"c{level}p{i}" for i in range(size)], rows)
        for fraction in (0.3, 0.7):
            values = mean + rng.normal(0, 0.05, len(mean)) + fraction / 10
            columns = {"participant": people, "condition": f"c{level}", "fraction": fraction, "correct": values}
            parts.append(pd.DataFrame(columns | {"trajectory": np.arange(len(mean)) + 1000 * level}))
    return pd.concat(parts, ignore_index=True)


def within(rng: np.random.Generator, people: int = 9, levels: int = 3) -> pd.DataFrame:
    person = rng.normal(0, 0.2, people)
    rows = [
        (f"p{i}", f"c{j}", 0.5, 0.5 + 0.05 * j + person[i] + rng.normal(0, 0.1))
        for i in range(people)
        for j in range(levels)
        for _ in range(2)
    ]
    return pd.DataFrame(rows, columns=["participant", "condition", "fraction", "correct"])


def participant_means(table: pd.DataFrame, fraction: float) -> pd.DataFrame:
    part = table[table["fraction"] == fraction]
    return part.groupby(["participant", "condition"], as_index=False)["correct"].mean()


# -- oracles ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [(8, 8, 8), (5, 9, 12, 7), (6, 11)])
def test_between_participants_agrees_with_statsmodels_and_scipy(sizes: tuple[int, ...]) -> None:
    anova_lm = pytest.importorskip("statsmodels.stats.anova").anova_lm
    ols = pytest.importorskip("statsmodels.formula.api").ols
    tukeyhsd = pytest.importorskip("statsmodels.stats.multicomp").pairwise_tukeyhsd
    table = between(np.random.default_rng(len(sizes)), sizes)
    found = compare_conditions(table)
    assert (found.design, found.unit) == ("between", "participant")
    for fraction in (0.3, 0.7):
        means = participant_means(table, fraction)
        expected = anova_lm(ols("correct ~ C(condition)", means).fit())
        row = found.anova.set_index("fraction").loc[fraction]
        assert row["F"] == pytest.approx(expected["F"].iloc[0])
        assert row["p"] == pytest.approx(expected["PR(>F)"].iloc[0])
        assert row["eta_squared"] == pytest.approx(expected["sum_sq"].iloc[0] / expected["sum_sq"].sum())
        samples = [part["correct"].to_numpy() for _, part in means.groupby("condition")]
        theirs, pairs = stats.tukey_hsd(*samples), found.pairs[found.pairs["fraction"] == fraction]
        interval = theirs.confidence_interval(0.95)
        for _, pair in pairs.iterrows():
            i, j = int(pair["a"][1:]), int(pair["b"][1:])
            assert pair["p"] == pytest.approx(theirs.pvalue[i, j], abs=1e-9)
            assert pair["difference"] == pytest.approx(theirs.statistic[i, j])
            assert (pair["low"], pair["high"]) == pytest.approx((interval.low[i, j], interval.high[i, j]), abs=1e-9)
        others = tukeyhsd(means["correct"], means["condition"])
        assert (pairs["p"] < 0.05).tolist() == others.reject.tolist()


@pytest.mark.parametrize("levels", [2, 3, 5])
def test_within_participants_agrees_with_statsmodels(levels: int) -> None:
    AnovaRM = pytest.importorskip("statsmodels.stats.anova").AnovaRM
    table = within(np.random.default_rng(levels), levels=levels)
    means = participant_means(table, 0.5)
    expected = AnovaRM(means, "correct", "participant", within=["condition"]).fit().anova_table.iloc[0]
    found = compare_conditions(table)
    row = found.anova.iloc[0]
    assert found.design == "within"
    assert (row["df1"], row["df2"]) == (expected["Num DF"], expected["Den DF"])
    assert (row["F"], row["p"]) == pytest.approx((expected["F Value"], expected["Pr > F"]))
    assert 1 / (levels - 1) <= row["epsilon"] <= 1
    assert row["p_corrected"] >= row["p"] - 1e-12 or row["F"] < 1
    if levels == 2:  # a paired t-test is the same test, and so is Tukey's with two means
        wide = means.pivot(index="participant", columns="condition", values="correct")
        paired = stats.ttest_rel(wide["c0"], wide["c1"])
        assert (row["F"], row["p"]) == pytest.approx((paired.statistic**2, paired.pvalue))
        assert found.pairs["p"].iloc[0] == pytest.approx(paired.pvalue, abs=1e-6)
        assert row["epsilon"] == pytest.approx(1.0)


def test_epsilon_is_greenhouse_and_geissers() -> None:
    table = within(np.random.default_rng(7), levels=4)
    wide = participant_means(table, 0.5).pivot(index="participant", columns="condition", values="correct")
    covariance = wide.cov().to_numpy()
    k = len(covariance)
    # Box's formula, term by term, as textbooks print it.
    above = k**2 * (covariance.diagonal().mean() - covariance.mean()) ** 2
    below = (covariance**2).sum() - 2 * k * (covariance.mean(axis=1) ** 2).sum() + k**2 * covariance.mean() ** 2
    assert compare_conditions(table).anova["epsilon"].iloc[0] == pytest.approx(above / ((k - 1) * below))


def test_bands_that_do_not_overlap_are_tukeys_differences() -> None:
    table = between(np.random.default_rng(3), (9, 9, 9), shift=0.07)
    found = compare_conditions(table)
    bands = found.means.set_index(["fraction", "condition"])
    verdicts = set()
    for _, pair in found.pairs.iterrows():
        a, b = bands.loc[(pair["fraction"], pair["a"])], bands.loc[(pair["fraction"], pair["b"])]
        apart = a["high"] < b["low"] or b["high"] < a["low"]
        assert apart == (pair["p"] < 0.05) == (pair["low"] > 0 or pair["high"] < 0)
        verdicts.add(bool(apart))
    assert verdicts == {True, False}
    q = stats.studentized_range.ppf(0.95, 3, 24)
    assert tukey_half_width(0.02, 9, 3, 24) == pytest.approx(q * np.sqrt(0.02 / 9) / 2)


def test_holm_agrees_with_statsmodels() -> None:
    multipletests = pytest.importorskip("statsmodels.stats.multitest").multipletests
    p = np.random.default_rng(0).uniform(0, 0.2, 12)
    np.testing.assert_allclose(holm(p), multipletests(p, method="holm")[1])
    assert np.isnan(holm([0.01, np.nan, 0.02])).tolist() == [False, True, False]
    np.testing.assert_allclose(holm([0.01, np.nan, 0.04])[[0, 2]], [0.02, 0.04])
    table = between(np.random.default_rng(1), (6, 6, 6), shift=0.03)
    found = compare_conditions(table, correct_fractions="holm")
    np.testing.assert_allclose(found.anova["p_holm"], holm(found.anova["p"]))
    for _, part in found.pairs.groupby(["a", "b"]):
        np.testing.assert_allclose(part["p_holm"], holm(part["p"]))


def test_effect_sizes_follow_their_definition() -> None:
    table = between(np.random.default_rng(5), (6, 10))
    means = participant_means(table, 0.3)
    a, b = (part["correct"].to_numpy() for _, part in means.groupby("condition"))
    pooled = np.sqrt((5 * a.var(ddof=1) + 9 * b.var(ddof=1)) / 14)
    row = compare_conditions(table).pairs.iloc[0]
    assert row["cohens_d"] == pytest.approx((a.mean() - b.mean()) / pooled)
    assert row["hedges_g"] == pytest.approx(row["cohens_d"] * (1 - 3 / (4 * 14 - 1)))


def test_hedges_g_has_one_answer_where_nothing_varies_and_where_a_spread_is_unknown() -> None:
    a, b = np.array([1.0, 2, 3, 4]), np.array([0.0, 1, 2, 3])
    assert hedges_g(a, b) == pytest.approx(1 / np.std(a, ddof=1) * (1 - 3 / 23))
    assert hedges_g(a, b) == -hedges_g(b, a)
    assert math.isnan(hedges_g(a[:1], b))
    assert hedges_g(np.ones(3), np.zeros(3)) == math.inf
    assert hedges_g(np.zeros(3), np.ones(3)) == -math.inf
    assert hedges_g(np.ones(3), np.ones(3)) == 0


# -- the null hypothesis ----------------------------------------------------------------------------------------------


def null_experiment(rng: np.random.Generator, people: int = 10, walks: int = 12) -> pd.DataFrame:
    """Two conditions that do not differ, evaluated by 4 folds x 3 repeats; people differ from one another."""
    parts = []
    for condition in ("a", "b"):
        talent = np.repeat(rng.beta(4, 4, people), walks)
        correct = (rng.random(people * walks) < talent).astype(float)
        names = np.repeat([f"{condition}{i}" for i in range(people)], walks)
        for repeat in range(3):
            fold = rng.permutation(np.arange(people * walks) % 4)
            columns = {"participant": names, "correct": correct, "repeat": repeat, "fold": fold}
            parts.append(pd.DataFrame(columns | {"condition": condition, "trajectory": np.arange(people * walks)}))
    return pd.concat(parts, ignore_index=True)


@pytest.mark.slow
def test_a_true_null_is_rejected_at_the_level_by_participants_and_far_too_often_by_folds() -> None:
    rng, rounds = np.random.default_rng(2024), 200
    rejected = {"participant": 0, "fold": 0}
    for _ in range(rounds):
        table = null_experiment(rng)
        for unit in ("participant", "fold"):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                found = compare_conditions(table, unit=unit)  # type: ignore[arg-type]
            rejected[unit] += int(found.anova["p"].iloc[0] < 0.05)
    # 0.9999 interval of a binomial with p = .05.
    low, high = stats.binom.interval(0.9999, rounds, 0.05)
    assert low <= rejected["participant"] <= high, rejected
    assert rejected["fold"] > 0.3 * rounds, rejected


@pytest.mark.slow
def test_within_participants_keeps_its_level_too() -> None:
    rng, rounds, rejected = np.random.default_rng(8), 200, 0
    for _ in range(rounds):
        table = within(rng, levels=2)
        table["correct"] -= 0.05 * table["condition"].str[1:].astype(int)
        rejected += int(compare_conditions(table).anova["p_corrected"].iloc[0] < 0.05)
    low, high = stats.binom.interval(0.9999, rounds, 0.05)
    assert low <= rejected <= high


# -- choices, warnings, errors ----------------------------------------------------------------------------------------


def constant(values: dict[str, float], people: int = 3) -> pd.DataFrame:
    rows = [(f"{name}{i}", name, 0.5, value) for name, value in values.items() for i in range(people)]
    return pd.DataFrame(rows, columns=["participant", "condition", "fraction", "correct"])


@pytest.mark.parametrize("design", ["between", "within"])
def test_values_that_do_not_vary_have_a_stated_answer(design: str) -> None:
    def tested(values: dict[str, float]) -> Any:
        table = constant(values)
        if design == "within":
            table["participant"] = table["participant"].str[-1]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return compare_conditions(table)

    equal, different = tested({"a": 0.7, "b": 0.7}), tested({"a": 0.1, "b": 0.7})
    assert equal.design == design
    assert np.isnan(equal.anova["F"].iloc[0])
    assert equal.anova["p"].iloc[0] == equal.pairs["p"].iloc[0] == 1.0
    assert equal.pairs["cohens_d"].iloc[0] == 0.0
    assert np.isinf(different.anova["F"].iloc[0])
    assert different.anova["p"].iloc[0] == different.pairs["p"].iloc[0] == 0.0
    assert different.pairs["cohens_d"].iloc[0] == -np.inf
    assert (different.means["half_width"] == 0).all()


def test_folds_as_units_are_warned_about() -> None:
    with pytest.warns(UserWarning, match="not independent"):
        found = compare_conditions(null_experiment(np.random.default_rng(0)), unit="fold")
    assert found.means["n"].tolist() == [12, 12]
    assert found.design == "between"


def test_people_in_some_conditions_only_need_a_decision() -> None:
    table = within(np.random.default_rng(0))
    table = table[~((table["participant"] == "p0") & (table["condition"] == "c1"))]
    with pytest.raises(ValueError, match="8 are in all 3"):
        compare_conditions(table)
    with pytest.warns(UserWarning, match="1 of 9"):
        found = compare_conditions(table, design="within")
    assert (found.dropped, found.means["n"].tolist()) == (1, [8, 8, 8])
    taken = compare_conditions(table, design="between").means
    assert dict(zip(taken["condition"], taken["n"], strict=True)) == {"c0": 9, "c1": 8, "c2": 9}


def test_conditions_evaluated_apart_are_compared_if_they_mean_the_same() -> None:
    table = between(np.random.default_rng(4), (6, 6))
    parts = {name: part.drop(columns="condition") for name, part in table.groupby("condition")}
    for part in parts.values():
        part.attrs["cut"] = "steps"
    whole, apart = compare_conditions(table), compare_conditions(parts)
    pd.testing.assert_frame_equal(whole.anova, apart.anova)
    parts["c1"].attrs["cut"] = "cells"
    with pytest.raises(ValueError, match="different cut"):
        compare_conditions(parts)


def test_the_mean_over_fractions_is_one_test() -> None:
    table = between(np.random.default_rng(6), (6, 7))
    found = compare_conditions(table, at="mean")
    samples = [part.groupby("participant")["correct"].mean() for _, part in table.groupby("condition")]
    assert found.anova["F"].tolist() == [pytest.approx(stats.f_oneway(*samples).statistic)]
    assert found.anova["fraction"].isna().all()


@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        ({"condition": "same"}, {}, "only condition is 'same'"),
        ({"participant": ""}, {}, "no participant"),
        ({"correct": np.nan}, {}, "missing values"),
        ({"participant": [f"p{i // 3}" for i in range(6)]}, {}, "1 unit"),
        ({}, {"unit": "fold"}, "needs the column 'repeat'"),
        ({}, {"unit": "walk"}, "must be one of"),
        ({}, {"factor": "layout"}, "no column 'layout'"),
        ({}, {"design": "mixed"}, "design"),
        ({}, {"at": "end"}, "each"),
        ({}, {"alpha": 5}, "alpha"),
        ({}, {"correct_fractions": "bonferroni"}, "holm"),
        ({"predictor": list("xyxyxy")}, {}, r"predictor=; the table has \['x', 'y'\]"),
        ({"predictor": "x"}, {"predictor": "z"}, "no values of predictor 'z'"),
    ],
)
@pytest.mark.filterwarnings("ignore:folds share")
def test_bad_input_is_refused_in_words(change: dict[str, Any], options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        compare_conditions(constant({"a": 0.2, "b": 0.4}).assign(**change), **options)


def test_only_tables_are_compared() -> None:
    with pytest.raises(ValueError, match="got list"):
        compare_conditions([1, 2])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no results"):
        compare_conditions({})
