"""The look of charts: files of three kinds, always the same bytes; ticks, names and legends; no setting changed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import matplotlib.style
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text

from legible_envs.drawing.chart_parts import (
    label_ends,
    legend_above,
    line_style,
    number_squares,
    round_upwards,
    shares_upwards,
)
from legible_envs.drawing.charts import COLOURS, INK, SIZES, Chart, save_figure, styled

SVG = "{http://www.w3.org/2000/svg}"


def chart(size="report", title="A < B & C costs $5 or $6"):
    with styled(size):
        made = Chart(title, "below", "a <note> & more", description="Two dots.", size=size)
        axes = made.subplots()
        (line,) = axes.plot([1, 2], [0.2, 0.8], marker="o", label="line")
        made.tip(line, ["first", "second & last"])
        shares_upwards(axes)
        label_ends(made, axes, [("line", 0.8)])
    return made


def root_of(path: Path) -> ElementTree.Element:
    return ElementTree.fromstring(path.read_text(encoding="utf-8"))


def texts(root: ElementTree.Element) -> list[str]:
    return [element.text or "" for element in root.iter(f"{SVG}text")]


# -- files ------------------------------------------------------------------------------------------------------------


def test_an_svg_can_stand_in_a_page_and_be_read_aloud(tmp_path):
    path = save_figure(tmp_path / "new" / "a.svg", chart())
    root, content = root_of(path), path.read_text(encoding="utf-8")
    assert content.startswith("<svg ")
    assert not re.search(r"<script|<image|<style|href=.(?!#)|url\((?!#)|@import| id=.(?!m|p)", content)
    assert root.get("role") == "img"
    assert "max-width:100%" in root.get("style", "")
    assert [(element.tag, element.text) for element in root[:2]] == [
        (f"{SVG}title", "A < B & C costs $5 or $6"),
        (f"{SVG}desc", "Two dots."),
    ]
    assert {"A < B & C costs $5 or $6", "below", "a <note> & more", "line", "20 %"} <= set(texts(root))
    assert [use[0].text for use in root.iter(f"{SVG}use") if len(use)] == ["first", "second & last"]
    assert "DejaVu" not in content  # the viewer's own font


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "head"), [("svg", b"<svg"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_the_same_figure_has_the_same_bytes(tmp_path, kind, head):
    once, made = save_figure(tmp_path / f"once.{kind}", chart()).read_bytes(), chart()
    assert once.startswith(head)
    assert [save_figure(tmp_path / f"again.{kind}", made).read_bytes() for _ in range(2)] == [once, once]
    assert {path.name for path in tmp_path.iterdir()} == {f"once.{kind}", f"again.{kind}"}
    code = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import test_charts as t; from pathlib import "
        f"Path; t.save_figure(Path({str(tmp_path)!r}) / 'other.{kind}', t.chart())"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert (tmp_path / f"other.{kind}").read_bytes() == once


def test_a_pdf_holds_its_fonts_as_true_type(tmp_path):
    content = save_figure(tmp_path / "a.pdf", chart()).read_bytes()
    assert b"/FontFile2" in content
    assert b"/Type3" not in content
    assert b"CreationDate" not in content


def test_other_fonts_are_those_installed(tmp_path):
    content = save_figure(tmp_path / "a.svg", chart(), font="DejaVu Serif").read_text()
    assert "font-family=\"'DejaVu Serif', system-ui" in content
    assert save_figure(tmp_path / "a.pdf", chart(), font="DejaVu Serif").read_bytes().count(b"DejaVuSerif") >= 1
    with pytest.raises(ValueError, match="installed here, got 'No Such Font'"):
        save_figure(tmp_path / "b.svg", chart(), font="No Such Font")
    assert not (tmp_path / "b.svg").exists()


def test_any_figure_of_matplotlib_can_be_written(tmp_path):
    figure = Figure()
    figure.subplots().set_title("Mine", family="serif")
    content = save_figure(tmp_path / "a.svg", figure).read_text()
    assert "Mine" in content
    assert "serif" in content
    assert "<title" not in content


def test_other_kinds_of_files_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"'\.svg', '\.pdf', '\.png'.*'a\.gif'"):
        save_figure(tmp_path / "a.gif", chart())
    with pytest.raises(ValueError, match="`size` must be one of"):
        chart("poster")


def test_notebooks_show_the_chart(tmp_path):
    assert chart()._repr_svg_() == save_figure(tmp_path / "a.svg", chart()).read_text(encoding="utf-8")


def test_settings_of_the_program_neither_matter_nor_change(tmp_path):
    plain = save_figure(tmp_path / "plain.svg", chart()).read_bytes()
    with matplotlib.style.context(["dark_background", {"font.size": 30, "svg.fonttype": "path", "axes.grid": True}]):
        before = dict(matplotlib.rcParams)
        made = chart()
        assert dict(matplotlib.rcParams) == before
        assert save_figure(tmp_path / "dark.svg", made).read_bytes() == plain
        with pytest.raises(RuntimeError), styled():
            raise RuntimeError
        assert dict(matplotlib.rcParams) == before


def test_packages_are_light_and_drawing_needs_no_window():
    code = (
        "import sys, legible_envs, legible_envs.drawing, optimizers, predictors.evaluation, benchmarks.cli.app; "
        "assert 'matplotlib' not in sys.modules; import predictors.evaluation.figures; "
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


# -- what stands on them ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
def test_sizes_of_papers_leave_words_to_the_caption(size):
    made = chart(size)
    assert made.get_size_inches()[0] == SIZES[size].width
    words = {text.get_text() for text in made.texts}
    assert words == ({"A < B & C costs $5 or $6", "below", "a <note> & more"} if SIZES[size].has_words else set())
    assert {text.get_size() for text in made.axes[0].texts} == {SIZES[size].text}


def test_long_words_take_more_lines_inside_the_figure():
    made = chart(title="A title of a good many words " * 6)
    made.draw_without_rendering()
    page = made.bbox
    for text in made.texts:
        box = text.get_window_extent()
        assert page.xmin <= box.xmin <= box.xmax <= page.xmax
        assert page.ymin <= box.ymin <= box.ymax <= page.ymax
    heading, panel = made.texts[0].get_window_extent(), made.axes[0].get_tightbbox()
    assert len(made.texts) > 4
    assert panel is not None
    assert min(text.get_window_extent().ymin for text in made.texts[:-1]) >= panel.ymax
    assert made.texts[-1].get_window_extent().ymax <= panel.ymin < heading.ymin


def test_lines_are_told_apart_by_colour_and_dashes():
    styles = [line_style(number) for number in range(32)]
    assert len({(style["color"], str(style["linestyle"])) for style in styles}) == 32
    assert [style["color"] for style in styles[:8]] == list(COLOURS)


@given(values=st.lists(st.floats(0, 1), min_size=1, max_size=12))
@settings(max_examples=15, deadline=None)
def test_names_of_lines_never_overlap(values):
    with styled():
        made = Chart("T", description="D")
        axes = made.subplots()
        shares_upwards(axes)
        label_ends(made, axes, [(f"line {i}", value) for i, value in enumerate(values)])
    made.draw_without_rendering()
    boxes = sorted((Text.get_window_extent(name) for name in axes.texts), key=lambda box: box.ymin)  # without leaders
    heights = [(box.ymin + box.ymax) / 2 for box in boxes]
    assert len(boxes) == len(values)
    assert all(gap >= 1.25 * SIZES["report"].text * made.dpi / 72 for gap in np.diff(heights))
    assert axes.bbox.ymin - 3 <= heights[0]
    assert heights[-1] <= axes.bbox.ymax + 3
    assert max(box.xmax for box in boxes) <= made.bbox.xmax
    assert [text.get_color() for text in sorted(axes.texts, key=lambda text: int(text.get_text()[5:]))] == [
        COLOURS[i % len(COLOURS)] for i in range(len(values))
    ]


def ticks_of(low, high):
    with styled():
        axes = Chart("T", description="D").subplots()
        round_upwards(axes, low, high)
    return axes.get_yticks(), axes


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 1.0, [0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (0.0, 0.0042, [0, 0.001, 0.002, 0.003, 0.004, 0.005]),
        (-1.6, 0.3, [-2.0, -1.5, -1.0, -0.5, 0.0, 0.5]),
        (41.4, 56.3, [40.0, 45.0, 50.0, 55.0, 60.0]),
        (7.0, 7.0, [7.0, 7.2, 7.4, 7.6, 7.8, 8.0]),
    ],
)
def test_ticks_are_round_and_enclose_the_data(low, high, expected):
    ticks, axes = ticks_of(low, high)
    np.testing.assert_allclose(ticks, expected, atol=1e-12)
    assert axes.get_ylim() == (ticks[0], ticks[-1])
    assert len(axes.lines) == (low < 0 < high)  # zero is marked where it lies between


@given(low=st.floats(-1e6, 1e6), span=st.floats(1e-3, 1e6))
@settings(max_examples=30, deadline=None)
def test_there_are_a_few_ticks(low, span):
    ticks, _ = ticks_of(low, low + span)
    assert 2 <= len(ticks) <= 8
    assert ticks[0] <= low + 1e-6 * span
    assert ticks[-1] >= low + span * (1 - 1e-6)
    step = np.diff(ticks)
    np.testing.assert_allclose(step, step[0], rtol=1e-3)
    assert min(abs(step[0] / 10 ** np.floor(np.log10(step[0] * 1.001)) - m) for m in (1, 2, 2.5, 5)) < 1e-2


def test_squares_show_their_values():
    values = np.array([[0.0, 0.3, 1.0], [0.9, np.nan, 0.1]])
    with styled():
        made = Chart("T", description="D")
        axes = made.subplots()
        squares = number_squares(axes, values, list("abcdef"))
        made.tip(squares, list("ABCDEF"))
    np.testing.assert_array_equal(np.ma.filled(squares.get_array(), np.nan).reshape(2, 3), values)
    places = {text.get_text(): text.get_position() for text in axes.texts}
    assert places == {"a": (0, 0), "b": (1, 0), "c": (2, 0), "d": (0, 1), "e": (1, 1), "f": (2, 1)}
    assert [text.get_color() for text in axes.texts] == [INK, INK, "white", "white", INK, INK]
    assert axes.get_ylim() == (1.5, -0.5)  # the first row on top
    titles = [path[0].text for path in ElementTree.fromstring(made._repr_svg_()).iter(f"{SVG}path") if len(path)]
    assert titles == list("ABCDEF")


@pytest.mark.parametrize("names", [["paper", "ours"], [f"a rather long name, number {i}" for i in range(5)]])
def test_legends_stand_between_heading_and_panels(names):
    with styled():
        made = Chart("T", "S", description="D")
        axes = made.subplots()
        axes.bar([0], [1])
        legend_above(made, names, COLOURS[: len(names)])
    made.draw_without_rendering()
    (legend,) = made.legends
    box, panel = legend.get_window_extent(), axes.get_tightbbox()
    assert panel is not None
    assert box.ymin >= panel.ymax - 1
    assert box.ymax <= made.texts[1].get_window_extent().ymin + 1
    assert box.xmax <= made.bbox.xmax
    found = {
        text.get_text(): matplotlib.colors.to_hex(patch.get_facecolor())
        for text, patch in zip(legend.get_texts(), legend.get_patches(), strict=True)
    }
    assert found == dict(zip(names, COLOURS, strict=False))
