"""Checkpoints: a run that is killed at any moment continues to the identical archive, and nothing is lost."""

import contextlib
import errno
import io
import json
import multiprocessing
import os
import pickle
import resource
import signal
import time

import numpy as np
import pytest

from legible_envs.support.files import remove_leftovers, write_atomically
from optimizers import CheckpointError, load_run, search
from optimizers.archives import archive_arrays, read_archive
from optimizers.runs import checkpoint as checkpoints
from optimizers.runs.folder import RunFolder
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
SETTINGS = {
    "evaluations": 700,
    "initial": 60,
    "seed": 11,
    "emitter": ["improve", "random", "ribs.emitters:GaussianEmitter"],
    "emitter_options": [{"climbs": 3, "fanout": 4}, {"batch_size": 5}, {"sigma": 0.6, "batch_size": 12}],
    "checkpoint_every": 0.0,
}
needs_fork = pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork on this system")


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("uninterrupted")
    return folder, search(SHELF, checkpoint=folder, **SETTINGS)


def assert_same_run(folder, uninterrupted):
    """Archive bit for bit, metrics row for row (apart from time), result and manifest."""
    reference, _ = uninterrupted
    ours, theirs = read_archive(folder / "archive.npz"), read_archive(reference / "archive.npz")
    for name in theirs:
        assert ours[name].tobytes() == theirs[name].tobytes(), name
    timing = ["seconds", "evaluations_per_second"]
    rows = [RunFolder(path).read_metrics().drop(columns=timing) for path in (folder, reference)]
    assert rows[0].equals(rows[1])
    assert len(rows[0])
    configs = [json.loads((path / "config.json").read_text()) for path in (folder, reference)]
    for config in configs:
        for name in ("seconds", "evaluation_seconds"):
            config["result"].pop(name)
        for name in ("created", "git_revision", "sha256"):
            config.pop(name)
        config["digests"].pop("metrics")  # of times, too
    assert configs[0] == configs[1]
    assert (folder / "best.txt").read_text() == (reference / "best.txt").read_text()


def in_a_process(target, *arguments):
    process = multiprocessing.get_context("fork").Process(target=target, args=arguments)
    process.start()
    return process


# -- killed ------------------------------------------------------------------------------------------------------------


class Slowly:
    """The usual objective, slow enough that a kill hits the search in the middle."""

    name = "slowly"

    def __call__(self, genomes):
        time.sleep(0.004)
        return SHELF.legibility(genomes)


def run_slowly(folder):
    search(SHELF, objective=Slowly(), checkpoint=folder, resume="auto", **SETTINGS)


@pytest.mark.slow
@needs_fork
@pytest.mark.parametrize("seed", range(3))
def test_killed_at_random_moments_continues_to_the_identical_archive(tmp_path, uninterrupted, seed):
    rng, killed = np.random.default_rng(seed), 0
    for _ in range(6):
        process = in_a_process(run_slowly, tmp_path)
        process.join(rng.uniform(0.01, 0.15))
        if process.exitcode is None:
            os.kill(process.pid, signal.SIGKILL)
        process.join()
        killed += process.exitcode == -signal.SIGKILL
    assert killed >= 2
    search(SHELF, objective=Slowly(), checkpoint=tmp_path, resume="auto", **SETTINGS)
    config = json.loads((tmp_path / "config.json").read_text())
    config["objective"]["name"] = "legibility"
    (tmp_path / "config.json").write_text(json.dumps(config))
    reference = dict(uninterrupted[1].config["archive"])
    assert config["archive"] == {**reference, "score_floor": config["archive"]["score_floor"]}
    config["archive"] = reference
    assert_same_run(tmp_path, uninterrupted)


