"""Every text that a person may hand over is read the same, whatever an editor did to it."""

from __future__ import annotations

import io
import sys

import pytest

from benchmarks.presenters.registry import load_design, read_source
from benchmarks.sweeps.sweep import Sweep, SweepError
from legible_envs import LayoutError, TaskError
from legible_envs.overcooked import KitchenFile, soup_task
from legible_envs.tabletop import TabletopLayout, TabletopTask
from legible_envs.tasks import TaskGraph

DRAWING = "XXPXX\nO1 2O\nX   X\nXDXSX\n"
SWEEP = """\
evaluations = 100
seeds = 1

[[workspaces]]
workspace = "overcooked"
shape = [5, 5]

[[emitters]]
emitter = "improve"
"""
TASK = TabletopTask.named("columns")
READERS = {
    "task": (TaskGraph.from_yaml, soup_task().to_yaml(), ".yaml", TaskError),
    "task of a table": (TabletopTask.from_yaml, TASK.to_yaml(), ".yaml", TaskError),
    "table": (TabletopLayout.from_json, TASK.layout.to_json(), ".json", LayoutError),
    "kitchen": (KitchenFile.read, DRAWING, ".txt", LayoutError),
    "source": (lambda path: read_source(str(path))[1].rstrip(), DRAWING, ".layout", LayoutError),
    "sweep": (Sweep.from_toml, SWEEP, ".toml", SweepError),
}
FORMS = {
    "byte-order mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "Windows": lambda text: text.replace("\n", "\r\n").encode(),
    "UTF-16": lambda text: text.encode("utf-16"),
    "no final newline": lambda text: text.rstrip().encode(),
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
@pytest.mark.parametrize("case", READERS.values(), ids=READERS)
def test_marks_line_endings_and_encodings_do_not_matter(case, form, tmp_path):
    read, text, suffix, _ = case
    plain, changed = tmp_path / f"same{suffix}", tmp_path / "of" / f"same{suffix}"
    changed.parent.mkdir()
    plain.write_text(text, encoding="utf-8")
    changed.write_bytes(form(text))
    assert read(changed) == read(plain)


@pytest.mark.parametrize("case", READERS.values(), ids=READERS)
def test_what_is_no_text_is_named_with_its_line(case, tmp_path):
    read, text, suffix, error = case
    path = tmp_path / f"other{suffix}"
    path.write_bytes(b"a: 1\n\xe4" + text.encode())
    with pytest.raises(error, match=f"other{suffix}.*line 2: byte 0xe4 is not UTF-8"):
        read(path)


@pytest.mark.parametrize("case", list(READERS.values())[:3], ids=list(READERS)[:3])
def test_texts_given_as_strings_too(case):
    read, text, *_ = case
    assert read("\ufeff" + text.replace("\n", "\r\n") + "\n") == read(text + "\n")


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_standard_input(form, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(form(DRAWING)), encoding="latin-1"))
    assert load_design("-").layout == KitchenFile.from_text(DRAWING).layout
    monkeypatch.setattr(sys, "stdin", io.StringIO("\ufeff" + DRAWING))
    assert load_design("-").layout == KitchenFile.from_text(DRAWING).layout


def test_a_kitchen_is_scored_with_the_orders_of_its_file(tmp_path):
    path = tmp_path / "room.layout"
    path.write_text(str({"grid": DRAWING, "start_all_orders": [["onion"], ["onion", "onion"]]}))
    design = load_design(str(path))
    facts = dict(design.facts())
    assert facts["task"] == "onion + onion"
    assert facts["left out"].startswith("onion (")
    assert facts["read as"] == "Overcooked-AI layout"
    path.write_text('{"grid": "XXX')
    with pytest.raises(LayoutError, match=r"room\.layout: no layout can be read: line 1, column"):
        load_design(str(path))
