"""Figures of evaluations show the numbers they are given, with their names and what they mean."""

from __future__ import annotations

import itertools
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from legible_envs.drawing.charts import SHADES, SIZES, save_figure
from predictors.evaluation.figures import accuracy_figure, confusion_figure, learning_curve_figure

SVG = "{http://www.w3.org/2000/svg}"


def curve(names: tuple[str, ...] = ("one", "two"), at: str = "fraction") -> pd.DataFrame:
    rows = [
        (name, x if at == "fraction" else int(100 * x), 0.2 + 0.1 * i + x / 2, 0.1 + x / 2, 0.4 + x / 2)
        for i, name in enumerate(names)
        for x in (0.1, 0.5, 0.9)
    ]
    return pd.DataFrame(rows, columns=["predictor", at, "accuracy", "low", "high"])


def texts(figure) -> list[str]:  # type: ignore[no-untyped-def]
    return [text.get_text() for text in figure.findobj(Text) if text.get_visible()]


def lines(figure):  # type: ignore[no-untyped-def]
    return {line.get_label(): line for line in figure.axes[0].lines if not str(line.get_label()).startswith("_")}


def titles_of_marks(figure) -> list[str]:  # type: ignore[no-untyped-def]
    root = ElementTree.fromstring(figure._repr_svg_())
    return [element.text or "" for element in root.iter(f"{SVG}title")][1:]


@pytest.mark.parametrize(("draw", "at"), [(accuracy_figure, "fraction"), (learning_curve_figure, "size")])
def test_curves_show_every_value_with_its_band(draw, at: str) -> None:  # type: ignore[no-untyped-def]
    table = curve(at=at)
    table.attrs["evaluation"] = "what <fraction> & cut mean"
    figure = draw(table, title="A < B & C")
    assert list(lines(figure)) == ["one", "two"]
    for name, line in lines(figure).items():
        own = table[table["predictor"] == name]
        np.testing.assert_array_equal(line.get_xydata(), own[[at, "accuracy"]])
    (axes,) = figure.axes
    assert axes.get_ylim() == (0, 1)
    assert axes.get_xlim() == ((0.1, 0.9) if at == "fraction" else (0, 90))
    assert len(axes.collections) == 2
    for band, (_, own) in zip(axes.collections, table.groupby("predictor", sort=False), strict=True):
        corners = {tuple(corner) for corner in band.get_paths()[0].vertices.round(9).tolist()}
        for edge in ("low", "high"):
            assert set(own[[at, edge]].round(9).itertuples(index=False, name=None)) <= corners
    assert titles_of_marks(figure)[:2] == ["one: 0.250 (0.150 to 0.450)", "one: 0.450 (0.350 to 0.650)"]
    assert {"A < B & C", "one", "two", "what <fraction> & cut mean", "accuracy"} <= set(texts(figure))


def test_rows_may_come_in_any_order() -> None:
    (line,) = lines(accuracy_figure(curve(("alone",)).iloc[::-1])).values()
    assert line.get_xdata().tolist() == [0.1, 0.5, 0.9]


def test_chance_and_conditions_are_named() -> None:
    figure = accuracy_figure(curve().assign(chance=0.25, condition=["A", "A", "A", "B", "B", "B"]))
    assert list(lines(figure)) == ["one, A", "two, B"]
    assert "chance" in texts(figure)
    assert any(np.array_equal(line.get_ydata(), [0.25, 0.25]) for line in figure.axes[0].lines)


def test_missing_bands_are_left_out() -> None:
    table = curve(("alone",))
    table[["low", "high"]] = np.nan
    figure = accuracy_figure(table)
    assert not figure.axes[0].collections
    assert titles_of_marks(figure)[0] == "alone: 0.250"


def test_names_of_lines_never_overlap() -> None:
    table = curve(tuple(f"predictor {i}" for i in range(12)))
    table["accuracy"] = 0.5
    figure = accuracy_figure(table)
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text().startswith("predictor")]
    boxes = sorted((Text.get_window_extent(name) for name in names), key=lambda box: box.ymin)  # without leaders
    assert len(boxes) == 12
    assert all(below.ymax <= above.ymin + 1 for below, above in itertools.pairwise(boxes))
    assert boxes[0].ymin > figure.axes[0].bbox.ymin - 10
    assert boxes[-1].ymax < figure.axes[0].bbox.ymax + 10
    assert max(box.xmax for box in boxes) <= figure.bbox.xmax


@pytest.mark.parametrize(
    "goals", [("a", "b"), ("onion@(1,0)", "a very long name of a goal", "x"), tuple("abcdefghijklmn")]
)
def test_confusions_show_shares_of_each_goal(goals: tuple[str, ...]) -> None:
    counts = np.random.default_rng(0).integers(0, 20, (len(goals), len(goals))).astype(float)
    counts[0] = 0
    figure = confusion_figure(pd.DataFrame(counts, index=list(goals), columns=list(goals)))
    (axes,) = figure.axes
    (squares,) = axes.collections
    shares = np.asarray(squares.get_array()).reshape(counts.shape)
    np.testing.assert_allclose(shares[1:], counts[1:] / counts[1:].sum(axis=1, keepdims=True))
    assert not shares[0].any()
    assert squares.get_cmap() is SHADES
    assert squares.get_clim() == (0, 1)
    assert f"{100 * shares[1, 1]:.0f}" in texts(figure)
    titles = titles_of_marks(figure)
    assert len(titles) == len(goals) ** 2
    assert titles[len(goals) + 1] == f"{goals[1]} predicted as {goals[1]}: {counts[1, 1]:.1f} of {counts[1].sum():.0f}"
    figure.draw_without_rendering()
    inside = figure.bbox
    for text in [*axes.texts, *axes.get_xticklabels(), axes.xaxis.label, axes.yaxis.label]:
        box = text.get_window_extent()
        assert inside.xmin <= box.xmin + 1 <= box.xmax <= inside.xmax + 1, text
        assert inside.ymin <= box.ymin + 1 <= box.ymax <= inside.ymax + 1, text
    label = axes.yaxis.label.get_window_extent()
    assert label.xmax <= min(text.get_window_extent().xmin for text in axes.texts)


def test_figures_for_papers_have_the_width_of_a_column() -> None:
    table = curve()
    table.attrs["evaluation"] = "what it means"
    for size, own in SIZES.items():
        figure = accuracy_figure(table, size=size)
        assert figure.get_size_inches()[0] == own.width
        assert ("what it means" in texts(figure)) == own.has_words


def test_bad_tables_are_refused() -> None:
    with pytest.raises(ValueError, match="missing"):
        accuracy_figure(curve().drop(columns="low"))
    with pytest.raises(ValueError, match="no rows"):
        learning_curve_figure(curve(at="size").iloc[:0])
    with pytest.raises(ValueError, match="same goals"):
        confusion_figure(pd.DataFrame(np.eye(2), index=["a", "b"], columns=["a", "c"]))


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_figures_are_written_whole_and_the_same(tmp_path, kind: str) -> None:  # type: ignore[no-untyped-def]
    paths = [save_figure(tmp_path / name / f"a.{kind}", accuracy_figure(curve())) for name in ("new", "newer")]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert len(list(paths[0].parent.iterdir())) == 1
