"""Names that strangers chose, at every exit: terminals, tables for spreadsheets, pages, pictures, names of files."""

from __future__ import annotations

import csv
import io
import itertools
import json
import random
import re
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from xml.dom import minidom
from xml.sax.saxutils import escape

import numpy as np
import pandas as pd
import pytest

from benchmarks.console import say, table
from benchmarks.csv_tables import as_written, csv_of
from benchmarks.presenters.tabletop_panels import LIST
from benchmarks.reports.experiment_report import Section, write_experiment_report
from benchmarks.sweeps import Sweep, SweepError
from benchmarks.trials.progress import describe
from legible_envs.drawing.canvas import text_sprite
from legible_envs.drawing.charts import Chart, save_figure, styled
from legible_envs.drawing.sheets import banner
from legible_envs.errors import LayoutError, TaskError
from legible_envs.rollouts import Trajectory, read_csv, write_csv
from legible_envs.support.csv_table import spreadsheet_text, text_of_spreadsheet
from legible_envs.support.names import check_file_name, file_name, printable
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask
from legible_envs.tasks import Subtask, TaskGraph
from predictors.evaluation.omissions import markdown_row
from tests.support.command_line import legible

HOSTILE = (
    # markup, and what steers or confuses a terminal
    "[/foo]", "[bold red]x[/]", "[link=http://evil.example]x[/link]", ":smile:", "\x1b[2J", "\x1b]0;owned\x07",
    "\x9b31m", "a\rb", "a\nb", "a\tb", "\x00", "\x7f", "\u202egnp.exe", "\u2066x\u2069", "\u200fx", "a\u200bb",
    "a\ufeffb", "a\u2028b", "a\x85b", "\ufffe",
    # formulas, also hidden ones
    "=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "\t=1", "'=1", "＝1", " =1",
    # HTML, SVG, scripts, templates, mathtext, Markdown
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "&amp;", "]]>", "</title>", "</script>", "<!--",
    "$x", "$\\frac{", "${x}", "{{7*7}}", "a|b](http://x)",
    # paths, devices, words with a meaning, length
    "../../etc/passwd", "con", "NA", "%s %n", "é" * 150,
)  # fmt: skip
ORDINARY = (
    "onion",
    "red-circle",
    "Kaffee kochen",
    "кружка",
    "杯子",
    "نمی\u200cخواهم",
    "👩\u200d🍳",
    "naïve café",
    "50 %",
    "a.b_c-d",
)
DANGEROUS = tuple("=+-@\t\r\n＝＋－＠")
TASK_NAME = "\x1b[31m[/task]\u202e =1"


# -- what the exits must look like -------------------------------------------------------------------------------------


def assert_plain(text: str) -> None:
    """Nothing in a text steers a terminal or hides."""
    assert printable(text, lines=True) == text


def assert_no_formula(path: Path) -> None:
    """No cell of a CSV is what a spreadsheet would run."""
    for row in csv.reader(io.StringIO(path.read_text(encoding="utf-8"), newline="")):
        for cell in row:
            is_number = re.fullmatch(r"[+-]?(\d+\.?\d*(e[+-]?\d+)?|inf)", cell)
            assert is_number or not cell.lstrip(" ").startswith(DANGEROUS), (path, cell)


