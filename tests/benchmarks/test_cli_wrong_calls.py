"""Every command called wrongly: one line that says what is wrong, exit code 2, at once, and nothing is written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.support.command_line import legible

KITCHEN = "XTXPXXX\nX     O\nX V   X\nC     X\nX   V F\nX     X\nXXDXSXX\n"
COMMANDS = ("optimize", "report", "score", "show", "play", "sweep", "reproduce", "bench", "demo", "workspaces",
            "emitters", "humans", "humans fetch", "humans stats", "humans evaluate")  # fmt: skip
PREFIXES = ("-1", "2", "nan", "inf", "0.5,", "a,b", "")
LONG = "x" * 300
NOT_UTF_8 = os.fsdecode(b"n\xff.txt")

Call = tuple[tuple[str, ...], str]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files that are not what a command wants, and one kitchen."""
    folder = tmp_path_factory.mktemp("wrong")
    texts = {
        "kitchen.txt": KITCHEN,
        "empty": "",
        "broken.json": "{",
        "deep.json": "[" * 100_000,
        "big.txt": ("X" * 300 + "\n") * 300,
        "walks.csv": "a,b\n1,2\n",
        "sweep.toml": 'workspaces = ["overcooked"]\n',
        "bad.toml": "a = \n",
        "task.yaml": "- 1\n- 2\n",
        "run-without-keys/config.json": "{}",
        "run-of-nonsense/config.json": "nonsense",
        "run-of-a-list/config.json": "[]",
    }
    (folder / "folder").mkdir()
    for name, text in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    (folder / "noise").write_bytes(bytes(range(256)) * 4)
    (folder / "latin.txt").write_bytes(KITCHEN.replace("T", "\xe4").encode("latin-1"))
    (folder / "link").symlink_to("nowhere/at/all")
    return folder


def _about_commands() -> list[Call]:
    unknown = [((*command.split(), "--nonsense"), "--nonsense") for command in COMMANDS]
    misspelt = [((*command.split(), "--hlep"), "--help") for command in COMMANDS]
    return [
        *unknown,
        *misspelt,
        (("nonsense",), "there are"),
        (("scroe",), "did you mean score?"),
        (("humans", "fetsh"), "did you mean fetch?"),
        (("--bogus",), "--bogus"),
        (("bench", "extra"), "extra"),
        (("demo", "extra"), "extra"),
        (("reproduce", "tabeltop"), "tabeltop"),
    ]


def _about_layouts() -> list[Call]:
    sources = {
        "nowhere": "No such file or directory: nowhere",
        "folder": "neither a run nor a layout",
        "empty": "the drawing is empty",
        "noise": "noise",
        "latin.txt": "latin.txt",
        "broken.json": "not valid JSON",
        "deep.json": "nested",
        "big.txt": "300",
        "run-without-keys": "lacks",
        "run-of-nonsense": "not valid JSON",
        "run-of-a-list": "holds a list",
        "link": "No such file or directory: link",
        LONG: "too long",
        "": "the name of the layout is empty",
        NOT_UTF_8: "No such file or directory: n\ufffd.txt",
        "/dev/null": "the drawing is empty",
    }
    return [
        *(((command, source), said) for command in ("score", "show", "play") for source, said in sources.items()),
        *(((command,), "LAYOUT") for command in ("score", "show", "play")),
        *(((command, "kitchen.txt", "more"), "more") for command in ("score", "show", "play")),
        *((("score", "kitchen.txt", "--prefix", text), "prefix") for text in PREFIXES),
        *((("score", "kitchen.txt", "--pots", text), "pots") for text in ("0", "-3", "1.5", "x", "9" * 30)),
        (("play", "kitchen.txt", "--fps", "0"), "--fps"),
        (("play", "kitchen.txt", "--fps", "1000"), "--fps"),
        (("score", "kitchen.txt", "--workspace", "overcoked"), "did you mean 'overcooked'?"),
        (("score", "kitchen.txt", "--workspace", "json:loads"), "not a subclass of Workspace"),
        (("score", "kitchen.txt", "--workspace", "no.such:Thing"), "cannot be imported"),
        (("score", "kitchen.txt", "--workspace", "os:"), "os:"),
        (("score", "kitchen.txt", "--task", "columns"), "--task does not apply"),
        *((("score", "kitchen.txt", "--trajectories", file), file)
          for file in ("nowhere", "folder", "empty", "noise", "walks.csv", "broken.json", "kitchen.txt")),
        (("score", "kitchen.txt", "--predictor", "bayesian"), "--predictor needs --trajectories"),
        (("score", "kitchen.txt", "--trajectories", "walks.csv", "--predictor", "bayesian"), "walks.csv"),
        (("score", "kitchen.txt", "--folds", "1"), "--folds"),
        (("score", "kitchen.txt", "--cut", "cell"), "--cut"),
        (("score", "kitchen.txt", "--seed", "-1"), "--seed"),
        (("report", "nowhere"), "nowhere"),
        (("report", "kitchen.txt"), "kitchen.txt"),
        (("report", "folder"), "config.json"),
        (("report", "run-without-keys"), "lacks"),
    ]  # fmt: skip


