"""report.html: whole, small, self-contained, and true to the run it shows."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.presenters.base import Panel
from benchmarks.reports.search_report import MAX_LAYOUTS, write_best_image, write_report
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from optimizers import SearchError, load_run
from tests.support.run_folders import write_full_run, write_run, write_run_of


class Page(HTMLParser):
    """What a page asks a browser to do: its elements, their attributes, and the text of its scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self._inside = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = dict(attrs).get("id") or tag

    def handle_data(self, data: str) -> None:
        self.texts[self._inside] = self.texts.get(self._inside, "") + data

    @property
    def data(self) -> Any:
        return json.loads(self.texts["data"])


@pytest.fixture(scope="module")
def workspace() -> OvercookedWorkspace:
    return OvercookedWorkspace(shape=(7, 7))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, workspace: OvercookedWorkspace) -> Path:
    return write_run(tmp_path_factory.mktemp("run"), workspace, 60)


def page_of(folder: Path, **sections: Any) -> Page:
    return Page(write_report(folder, **sections).read_text(encoding="utf-8"))


def test_it_shows_every_elite_with_its_own_layout_and_scores(run: Path, workspace: OvercookedWorkspace) -> None:
    data, source = page_of(run).data, load_run(run).elites()
    assert len(data["cells"]) == data["archive_size"] == len(source)
    by_cell = {tuple(map(int, m)): g for m, g in zip(source.measures, source.solution, strict=True)}
    for row, column, objective, legibility, distance, drawing in data["cells"]:
        genome = by_cell[row, column]
        lines = [drawing[i : i + 7] for i in range(0, 49, 7)]
        layout = OvercookedLayout.from_rows(lines)
        assert np.array_equal(layout.cells, workspace.decode(genome).cells)
        assert objective == pytest.approx(workspace.legibility(genome), rel=1e-4)
        assert legibility == objective
        assert distance == pytest.approx(workspace.distance(genome), rel=1e-4)
    scores = [cell[2] for cell in data["cells"]]
    assert scores == sorted(scores, reverse=True)


def test_labels_name_the_orders(run: Path, workspace: OvercookedWorkspace) -> None:
    rows, columns = page_of(run).data["axes"]
    assert columns["labels"] == list(workspace.order_names)
    assert rows["labels"] == [str(i) for i in range(rows["count"])]
    assert rows["whole"] == workspace.archive_dims[0]


@pytest.mark.parametrize("shape", [(7, 7), (9, 9), (12, 12)])
def test_a_full_archive_stays_below_300_kilobytes(tmp_path: Path, shape: tuple[int, int]) -> None:
    page = write_report(write_full_run(tmp_path, OvercookedWorkspace(shape=shape)))
    data = Page(page.read_text(encoding="utf-8")).data
    assert page.stat().st_size < 300_000
    rows, columns = data["axes"]
    assert len(data["cells"]) == rows["count"] * columns["count"]
    carried = [cell[5] is not None for cell in data["cells"]]
    assert carried == sorted(carried, reverse=True), "the best cells carry their layouts"
    assert 0 < sum(carried) <= MAX_LAYOUTS


