"""Trajectories survive CSV whatever their names are, and what is wrong with a CSV is said with its line."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from legible_envs.rollouts import Trajectory, load_trajectories, read_csv, save_trajectories, write_csv
from legible_envs.support.csv_table import CsvSyntaxError, join_values, read_records, split_values
from tests.legible_envs.rollouts.hostile import HARD_NAMES, KITCHEN, MANY, NAMES, TEXTS


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(found=MANY)
def test_trajectories_survive_csv_and_npz(tmp_path_factory: pytest.TempPathFactory, found: list[Trajectory]) -> None:
    folder = tmp_path_factory.mktemp("files")
    path = write_csv(folder / "walks.csv", found)
    assert read_csv(path) == found
    assert load_trajectories(path) == found
    assert load_trajectories(save_trajectories(folder / "walks.npz", found)) == found


@pytest.mark.parametrize("name", HARD_NAMES)
def test_every_hard_name_survives_in_every_place(tmp_path: Path, name: str) -> None:
    found = [
        Trajectory([(0, 0), (0, 1)], start=name, goal=name, candidates=("x", name, name + name), participant=name,
                   condition=name, layout_name=name)
    ]  # fmt: skip
    assert read_csv(write_csv(tmp_path / "a.csv", found)) == found
    assert load_trajectories(save_trajectories(tmp_path / "a.npz", found)) == found


def test_what_no_text_can_hold_is_refused_and_survives_npz(tmp_path: Path) -> None:
    for name in ("a\0b", "\ud800"):
        found = [Trajectory([(0, 0)], candidates=(name,))]
        with pytest.raises(ValueError, match=r"trajectory 0: .* no text file can hold; use `save_trajectories`"):
            write_csv(tmp_path / "a.csv", found)
        assert load_trajectories(save_trajectories(tmp_path / "a.npz", found)) == found
    assert not (tmp_path / "a.csv").exists()


def test_csv_of_other_people_needs_little(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "\ufefftrajectory,row,col,goal,mood\n7,1,1,onion,good\n7,0,1,onion,bad\nz,1,3,tomato,\nz,0,3,tomato,\n"
    )
    first, second = read_csv(path, layout=KITCHEN)
    assert first == Trajectory([(1, 1), (0, 1)], goal="onion", candidates=("onion", "tomato"), layout=KITCHEN)
    assert second.goal == "tomato"
    path.write_text("trajectory,time,x,y,goal,candidates\na,0,.5,1,,left; right\na,.1,.5,1e-1,,left; right\n")
    (reach,) = read_csv(path)
    assert (reach.goal, reach.candidates, reach.times.tolist()) == (None, ("left", "right"), [0.0, 0.1])
    assert not reach.is_grid


REACH = Trajectory([(0.5, 1.0), (0.25, 1.5)], times=[0, 0.1], goal="a b", candidates=("a b", "c"))


@pytest.mark.parametrize(
    "text",
    [
        "Trajectory,TIME,X,Y,Goal,Candidates\n1,0,.5,1,a b,a b;c\n1,.1,.25,1.5,a b,a b;c\n",
        "trajectory;time;x;y;goal;candidates\n1;0;.5;1;a b;\"a b;c\"\n1;.1;.25;1.5;a b;\"a b;c\"\n",
        "trajectory\ttime\tx\ty\tgoal\tcandidates\n1\t0\t.5\t1\ta b\ta b;c\n1\t.1\t.25\t1.5\ta b\ta b;c\n",
        "\n trajectory , time,x,y ,goal,candidates\n\n 1 ,0, .5,1, a b ,  a b ; c \n,,,,,\n"
        "1,.1,.25,1.5,a b,a b ; c,,\n\n",
        '"trajectory","time","x","y","goal","candidates"\r\n"1","0","+.5","1","a b","a b;c"\r\n'
        '"1","0.1","25e-2","1.5","a b","a b;c"',
        "goal,mood,y,x,candidates,trajectory,time,mood\ra b,,1,.5,a b;c,1,0,\ra b,,1.5,.25,a b;c,1,.1,\r",
    ],
    ids=["capitals", "semicolons", "tabs", "blanks", "quotes", "order and carriage returns"],
)  # fmt: skip
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_the_same_table_in_every_form(tmp_path: Path, text: str, encoding: str) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode(encoding))
    assert read_csv(path) == [REACH]


def test_a_value_may_be_as_long_as_real_files_have_them(tmp_path: Path) -> None:
    long = [
        Trajectory([(0, 0), (0, 1)], candidates=tuple(f"goal {i}" for i in range(100_000)), participant="p" * 2**20)
    ]
    before = csv.field_size_limit()
    assert read_csv(write_csv(tmp_path / "long.csv", long)) == long
    assert csv.field_size_limit() == before


BAD = {
    "": "looks like an empty file; expected columns 'trajectory'",
    "trajectory,x,y\na,1,2\n": "line 1: expected columns 'trajectory', 'goal'",
    "trajectory,goal\na,b\n": "line 1: expected the columns row, col",
    "trajectory,y,goal\na,1,b\n": "row, col",
    "row,col,goal\n1,1,b\n": r"expected columns 'trajectory'.*line 1: found \['row', 'col', 'goal'\]",
    "trajectory|x|goal\n1|1|b\n": "with '|' between values, where commas, semicolons or tabs are read",
    "trajectory,x,y,X,goal\na,1,2,3,b\n": "line 1: the column 'x' is there twice, as columns 2 and 4",
    "trajectory,x,x,goal\na,1,2,b\n": "the column 'x' is there twice",
    "trajectory,row,col,goal\na,1,x,b\n": "line 2: 'col' must be a whole number, got 'x'",
    "trajectory,row,col,goal\na,1,1.0,b\n": "line 2: 'col' must be a whole number, got '1.0'",
    "trajectory,row,col,goal\na,1,1_0,b\n": "line 2: 'col' must be a whole number, got '1_0'; digits are not grouped",
    "trajectory,row,col,goal\na,1,99999999999999999999,b\n": "line 2: 'col' must be a whole number",
    "trajectory,row,col,goal\na,1,١,b\n": "line 2: 'col' must be a whole number",
    "trajectory,x,goal\na,1,b\na,,b\n": "line 3: 'x' must be a number, got ''",
    "trajectory,x,goal\na,nan,b\n": "line 2: 'x' must be a number, got 'nan'; numbers must be finite",
    "trajectory,x,goal\na,-inf,b\n": "got '-inf'; numbers must be finite",
    "trajectory,x,goal\na,1_0,b\n": "line 2: 'x' must be a number, got '1_0'; digits are not grouped",
    "trajectory,x,goal\na,0x1,b\n": "line 2: 'x' must be a number, got '0x1'",
    "trajectory,x,goal\na,1e999,b\n": "line 2: 'x' must be a number, got '1e999'",
    "trajectory,x,goal\na,.,b\n": "line 2: 'x' must be a number, got '.'",
    "trajectory;x;goal\na;0,5;b\n": "line 2: 'x' must be a number, got '0,5', with a decimal comma",
    "trajectory,x,goal\na,0,5,b\n": "line 2: the header names 3 columns, this row has 4 .*numbers take a decimal",
    "trajectory,x,goal\na,0,b\na,1\n": "line 3: the header names 3 columns, this row has 2 values, with commas between",
    "trajectory,x,goal\na,1,b\na,2,c\n": "line 3: 'goal' differs from line 2",
    "trajectory,x,goal\na,1,b\nc,1,b\na,2,b\n": "line 4: rows of trajectory 'a' are not together",
    "trajectory,x,goal\na,1,b\n,1,b\n": "line 3: 'trajectory' is empty",
    "trajectory,x,time,goal\na,1,0,b\na,1,,b\n": "line 3: no time",
    "trajectory,x,time,goal\na,1,1,b\na,1,0,b\n": "line 3: times must never decrease; 0.0 follows 1.0",
    "trajectory,x,time,goal\na,1,nan,b\n": "line 2: 'time' must be a number, got 'nan'",
    "trajectory,x,goal,candidates\nq,1,d,c;d\na,1,b,c;d\n": "line 3: trajectory 'a': .*not among the candidates",
    "trajectory,x,goal,candidates\na,1,,c;c\n": "line 2: .*each once",
    "trajectory,x,goal\na,1,\n": "line 2: .*at least one goal",
    "trajectory,x,goal,positions\na,1,b,1;x\n": "line 2: 'positions' must be numbers",
    "trajectory,x,goal,positions\na,1,b,nan\n": "line 2: 'positions' must be numbers",
    "trajectory,x,goal,positions\na,1,b,1;2\n": "line 2: .*one finite position for each of 1",
    "trajectory,x,goal,complete\na,1,b,yes\n": "line 2: 'complete' must be 0 or 1, got 'yes'",
    "trajectory,x,goal,candidate_set\na,1,b,none\n": "line 2: .*candidate_set",
    "trajectory,row,col,goal,layout\na,1,1,b,XX/X\n": "line 2: .*row",
    'trajectory,x,goal\na,1,"b\na,2,b\n': "line 2: a quote is opened here and never closed",
    'trajectory,x,goal\na,1,b "c"\n': "line 2: a quote inside a value",
    # the lines of quoted line breaks and of blank lines count
    'trajectory,x,goal\na,1,"b\n\r\nc"\n\n,,\na,x,"b\n\r\nc"\n': "line 7: 'x' must be a number, got 'x'",
}  # fmt: skip


@pytest.mark.parametrize("text", BAD)
def test_bad_csv_is_refused_with_its_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(text.encode())
    with pytest.raises(ValueError, match=BAD[text].replace("|", r"\|").replace("'.'", r"'\.'")) as caught:
        read_csv(path)
    assert str(caught.value).startswith(str(path))


def test_other_encodings_are_named(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    text = "trajectory,x,goal,participant\na,1,b,Ann\na,1,b,Zoë\n"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=r"line 3: byte 0xeb is not UTF-8.*save as 'CSV UTF-8'.*another encoding"):
        read_csv(path)
    path.write_bytes(text.encode("utf-16-le"))
    with pytest.raises(ValueError, match="zero bytes"):
        read_csv(path)


def test_what_csv_cannot_hold_is_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "w.csv", [Trajectory([(1, 1)], candidates=("a",))])
    before = path.read_bytes()
    cell = Trajectory([(1, 1)], candidates=("a",))
    for bad, message in (
        ([cell, Trajectory([(1.0, 1.0)], candidates=("a",))], "one kind"),
        ([cell.first(0)], "has no states"),
        ([Trajectory([(1.0,) * 4], candidates=("a",))], "1 to 3"),
    ):
        with pytest.raises(ValueError, match=message):
            write_csv(path, bad)
        assert path.read_bytes() == before
    with pytest.raises(FileNotFoundError):
        read_csv(tmp_path / "none.csv")


# -- the table beneath ------------------------------------------------------------------------------------------------


@settings(max_examples=100, deadline=None)
@given(rows=st.lists(st.lists(TEXTS, min_size=2, max_size=4), max_size=5), delimiter=st.sampled_from(",;\t"))
@example(rows=[["a", "b\r"], ["\r\n", ""]], delimiter=",")
def test_records_come_back_and_are_those_of_the_standard_library(rows: list[list[str]], delimiter: str) -> None:
    text = "".join(join_values(row, delimiter) + "\n" for row in rows)
    kept = [row for row in rows if any(row)]
    assert [record.values for record in read_records(text, delimiter)] == kept
    # its reader drops no blanks and knows no lines, but reads the same values
    theirs = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True))
    assert [row for row in theirs if any(row)] == kept
    written = io.StringIO()
    csv.writer(written, delimiter=delimiter).writerows(rows)
    ours = [record.values for record in read_records(written.getvalue(), delimiter)]
    assert ours == [
        row for row in ([v if _needs_quotes(v, delimiter) else v.strip(" \t") for v in r] for r in rows) if any(row)
    ]


def _needs_quotes(value: str, delimiter: str) -> bool:
    return any(mark in value for mark in (delimiter, '"', "\r", "\n"))


@given(values=st.lists(NAMES, min_size=1, max_size=4))
def test_joined_values_are_split_again(values: list[str]) -> None:
    assert split_values(join_values(values, ";"), ";") == values


def test_hostile_quotes_take_linear_time() -> None:
    for text in ('"' * 200_001, 'a,"' + "b" * 200_000, ('"' + " " * 1000) * 201, " " * 100_000 + '"x'):
        with pytest.raises(CsvSyntaxError, match="line 1"):
            list(read_records(text))


@pytest.mark.slow
def test_a_million_values_are_read_in_seconds(tmp_path: Path) -> None:
    long = [Trajectory(np.stack([np.arange(60_000.0)] * 2, axis=1), goal="a", candidates=("a", "b")) for _ in range(2)]
    assert read_csv(write_csv(tmp_path / "long.csv", long)) == long