def run_until(folder, call, count, when):
    """Search in this process, which kills itself before or after the nth use of one system call."""
    original, left = getattr(os, call), [count]

    def fatal(*arguments, **keywords):
        left[0] -= 1
        if left[0] == 0 and when == "before":
            os.kill(os.getpid(), signal.SIGKILL)
        result = original(*arguments, **keywords)
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return result

    setattr(os, call, fatal)
    search(SHELF, checkpoint=folder, **SETTINGS)


@needs_fork
@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 25])
def test_killed_while_writing_continues_to_the_identical_archive(tmp_path, uninterrupted, call, count, when):
    process = in_a_process(run_until, tmp_path, call, count, when)
    process.join()
    assert process.exitcode == -signal.SIGKILL
    folder = RunFolder(tmp_path)
    # Whatever can be seen of a killed run is whole, and whatever is a run can be resumed.
    search(SHELF, checkpoint=tmp_path, resume=True if folder.holds_a_run else "auto", **SETTINGS)
    assert_same_run(tmp_path, uninterrupted)
    assert not [path for path in tmp_path.rglob("*") if ".part-" in path.name]


def test_stopped_and_resumed_many_times_is_the_same(tmp_path, uninterrupted):
    stop = [lambda state: state.iteration % 6 == 5]
    assert search(SHELF, checkpoint=tmp_path, callbacks=stop, **SETTINGS).stopped == "callback"
    for _ in range(50):
        result = search(SHELF, checkpoint=tmp_path, callbacks=stop, resume=True, **SETTINGS)
        if result.stopped != "callback":
            break
    assert result.stopped == "evaluations"
    assert_same_run(tmp_path, uninterrupted)


def test_how_often_it_checkpoints_changes_nothing(tmp_path, uninterrupted):
    search(SHELF, checkpoint=tmp_path, **{**SETTINGS, "checkpoint_every": 1e9})
    assert_same_run(tmp_path, uninterrupted)


def test_resuming_a_finished_run_returns_it(tmp_path, uninterrupted):
    search(SHELF, checkpoint=tmp_path, **SETTINGS)
    again = search(SHELF, checkpoint=tmp_path, resume=True, **SETTINGS)
    assert again.evaluations == uninterrupted[1].evaluations
    assert_same_run(tmp_path, uninterrupted)


def test_a_finished_run_can_go_on_with_more_evaluations(tmp_path):
    settings = {**SETTINGS, "evaluations": 300}
    search(SHELF, checkpoint=tmp_path, **settings)
    grown = search(SHELF, checkpoint=tmp_path, resume=True, **SETTINGS)
    assert grown.config["evaluations"] == SETTINGS["evaluations"]
    straight = archive_arrays(search(SHELF, **SETTINGS).archive)
    for name, values in archive_arrays(grown.archive).items():
        np.testing.assert_array_equal(values, straight[name])


# -- refused -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path):
    """A run that was stopped half-way."""
    settings = {"evaluations": 1500, "emitter_options": {"climbs": 2, "fanout": 8}, "checkpoint_every": 0.0}
    search(SHELF, checkpoint=tmp_path, callbacks=[lambda state: state.iteration == 9], **settings)
    return tmp_path, settings


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": 5}, "seed was 0, now it is 5"),
        ({"initial": 10}, "initial was 1000, now it is 10"),
        ({"evaluations": 1499}, "evaluations was 1500, now it is 1499"),
        ({"emitter_options": {"climbs": 3, "fanout": 8}}, "emitter was "),
        ({"objective": "efficiency"}, "(archive.score_floor|objective.name) was "),
        ({"max_distance": 3.0}, r"objective\.max_distance was None, now it is 3\.0"),
        ({"evaluations": None, "iterations": (10, 10)}, "evaluations was 1500, now it is None"),
    ],
)
def test_other_settings_are_refused_by_name(run, change, message):
    folder, settings = run
    with pytest.raises(CheckpointError, match=message):
        search(SHELF, checkpoint=folder, resume=True, **{**settings, **change})


