"""What stands on pages: numbers, tables, layouts that differ, prices in words, and what anyone can read."""

from __future__ import annotations

import math
import re
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.presenters import presenter_of
from benchmarks.presenters.base import Panel
from benchmarks.presenters.losses import loss_row, losses_and_gains
from benchmarks.presenters.panels import price_of
from benchmarks.reports.experiment_report import Section, write_experiment_report
from benchmarks.reports.numbers import fixed, p_value, significant
from benchmarks.reports.pages import page_environment, table_of
from benchmarks.reports.search_report import report_data, write_report
from benchmarks.reports.variety import pick_varied
from legible_envs.legibility import posterior
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.tabletop import TabletopWorkspace
from optimizers import load_run
from tests.support.run_folders import write_run

# -- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (8.882e-15, "0"),
        (-3e-13, "0"),
        (0.0, "0"),
        (0.125, "0.125"),
        (-0.0123456, "−0.01235"),
        (2.345e-9, "2.345 × 10⁻⁹"),
        (-1e-5, "−1 × 10⁻⁵"),
        (7692.0, "7\u202f692"),
        (123456.7, "123\u202f457"),
        (math.inf, "∞"),
        (math.nan, "–"),
    ],
)
def test_numbers_are_for_reading(value: float, shown: str) -> None:
    assert significant(value) == shown


def test_rounding_errors_among_large_numbers_are_nothing() -> None:
    assert significant(2e-9, scale=20.0) == "0"
    assert significant(2e-9, scale=1e-8) == "2 × 10⁻⁹"
    assert fixed(-0.0001) in ("0.00", "−0.00")
    assert fixed(-25.1746) == "−25.17"
    assert fixed(None) == "–"
    assert (p_value(3e-16), p_value(0.04049), p_value(math.nan)) == ("< 0.001", "0.040", "–")


def test_a_table_knows_its_columns() -> None:
    rows = [
        {"method": "a", "gap": 8.9e-15, "p_holm": 1e-9, "reached": True, "share": "5 %", "hedges_g": math.inf},
        {"method": "b", "gap": 0.25, "p_holm": 0.5, "reached": np.False_, "share": "50 %", "hedges_g": None},
    ]
    found = table_of([("Methods", rows), ("None", [])])
    assert found is not None
    assert [c.name for c in found.columns] == ["method", "gap", "p, Holm", "reached", "share", "Hedges’ g"]
    assert [c.is_number for c in found.columns] == [False, True, True, False, True, True]
    assert found.groups == [
        ("Methods", [["a", "0", "< 0.001", "yes", "5 %", "∞"], ["b", "0.25", "0.500", "no", "50 %", "–"]])
    ]
    assert table_of([("", [])]) is None


# -- layouts that differ ----------------------------------------------------------------------------------------------


def apart(a: np.ndarray, b: np.ndarray, extent: np.ndarray) -> float:
    return float(np.mean([abs(x - y) / (e or 1.0) for x, y, e in zip(a, b, extent, strict=True)]))