class Elements(HTMLParser):
    """The elements and attributes of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, dict]] = []

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.found.append((tag, dict(attrs)))


def assert_no_injection(page: Path, scripts: int) -> None:
    """A page has its own scripts, no handler of events, and no picture from elsewhere."""
    elements = Elements()
    elements.feed(text := page.read_text(encoding="utf-8"))
    elements.close()
    assert_plain(re.sub(r"<script.*?</script>", "", text, flags=re.S))
    assert sum(tag == "script" for tag, _ in elements.found) == scripts
    assert not [name for _, attributes in elements.found for name in attributes if name.startswith("on")]
    assert all(a["src"].startswith("data:image/") for tag, a in elements.found if tag == "img")
    assert sum(tag == "title" for tag, _ in elements.found if tag == "title") == 1


def assert_is_svg(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert_plain(text)
    root = minidom.parseString(text).documentElement
    assert not root.getElementsByTagName("script")
    assert not root.getElementsByTagName("img")


# -- the rules ---------------------------------------------------------------------------------------------------------


def test_what_is_not_seen_is_written_out_and_ordinary_names_stay(repeats) -> None:
    rng = random.Random(0)
    drawn = ["".join(chr(rng.choice([rng.randrange(0x250), rng.randrange(0x110000)])) for _ in range(8))
             for _ in range(repeats(500, 100_000))]  # fmt: skip
    for name in (*HOSTILE, *drawn):
        seen = printable(name)
        assert printable(seen) == seen
        assert "\n" not in seen
        assert not any(ord(c) < 32 or 0x7F <= ord(c) < 0xA0 or 0x202A <= ord(c) <= 0x202E for c in seen)
        assert minidom.parseString(f"<a>{escape(seen)}</a>".encode())
        file = file_name(name)
        assert file_name(file) == file == Path(file).name
        assert not set(file) & set('/\\:*?"<>|')
        assert 0 < len(file.encode()) <= 200
        assert file[0] != "."
        assert file[-1] not in ". "
        assert text_of_spreadsheet(spreadsheet_text(name)) == name
        assert not spreadsheet_text(name).lstrip(" ").startswith(("=", "@", "\t", "\r"))
    for name in ORDINARY:
        assert printable(name) == file_name(name) == spreadsheet_text(name) == check_file_name("name", name) == name


def test_every_text_survives_the_cells_of_spreadsheets(repeats) -> None:
    rng = random.Random(1)
    texts = ["".join(rng.choice("'=+-@ \t\r\n1.e＝a;\",") for _ in range(rng.randrange(6)))
             for _ in range(repeats(5_000, 500_000))]  # fmt: skip
    written = pd.DataFrame({"=1": [*HOSTILE, *texts], "n": -1.5})
    read = pd.read_csv(io.StringIO(csv_of(written), newline=""), keep_default_na=False)
    again = as_written(read)
    assert again["=1"].tolist() == written["=1"].tolist()
    assert again["n"].tolist() == written["n"].tolist()
    assert list(again.columns) == ["=1", "n"]


NO_FILES = (
    "../..",
    "a/b",
    "..",
    ".",
    "",
    " ",
    "a\\b",
    "c:d",
    "x\ny",
    "x\0",
    "con",
    "NUL.txt",
    "x.",
    ".x",
    "x" * 201,
    3,
)


def test_a_sweep_is_named_like_a_file(tmp_path) -> None:
    for name in NO_FILES:
        with pytest.raises(SweepError, match="`name` must be the name of a file on every system"):
            Sweep.from_dict({"name": name, "workspaces": ["overcooked"]})
    (file := tmp_path / "con.toml").write_text('workspaces = ["overcooked"]\n')
    assert Sweep.from_toml(file).name == "_con"


def test_halves_of_characters_are_refused_at_the_door() -> None:
    half = "cup\ud83c"
    for refused in (
        lambda: TableObject(half, (0.2, 0.3)),
        lambda: TableObject("cup", (0.2, 0.3), colour=half),
        lambda: TabletopLayout.from_json('{"schema": 1, "objects": [{"name": "\\ud83c", "at": [0.2, 0.3]}]}\n'),
        lambda: Subtask(half, ("cup",)),
        lambda: Subtask("cup", (half,)),
        lambda: TaskGraph([Subtask("cup", ("cup",))], half),
    ):
        with pytest.raises((LayoutError, TaskError), match=r"surrogate|whole|names|place"):
            refused()


# -- tables, whose objects have names ----------------------------------------------------------------------------------


def task_of(names: Sequence[str]) -> TabletopTask:
    """A task with objects of these names, two of which may be reached for at any time."""
    objects = [
        TableObject(name, (0.15 + 0.13 * (i % 5), 0.25 + 0.15 * (i // 5)), ["red", "blue"][i % 2], name)
        for i, name in enumerate(names)
    ]
    steps = [Subtask(name, (name,), (names[i - 2],) if i > 1 else (), ("assembly",)) for i, name in enumerate(names)]
    return TabletopTask(TASK_NAME, TabletopLayout(objects), TaskGraph(steps, "home"))


GROUPS = tuple(HOSTILE[i::4] for i in range(4))


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A function that writes a task and its table."""
    monkeypatch.chdir(tmp_path)

    def write(names: Sequence[str]) -> TabletopTask:
        task = task_of(names)
        task.to_yaml("task.yaml")
        task.layout.to_json("table.json")
        assert TabletopTask.from_yaml("task.yaml") == task
        return task

    return write


