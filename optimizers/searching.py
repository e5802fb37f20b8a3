"""The search: emitters propose layouts, the workspace scores them, the archive keeps the best of every kind."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from legible_envs.key_space import KeySpace
from legible_envs.support.validation import choice, entries, integer, integers, is_integer, real, shown
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.registry import EmitterSpec
from optimizers.errors import SearchInterrupted
from optimizers.evaluator import Evaluator, Objective
from optimizers.progress import Progress
from optimizers.runs.folder import RunFolder
from optimizers.runs.result import SearchResult
from optimizers.search_run import SearchRun, SearchState

__all__ = ["Callback", "SearchState", "search"]

_DEFAULT_EVALUATIONS = 100_000


Callback = Callable[[SearchState], object]


def search(
    workspace: Workspace | KeySpace,
    *,
    objective: str | Objective = "legibility",
    emitter: EmitterSpec | Sequence[EmitterSpec] = "improve",
    evaluations: int | None = None,
    iterations: tuple[int, int] | None = None,
    seed: int | None = 0,
    initial: int = 1000,
    max_distance: float | None = None,
    emitter_options: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
    checkpoint: str | Path | None = None,
    resume: bool | Literal["auto"] = False,
    overwrite: bool = False,
    checkpoint_every: float = 10.0,
    time_limit: float | None = None,
    callbacks: Sequence[Callback] = (),
    progress: bool | None = None,
    scheduler: str | None = None,
) -> SearchResult:
    """Search a workspace for layouts that score high, of every kind its measures tell apart (MAP-Elites).

    Algorithm 2 of Tung et al. (HRI 2024): ``initial`` random layouts go into the archive, then emitters propose. The
    same arguments and seed give the same archive, bit for bit, however often the search is interrupted and resumed
    (``time_limit`` and Ctrl-C decide only how far it gets).

    Args:
        workspace: The design problem, such as ``OvercookedWorkspace()``. Or its ``continuous()``: then emitters that
            know no workspace, such as pyribs' own, move in random keys (:class:`~legible_envs.key_space.KeySpace`);
            archive, checkpoints and result are of layouts all the same.
        objective: Name known to ``workspace.objective``, or a callable from ``(n, d)`` genomes to ``(n,)`` scores to be
            maximised, NaN where a layout is not allowed.
        emitter: Name, ``"module:Class"``, factory or proposing function (:mod:`optimizers.emitters.registry`), or
            several of them, which then share the archive.
        evaluations: Layouts to score, the initial ones included; the search stops at the end of the first batch that
            reaches this number. Default 100,000 unless ``iterations`` is given.
        iterations: The paper's budget instead: number of random layouts, then number of climbs, each to its end.
            Emitters that do not count iterations propose that many layouts.
        seed: Seed of everything random; archive and emitters get child seeds of one ``SeedSequence``. None draws one,
            which the manifest then names.
        initial: Random layouts scored first (20 % obstacles in a kitchen). ``iterations`` overrides it.
        max_distance: Layouts whose expected distance over one task execution is greater are not allowed.
        emitter_options: Keyword arguments of the emitter, such as ``{"sigma": 0.1}``, or one mapping per emitter.
        checkpoint: Folder of the run; everything in :mod:`.folder` is written there. None writes nothing.
        resume: True continues the run in that folder and fails if there is none; ``"auto"`` begins one if there is
            none. ``evaluations`` may have grown, everything else must be as it was; the emitters go on with the
            defaults they derived from the first budget.
        overwrite: Whether a run that lies in the folder may be replaced.
        checkpoint_every: Seconds between checkpoints. Has no influence on the result.
        time_limit: Seconds after which this session stops at the end of a batch.
        callbacks: Each is called with the :class:`SearchState` after every batch; returning True stops the search.
        progress: Whether to show a progress bar; None shows it where standard error is a terminal.
        scheduler: Address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers share the scoring of
            every batch; the result is the same. Worth it where scoring is dear.

    Returns:
        The result. Its best layout is pruned of obstacles that do nothing; the archive is as searched.

    Raises:
        SearchInterrupted: Ctrl-C; raised at the end of the batch, after saving. A second Ctrl-C stops at once.
        CheckpointError: A checkpoint cannot be written, read or continued.
        SearchError: The folder holds a run already, or the search cannot go on.
        EmitterError: The emitter is unknown or breaks the contract.
        ConnectionError: No scheduler answers at the address ``scheduler``.

        Any exception raised after the search began has an attribute ``partial``: the result so far.
    """
    if evaluations is not None and iterations is not None:
        raise ValueError("give either evaluations or iterations, not both")
    if iterations is None:
        evaluations = _DEFAULT_EVALUATIONS if evaluations is None else evaluations
    _check_budget(evaluations, iterations, initial, resume, checkpoint)
    _check_conduct(seed, checkpoint_every, time_limit, callbacks)
    space = workspace if isinstance(workspace, KeySpace) else None
    workspace = workspace if space is None else space.workspace
    if not isinstance(workspace, Workspace):
        raise TypeError(f"`workspace` must be a Workspace or its continuous(), got {shown(workspace)}")
    run = SearchRun(
        workspace=workspace,
        space=space,
        evaluator=Evaluator(workspace, objective, max_distance, scheduler),
        emitters=_paired(emitter, emitter_options),
        evaluations=evaluations,
        iterations=iterations,
        initial=initial if iterations is None else iterations[0],
        seed=int(np.random.SeedSequence().generate_state(1)[0]) if seed is None else int(seed),
        folder=None if checkpoint is None else RunFolder(Path(checkpoint)),
        checkpoint_every=checkpoint_every,
    )
    with contextlib.closing(run.evaluator):
        run.open(resume=resume, overwrite=overwrite)
        return _conduct(run, callbacks, time_limit, progress)


def _conduct(
    run: SearchRun,
    callbacks: Sequence[Callback],
    time_limit: float | None,
    progress: bool | None,
) -> SearchResult:
    """Search until something ends it; the error of one that fails carries what was found."""
    deadline = None if time_limit is None else time.monotonic() + time_limit
    with _interrupts() as interrupted, Progress(*run.goal(), show=progress) as bar:
        try:
            stopped = _loop(run, bar, callbacks, deadline, interrupted)
            result = run.finish(stopped)
        except BaseException as error:
            with contextlib.suppress(AttributeError):
                error.partial = run.rescue()  # type: ignore[attr-defined]
            raise
    if stopped == "interrupted":
        where = "" if run.folder is None else f"; saved in {run.folder.path}, continue with resume=True"
        raise SearchInterrupted(f"interrupted after {result.evaluations:,} evaluations{where}", partial=result)
    return result


def _loop(
    run: SearchRun,
    bar: Progress,
    callbacks: Sequence[Callback],
    deadline: float | None,
    interrupted: threading.Event,
) -> str:
    """Run batches until something ends the search; returns what did."""
    while not run.over:
        run.advance()
        if run.state.history:
            bar.update(run.goal_done(), run.state.history[-1])
        stops = [callback(run.state) is True for callback in callbacks]
        if any(stops):
            return "callback"
        if interrupted.is_set():
            return "interrupted"
        if deadline is not None and time.monotonic() >= deadline:
            return "time limit"
        run.save_if_due()
    return "evaluations" if run.evaluations is not None else "iterations"


def _paired(
    emitter: EmitterSpec | Sequence[EmitterSpec], options: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None
) -> list[tuple[EmitterSpec, dict[str, Any]]]:
    """Each emitter with its options."""
    specs = list(emitter) if isinstance(emitter, Sequence) and not isinstance(emitter, str) else [emitter]
    if not specs:
        raise ValueError("give at least one emitter")
    if options is None:
        given: list[Any] = [{} for _ in specs]
    else:
        given = list(options) if isinstance(options, list | tuple) else [options]
    for one in given:
        if not isinstance(one, Mapping) or not all(isinstance(name, str) for name in one):
            raise ValueError(
                "`emitter_options` must be None, keyword arguments such as {'sigma': 0.1}, or a list of such, got "
                f"{shown(options)}"
            )
    if len(given) != len(specs):
        number = len(specs)
        needed = f"{number} emitters need {number} mappings" if number > 1 else "1 emitter needs 1 mapping"
        raise ValueError(f"{needed} of `emitter_options`, got {len(given)}")
    return [(spec, dict(one)) for spec, one in zip(specs, given, strict=True)]


def _check_budget(
    evaluations: int | None, iterations: tuple[int, int] | None, initial: int, resume: object, checkpoint: object
) -> None:
    integers(1, evaluations=evaluations)
    if iterations is not None:
        counts = entries(iterations)
        if len(counts) != 2 or not all(map(is_integer, counts)) or not 1 <= counts[0] <= MOST_GENOMES or counts[1] < 0:
            raise ValueError(
                f"`iterations` must be (random layouts >= 1, at most {MOST_GENOMES:,}; climbs >= 0), got "
                f"{shown(iterations)}"
            )
        integer("a number in `iterations`", counts[1], 0)
    integer("initial", initial, 1, MOST_GENOMES)
    choice("resume", resume, (True, False, "auto"))
    if resume and checkpoint is None:
        raise ValueError("resume needs checkpoint=, the folder of the run")


def _check_conduct(seed: object, checkpoint_every: object, time_limit: object, callbacks: object) -> None:
    integers(0, seed=seed)
    real("checkpoint_every", checkpoint_every, 0, unit="seconds")
    if time_limit is not None:
        real("time_limit", time_limit, 0, also="None", unit="seconds")
    if not isinstance(callbacks, Sequence) or not all(map(callable, callbacks)):
        raise ValueError(f"`callbacks` must be functions of the state of the search, got {shown(callbacks)}")


@contextmanager
def _interrupts() -> Iterator[threading.Event]:
    """Turn the first Ctrl-C into a note to stop after the batch; a second one interrupts at once, as usual."""
    asked = threading.Event()
    before = signal.getsignal(signal.SIGINT)
    # Signals reach the main thread only; a process told to ignore them (nohup) goes on ignoring them.
    if threading.current_thread() is not threading.main_thread() or before in (signal.SIG_IGN, None):
        yield asked
        return

    def note(number: int, frame: object) -> None:
        asked.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)