@settings(deadline=None, max_examples=300)
@given(st.integers(0, 40), st.integers(1, 5), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_each_next_layout_is_the_farthest_from_those_before(rows: int, genes: int, count: int, seed: int) -> None:
    genomes = np.random.default_rng(seed).integers(0, 4, (rows, genes)).astype(float)
    taken = pick_varied(genomes, count)
    room = min(rows, max(math.ceil(rows / 2), count))
    better = genomes[:room]
    assert taken[:1] == [0][:rows]
    extent = np.ptp(better, axis=0) if rows else np.zeros(genes)
    for number in range(1, len(taken)):
        before = [better[i] for i in taken[:number]]
        nearest = [min(apart(row, b, extent) for b in before) for row in better]
        assert nearest[taken[number]] == pytest.approx(max(nearest))
        assert nearest[taken[number]] > 0
    if len(taken) < min(count, room):
        shown = {tuple(better[i]) for i in taken}
        assert {tuple(row) for row in better} == shown, "only where nothing different is left"


# -- prices and losses ------------------------------------------------------------------------------------------------


def panel(name: str, distance: float) -> Panel:
    return Panel(name, None, 1.0, distance)


@pytest.mark.parametrize(
    ("mine", "theirs", "said"),
    [
        (64.13, 64.13, "Legibility costs no distance here: 64.1 steps for one task, as in the efficient layout."),
        (64.14, 64.06, "Legibility costs no distance here: 64.1 steps for one task, as in the efficient layout."),
        (60.0, 64.0, "costs no distance here: 60.0 steps for one task, 6 % less than in the efficient layout."),
        (
            113.8,
            64.1,
            "Its price is distance: 113.8 steps for one task, 78 % more than the 64.1 steps in the",
        ),
        (64.4, 64.1, "64.4 steps for one task, less than 1 % more than the 64.1 steps"),
    ],
)
def test_the_price_is_what_the_numbers_say(mine: float, theirs: float, said: str) -> None:
    assert said in price_of(panel("legible", mine), panel("efficient", theirs), unit="steps", digits=1)


@pytest.mark.parametrize("workspace", [OvercookedWorkspace(shape=(5, 5)), TabletopWorkspace()])
def test_the_runner_up_is_the_goal_that_the_observer_finds_next_probable(workspace: Any) -> None:
    rows = workspace.explain(workspace.sample(1, np.random.default_rng(4))[0])
    assert any(len(row["goals"]) > 2 for row in rows)
    for row in rows:
        assert sum(row["belief"].values()) == pytest.approx(1.0)
        assert set(row["belief"]) == set(row["goals"])
        shown = loss_row(row)
        assert shown["believed in"] == f"{row['belief'][row['goal']]:.0%}"
        others = {goal: share for goal, share in row["belief"].items() if goal != row["goal"]}
        if not others:
            assert (shown["not to"], shown["runner-up"]) == ("no other goal", "none")
        else:
            best = max(others.values())
            assert f"{best:.0%}" in shown["runner-up"]
            assert all((goal in shown["runner-up"]) == (best - share < 1e-9) for goal, share in others.items())


def test_belief_on_a_table_is_the_mean_posterior() -> None:
    workspace: Any = TabletopWorkspace()
    layout = workspace.decode(workspace.sample(1, np.random.default_rng(5))[0])
    row = next(r for r in workspace.explain(layout) if len(r["goals"]) == 4)
    columns = [layout.index(goal) for goal in row["goals"]]
    start = layout.place(row["start"])
    path = layout.paths.polyline(start, row["goal"])
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    optimal = dict(zip(row["goals"], layout.paths.lengths(np.array([start]))[0, columns], strict=True))
    found = []
    for prefix in row["prefixes"]:
        at = [np.interp(prefix["fraction"] * lengths[-1], lengths, path[:, axis]) for axis in (0, 1)]
        remaining = dict(zip(row["goals"], layout.paths.lengths(np.array([at]))[0, columns], strict=True))
        found.append(posterior(remaining, optimal, workspace.observer.beta))
    for goal in row["goals"]:
        assert row["belief"][goal] == pytest.approx(np.mean([each[goal] for each in found]))


def test_losses_are_called_losses_only_where_something_is_lost() -> None:
    def rows(*contributions: float) -> list[dict[str, Any]]:
        return [{"contribution": value} for value in contributions]

    worst, best, title = losses_and_gains(rows(-2, -1, 0.5, 1, 2), 10, 2)
    assert ([r["contribution"] for r in worst], [r["contribution"] for r in best]) == ([-2, -1], [2, 1])
    assert title == "Reaches that lose most"
    worst, best, title = losses_and_gains(rows(0.1, 0.2, 0.3), 2, 3)
    assert ([r["contribution"] for r in worst], [r["contribution"] for r in best]) == ([0.1, 0.2], [0.3])
    assert title.startswith("No reach loses")
    assert losses_and_gains(rows(-3, -2, -1), 2, 2)[:2] == (rows(-3, -2), [])


# -- pages ------------------------------------------------------------------------------------------------------------


class Outline(HTMLParser):
    """Headings in order, pictures, and headed cells of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.headings: list[int] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))


def check_readable(page: Path) -> Outline:
    outline = Outline(page.read_text(encoding="utf-8"))
    assert outline.headings[0] == 1
    assert outline.headings.count(1) == 1
    assert all(after - before <= 1 for before, after in zip(outline.headings, outline.headings[1:], strict=False))
    for tag, attributes in outline.elements:
        if tag == "img":
            assert len(attributes["alt"] or "") > 15
        if tag == "td":
            assert attributes["data-label"], "on a phone every entry says what it is"
        if tag == "th":
            assert attributes.get("scope")
    return outline


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("run"), OvercookedWorkspace(shape=(5, 5)), 30)


def test_a_search_report_shows_doubts_where_the_workspace_has_them(run: Path) -> None:
    data = report_data(load_run(run))
    workspace: Any = load_run(run).workspace
    assert [p["name"] for p in data["panels"]] == ["random", "shortest", "legible"]
    for shown in data["panels"]:
        rows = [shown["layout"][i : i + 5] for i in range(0, 25, 5)]
        wrong = workspace.ambiguity(workspace.encode(type(load_run(run).best_layout).from_rows(rows)))
        doubts = np.array([np.nan if value is None else value / 100 for value in shown["paths"]])
        np.testing.assert_allclose(doubts, wrong.ravel(), atol=0.005)
    assert min(e[4] for e in data["cells"]) == pytest.approx(data["panels"][1]["distance"])
    assert "The darker a floor cell" in data["texts"]["panels"]
    assert re.search(r"price is distance|costs no distance", data["texts"]["panels"])
    assert data["varied"][0] == 0
    assert len(data["varied"]) == len(set(data["varied"])) == 8
    assert all(data["cells"][rank][5] for rank in data["varied"])


def test_a_search_report_can_be_read_by_anyone(run: Path) -> None:
    outline = check_readable(write_report(run))
    ids = {attributes.get("id") for _, attributes in outline.elements}
    assert {"codes", "doubt", "legend", "k-T", "k-S-3", "k-light"} <= ids
    assert "-" not in [attributes.get("data-label") for _, attributes in outline.elements]


def test_an_efficient_search_is_shown_beside_its_most_legible_layout(tmp_path: Path) -> None:
    workspace = OvercookedWorkspace(shape=(5, 5))
    write_run(tmp_path, workspace, 20, objective={"name": "efficiency", "max_distance": None})
    panels = presenter_of("overcooked").panels(load_run(tmp_path))
    assert [p.name for p in panels] == ["random", "legible", "efficient"]
    assert panels[1].score == pytest.approx(workspace.legibility(load_run(tmp_path).elites().solution).max())


def test_a_search_from_a_kitchen_is_shown_beside_it(tmp_path: Path) -> None:
    start = OvercookedWorkspace(shape=(5, 5)).decode(
        OvercookedWorkspace(shape=(5, 5)).sample(1, np.random.default_rng(1))[0]
    )
    write_run(tmp_path, OvercookedWorkspace(shape=(5, 5), start_from=start), 10)
    first = presenter_of("overcooked").panels(load_run(tmp_path))[0]
    assert first.name == "start"
    assert np.array_equal(first.layout.cells, start.cells)


def test_an_experiment_report_can_be_read_by_anyone(tmp_path: Path) -> None:
    from PIL import Image

    chart = '<svg xmlns="http://www.w3.org/2000/svg"><title>Accuracy &amp; more</title><desc>Lines.</desc></svg>'
    (tmp_path / "chart.svg").write_text(chart, encoding="utf-8")
    Image.new("RGB", (4, 2)).save(tmp_path / "layouts.png")
    table = pd.DataFrame({"method": ["a", "b"], "gap": [8.882e-15, 0.0], "eta_squared": [0.5, np.nan]})
    long = pd.DataFrame({"n": range(30)})
    sections = [
        Section(
            "One",
            "Changes by -0.5 (see `a-1`), 2019-2020.",
            {"Gaps": table, "Long": long, "Nothing": table[:0]},
            [tmp_path / "chart.svg", tmp_path / "layouts.png"],
            {"layouts": "Two kitchens, seen from above"},
        )
    ]
    page = write_experiment_report(tmp_path, sections, title="T", lede="L")
    check_readable(page)
    text = page.read_text(encoding="utf-8")
    assert "e-15" not in text
    assert "by \u22120.5 (see <code>a-1</code>), 2019-2020." in text
    assert 'alt="Accuracy &amp; more. Lines"' in text
    assert "<figcaption>Two kitchens, seen from above</figcaption>" in text
    assert "Long (30 rows)" in text
    assert "Nothing" not in text


def luminance(colour: str) -> float:
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: str, b: str) -> float:
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_text_stands_out_from_its_ground(scheme: int) -> None:
    style = (files("benchmarks") / "templates" / "report.css").read_text(encoding="utf-8")
    colours = dict(re.findall(r"--(\w+(?:-\w+)*): (#[0-9a-f]{6});", style.split(":root {")[1 + scheme]))
    for ground in ("page", "panel"):
        for ink in ("ink", "soft", "accent"):
            assert contrast(colours[ink], colours[ground]) >= 4.5, (ink, ground)
        for mark in ("warm", "accent", "third", "fourth"):
            assert contrast(colours[mark], colours[ground]) >= 3, (mark, ground)


def test_templates_escape_what_they_are_given() -> None:
    rows = table_of([("<i>", [{"<b>": "<script>"}])])
    text = page_environment().from_string('{% import "parts.html.j2" as p %}{{ p.table(t, "<u>") }}').render(t=rows)
    assert not re.search("<(b|i|u|script)>", text)
