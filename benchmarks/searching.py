"""Searches started from the command line: progress, Ctrl-C, and the pictures that belong in every run folder."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.console import number
from benchmarks.runs import RunError, is_run_folder, read_config

if TYPE_CHECKING:
    from legible_envs.overcooked import OvercookedLayout
    from optimizers import SearchResult

__all__ = ["default_folder", "emitter_rows", "resumed_settings", "run_search"]


def default_folder(domain: str, settings: Mapping[str, Any]) -> Path:
    """Where a search is written that names no folder."""
    if settings.get("start_from"):
        return Path("runs") / f"{domain}-from-{Path(settings['start_from']).stem}-seed{settings['seed']}"
    rows, columns = settings["shape"]
    return Path("runs") / f"{domain}-{rows}x{columns}-{settings['objective']}-seed{settings['seed']}"


def resumed_settings(folder: Path, settings: Mapping[str, Any], given: Collection[str]) -> dict[str, Any]:
    """Settings of a search that is continued: its own, except those given anew (which it may refuse).

    Raises:
        RunError: The folder holds no run.
    """
    config = read_config(folder / "config.json")
    workspace = config["workspace"]
    own = {
        "shape": tuple(workspace.get("shape", settings["shape"])),
        "prefix": workspace.get("prefix", settings["prefix"]),
        "pots": workspace.get("pots"),
        "objective": config["objective"]["name"],
        "max_distance": config["objective"].get("max_distance"),
        "start_from": workspace.get("start_from"),
        "lock": tuple(workspace.get("locked") or ()),
        "relocation_cost": workspace.get("relocation_cost", 0.0),
        "emitter": config["emitter"]["name"],
        "evaluations": config.get("evaluations", settings["evaluations"]),
        "seed": config.get("seed", settings["seed"]),
    }
    return {name: value if name in given else own.get(name, value) for name, value in settings.items()}


def run_search(
    domain: str,
    out: Path,
    *,
    shape: tuple[int, int],
    prefix: Any,
    pots: int | None,
    objective: str,
    emitter: str,
    evaluations: int,
    seed: int,
    max_distance: float | None,
    start_from: str | None,
    lock: tuple[str, ...],
    relocation_cost: float,
    resume: bool,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Search, then write ``best.png`` and ``report.html`` beside what the search itself writes.

    Raises:
        RunError: The folder already holds a run, and nobody said what to do with it.
        SearchError: Its checkpoint cannot be continued, or the search cannot go on.
    """
    from legible_envs.workspace import make_workspace
    from optimizers import SearchInterrupted, search

    if is_run_folder(out) and not (resume or overwrite):
        raise RunError(
            f"{out} already holds a search: add --resume to continue it, --overwrite to replace it, or choose another "
            "folder with --out"
        )
    design: dict[str, Any] = {"shape": shape, "prefix": prefix, "pots": pots}
    if start_from is not None:
        kitchen = _existing_kitchen(start_from)
        design |= {"shape": kitchen.shape, "start_from": kitchen.to_ascii(), "relocation_cost": relocation_cost}
        design["locked"] = list(lock)
    elif lock or relocation_cost:
        raise click.UsageError("--lock and --relocation-cost need --start-from, the kitchen they are about")
    workspace = make_workspace(domain, **design)
    try:
        result = search(
            workspace,
            objective=objective,
            max_distance=max_distance,
            emitter=emitter,
            evaluations=evaluations,
            seed=seed,
            checkpoint=out,
            resume=resume,
            overwrite=overwrite,
            progress=False if quiet else None,
        )
    except SearchInterrupted as stop:
        done = 0 if stop.partial is None else stop.partial.evaluations
        click.echo(f"stopped after {done:,} evaluations; everything is saved in {out}", err=True)
        if stop.partial is not None and stop.partial.best_genome is not None:
            _pictures(out)
        click.echo(f"to go on: legible optimize {domain} --resume --out {shlex.quote(str(out))}", err=True)
        raise click.exceptions.Exit(130) from None
    _tell(result, out)


def _existing_kitchen(start_from: str) -> OvercookedLayout:
    """The kitchen of ``--start-from``; the manifest of a run holds the drawing itself."""
    from benchmarks.kitchens import load_kitchen
    from legible_envs.overcooked import OvercookedLayout

    return OvercookedLayout.from_ascii(start_from) if "\n" in start_from else load_kitchen(start_from).layout


def _tell(result: SearchResult, out: Path) -> None:
    if result.best_genome is None:
        click.echo(f"no layout scored in {result.evaluations:,} evaluations; is --max-distance too low?", err=True)
        raise click.exceptions.Exit(1)
    from benchmarks.console import board_for, say

    image, page = _pictures(out)
    console = say()
    console.print(board_for(console, result.best_layout))
    summary = result.workspace.summary(result.best_genome)
    console.print(
        f"{result.config['objective']['name']} {number(result.best_objective, 4)} "
        f"(legibility {number(summary['score'])}, distance {number(summary['distance'], 1)}) "
        f"after {result.evaluations:,} evaluations in {result.seconds:.1f} s"
    )
    console.print(f"picture {image}\nreport  {page}")


def _pictures(out: Path) -> tuple[Path, Path]:
    from benchmarks.report import write_best_image, write_report

    return write_best_image(out), write_report(out)


def emitter_rows() -> list[dict[str, Any]]:
    """A row per emitter that can be named: its name, where it comes from, and what it is."""
    from optimizers import list_emitters

    return [
        {"name": info.name, "from": info.origin, "class": info.target, "what": info.summary()}
        for info in list_emitters().values()
    ]
