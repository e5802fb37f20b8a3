"""The paper's hypotheses as tests: right on data whose answer is known, and when nothing is there."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.hypotheses import HYPOTHESES, assess_hypotheses, reached_at
from predictors.evaluation.comparison import compare_conditions

FRACTIONS = (0.1, 0.3, 0.5, 0.7, 0.9)


def people(gains: dict[str, float], seed: int = 0, *, layouts: int = 4, spread: float = 0.03, noise: float = 0.02):
    """Rows of two predictors; ``blind`` gains nothing from any condition."""
    rng = np.random.default_rng(seed)
    rows = []
    for predictor in ("keen", "blind"):
        for condition, gain in gains.items():
            for layout in range(layouts):
                here = 0.5 + (gain if predictor == "keen" else 0) + spread * rng.normal()
                for person in range(6):
                    own = here + noise * rng.normal()
                    rows += [
                        (predictor, condition, layout, f"{condition}{layout}/{person}", f, own + 0.3 * f)
                        for f in FRACTIONS
                    ]
    return pd.DataFrame(rows, columns=["predictor", "condition", "layout", "participant", "fraction", "correct"])


def learning(gains: dict[str, float], growth: float = 0.1) -> pd.DataFrame:
    rng = np.random.default_rng(1)
    rows = [
        ("keen", condition, layout, share, 0.5 + gain + growth * share + 0.01 * rng.normal())
        for condition, gain in gains.items()
        for layout in range(4)
        for share in (0.25, 1.0)
    ]
    return pd.DataFrame(rows, columns=["predictor", "condition", "layout", "share", "accuracy"])


GAINS = {"Random": 0.0, "Efficient": 0.02, "Legible": 0.3}


def test_a_large_gain_is_found_for_the_predictor_that_has_it_alone() -> None:
    found = assess_hypotheses(
        people(GAINS), treatment="Legible", controls=["Random", "Efficient"], curves=learning(GAINS)
    )
    verdicts = found.verdicts().set_index("hypothesis")
    assert verdicts["keen"].tolist() == ["supported"] * 3
    assert verdicts["blind"].tolist() == ["not supported", "not supported", "–"]
    assert verdicts["every predictor"].tolist() == ["not supported", "not supported", "supported"]
    assert found.unit == "layout"
    first = found.tests[(found.tests["hypothesis"] == "H1") & (found.tests["predictor"] == "keen")]
    assert first["difference"].between(0.2, 0.4).all()
    assert (first["g_units"] > 3).all()
    words = found.words()
    assert all(name in words for name in HYPOTHESES)
    assert "supported for 1 of 2 predictors (not for blind)" in words


def test_the_test_is_the_analysis_of_variance_of_layout_means() -> None:
    rows = people(GAINS)
    found = assess_hypotheses(rows, treatment="Legible", controls=["Random", "Efficient"])
    own = rows[rows["predictor"] == "keen"]
    means = own.groupby(["condition", "layout"])["correct"].mean().reset_index()
    means["participant"] = means["condition"] + means["layout"].astype(str)
    pairs = compare_conditions(means, at="mean").pairs.set_index(["a", "b"])
    test = found.tests[(found.tests["hypothesis"] == "H1") & (found.tests["predictor"] == "keen")].set_index("control")
    for control in ("Random", "Efficient"):
        sign = 1 if ("Legible", control) in pairs.index else -1
        pair = pairs.loc[("Legible", control) if sign == 1 else (control, "Legible")]
        assert test["difference"][control] == pytest.approx(sign * pair["difference"])
        assert test["p"][control] == pytest.approx(pair["p"], abs=1e-9)
        assert test["g_units"][control] == pytest.approx(sign * pair["hedges_g"])


def test_luck_of_layouts_is_no_effect_of_a_condition() -> None:
    """Between layouts accuracy differs, between conditions it does not: people as units would often say it does."""
    by = {"layout": 0, "participant": 0}
    for seed in range(10):
        rows = people({"Random": 0.0, "Legible": 0.0}, seed, layouts=3, spread=0.1, noise=0.01)
        for unit in by:
            found = assess_hypotheses(rows, treatment="Legible", controls=["Random"], unit=unit)  # type: ignore[arg-type]
            by[unit] += int((found.tests["p"][found.tests["hypothesis"] == "H1"] < 0.05).sum())
    assert by["layout"] <= 4  # of 20
    assert by["participant"] >= 10


def test_being_read_worse_late_denies_the_second_hypothesis() -> None:
    rows = people(GAINS)
    late = (rows["condition"] == "Legible") & (rows["fraction"] > 0.6) & (rows["predictor"] == "keen")
    rows.loc[late, "correct"] -= 0.6
    found = assess_hypotheses(rows, treatment="Legible", controls=["Random"])
    second = found.tests[(found.tests["hypothesis"] == "H2") & (found.tests["predictor"] == "keen")].iloc[0]
    assert second["difference"] > 0
    assert second["p"] < 0.05
    assert not second["supported"]
    assert "worse at 70, 90 %" in second["note"]


def test_what_learns_slowly_needs_as_much_data() -> None:
    small = {"Random": 0.0, "Efficient": 0.0, "Legible": 0.05}
    found = assess_hypotheses(
        people(small), treatment="Legible", controls=["Random"], curves=learning(small, growth=0.3)
    )
    third = found.tests[found.tests["hypothesis"] == "H3"].iloc[0]
    assert third["difference"] == pytest.approx(0.05 - 0.3 * 0.75, abs=0.02)
    assert not third["supported"]
    assert found.share == 0.25


def test_one_layout_per_condition_takes_people_as_units() -> None:
    rows = people(GAINS, layouts=1).drop(columns="layout")
    assert assess_hypotheses(rows, treatment="Legible", controls=["Random"]).unit == "participant"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows.drop(columns="fraction"), "'fraction'"),
        (lambda rows: rows[rows["condition"] != "Random"], "no condition 'Random'"),
    ],
)
def test_rows_that_cannot_be_tested_are_refused(change, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=message):
        assess_hypotheses(change(people(GAINS)), treatment="Legible", controls=["Random"])


def test_when_a_level_is_reached() -> None:
    assert reached_at([0.1, 0.5, 0.9], [0.2, 0.6, 1.0], 0.4) == pytest.approx(0.3)
    assert reached_at([0.9, 0.1, 0.5], [1.0, 0.2, 0.6], 0.4) == pytest.approx(0.3)
    assert reached_at([0.1, 0.5], [0.6, 0.7], 0.5) == 0.1
    assert math.isnan(reached_at([0.1, 0.5], [0.2, 0.3], 0.5))
