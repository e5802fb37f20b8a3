"""``legible reproduce``: the paper's experiments, and others that need simulated participants."""

from __future__ import annotations

import importlib
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from benchmarks.cli.destinations import check_folder
from benchmarks.cli.options import out_folder, scheduler_option, worker_timeout_option, workers_option
from benchmarks.cli.program import STOPPED
from benchmarks.console import tell

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.reports.experiment_report import Section
    from benchmarks.trials import Event

__all__ = ["EXPERIMENTS", "Experiment", "reproduce", "run_experiment"]


@dataclass(frozen=True)
class Experiment:
    """An experiment that one command runs.

    Attributes:
        modules: Its parts by the folder each writes to; a part offers ``reproduce(folder, *, quick, seeds, workers,
            scheduler, progress)`` and, in ``analysis``, ``sections(folder)``.
        title: Of its report.
        lede: Below the title.
    """

    modules: Mapping[str, str]
    title: str
    lede: str


_PEOPLE = "Participants are simulated or recorded here, not those of the paper."

EXPERIMENTS: Final = {
    "overcooked": Experiment(
        {".": "benchmarks.experiments.overcooked", "recorded": "benchmarks.experiments.recorded"},
        "Are goals predicted better in legible kitchens?",
        "Random, efficient, legible-efficient and legible kitchens, and how early predictors tell a cook's goal. "
        f"{_PEOPLE}",
    ),
    "tabletop": Experiment(
        {".": "benchmarks.experiments.tabletop"},
        "Are goals predicted better at legible tables, and does a robot profit?",
        "Sorted cubes, better places, virtual obstacles, and both: goals predicted, then a robot at the same table. "
        f"{_PEOPLE}",
    ),
    "optimizers": Experiment(
        {".": "benchmarks.experiments.optimizers"},
        "Which search finds the most legible kitchens?",
        "Emitters under the same scheduler, at the paper's number of iterations and at equal numbers of evaluations.",
    ),
    "learning": Experiment(
        {".": "benchmarks.experiments.learning"},
        "How well does an agent learn to cook, and to build?",
        "PPO in fixed and in random kitchens and at the table, beside a scripted cook.",
    ),
}


def run_experiment(
    name: str,
    folder: Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    worker_timeout: float = 60.0,
    progress: Callable[[Event], object] | None = None,
) -> Path:
    """Run the trials that are missing, analyse all of them, and write the report.

    Args:
        name: One of :data:`EXPERIMENTS`.
        folder: Where results, tables, figures and ``report.html`` are written.
        quick: The version of two minutes.
        seeds: How many seeds in place of the experiment's own number.
        workers: Processes on this machine; all cores if None.
        scheduler: Address of a Dask scheduler instead.
        worker_timeout: Seconds to wait for a worker of the cluster where there is none.
        progress: Called with an :class:`~benchmarks.trials.Event` whenever something changes.

    Returns:
        The report.
    """
    from benchmarks.reports.experiment_report import write_experiment_report

    experiment = EXPERIMENTS[name]
    how = {
        "quick": quick,
        "seeds": seeds,
        "workers": workers,
        "scheduler": scheduler,
        "worker_timeout": worker_timeout,
        "progress": progress,
    }
    sections = []
    for part, module in experiment.modules.items():
        sections += _run_part(module, folder / part, how)
    lede = experiment.lede + (" This is the quick version: few layouts, participants and seeds." if quick else "")
    return write_experiment_report(folder, sections, title=experiment.title, lede=lede)


def _run_part(module: str, folder: Path, how: Mapping[str, Any]) -> list[Section]:
    """Run one part and return its sections; a part whose recordings are missing says so in the report."""
    from benchmarks.reports.experiment_report import Section
    from legible_envs.datasets.overcooked_2019 import RecordingsError

    try:
        importlib.import_module(module).reproduce(folder, **how)
    except RecordingsError as error:
        return [Section("Recorded participants", f"Left out: {error}")]
    return list(importlib.import_module(f"{module}.analysis").sections(folder))


@click.command()
@click.argument("experiment", type=click.Choice(list(EXPERIMENTS)))
@click.option("--quick", is_flag=True, help="A version of two minutes.")
@click.option("--seeds", type=click.IntRange(1, 10_000), help="Seeds, in place of the experiment's own number.")
@out_folder
@workers_option
@scheduler_option
@worker_timeout_option
@click.option("--quiet", is_flag=True, help="Show no progress.")
def reproduce(
    experiment: str,
    quick: bool,
    seeds: int | None,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    worker_timeout: float,
    quiet: bool,
) -> None:
    """Run an experiment of the paper again.

    Writes result files, tables, figures and report.html. After an interruption the same command continues.
    """
    from benchmarks.trials import TrialsFailed, TrialsStopped
    from benchmarks.trials.progress import TrialsProgress

    folder = out or Path("runs") / (f"{experiment}-quick" if quick else experiment)
    check_folder(folder, "--out")
    try:
        with TrialsProgress(False if quiet else None) as progress:
            report = run_experiment(
                experiment,
                folder,
                quick=quick,
                seeds=seeds,
                workers=workers,
                scheduler=scheduler,
                worker_timeout=worker_timeout,
                progress=progress,
            )
    except KeyboardInterrupt:
        tell(f"stopped; finished trials are kept in {folder}; the same command continues from there", err=True)
        raise click.exceptions.Exit(STOPPED) from None
    except TrialsStopped as error:
        command = ["legible", "reproduce", experiment, *(["--quick"] if quick else []), "--out", str(folder)]
        command += ([] if seeds is None else ["--seeds", str(seeds)]) + ["--scheduler", str(scheduler)]
        raise click.ClickException(f"{error}\nto go on: {shlex.join(command)}") from None
    except TrialsFailed as error:
        raise click.ClickException(str(error)) from error
    _tell(folder)
    tell(f"report {report}")


def _tell(folder: Path) -> None:
    """Print the files written."""
    for kind in ("tables", "figures"):
        found = sorted(path.name for path in (folder / kind).glob("*") if path.is_file())
        if found:
            tell(f"{kind} {folder / kind}: {', '.join(found)}")