def test_another_workspace_is_refused(run):
    folder, settings = run
    with pytest.raises(CheckpointError, match=r"(workspace\.scale was 1\.0, now it is 2\.0|archive\.score_floor was)"):
        search(ShelfWorkspace(scale=2.0), checkpoint=folder, resume=True, **settings)


@pytest.mark.parametrize("there", ["nothing", "empty folder"])
def test_nothing_to_resume_says_what_to_do(tmp_path, there):
    folder = tmp_path / "run"
    if there == "empty folder":
        folder.mkdir()
    with pytest.raises(CheckpointError, match=r"nothing to resume.*without resume.*resume='auto'"):
        search(SHELF, checkpoint=folder, resume=True)
    assert search(SHELF, checkpoint=folder, resume="auto", evaluations=1500).stopped == "evaluations"


def newest(folder):
    return sorted((folder / "checkpoint").glob("*.checkpoint"))


def damage(path, how):
    content = path.read_bytes()
    path.write_bytes(
        {
            "cut": content[:-100],
            "emptied": b"",
            "flipped": content[:-50] + bytes([content[-50] ^ 1]) + content[-49:],
            "other": b"PK\x03\x04 not ours",
            "header": content.replace(b'"iteration"', b'"iteratiom"'),
        }[how]
    )


@pytest.mark.parametrize("how", ["cut", "emptied", "flipped", "other", "header"])
def test_a_damaged_checkpoint_falls_back_to_the_one_before(run, how):
    folder, settings = run
    assert len(newest(folder)) == 2
    damage(newest(folder)[-1], how)
    with pytest.warns(UserWarning, match="damaged checkpoint passed over"):
        result = search(SHELF, checkpoint=folder, resume=True, **settings)
    straight = archive_arrays(search(SHELF, **settings).archive)
    for name, values in archive_arrays(result.archive).items():
        np.testing.assert_array_equal(values, straight[name])


def test_only_damaged_checkpoints_say_what_to_do_and_leave_the_archive(run):
    folder, settings = run
    for path in newest(folder):
        damage(path, "cut")
    with pytest.raises(CheckpointError, match=r"no checkpoint .* can be read .*archive\.npz.*overwrite=True"):
        search(SHELF, checkpoint=folder, resume=True, **settings)
    assert len(load_run(folder).archive) > 0


def test_a_damaged_checkpoint_is_never_unpickled(run, monkeypatch):
    folder, settings = run
    for path in newest(folder):
        damage(path, "flipped")
    monkeypatch.setattr(pickle, "Unpickler", None)
    with pytest.raises(CheckpointError, match="no checkpoint"):
        search(SHELF, checkpoint=folder, resume=True, **settings)


def test_another_version_is_refused_with_the_version_to_install(run, monkeypatch):
    folder, settings = run
    versions = {"python": "3.11", "numpy": "2.4", "ribs": "0.13.0", "legible-envs": "0.1.0"}
    header = json.loads(newest(folder)[-1].read_bytes().split(b"\n")[1])
    monkeypatch.setattr("optimizers.search_run.pickle_versions", lambda: {**header["versions"], "ribs": "99.0"})
    with pytest.raises(CheckpointError, match=r"written with ribs 0\.12.*this is ribs 99\.0.*install ribs==0\.12"):
        search(SHELF, checkpoint=folder, resume=True, **settings)
    assert versions.keys() == header["versions"].keys()


def test_another_checkpoint_format_is_refused(run, monkeypatch):
    folder, settings = run
    monkeypatch.setattr(checkpoints, "SCHEMA", 3)
    with pytest.raises(CheckpointError, match=r"has checkpoint format 2, this version reads 3.*0\.1\.0"):
        search(SHELF, checkpoint=folder, resume=True, **settings)


def test_checkpoints_hold_neither_workspace_nor_objective(run):
    folder, _ = run
    content = newest(folder)[-1].read_bytes()
    assert b"shelf_workspace" not in content.split(b"\n", 2)[2]


