"""Kinds of layouts: built-in ones keep their files to the byte, those of other packages travel in the same files."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import LayoutKind, kind_named, kind_of, kind_of_line, register_layout_kind
from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import (
    Trajectory,
    load_trajectories,
    read_csv,
    register_trajectory_format,
    save_trajectories,
    write_csv,
)
from legible_envs.tabletop import Table, TableObject, TabletopLayout, VirtualObstacle

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nD   P\nXXSXX")
TABLE = TabletopLayout([TableObject("Löffel", (0.3, 1 / 3))], [VirtualObstacle((0.4, 0.2), 0.3)], Table(hand=0.03))


@dataclass(frozen=True)
class Shelf:
    boxes: str

    @classmethod
    def from_text(cls, text: str) -> Shelf:
        if not text.startswith("shelf\n"):
            raise LayoutError(f"no shelf: {text!r}", rule="shelf")
        return cls(text.partition("\n")[2])

    def to_text(self) -> str:
        return f"shelf\n{self.boxes}"


pytestmark = pytest.mark.usefixtures("clean_registries")

SHELF = LayoutKind("shelf", Shelf, Shelf.to_text, Shelf.from_text)


def reach(layout: object, **more: object) -> Trajectory:
    return Trajectory([(0.1, 0.1), (0.3, 0.5)], goal="a", candidates=("a", "b"), layout=layout, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("layout", [KITCHEN, TABLE], ids=["kitchen", "table"])
def test_built_in_kinds_read_what_they_write(layout: object) -> None:
    kind = kind_of(layout)
    assert kind_named(kind.name) is kind
    assert kind.from_text(kind.to_text(layout)) == layout
    assert kind.read_line(kind.line(layout)) == layout
    assert "\n" not in kind.line(layout)
    assert kind_of_line(kind.line(layout)) is kind


def test_csv_files_of_kitchens_and_tables_are_those_of_before(tmp_path: Path) -> None:
    found = [
        reach(KITCHEN, participant="p1", layout_name="home"),
        reach(TABLE, goal_positions=((0.3, 0.5), (0.5, 0.5))),
        reach(None),
    ]
    content = write_csv(tmp_path / "w.csv", found).read_bytes()
    assert hashlib.sha256(content).hexdigest() == "680b29c0adcdab51dce1e5400fa12927a2571eef339e7e2f3744afaf1ad772ad"
    save_trajectories(tmp_path / "w.npz", found)
    with np.load(tmp_path / "w.npz") as file:
        assert int(file["schema"]) == 3
        assert (
            hashlib.sha256(file["records"].tobytes()).hexdigest()
            == "14a80414758d8d7e59eaf45466e18eda9698593eaaf8d127ac67f390392f3d24"
        )


def test_layouts_of_another_package_travel_with_their_trajectories(tmp_path: Path) -> None:
    found = [reach(Shelf("a.b")), reach(KITCHEN), reach(Shelf("b.a")), reach(None), reach(TABLE)]
    for save in (save_trajectories, write_csv):
        with pytest.raises(LayoutError, match=r"class Shelf have no kind.*entry point group 'legible\.layouts'"):
            save(tmp_path / "w", found)
    register_layout_kind(SHELF)
    save_trajectories(tmp_path / "w.npz", found)
    write_csv(tmp_path / "w.csv", found)
    assert load_trajectories(tmp_path / "w.npz") == read_csv(tmp_path / "w.csv") == found
    assert load_trajectories(tmp_path / "w.csv") == found
    with np.load(tmp_path / "w.npz") as file:
        assert int(file["schema"]) == 3


def test_a_malformed_layout_of_another_package_is_named(tmp_path: Path) -> None:
    register_layout_kind(SHELF)
    path = tmp_path / "w.csv"
    path.write_text("trajectory,x,goal,layout,layout_kind\na,1,b,cupboard,shelf\n")
    with pytest.raises(ValueError, match=r"w\.csv, line 2: trajectory 'a': no shelf: 'cupboard'"):
        read_csv(path)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (LayoutKind("overcooked", Shelf, Shelf.to_text, Shelf.from_text), "'overcooked' is built in"),
        (LayoutKind("a:b", Shelf, Shelf.to_text, Shelf.from_text), "without ':'"),
        (Shelf("a.b"), "must be a LayoutKind"),
    ],
)
def test_a_bad_registration_is_refused(kind: LayoutKind, message: str) -> None:
    with pytest.raises(LayoutError, match=message) as caught:
        register_layout_kind(kind)
    assert caught.value.rule == "kind"


def test_a_kind_is_replaced_only_when_asked() -> None:
    register_layout_kind(SHELF)
    with pytest.raises(LayoutError, match="'shelf' is taken"):
        register_layout_kind(SHELF)
    register_layout_kind(SHELF, overwrite=True)
    assert kind_named("shelf") is SHELF


def test_other_formats_of_recordings_can_be_read(tmp_path: Path) -> None:
    (tmp_path / "w.log").write_text("log")
    with pytest.raises(ValueError, match="cannot read trajectories"):
        load_trajectories(tmp_path / "w.log")
    register_trajectory_format("log", lambda path: [reach(KITCHEN)] if path.suffix == ".log" else None)
    assert load_trajectories(tmp_path / "w.log") == [reach(KITCHEN)]
    with pytest.raises(ValueError, match="'recorded play' is built in"):
        register_trajectory_format("recorded play", lambda path: None)


def test_file_formats_import_no_environment_before_a_layout_is_there() -> None:
    code = (
        "import sys, legible_envs.rollouts.npz_files, legible_envs.rollouts.csv_files, legible_envs.rollouts.reading\n"
        "environments = ('legible_envs.overcooked', 'legible_envs.tabletop')\n"
        "found = [name for name in sys.modules if name.startswith(environments)]\n"
        "sys.exit(' '.join(found) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
