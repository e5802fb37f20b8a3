"""Places to write to: every option that names one is checked before the work, whatever the command."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from benchmarks.cli.app import main
from benchmarks.cli.destinations import DestinationFile, DestinationFileOrFolder, DestinationFolder, check_folder
from tests.support.command_line import legible

KITCHEN = "XTXPXXX\nX     O\nX V   X\nC     X\nX   V F\nX     X\nXXDXSXX\n"


def _commands(group: click.Group, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from _commands(command, (*path, name))
        else:
            yield (*path, name), command


OPTIONS = [(path, parameter) for path, command in _commands(main) for parameter in command.params]
DESTINATIONS = [
    (path, option)
    for path, option in OPTIONS
    if isinstance(option.type, DestinationFile | DestinationFileOrFolder | DestinationFolder)
]


def test_every_path_is_read_and_must_exist_or_is_a_checked_destination() -> None:
    for path, option in OPTIONS:
        if isinstance(option.type, click.Path | click.File):
            assert isinstance(option.type, click.Path), (path, option.name)
            assert option.type.exists, (path, option.name)
        if option.name in ("out", "record", "peers_dir"):
            assert (path, option) in DESTINATIONS, (path, option.name)
    writing = {path for path, _ in DESTINATIONS}
    assert writing == {("optimize",), ("score",), ("show",), ("play",), ("humans", "fetch"), ("humans", "evaluate"),
                       ("sweep",), ("reproduce",), ("demo",), ("bench",),
                       ("study", "new"), ("study", "export"), ("study", "analyse"), ("study", "replay"),
                       ("study", "hand-out"), ("study", "progress"), ("train",), ("datasets", "make")}  # fmt: skip


@pytest.mark.parametrize("there", ["file/inside", "file/deep/inside", "/proc/inside", "/dev/null/inside", "link/inside",
                                   "a" * 300, "", "b" * 230])  # fmt: skip
@pytest.mark.parametrize(
    ("path", "option"), DESTINATIONS, ids=lambda value: " ".join(value) if isinstance(value, tuple) else value.name
)
def test_places_that_cannot_be_written_are_refused_before_the_work(
    path: tuple[str, ...], option: click.Option, there: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if there.startswith("/proc") and not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text(KITCHEN)
    (tmp_path / "sweep.toml").write_text('workspaces = ["overcooked"]\n')
    (tmp_path / "link").symlink_to("nowhere")
    before = sorted(tmp_path.rglob("*"))
    ending = option.type.suffixes[0] if isinstance(option.type, DestinationFile) and there else ""
    needed = {"optimize": ["overcooked"], "sweep": ["sweep.toml"], "reproduce": ["optimizers"],
              "score": ["file"], "show": ["file"], "play": ["file"], "new": ["--domain", "overcooked"],
              "export": ["."], "analyse": ["."], "progress": ["."], "replay": [".", "P001"],
              "hand-out": [".", "P001"]}  # fmt: skip
    named = option.make_metavar(click.Context(main)) if isinstance(option, click.Argument) else option.opts[0]
    place = [there + ending] if isinstance(option, click.Argument) else [named, there + ending]
    result = legible(*path, *needed.get(path[-1], []), *place)
    assert result.exit_code == 2, result.output
    assert f"Invalid value for '{named}'" in result.output
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("show", "k.txt", "--out", "x.pdf"), "x.pdf must be a name that ends in .png"),
        (("show", "k.txt", "--out", "x"), ".png"),
        (("show", "k.txt", "--out", ".png"), ".png"),
        (("show", "k.txt", "--out", "folder"), "folder is a folder; name a file in it"),
        (("show", "k.txt", "--out", "new/"), "new is a folder; name a file in it"),
        (("show", "k.txt", "--out", "folder.png"), "folder.png is a folder"),
        (("play", "k.txt", "--record", "x.csv"), "x.csv must be a name that ends in .npz"),
        (("bench", "--out", "x.html"), "x.html must be a name that ends in .md"),
        (("bench", "--out", "pipe.md"), "pipe.md is no plain file"),
    ],
)
def test_files_of_another_kind_are_refused(
    arguments: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "k.txt").write_text(KITCHEN)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    os.mkfifo(tmp_path / "pipe.md")
    result = legible(*arguments)
    assert result.exit_code == 2, result.output
    assert said in result.output


def test_suffixes_count_in_any_case_and_missing_folders_are_made(tmp_path: Path) -> None:
    (tmp_path / "k.txt").write_text(KITCHEN)
    picture = tmp_path / "new" / "er" / "X.PNG"
    assert legible("show", tmp_path / "k.txt", "--out", picture).exit_code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is read-only for this user")
def test_read_only_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    with pytest.raises(click.UsageError, match="Permission denied"):
        check_folder(tmp_path / "locked" / "new")


def test_a_folder_that_cannot_be_written_is_said_with_the_systems_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a read-only disk, whoever the user is."""

    def refuse(dir: Path) -> None:
        raise OSError(30, "Read-only file system", str(dir))

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    with pytest.raises(click.UsageError, match=r"new cannot be written to: Read-only file system; .* with --out"):
        check_folder(tmp_path / "new", "--out")
    result = legible("demo", "--out", tmp_path / "new")
    assert result.exit_code == 2
    assert "Read-only file system" in result.output


def test_default_folders_are_checked_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").write_text("in the way")
    (tmp_path / "s.toml").write_text('workspaces = [{workspace = "overcooked", shape = [5, 5]}]\n')
    for arguments in (("optimize", "overcooked"), ("sweep", "s.toml"), ("reproduce", "optimizers"), ("demo",)):
        result = legible(*arguments)
        assert result.exit_code == 2, (arguments, result.output)
        assert "runs is a file, where a folder must be" in result.output


def test_the_check_leaves_no_trace(tmp_path: Path) -> None:
    check_folder(tmp_path / "a" / "b")
    check_folder(tmp_path)
    assert list(tmp_path.iterdir()) == []