def _about_searches() -> list[Call]:
    gaussian = ("--emitter", "ribs.emitters:GaussianEmitter")
    kitchen: dict[tuple[str, ...], str] = {
        ("--shape", "3", "7"): "--shape",
        ("--shape", "7"): "--shape",
        ("--shape", "a", "b"): "--shape",
        ("--shape", "9999999", "5"): "shape",
        ("--prefix", "most"): "most",
        ("--pots", "0"): "--pots",
        ("--emitter", "imrpove"): "did you mean 'improve'?",
        ("--emitter", "json:nobody"): "nobody",
        ("--emitter", ""): "no emitter named ''",
        gaussian: "--emitter-option NAME=VALUE",
        (*gaussian, "--emitter-option", "sigma=a"): "GaussianEmitter",
        (*gaussian, "--emitter-option", "sigma"): "is not NAME=VALUE",
        ("--emitter-option", "=3"): "is not NAME=VALUE",
        ("--emitter-option", "nosuch=3"): "no option nosuch",
        ("--emitter-option", "climbs=0"): "`climbs` must be an integer from 1 to 1000000, got 0",
        ("--emitter-option", "climbs=a"): "got 'a'",
        ("--emitter-option", "climbs=[1, 2]"): "got [1, 2]",
        ("--emitter-option", "climbs=1", "--emitter-option", "climbs=2"): "climbs is given twice",
        ("--evaluations", "0"): "--evaluations",
        ("--evaluations", "1e3"): "--evaluations",
        ("--evaluations", "9" * 40): "evaluations",
        ("--evaluations", "5", "--iterations", "2", "2"): "not both",
        ("--iterations", "0", "0"): "iterations",
        ("--iterations", "9" * 40, "3"): "--iterations",
        ("--seed", "-1"): "--seed",
        ("--seed", "9" * 5000): "…",
        ("--max-distance", "0"): "'0' is not a finite number > 0",
        ("--max-distance", "nan"): "--max-distance",
        ("--start-from", "nowhere"): "nowhere",
        ("--start-from", "folder"): "folder",
        ("--start-from", "noise"): "noise",
        ("--lock", "pot"): "need --start-from",
        ("--start-from", "kitchen.txt", "--lock", "nothing"): "nothing",
        ("--start-from", "kitchen.txt", "--relocation-cost", "-1"): "finite number >= 0",
        ("--set", "nosuch=1"): "nosuch",
        ("--set", "beta=a"): "`beta` must be",
        ("--set", "beta=-1"): "`beta` must be",
        ("--set", "stations=3"): "`stations` must be",
        ("--set", "shape=7"): "`shape` must be",
        ("--set", "recipes=5"): "`recipes` must be",
        ("--set", "task=[1]"): "`task` must be",
        ("--set", "human=drunk"): "`human` must be",
        ("--set", "workspace=tabletop"): "first argument",
        ("--set", "beta=1", "--set", "beta=2"): "beta is given twice",
        ("--set", "beta"): "is not NAME=VALUE",
        ("--resume", "--overwrite"): "either --resume",
        ("--resume", "--out", "."): "has no config.json, and holds other files",
        ("--resume", "--out", "run-without-keys"): "lacks",
        ("--resume", "--out", "run-of-nonsense"): "not valid JSON",
        ("--objective", "legible"): "--objective",
        ("--condition", "both"): "--condition is about a table",
        ("--task", "tea"): "--task is about a table",
    }
    table: dict[tuple[str, ...], str] = {
        ("--shape", "5", "5"): "--shape is about a kitchen",
        ("--lock", "pot"): "--lock is about a kitchen",
        ("--condition", "neither"): "--condition",
        ("--task", "nothing"): "no task 'nothing'",
        ("--task", "no.yaml"): "no.yaml",
        ("--task", "task.yaml"): "must be a mapping",
        ("--set", "obstacle_cost=a"): "`obstacle_cost` must be",
        ("--set", "max_obstacles=-1"): "`max_obstacles` must be",
        ("--start-from", "kitchen.txt"): "expected a table",
    }
    return [
        *((("optimize", "overcooked", *options), said) for options, said in kitchen.items()),
        *((("optimize", "tabletop", *options), said) for options, said in table.items()),
        (("optimize", "overcoked"), "did you mean 'overcooked'?"),
        (("optimize", "json:loads"), "not a subclass of Workspace"),
        (("optimize", ":"), "cannot be imported"),
        (("optimize", ""), "no workspace named ''"),
        (("optimize",), "WORKSPACE"),
    ]