def test_tables_are_shown_and_scored(files) -> None:
    for names in GROUPS:
        files(names)
        for command in ("show", "score"):
            result = legible(command, "table.json", "--task", "task.yaml")
            assert result.exit_code == 0, result.output
            assert_plain(result.output)
            assert printable(TASK_NAME) in result.output
            found = [name for name in names if printable(name) in result.output]
            assert len(found) >= (4 if command == "show" else 0)


def test_tables_are_searched_reported_and_drawn(files, tmp_path, repeats) -> None:
    for names in GROUPS[: repeats(1, 4)]:
        task = files(names)
        run = legible("optimize", "tabletop", "--task", "task.yaml", "--condition", "placement", "--out", "run",
                      "--evaluations", 30, "--emitter", "random", "--quiet", "--overwrite")  # fmt: skip
        assert run.exit_code == 0, run.output
        assert_plain(run.output)
        assert_no_injection(tmp_path / "run" / "report.html", scripts=2)
        for path in (tmp_path / "run").glob("*.csv"):
            assert_no_formula(path)
        assert TabletopLayout.from_json(tmp_path / "run" / "best.json").goals == task.layout.goals
        assert (tmp_path / "run" / "boards.png").read_bytes().startswith(b"\x89PNG")
        assert {path.name for path in tmp_path.iterdir()} == {"task.yaml", "table.json", "run"}


# -- trajectories, whose people, goals and conditions have names -------------------------------------------------------


def reaches_of(names: Sequence[str]) -> list[Trajectory]:
    """Straight reaches to goals of these names, twice each, of people and under conditions of such names."""
    places = {name: (0.1 * (i + 1), 0.5) for i, name in enumerate(names)}
    found = []
    for i, (copy, name) in enumerate(itertools.product(range(4), names)):
        path = np.linspace((0.3, 0.0), places[name], 12) + 0.01 * copy
        found.append(
            Trajectory(
                path,
                times=np.linspace(0, 1, 12),
                goal=name,
                candidates=tuple(names),
                goal_positions=tuple(places.values()),
                participant=HOSTILE[(i + copy) % len(HOSTILE)],
                condition=names[copy % 2],
                start="home",
                layout_name=name,
            )
        )
    return found


def test_trajectories_keep_their_names_in_csv_that_no_spreadsheet_runs(tmp_path) -> None:
    names = [name for name in HOSTILE if "\0" not in name]
    for i in range(0, len(names), 5):
        reaches = reaches_of(names[i : i + 5])
        reaches = [each for each in reaches if "\0" not in each.participant]
        path = write_csv(tmp_path / "reaches.csv", reaches)
        assert_no_formula(path)
        assert read_csv(path) == reaches


@pytest.mark.parametrize("names", [HOSTILE[4:36:8], HOSTILE[:40:7]], ids=["first", "second"])
def test_predictors_are_evaluated_reported_and_drawn(names, tmp_path) -> None:
    from benchmarks.reports.prediction_report import evaluate_trajectories, print_evaluation, write_evaluation

    results = evaluate_trajectories(reaches_of(names), ["reach-knn", "reach-bayesian"], folds=2, repeats=1, curve=False)
    console = say()
    console.file = stream = io.StringIO()
    print_evaluation(console, results)
    assert_plain(stream.getvalue())
    written = write_evaluation(results, tmp_path, title=f"people of {names[0]}")
    assert {path.suffix for path in written} == {".csv", ".svg", ".json", ".html"}
    for path in written:
        if path.suffix == ".csv":
            assert_no_formula(path)
        elif path.suffix == ".svg":
            assert_is_svg(path)
    assert_no_injection(tmp_path / "report.html", scripts=0)
    assert_plain(results.evaluation.to_markdown())


# -- charts, pictures, pages, consoles ---------------------------------------------------------------------------------


