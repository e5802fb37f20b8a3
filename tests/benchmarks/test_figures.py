"""Figures of the experiments show the numbers they are given."""

from __future__ import annotations

import matplotlib.colors
import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Annotation

from benchmarks.experiments.figures import learning_by_condition
from benchmarks.experiments.optimizers.figures import anytime_figure
from benchmarks.experiments.overcooked.figures import behaviour_map, task_figure
from benchmarks.experiments.recorded.figures import correlation_figure, draw_all, scatter_figure
from benchmarks.experiments.tabletop.figures import team_figure
from benchmarks.experiments.tabletop.sweep import CONDITIONS
from legible_envs.drawing.charts import COLOURS, SIZES, save_figure
from legible_envs.overcooked.recipes import soup_task


def words(figure):
    return [text.get_text() for text in figure.texts]


def inside(figure):
    """Whether all that stands on a figure lies within it."""
    figure.draw_without_rendering()
    boxes = [axes.get_tightbbox() for axes in figure.axes] + [legend.get_window_extent() for legend in figure.legends]
    room = figure.bbox.padded(1)
    return all(room.contains(box.xmin, box.ymin) and room.contains(box.xmax, box.ymax) for box in boxes)


# -- optimizers -------------------------------------------------------------------------------------------------------


def curves(first=1000.0, last=100_000.0):
    scored = np.geomspace(first, last, 5)
    parts = [
        {"method": name, "scored": scored, "best": best + np.arange(5), "low": best - 1.0, "high": best + 6.0}
        for name, best in (("cma-me", -9.0), ("improve", 2.0))
    ]
    return pd.concat([pd.DataFrame(part) for part in parts], ignore_index=True)


def test_scores_rise_over_evaluations():
    table = curves()
    figure = anytime_figure(table, title="So far")
    (axes,) = figure.axes
    for line, (name, own) in zip(axes.lines, table.groupby("method", sort=False), strict=True):
        assert line.get_label() == name
        np.testing.assert_array_equal(line.get_xydata(), own[["scored", "best"]])
    assert [band.get_datalim(axes.transData).intervaly.tolist() for band in axes.collections] == [[-10, -3], [1, 8]]
    assert axes.get_xscale() == "log"
    assert axes.get_xlim() == (1000, 100_000)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1,000", "10,000", "100,000"]
    assert [text.get_text() for text in axes.texts] == ["cma-me \u22125.0", "improve 6.0"]
    assert "So far" in words(figure)
    assert inside(figure)


@pytest.mark.parametrize(("first", "last"), [(1000, 2000), (1000, 8000), (900, 1100), (730, 730), (10, 2e7)])
def test_ticks_of_evaluations_are_round_and_within(first, last):
    ticks = anytime_figure(curves(first, last), title="T").axes[0].get_xticks()
    assert 1 <= len(ticks) <= 9
    assert all(first <= tick <= last for tick in ticks)
    assert all(f"{tick:.0e}"[0] in "12357" for tick in ticks)


# -- kitchens ---------------------------------------------------------------------------------------------------------


def test_the_behaviour_map_shows_the_best_of_every_kind():
    elites = pd.DataFrame(
        {
            "obstacles": [0.0, 0.0, 2.0, 2.0],
            "order": ["TO", "TO", "TO", "OT"],
            "objective": [1.0, 3.4, -2.0, 8.0],
        }
    )
    figure = behaviour_map(elites)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.texts] == ["8", "\u22122", "", "", "", "3"]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["OT", "TO"]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["2", "1", "0"]
    (squares,) = axes.collections
    shades = np.ma.filled(squares.get_array(), np.nan).reshape(3, 2)
    assert np.isnan(shades).tolist() == [[False, False], [True, True], [True, False]]
    assert shades[0, 0] == 1.0 > shades[2, 1] > shades[0, 1] == pytest.approx(0.06)
    svg = figure._repr_svg_()
    assert "<title>2 obstacles, OT: 8.00</title>" in svg
    assert "<title>1 obstacles, OT: no layout found</title>" in svg
    assert any("darkest 8.0" in line for line in words(figure))
    assert inside(figure)


def test_the_task_is_drawn_as_boxes_and_arrows():
    figure = task_figure(soup_task())
    (axes,) = figure.axes
    boxes = [text.get_text() for text in axes.texts if "→" in text.get_text()]
    assert sorted(set(boxes)) == [
        "1 × cabbage → pot",
        "1 × onion → pot",
        "2 × onion → pot",
        "2 × tomato → pot",
        "3 × fish → pot",
        "dish → pot → serving",
    ]
    assert sum(isinstance(text, Annotation) for text in axes.texts) == 5
    assert any("7,484,400 valid sequences, 50 stages" in line for line in words(figure))
    figure.draw_without_rendering()
    white = [patch.get_window_extent() for patch in axes.patches if patch.get_facecolor()[:3] == (1, 1, 1)]
    labels = [text.get_window_extent() for text in axes.texts if "→" in text.get_text()]
    assert all(any(box.xmin < label.xmin and label.xmax < box.xmax for box in white) for label in labels)


def test_learning_is_drawn_by_condition():
    table = pd.DataFrame(
        [
            ("eq", condition, layout, share, 10 * share + layout, 0.1 * layout + share / 2)
            for condition in ("A", "B")
            for layout in (0, 1)
            for share in (0.5, 1.0)
        ],
        columns=["predictor", "condition", "layout", "share", "size", "accuracy"],
    )
    figure = learning_by_condition(table, "eq", ["B", "A"])
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert list(lines) == ["B", "A"]
    np.testing.assert_allclose(lines["A"].get_xydata(), [[6, 0.3], [10, 0.55]])
    assert len(figure.axes[0].collections) == 2
    assert "What more trajectories buy: eq" in words(figure)