def _about_experiments() -> list[Call]:
    trials = (("sweep", "sweep.toml"), ("reproduce", "optimizers", "--quick"))
    shared: dict[tuple[str, ...], str] = {
        ("--workers", "0"): "--workers",
        ("--workers", "x"): "--workers",
        ("--scheduler", "nonsense"): "its port is missing",
        ("--scheduler", "http://here:1"): "none of its protocols",
        ("--scheduler", "tcp://:8786"): "its host is missing",
        ("--scheduler", "tcp://here:99999"): "out of range",
        ("--scheduler", "tcp://here:one"): "no address of a scheduler",
        ("--scheduler", "tcp://here:1/status"): "goes on after the port",
        ("--scheduler", ""): "no address of a scheduler",
    }
    return [
        *(((*trial, *options), said) for trial in trials for options, said in shared.items()),
        *((("sweep", file), file) for file in ("nowhere", "folder", "noise", "empty", "bad.toml", "kitchen.txt")),
        (("sweep",), "FILE"),
        (("reproduce",), "Missing argument"),
        (("reproduce", "optimizers", "--seeds", "0"), "--seeds"),
        (("demo", "--seed", "x"), "--seed"),
        (("humans", "fetch", "--from", "nowhere"), "nowhere"),
        (("humans", "fetch", "--from", "folder"), "folder"),
        (("humans", "fetch", "--from", "kitchen.txt"), "is not the recorded games"),
        (("humans", "stats"), "no recorded games"),
        (("humans", "stats", "--from", "folder"), "no recorded games"),
        (("humans", "stats", "--from", "kitchen.txt"), "kitchen.txt"),
        (("humans", "evaluate"), "no recorded games"),
        (("humans", "evaluate", "--layout", "nowhere"), "nowhere"),
        (("humans", "evaluate", "--repeats", "0"), "--repeats"),
        (("humans", "evaluate", "--pointing", "folder"), "--pointing"),
    ]


CALLS = [*_about_commands(), *_about_layouts(), *_about_searches(), *_about_experiments()]


def _name(call: object) -> str:
    return " ".join(part[:30] for part in call).encode("ascii", "replace").decode() if isinstance(call, tuple) else ""


@pytest.mark.parametrize(("arguments", "said"), CALLS, ids=_name)
def test_wrong_calls_are_answered_in_a_line(
    arguments: tuple[str, ...], said: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(place)
    monkeypatch.setenv("LEGIBLE_DATA", str(place / "data"))
    before = sorted(place.rglob("*"))
    result = legible(*arguments)
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 2, result.output
    assert result.output.count("Error: ") == 1
    text = result.output[result.output.index("Error: ") :]
    assert said in text
    assert len(text) < 1200
    for internal in ("Traceback", " at 0x", "<class", "PosixPath", "codec can't"):
        assert internal not in text
    assert sorted(place.rglob("*")) == before, "nothing is written"


def test_there_are_calls_of_every_command() -> None:
    assert len(CALLS) > 200
    for command in COMMANDS:
        assert any(" ".join(arguments).startswith(command) for arguments, _ in CALLS)