def test_an_archive_over_all_orders_is_drawn_coarser_keeping_the_best(tmp_path: Path) -> None:
    workspace = OvercookedWorkspace(shape=(6, 6), ranked="all")
    page = write_report(write_run(tmp_path, workspace, 1500))
    data, source = Page(page.read_text(encoding="utf-8")).data, load_run(tmp_path).elites()
    step = data["axes"][1]["step"]
    assert step > 1
    assert page.stat().st_size < 300_000
    assert len({(cell[0], cell[1]) for cell in data["cells"]}) == len(data["cells"])
    best: dict[tuple[int, int], float] = {}
    for (row, column), value in zip(source.measures.astype(int), source.objective, strict=True):
        key = (int(row), int(column) // step)
        best[key] = max(best.get(key, -np.inf), value)
    assert {(c[0], c[1]): c[2] for c in data["cells"]} == pytest.approx(best, rel=1e-4)


def test_it_asks_for_nothing_from_anywhere(run: Path) -> None:
    text = write_report(run).read_text(encoding="utf-8")
    page = Page(text)
    assert not re.search(r"https?:|//[a-z]+\.[a-z]", text)
    for tag, attributes in page.elements:
        for name in ("src", "href", "xlink:href", "data", "action", "poster", "srcset"):
            target = attributes.get(name)
            assert target is None or target.startswith(("#", "data:")), (tag, name, target)
    assert "@import" not in text
    assert "url(" not in text
    policy = next(a["content"] for t, a in page.elements if t == "meta" and "http-equiv" in a)
    assert policy is not None
    assert policy.startswith("default-src 'none'")


def test_hostile_text_cannot_leave_its_place(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    evil = "</script><img src=x onerror=alert(1)><!--"
    write_run(tmp_path, workspace, 5, platform=evil)
    layout = load_run(tmp_path).best_layout
    page = page_of(tmp_path, panels=[Panel(evil, layout, 1.0, 2.0, note=evil)], recorded_play={"note": evil})
    assert page.data["panels"][0]["name"] == evil
    assert not [a for t, a in page.elements if t == "img"]


def test_sections_appear_only_with_their_data(run: Path, workspace: OvercookedWorkspace) -> None:
    layout = load_run(run).best_layout
    bare = {a.get("id") for _, a in page_of(run, panels=[]).elements}
    assert "panels" not in bare
    assert "people" not in bare
    people = {
        "note": "12 walks",
        "fractions": [0.1, 0.5],
        "curves": [{"label": "Eq. 1", "values": [0.5, float("nan")]}],
        "table": {"columns": ["kitchen", "walks"], "rows": [["<b>x</b>", 12]]},
    }
    page = page_of(run, panels=[Panel("random", layout, -1.5, 80.0)], recorded_play=people)
    assert {"panels", "people", "curves"} <= {a.get("id") for _, a in page.elements}
    assert page.data["recorded_play"]["curves"][0]["values"] == [0.5, None]
    assert not [t for t, _ in page.elements if t == "b"], "cells are text, not markup"


def test_an_interrupted_run_has_a_page_too(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    write_run(tmp_path, workspace, 20, result=None)
    whole = (tmp_path / "metrics.csv").read_text()
    (tmp_path / "metrics.csv").write_text(whole[: whole.rindex(",")] + "\n7,sea")
    data = page_of(tmp_path).data
    assert (
        data["best"]["score"]
        == data["cells"][0][3]
        == pytest.approx(load_run(tmp_path).elites().objective.max(), rel=1e-4)
    )
    assert len(data["history"]["best"]) == 39, "the rows before the one that was cut off"
    (tmp_path / "metrics.csv").unlink()
    assert page_of(tmp_path).data["history"] == {}


def test_writing_twice_gives_the_same_bytes_and_leaves_no_other_files(run: Path) -> None:
    first, files = write_report(run).read_bytes(), sorted(run.iterdir())
    assert write_report(run).read_bytes() == first
    assert sorted(run.iterdir()) == files


def test_best_image_draws_the_best_layout(run: Path) -> None:
    from PIL import Image

    with Image.open(write_best_image(run, tile=16)) as image:
        assert image.size[0] == 7 * 16
        assert len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)) > 20


def test_an_empty_archive_is_said(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    write_run(tmp_path, workspace, 5, result=None)
    empty = {"solution": np.zeros((0, 32), np.int8), "objective": [], "measures": np.zeros((0, 2)), "index": []}
    np.savez(tmp_path / "archive.npz", **empty)
    with pytest.raises(SearchError, match="empty"):
        write_report(tmp_path)


def test_write_run_of_uses_the_given_cells(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    genomes = workspace.sample(3, np.random.default_rng(3))
    run = load_run(write_run_of(tmp_path, workspace, genomes, np.array([5, 30, 77])))
    assert sorted(run.elites().index) == [5, 30, 77]
