"""Clusters whose scheduler or workers are lost, that have no workers, or workers with other code."""

from __future__ import annotations

import re
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.trials import Event, TrialsStopped, run_trials
from optimizers import ClusterError, SearchResult, search
from optimizers.searching import SearchState
from tests.reliability.worker_functions import draw
from tests.support.clusters import LocalCluster, copy_of_the_packages, without_the_packages
from tests.support.repeats import Repeats
from tests.support.shelf_workspace import ShelfWorkspace

Client = pytest.importorskip("distributed").Client

pytestmark = pytest.mark.slow

WORKSPACE = ShelfWorkspace()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[LocalCluster]:
    """A scheduler without workers."""
    folder = tmp_path / "cluster"
    folder.mkdir()
    with LocalCluster(folder) as found:
        yield found


def test_nobody_is_waited_for_longer_than_said(cluster: LocalCluster, tmp_path: Path) -> None:
    search(WORKSPACE, evaluations=100)  # what is loaded once is not waited for
    began = time.monotonic()
    with (
        pytest.warns(UserWarning, match=r"has no workers; waiting up to .* s for one: `dask worker tcp://"),
        pytest.raises(ClusterError, match=r"no worker joined the scheduler at tcp://.* before the time limit; start"),
    ):
        search(WORKSPACE, evaluations=1000, scheduler=cluster.address, time_limit=1)
    with pytest.warns(UserWarning, match="no workers"), pytest.raises(ClusterError, match=r"within 0.2 s; start some"):
        search(WORKSPACE, evaluations=1000, scheduler=cluster.address, worker_timeout=0.2)
    with pytest.warns(UserWarning, match="no workers"), pytest.raises(TrialsStopped, match=r"within 0.2 s; .*0 of 1 t"):
        run_trials(draw, [{"seed": 1}], tmp_path / "run", scheduler=cluster.address, worker_timeout=0.2)
    assert time.monotonic() - began < 10


def test_workers_with_other_code_are_named_and_not_used(cluster: LocalCluster, tmp_path: Path) -> None:
    """Also one that joins later; where no other is left, that is said."""
    seen = tmp_path / "seen"
    trials = [{"seed": 0}, {"seed": 1, "until": str(seen)}, {"seed": 2}]
    used: set[str] = set()

    def watch(event: Event) -> None:
        used.update(event.running)
        if event.done == 1 and len(cluster.workers) == 1:
            cluster.add_worker(copy_of_the_packages(tmp_path / "other"))
        if any(refusal.search(str(warning.message)) for warning in record):
            seen.touch()

    refusal = re.compile(
        r"the worker tcp://\S+ is not used: its files of legible_envs are others \(digest \w+, ours \w+\)"
    )
    cluster.add_worker()
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        table = run_trials(draw, trials, tmp_path / "run", scheduler=cluster.address, progress=watch)
    assert seen.exists()
    assert len(used) == 1
    assert table["value"].tolist() == [draw({"seed": seed})["value"] for seed in range(3)]
    cluster.workers[0].kill()
    lacking = cluster.add_worker(without_the_packages(tmp_path / "lacking"))
    with Client(cluster.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    with (
        pytest.warns(UserWarning, match=r"is not used: it cannot say which code it runs \(ModuleNotFoundError: "),
        pytest.warns(UserWarning, match="is not used: its files of legible_envs are others"),
        pytest.raises(ClusterError, match=r"no worker of the scheduler at \S+ can be used within 4 s: .* files of leg"),
    ):
        search(WORKSPACE, evaluations=1000, scheduler=cluster.address, worker_timeout=4)
    assert lacking.poll() is None, "it serves others"


def test_a_lost_scheduler_costs_only_what_was_under_way(tmp_path: Path, repeats: Repeats) -> None:
    trials = [{"seed": seed, "seconds": 0.1} for seed in range(12)]
    alone = run_trials(draw, trials, tmp_path / "alone", workers=1)
    for attempt in range(repeats(1, 20)):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        with LocalCluster(folder) as cluster:
            cluster.add_worker()

            def lose(event: Event, cluster: LocalCluster = cluster, enough: int = 1 + attempt % 11) -> None:
                if event.done >= enough:
                    cluster.scheduler.kill()

            began = time.monotonic()
            with pytest.raises(TrialsStopped, match=r"the scheduler at \S+ was lost: .* kept in .*: \d+ of 12 trials"):
                run_trials(draw, trials, folder / "run", scheduler=cluster.address, progress=lose)
            assert time.monotonic() - began < 60
        kept = {path: path.stat().st_mtime_ns for path in (folder / "run" / "cells").iterdir()}
        assert len(kept) >= 1 + attempt % 11
        pd.testing.assert_frame_equal(alone, run_trials(draw, trials, folder / "run", workers=1))
        assert kept.items() <= {path: path.stat().st_mtime_ns for path in (folder / "run" / "cells").iterdir()}.items()


def test_a_search_outlives_its_workers_but_not_its_scheduler(cluster: LocalCluster, tmp_path: Path) -> None:
    def same(result: SearchResult) -> None:
        for field in ("solution", "objective", "index"):
            np.testing.assert_array_equal(alone.archive.data(field), result.archive.data(field))

    settings: dict[str, Any] = {"evaluations": 3000, "seed": 1, "emitter": "mutation"}
    alone = search(WORKSPACE, **settings)
    cluster.add_worker()

    def replace_worker(state: SearchState) -> None:
        if len(cluster.workers) == 1:
            cluster.workers[0].kill()
            cluster.add_worker()

    same(search(WORKSPACE, **settings, scheduler=cluster.address, callbacks=[replace_worker]))

    def lose_scheduler(state: SearchState) -> None:
        cluster.scheduler.kill()

    settings["checkpoint"] = tmp_path / "run"
    with pytest.raises(ClusterError, match=r"was lost: .* The last checkpoint is in .*run: .* resume=True") as caught:
        search(WORKSPACE, **settings, scheduler=cluster.address, callbacks=[lose_scheduler])
    assert caught.value.partial.evaluations == 1000
    same(search(WORKSPACE, **settings, resume=True))
