"""One search under way: its settings, its state between batches, and how both are saved."""

from __future__ import annotations

import contextlib
import json
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt
from ribs.schedulers import Scheduler

from legible_envs.key_space import KeySpace
from legible_envs.support.files import remove_leftovers
from legible_envs.workspace import Workspace
from optimizers.archives import WorkspaceArchive, archive_arrays, make_archive, write_archive
from optimizers.emitters.registry import EmitterSpec, emitter_name, make_emitter
from optimizers.errors import CheckpointError, EmitterError, SearchError
from optimizers.evaluator import Evaluator
from optimizers.runs.checkpoint import CheckpointFolder, Header, refuse_other_settings
from optimizers.runs.folder import RunFolder, git_revision, package_versions, pickle_versions, platform_name
from optimizers.runs.manifest import SCHEMA, digests_of, settings_of
from optimizers.runs.result import SearchResult

__all__ = ["SearchRun", "SearchState"]

_ROWS = 1000
_ROW_EVERY = 1000


@dataclass
class SearchState:
    """Everything that changes during a search; what a checkpoint holds, and what callbacks see.

    Attributes:
        scheduler: The pyribs scheduler with its archive and emitters.
        iteration: Batches after the initial random one.
        evaluations: Layouts scored so far.
        seconds: Wall time so far, all sessions together.
        evaluation_seconds: Part of it spent in the objective.
        history: Logged rows, the columns of ``metrics.csv``.
    """

    scheduler: Scheduler
    iteration: int = 0
    evaluations: int = 0
    seconds: float = 0.0
    evaluation_seconds: float = 0.0
    history: list[dict[str, Any]] = field(default_factory=list)

    @property
    def archive(self) -> WorkspaceArchive:
        """The archive, to be read only."""
        return self.scheduler.archive