def test_charts_and_pictures_take_every_name(tmp_path) -> None:
    with styled():
        chart = Chart("\x1b[2J $x", HOSTILE[13], HOSTILE[28], description=" ".join(HOSTILE), height=6.0)
        axes = chart.subplots()
        axes.set_xticks(range(5), HOSTILE[4:9])
        axes.set_yticks(range(len(HOSTILE)), [name[:30] for name in HOSTILE])
        axes.set_ylabel("\x00")
        axes.annotate("\ufffe", (0, 0))
        marks = axes.scatter(range(len(HOSTILE)), range(len(HOSTILE)))
        chart.tip(marks, HOSTILE)
    assert_is_svg(save_figure(tmp_path / "chart.svg", chart))
    assert_is_svg(save_figure(tmp_path / "chart.svg", chart))  # twice the same
    for kind in ("png", "pdf"):
        assert save_figure(tmp_path / f"chart.{kind}", chart).stat().st_size > 1_000
    for name in HOSTILE:
        assert text_sprite(name, 12, "#000000").colour.shape[0] > 0
    for name in ("\x00", "\u202e\x1b[2J" * 9):
        assert banner(np.zeros((20, 90, 3), np.uint8), name, 20).shape[1] == 90


def test_pages_of_experiments_and_tables_of_the_terminal(tmp_path, capsys) -> None:
    rows = [{"name": name, "=1": 1.5} for name in HOSTILE]
    sections = [Section(name, f"`{name}` and {name}", {name: pd.DataFrame(rows)}) for name in HOSTILE[:40:3]]
    write_experiment_report(tmp_path, sections, title="</title>\x1b[2J", lede="<script>", eyebrow="\u202e")
    assert_no_injection(tmp_path / "report.html", scripts=0)
    console = say()
    console.print(table([{name: name, "n": 1.0} for name in HOSTILE[:1]]))
    console.print(table(rows))
    for name in HOSTILE:
        console.print(name, style="dim")
        with console.status(f"measuring {name}"):
            pass
        assert_plain(describe({"label": name, "settings": {"a": [name]}}))
        assert markdown_row([name]).count(" |") == 1 + name.count(" |")
    printed = capsys.readouterr()
    assert_plain(printed.out + printed.err)
    assert "[/foo]" in printed.out
    assert ":smile:" in printed.out


# -- what is said of wrong arguments, and where files are written ------------------------------------------------------


def test_errors_quote_names_without_obeying_them(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = itertools.cycle(
        (
            ("show", "{}"),
            ("optimize", "{}"),
            ("{}",),
            ("optimize", "overcooked", "--emitter", "{}"),
            ("optimize", "overcooked", "--set", "{}=1"),
            ("optimize", "tabletop", "--task", "{}"),
            ("sweep", "{}"),
        )
    )
    for name in HOSTILE * 2:
        arguments = [part.replace("{}", name) for part in next(commands)]
        if "\0" not in name:
            result = legible(*arguments)
            assert result.exit_code == 2, (arguments, result.output)
            assert_plain(result.output)
    assert not list(tmp_path.iterdir())


def test_folders_are_written_inside_the_folder_that_was_named(tmp_path, files, monkeypatch) -> None:
    from benchmarks.cli.optimize import default_folder

    for name in HOSTILE:
        settings = {"start_from": f"x/{name}", "seed": 0, "task": name, "condition": "all", "objective": "legibility"}
        for chosen in (settings, settings | {"start_from": None}):
            folder = default_folder("tabletop", chosen)
            assert folder.parent == Path("runs")
            assert file_name(folder.name) == folder.name
    # a stranger's list of conditions names no folder elsewhere
    files(ORDINARY[:2])
    run = ("optimize", "tabletop", "--task", "task.yaml", "--evaluations", 20, "--emitter", "random", "--quiet")
    assert legible(*run, "--condition", "placement", "--out", "inside/run").exit_code == 0
    for name in ("../../elsewhere", "/elsewhere", "..", "a/b", "a\\b"):
        Path("inside/run", LIST).write_text(json.dumps({"placement": ".", "both": name}))
        result = legible(*run[:2], "--resume", "--evaluations", 40, "--quiet", "--out", "inside/run")
        assert result.exit_code == 2, result.output
        assert "must be '.' or" in result.output
    assert {path.name for path in tmp_path.iterdir()} == {"task.yaml", "table.json", "inside"}