class Unpicklable:
    """An emitter that cannot be checkpointed."""

    solution_dim = SHELF.genome_size

    def __init__(self, archive, workspace, seed):
        self.workspace, self.rng, self.rule = workspace, np.random.default_rng(seed), lambda: None

    def ask(self):
        return self.workspace.sample(10, self.rng)

    def tell(self, *arguments):
        pass


def test_an_emitter_that_does_not_pickle_is_told_before_the_search(tmp_path):
    with pytest.raises(CheckpointError, match=r"does not pickle.*or search without checkpoint="):
        search(SHELF, emitter=Unpicklable, checkpoint=tmp_path)
    assert search(SHELF, emitter=Unpicklable, evaluations=1100).evaluations == 1100


# -- full disk ---------------------------------------------------------------------------------------------------------


def disk_full(*arguments, **keywords):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_keeps_the_checkpoint_before_and_brings_the_result(tmp_path, uninterrupted, monkeypatch):
    def fill(state):
        if state.iteration == 12:
            monkeypatch.setattr(os, "fsync", disk_full)

    with pytest.raises(CheckpointError, match=r"No space left.*intact.*resume=True.*partial") as caught:
        search(SHELF, checkpoint=tmp_path, callbacks=[fill], **SETTINGS)
    monkeypatch.undo()
    partial = caught.value.partial
    assert partial.iterations == 12
    assert len(partial.archive) > 0
    assert len(newest(tmp_path)) == 2
    assert not [path for path in tmp_path.rglob("*") if ".part-" in path.name]
    search(SHELF, checkpoint=tmp_path, resume=True, **SETTINGS)
    assert_same_run(tmp_path, uninterrupted)


def run_with_little_room(folder, outcome):
    """Search in this process, whose files may not grow beyond a few kB: writes fail as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    def fill(state):
        if state.iteration == 6:
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    try:
        search(SHELF, checkpoint=folder, callbacks=[fill], **SETTINGS)
    except CheckpointError as error:
        outcome.send((str(error), error.partial.iterations, len(error.partial.archive)))


@needs_fork
def test_writes_that_really_fail_leave_a_run_that_goes_on(tmp_path, uninterrupted):
    receive, send = multiprocessing.Pipe(duplex=False)
    process = in_a_process(run_with_little_room, tmp_path, send)
    assert receive.poll(60)
    message, iterations, elites = receive.recv()
    process.join()
    assert "File too large" in message
    assert (iterations, process.exitcode) == (6, 0)
    assert elites > 0
    search(SHELF, checkpoint=tmp_path, resume=True, **SETTINGS)
    assert_same_run(tmp_path, uninterrupted)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match="file"):
        search(SHELF, checkpoint=tmp_path / "file" / "run")


# -- the pieces --------------------------------------------------------------------------------------------------------


def test_a_write_that_fails_leaves_the_file_as_it_was(tmp_path):
    path = tmp_path / "a.txt"
    write_atomically(path, lambda stream: stream.write(b"old"))

    def half(stream: io.BufferedWriter):
        stream.write(b"new, but ")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        write_atomically(path, half)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_leftovers_of_killed_processes_are_removed_and_nothing_else(tmp_path):
    for name in (".a.checkpoint.part-123", "a.checkpoint", ".hidden"):
        (tmp_path / name).write_text("x")
    remove_leftovers(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"a.checkpoint", ".hidden"}


def test_an_unreadable_checkpoint_folder_is_an_error_not_a_fresh_start(run):
    folder, settings = run
    for path in newest(folder):
        path.unlink()
    for resume in (True, "auto"):
        with pytest.raises(CheckpointError, match="nothing to resume"):
            search(SHELF, checkpoint=folder, resume=resume, **settings)
    with contextlib.suppress(CheckpointError):
        search(SHELF, checkpoint=folder, resume="auto", **settings)
    assert len(load_run(folder).archive) > 0