@dataclass
class SearchRun:
    """One search under way: its settings, and its state between batches."""

    workspace: Workspace
    evaluator: Evaluator
    emitters: list[tuple[EmitterSpec, dict[str, Any]]]
    evaluations: int | None
    iterations: tuple[int, int] | None
    initial: int
    seed: int
    folder: RunFolder | None
    checkpoint_every: float
    space: KeySpace | None = None

    def __post_init__(self) -> None:
        root = np.random.SeedSequence(self.seed)
        archive_seed, self._initial_seed, *emitter_seeds = root.spawn(2 + len(self.emitters))
        archive = make_archive(self.workspace, seed=archive_seed, score_floor=self.evaluator.score_floor)
        made = [
            make_emitter(
                spec,
                archive,
                self.workspace if self.space is None else self.space,
                seed=int(child.generate_state(1)[0]),
                evaluations=self.evaluations,
                iterations=None if self.iterations is None else self.iterations[1],
                options=options,
            )
            for (spec, options), child in zip(self.emitters, emitter_seeds, strict=True)
        ]
        self.state = SearchState(Scheduler(archive, made))
        self._settings = self._described()
        self._config: dict[str, Any] = {}
        self._saved_at = time.monotonic()
        self._consistent = True

    # -- beginning and ending ------------------------------------------------------------------------------------------

    def open(self, *, resume: bool | str, overwrite: bool) -> None:
        """Begin a new run, or take up the one in the folder."""
        if self.folder is None:
            self._config = self._manifest({})
            return
        self._checkpoints = CheckpointFolder(self.folder.checkpoints, {"workspace": self.workspace})
        if resume is True or (resume == "auto" and self.folder.holds_a_run):
            self._take_up()
        else:
            # What can fail comes before anything is written: a run that is to be replaced is still whole then.
            self._checkpoints.check(self.state)
            self._config = self._manifest({})
            self.folder.create(overwrite=overwrite)
            self._begin()

    def _begin(self) -> None:
        """Write the first files: the manifest before all others, so that whatever lies there can be resumed."""
        assert self.folder is not None
        self.folder.write_config(self._config)
        self.folder.rewrite_metrics([])
        self.save()

    def _take_up(self) -> None:
        """Go on from the newest checkpoint; begin anew where the run was stopped before its first one."""
        assert self.folder is not None
        if self.folder.has_only_begun:
            before = self.folder.read_config()
            refuse_other_settings(self.folder.path, settings_of(before), self._settings)
            warnings.warn(
                f"{self.folder.path}: this search was stopped before its first checkpoint; it begins anew with the "
                "same settings",
                stacklevel=4,
            )
            remove_leftovers(self.folder.path)
            self._checkpoints.check(self.state)
            self._config = self._manifest(before)
            self._begin()
            return
        self.state = self._checkpoints.load(self._settings, pickle_versions())
        remove_leftovers(self.folder.path)
        self._config = self._manifest(self._config_before())
        self.folder.write_config(self._config)
        self.folder.rewrite_metrics(self.state.history)

    def _config_before(self) -> dict[str, Any]:
        """The manifest of the run that is continued; empty where it is lost: all of it but its date is known."""
        assert self.folder is not None
        try:
            return self.folder.read_config()
        except SearchError as error:
            warnings.warn(f"{error}; it is written anew from the checkpoint", stacklevel=5)
            return {}

    def finish(self, stopped: str) -> SearchResult:
        """Log the last batch, prune the best layout, and write everything."""
        if not self.state.history or self.state.history[-1]["iteration"] != self.state.iteration:
            self._log()
        result = self._result(stopped, prune=True)
        if self.folder is not None:
            self.save()
            if result.best_genome is not None:
                self.folder.write_best(result.best_layout)
            result.config["digests"] = digests_of(archive_arrays(result.archive), result.history)
            self.folder.write_config(result.config)
        if result.best_genome is None:
            warnings.warn(
                f"none of {result.evaluations:,} layouts has a score; is max_distance too small?", stacklevel=3
            )
        return result

    def rescue(self) -> SearchResult | None:
        """The result so far, for an error on its way out; saves what can still be saved, and never raises."""
        if self.folder is not None:
            with contextlib.suppress(Exception):
                write_archive(self.folder.archive, self.state.archive)
            with contextlib.suppress(Exception):
                if self._consistent:
                    self.save()
        try:
            return self._result("error", prune=False)
        except Exception:
            return None

    # -- one batch -----------------------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether the budget is used up."""
        if self.state.evaluations == 0:
            return False
        if self.evaluations is not None:
            return self.state.evaluations >= self.evaluations
        counting = self._counting()
        if counting:
            return all(emitter.done for emitter in counting)
        return self.state.evaluations >= self.goal()[0]

    def advance(self) -> None:
        """Propose, score and archive one batch."""
        started, scoring = time.perf_counter(), self.evaluator.seconds
        self._consistent = False
        if self.state.evaluations == 0:
            genomes = self._add_initial()
        else:
            genomes = self._add_proposed()
            self.state.iteration += 1
        self.state.evaluations += len(genomes)
        self.state.evaluation_seconds += self.evaluator.seconds - scoring
        self.state.seconds += time.perf_counter() - started
        last = self.state.history[-1]["evaluations"] if self.state.history else -np.inf
        if self.state.evaluations - last >= (_ROW_EVERY if self.evaluations is None else self.evaluations / _ROWS):
            self._log()
        self._consistent = True

    def _add_initial(self) -> npt.NDArray[Any]:
        """Score and archive the random layouts every search begins with."""
        n = self.initial if self.evaluations is None else min(self.initial, self.evaluations)
        genomes = self.workspace.sample(n, np.random.default_rng(self._initial_seed))
        self.state.archive.add(genomes, *self.evaluator(genomes))
        if self.iterations is not None and self.state.archive.empty:
            raise SearchError(f"none of {n:,} random layouts has a score to climb from; is max_distance too small?")
        return genomes

    def _add_proposed(self) -> npt.NDArray[Any]:
        """Let the emitters propose, score, and tell them."""
        genomes = self.state.scheduler.ask()
        if not len(genomes):
            names = ", ".join(emitter_name(spec) for spec, _ in self.emitters)
            raise EmitterError(f"{names}: ask() proposed nothing although the search is not over")
        scores, measures = self.evaluator(genomes)
        with warnings.catch_warnings() if self.state.archive.empty else contextlib.nullcontext():
            if self.state.archive.empty:
                # pyribs suspects a threshold where nothing was added yet; here no layout had a score.
                warnings.filterwarnings("ignore", message=".*was empty before adding solutions")
            self.state.scheduler.tell(scores, measures)
        return genomes

    def _log(self) -> None:
        """Add a row to the history."""
        state, stats = self.state, self.state.archive.stats
        row = {
            "iteration": state.iteration,
            "phase": "initial" if state.iteration == 0 else "search",
            "evaluations": state.evaluations,
            "seconds": round(state.seconds, 6),
            "best": None if stats.obj_max is None else float(stats.obj_max),
            "qd_score": float(stats.qd_score),
            "coverage": float(stats.coverage),
            "elites": int(stats.num_elites),
            "evaluations_per_second": round(state.evaluations / state.seconds, 1) if state.seconds else 0.0,
        }
        state.history.append(row)
        if self.folder is not None:
            self.folder.append_metrics(row)

    # -- saving --------------------------------------------------------------------------------------------------------

    def save_if_due(self) -> None:
        """Write a checkpoint if the last one is old enough."""
        if self.folder is not None and time.monotonic() - self._saved_at >= self.checkpoint_every:
            self.save()

    def save(self) -> None:
        """Write a checkpoint, and the archive and best layout so far: a killed run can be looked at."""
        assert self.folder is not None
        header = Header(self._settings, pickle_versions(), self.state.iteration)
        try:
            self._checkpoints.save(header, self.state)
            write_archive(self.folder.archive, self.state.archive)
            if self.state.archive.best_elite is not None:
                self.folder.write_best(self.workspace.decode(self.state.archive.best_elite["solution"]))
        except OSError as error:
            raise CheckpointError(
                f"cannot write to {self.folder.path}: {error}. The last whole checkpoint there is intact: make room "
                "and continue with resume=True. What was found so far is in this error's `partial`."
            ) from error
        self._saved_at = time.monotonic()

    def _described(self) -> dict[str, Any]:
        """Everything the result depends on, as JSON."""
        archive = self.state.archive
        described = {
            "workspace": self.workspace.to_config(),
            **({} if self.space is None else {"continuous": True}),
            "objective": {"name": self.evaluator.name, "max_distance": self.evaluator.max_distance},
            "emitter": [{"name": emitter_name(spec), "options": options} for spec, options in self.emitters],
            "archive": {
                "dims": [int(n) for n in archive.dims],
                "ranges": [
                    [float(a), float(b)] for a, b in zip(archive.lower_bounds, archive.upper_bounds, strict=True)
                ],
                "measure_names": list(self.workspace.measure_names),
                "score_floor": float(archive.qd_score_offset),
            },
            "seed": self.seed,
            "initial": self.initial,
            "evaluations": self.evaluations,
            "iterations": None if self.iterations is None else list(self.iterations),
        }
        return _as_json(described)

    def _manifest(self, before: Mapping[str, Any]) -> dict[str, Any]:
        """The manifest of the run; keeps the date of its beginning where it is continued."""
        emitters = [
            {**described, "settings": getattr(emitter, "settings", {})}
            for described, emitter in zip(self._settings["emitter"], self.state.scheduler.emitters, strict=True)
        ]
        return _as_json(
            {
                "versions": package_versions(),
                "created": before.get("created", datetime.now(UTC).isoformat(timespec="seconds")),
                "git_revision": git_revision(),
                "platform": platform_name(),
                **self._settings,
                "emitter": emitters[0] if len(emitters) == 1 else emitters,
                "calibration": self.workspace.calibration,
            }
        )

    def _result(self, stopped: str, *, prune: bool) -> SearchResult:
        state, elite = self.state, self.state.archive.best_elite
        genome, score, removed = None, None, False
        if elite is not None:
            genome, score = np.array(elite["solution"]), float(elite["objective"])
            if prune:
                genome = np.asarray(self.workspace.prune(genome, self.evaluator.score))
                removed = not np.array_equal(genome, elite["solution"])
                score = float(self.evaluator.score(genome[None])[0]) if removed else score
        summary = {
            "best_objective": score,
            "best_genome": None if genome is None else genome.tolist(),
            "pruned": prune,
            "pruning_changed_best": removed,
            "evaluations": state.evaluations,
            "iterations": state.iteration,
            "seconds": round(state.seconds, 6),
            "evaluation_seconds": round(state.evaluation_seconds, 6),
            "qd_score": float(state.archive.stats.qd_score),
            "coverage": float(state.archive.stats.coverage),
            "stopped": stopped,
        }
        return SearchResult(
            workspace=self.workspace,
            archive=state.archive,
            best_genome=genome,
            best_objective=score,
            history=list(state.history),
            evaluations=state.evaluations,
            iterations=state.iteration,
            seconds=state.seconds,
            evaluation_seconds=state.evaluation_seconds,
            stopped=stopped,
            config={"schema": SCHEMA, **self._config, "result": summary},
            folder=None if self.folder is None else self.folder.path,
        )

    # -- budget --------------------------------------------------------------------------------------------------------

    def _counting(self) -> list[Any]:
        """Emitters that count iterations of their own and say when they are done."""
        return [emitter for emitter in self.state.scheduler.emitters if hasattr(emitter, "done")]

    def goal(self) -> tuple[int, str]:
        """The number that the progress bar counts up to, and its unit."""
        if self.evaluations is not None:
            return self.evaluations, "evaluations"
        assert self.iterations is not None
        if self._counting():
            return self.iterations[1] * len(self._counting()), "climbs"
        return sum(self.iterations), "evaluations"

    def goal_done(self) -> int:
        """How much of the goal is reached."""
        if self.goal()[1] == "climbs":
            return sum(int(getattr(emitter, "finished", 0)) for emitter in self._counting())
        return self.state.evaluations


def _as_json(data: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data that reads back from JSON as it is; anything else by a description that is the same next time."""

    def describe(value: Any) -> Any:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        return emitter_name(value)

    return json.loads(json.dumps(data, default=describe))