# -- recorded participants --------------------------------------------------------------------------------------------


def places():
    return pd.DataFrame(
        {
            "predictor": "Eq. 1",
            "candidate_set": "all",
            "kitchen": ["big_room", "big_room", "ring"],
            "start": "pot",
            "goals": ["onion dish", "onion tomato", "dish tomato"],
            "walks": [7, 8, 9],
            "score": [-0.4, 0.2, 0.5],
            "accuracy": [0.5, 0.6, 0.9],
        }
    )


def correlations():
    columns = ["predictor", "candidate_set", "places", "rho", "people_low", "people_high", "places_low", "places_high"]
    rows = [("Eq. 1", "all", 9, 0.5, 0.4, 0.6, 0.1, 0.9), ("Eq. 1", "of_use", 7, -0.2, -0.4, 0.1, -0.9, 0.3)]
    return pd.DataFrame(rows, columns=columns).assign(level="stage")


def test_every_stage_is_a_dot():
    figure = scatter_figure(places(), "T", "S")
    (axes,) = figure.axes
    assert [dots.get_offsets().tolist() for dots in axes.collections] == [[[-0.4, 0.5], [0.2, 0.6]], [[0.5, 0.9]]]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["big room", "ring"]
    assert [matplotlib.colors.to_hex(dots.get_facecolor()[0]) for dots in axes.collections] == list(COLOURS[:2])
    assert "<title>big room, from pot to onion dish: 7 trajectories</title>" in figure._repr_svg_()
    assert inside(figure)
    assert axes.get_legend().get_window_extent().xmin > axes.bbox.xmax


def test_every_correlation_has_both_intervals():
    figure = correlation_figure(correlations(), "T")
    (axes,) = figure.axes
    drawn = {name: [] for name in ("places", "participants", "rho")}
    for line in axes.lines:
        if line.get_label() in drawn:
            drawn[line.get_label()].append(np.asarray(line.get_xdata()).ravel().tolist())
    assert drawn == {
        "places": [[0.1, 0.9], [-0.9, 0.3]],
        "participants": [[0.4, 0.6], [-0.4, 0.1]],
        "rho": [[0.5], [-0.2]],
    }
    labels = axes.get_yticklabels()
    assert [label.get_text() for label in labels] == ["Eq. 1, all in reach", "Eq. 1, of use in the game"]
    assert [label.get_color() for label in labels] == list(COLOURS[:2])
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first row on top
    assert "9 (all in reach) and 7 (of use in the game)" in " ".join(words(figure))
    assert inside(figure)


def test_figures_lie_under_the_names_they_always_had(tmp_path):
    files = draw_all(places(), correlations(), tmp_path)
    assert [path.name for path in files] == ["correlations_stage.svg", "stages_all_eq_1.svg"]
    assert all(path.read_text().startswith("<svg ") for path in files)


# -- teams ------------------------------------------------------------------------------------------------------------


def teams():
    measures = {"completion_time": 12.0, "decision_time": 0.8, "conflicts": 0.5, "human_idle": 0.3, "robot_idle": 0.4}
    rows = [
        (reader, measure, condition, value + 0.01 * i, value - 0.2, value + 0.6)
        for reader in ("Eq. 1", "Gaussian")
        for measure, value in measures.items()
        for i, condition in enumerate(CONDITIONS)
    ]
    return pd.DataFrame(rows, columns=["reader", "measure", "condition", "mean", "low", "high"])


def test_teams_have_a_panel_for_each_measure():
    figure = team_figure(teams())
    panels = {axes.get_title(loc="left"): axes for axes in figure.axes}
    time, idle = panels["completion time, s"], panels["human idle, share of time"]
    dots = {line.get_label(): line for line in time.lines}
    assert list(dots) == ["Eq. 1", "Gaussian"]
    np.testing.assert_allclose(dots["Eq. 1"].get_ydata(), 12 + 0.01 * np.arange(len(CONDITIONS)))
    assert np.round(dots["Gaussian"].get_xdata()).tolist() == list(range(len(CONDITIONS)))
    spans = [segment[:, 1].tolist() for lines in time.collections for segment in lines.get_segments()]
    assert len(spans) == 2 * len(CONDITIONS)
    np.testing.assert_allclose(spans, [[11.8, 12.6]] * len(spans))
    assert time.get_ylim()[0] > 10  # times need not begin at zero, shares do
    assert idle.get_ylim()[0] == 0
    assert not panels[""].axison  # not measured
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["Eq. 1", "Gaussian"]
    assert f"<title>{CONDITIONS[0]}, Eq. 1: 0.3</title>" in figure._repr_svg_()
    assert inside(figure)


@pytest.mark.parametrize("size", SIZES)
def test_every_figure_comes_in_every_size(tmp_path, size):
    figures = {
        "anytime": anytime_figure(curves(), title="T", size=size),
        "scatter": scatter_figure(places(), "T", "S", size=size),
        "correlation": correlation_figure(correlations(), "T", size=size),
        "teams": team_figure(teams(), size=size),
    }
    for name, figure in figures.items():
        assert figure.get_size_inches()[0] == SIZES[size].width
        assert inside(figure), name
        assert save_figure(tmp_path / f"{name}.pdf", figure).read_bytes().startswith(b"%PDF")
