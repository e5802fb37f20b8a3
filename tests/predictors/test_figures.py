"""Figures are well-formed, self-contained, and show the numbers they are given."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from predictors.evaluation.figures import (
    accuracy_figure,
    confusion_figure,
    learning_curve_figure,
    round_ticks,
    save_figure,
)

SVG = "{http://www.w3.org/2000/svg}"


def curve(names: tuple[str, ...] = ("one", "two"), at: str = "fraction") -> pd.DataFrame:
    rows = [
        (name, x if at == "fraction" else int(100 * x), 0.2 + 0.1 * i + x / 2, 0.1 + x / 2, 0.4 + x / 2)
        for i, name in enumerate(names)
        for x in (0.1, 0.5, 0.9)
    ]
    return pd.DataFrame(rows, columns=["predictor", at, "accuracy", "low", "high"])


def parsed(svg: str) -> ElementTree.Element:
    assert not re.search(r"<script|<image|href=|url\(|@import", svg)
    return ElementTree.fromstring(svg)


def texts(root: ElementTree.Element) -> list[str]:
    return [element.text or "" for element in root.iter(f"{SVG}text")]


@pytest.mark.parametrize(("draw", "at"), [(accuracy_figure, "fraction"), (learning_curve_figure, "size")])
def test_curves_show_every_value_with_its_band(draw, at: str) -> None:  # type: ignore[no-untyped-def]
    table = curve(at=at)
    table.attrs["evaluation"] = "what <fraction> & cut mean"
    root = parsed(draw(table, title="A < B & C"))
    dots = list(root.iter(f"{SVG}circle"))
    assert [dot[0].text for dot in dots][:2] == ["one: 0.250 (0.150 to 0.450)", "one: 0.450 (0.350 to 0.650)"]
    heights, values = [float(dot.get("cy", "")) for dot in dots], table["accuracy"].to_numpy()
    slope, offset = np.polyfit(values, heights, 1)
    np.testing.assert_allclose(heights, slope * values + offset, atol=0.11)
    assert slope < 0
    assert len(list(root.iter(f"{SVG}polygon"))) == 2
    assert {"A < B & C", "one", "two", "what <fraction> & cut mean"} <= set(texts(root))


def test_missing_bands_are_left_out() -> None:
    table = curve(("alone",))
    table[["low", "high"]] = np.nan
    assert not list(parsed(accuracy_figure(table)).iter(f"{SVG}polygon"))


def test_names_of_lines_never_overlap() -> None:
    table = curve(tuple(f"predictor {i}" for i in range(12)))
    table["accuracy"] = 0.5
    root = parsed(accuracy_figure(table))
    heights = sorted(float(e.get("y", "")) for e in root.iter(f"{SVG}text") if (e.text or "").startswith("predictor"))
    assert len(heights) == 12
    assert np.diff(heights).min() >= 15.8
    assert heights[0] > 60
    assert heights[-1] < 430


@pytest.mark.parametrize(
    "goals", [("a", "b"), ("onion@(1,0)", "a very long name of a goal", "x"), tuple("abcdefghijklmn")]
)
def test_confusions_show_shares_of_each_goal(goals: tuple[str, ...]) -> None:
    counts = np.random.default_rng(0).integers(0, 20, (len(goals), len(goals))).astype(float)
    counts[0] = 0
    root = parsed(confusion_figure(pd.DataFrame(counts, index=list(goals), columns=list(goals))))
    cells = [rect for rect in root.iter(f"{SVG}rect") if len(rect)]
    assert len(cells) == len(goals) ** 2
    share = counts[1, 1] / counts[1].sum()
    assert f"{100 * share:.0f}" in texts(root)
    assert (
        cells[len(goals) + 1][0].text == f"{goals[1]} taken for {goals[1]}: {counts[1, 1]:.1f} of {counts[1].sum():.0f}"
    )
    width = float(root.get("width", ""))
    assert all(float(c.get("x", "")) + float(c.get("width", "")) <= width for c in cells)


def test_bad_tables_are_refused() -> None:
    with pytest.raises(ValueError, match="missing"):
        accuracy_figure(curve().drop(columns="low"))
    with pytest.raises(ValueError, match="no rows"):
        learning_curve_figure(curve(at="size").iloc[:0])
    with pytest.raises(ValueError, match="same goals"):
        confusion_figure(pd.DataFrame(np.eye(2), index=["a", "b"], columns=["a", "c"]))


def test_figures_are_written_whole(tmp_path: Path) -> None:
    svg = accuracy_figure(curve())
    path = save_figure(tmp_path / "new" / "a.svg", svg)
    assert path.read_text(encoding="utf-8") == svg
    with pytest.raises(ValueError, match=r"FILE\.svg"):
        save_figure(tmp_path / "a.png", svg)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 1.0, [0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (-1.6, 0.3, [-1.5, -1.0, -0.5, 0.0]),
        (41.4, 56.3, [45.0, 50.0, 55.0]),
        (7.0, 7.0, [7.0]),
    ],
)
def test_ticks_are_round_and_lie_within(low, high, expected):
    assert round_ticks(low, high) == expected


@given(low=st.floats(-1e6, 1e6), span=st.floats(1e-3, 1e6))
def test_there_are_a_few_ticks(low, span):
    ticks = round_ticks(low, low + span)
    assert 2 <= len(ticks) <= 8
    assert all(low - 1e-6 * span <= value <= low + span * (1 + 1e-6) for value in ticks)
