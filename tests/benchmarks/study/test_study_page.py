"""What docs/study.md says about files, tables, columns and settings, against what there is."""

import re
import sqlite3
import tomllib
from pathlib import Path

from benchmarks.study.analysis.export_rows import COLUMNS
from benchmarks.study.design.models import RecruitmentEntry, SittingEntry
from benchmarks.study.design.questionnaires import Item, Questionnaire, item_problems
from benchmarks.study.design.text_names import TEXTS
from benchmarks.study.store.schema import TABLES
from benchmarks.study.timeline import ENDINGS
from legible_envs.support.models import validated

PAGE = (Path(__file__).parents[3] / "docs/study.md").read_text("utf-8")


def rows(name):
    """``[first cell, names of the second cell, third cell]`` of a table between comments; empty cells repeat."""
    table = PAGE.split(f"<!-- {name} -->")[1].split("<!-- end -->")[0]
    found, first = [], ""
    for line in table.strip().split("\n")[2:]:
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]
        first = "".join(re.findall(r"`([^`]+)`", cells[0])) or first
        found.append((first, re.findall(r"`([^`]+)`", cells[1]), cells[2]))
    return found


def dictionary(name):
    found = {}
    for first, columns, _ in rows(name):
        found.setdefault(first, []).extend(columns)
    return found


def test_every_column_of_the_database_is_in_the_dictionary_and_no_other():
    with sqlite3.connect(":memory:") as database:
        database.executescript(TABLES)
        names = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        columns = {name: [row[1] for row in database.execute(f"PRAGMA table_info({name})")] for name in names}
    told = dictionary("database")
    assert told.keys() == columns.keys()
    for name, known in columns.items():
        assert sorted(told[name]) == sorted(known), name


def test_every_column_of_the_export_is_in_the_dictionary():
    always = {"participant", "visit", "screen", "kind", "sitting", "condition", "round", "attempt"}
    told = {name.removesuffix(".csv"): set(columns) for name, columns in dictionary("export").items()}
    assert "kind" in told["events"]  # of the event, not of a screen
    told["events"].remove("kind")
    assert told == {name: set(columns) - always for name, columns in COLUMNS.items()}


def test_states_of_participants_are_named():
    [state] = [
        meaning for table, columns, meaning in rows("database") if table == "participants" and columns == ["state"]
    ]
    assert set(re.findall(r"`(\w+)`", state)) == {"active", *ENDINGS}


def test_every_text_is_named():
    section = PAGE.split("### Texts")[1].split("###")[0]
    assert set(re.findall(r"`(\w+)\.md`", section)) == set(TEXTS)


def blocks():
    return [tomllib.loads(block) for block in re.findall(r"^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)]


def test_what_is_shown_as_settings_can_be_written_so():
    shown = {next(iter(block)): block for block in blocks()}
    assert shown.keys() == {"title", "sittings", "recruitment"}
    asked = validated(Questionnaire, shown["title"])
    assert list(item_problems(asked)) == []
    assert {item.kind for item in asked.items} == {"likert", "choice", "matrix", "attention"}
    assert [validated(SittingEntry, entry).obstacles for entry in shown["sittings"]["sittings"]] == [True, False, True]
    assert validated(RecruitmentEntry, shown["recruitment"]["recruitment"]).codes.keys() <= set(ENDINGS)


def test_kinds_of_items_are_all_named():
    from legible_envs.support.models import problems_of

    [(_, refusal)] = problems_of(Item, {"name": "i", "text": "?", "kind": "nothing"})
    known = set(re.findall(r"'(\w+)'", refusal)) - {"nothing"}
    [line] = [line for line in PAGE.split("\n") if line.startswith('kind = "likert"')]
    assert set(re.findall(r"\w+", line.split("#")[1])) - {"or"} == known


def test_commands_that_are_named_are_those_that_there_are():
    from benchmarks.cli.study import study

    named = set(re.findall(r"legible study ([a-z-]+)", PAGE.replace("legible study\nreplay", "legible study replay")))
    assert set(study.commands) <= named
