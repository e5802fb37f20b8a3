"""Searches started from the command line: progress, Ctrl-C, and the pictures that belong in every run folder."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from benchmarks.cli.options import settings_from
from benchmarks.cli.program import STOPPED
from benchmarks.console import number, plural, tell
from benchmarks.presenters.base import Part, Presenter, summary_of
from benchmarks.presenters.registry import presenter_of, presenter_of_run, usable_presenters
from legible_envs.support.names import file_name
from legible_envs.workspace import workspace_class
from optimizers.errors import SearchError
from optimizers.runs.folder import RunFolder, is_run_folder

if TYPE_CHECKING:
    from legible_envs.support.plugins import Plugin
    from optimizers import SearchResult

__all__ = [
    "check_options",
    "default_folder",
    "emitter_rows",
    "found_lines",
    "run_search",
    "workspace_rows",
    "write_pictures",
]


def default_folder(domain: str, settings: Mapping[str, Any]) -> Path:
    """The folder of a search that names none."""
    name = re.sub(r"[^\w-]+", "-", domain)
    if settings.get("start_from"):
        about = f"from-{Path(settings['start_from']).stem}"
    else:
        about = presenter_of(domain).folder_name(settings)
    return Path("runs") / file_name(f"{name}-{about}-seed{settings['seed']}")


def check_options(domain: str, given: Collection[str]) -> None:
    """Refuse options of another workspace.

    Raises:
        click.UsageError: One was given.
    """
    own = presenter_of(domain)
    for other in usable_presenters():
        wrong = sorted((other.options - own.options) & set(given))
        if wrong:
            raise click.UsageError(f"--{wrong[0].replace('_', '-')} is about a {other.noun}, not about {domain}")


def run_search(domain: str, out: Path, settings: Mapping[str, Any], given: Collection[str]) -> None:
    """Search, then write ``best.png`` and ``report.html`` beside what the search itself writes.

    Args:
        domain: Name of the workspace, or ``module:Class``.
        out: Folder of the run.
        settings: Options of ``legible optimize``; ``assigned`` are further settings of the workspace.
        given: Names of the options that the user gave; the others do not count where a search is continued.

    Raises:
        SearchError: The folder already holds a search and neither resume nor overwrite is set, or it holds none to
            resume; its checkpoint cannot be continued, or the search cannot go on.
    """
    presenter = presenter_of(domain)
    if is_run_folder(out) and not (settings["resume"] or settings["overwrite"]):
        raise SearchError(
            f"{out} already holds a search: add --resume to continue it, --overwrite to replace it, or choose another "
            "folder with --out"
        )
    config: dict[str, Any] = {"workspace": domain}
    if settings["resume"]:
        before = RunFolder(out).read_config()
        config = dict(before["workspace"])
        if not _same_workspace(str(config.get("workspace")), domain):
            raise SearchError(f"{out} holds a search of {config.get('workspace')!r}, not of {domain!r}")
        settings = _continued(before, settings, given)
    assigned = settings_from(settings.get("assigned", ()), "--set")
    if "workspace" in assigned:
        raise click.UsageError("--set workspace does not apply: the workspace is the first argument")
    config |= presenter.design(settings) | assigned
    parts = presenter.parts(config, settings, out)
    results = [_search_part(domain, part, settings, out) for part in parts]
    _tell(presenter, results[0], parts)


def _same_workspace(one: str, other: str) -> bool:
    """Whether two names mean the same workspace; ``module:Class`` may name what has a short name too."""
    return one == other or (":" in one + other and workspace_class(one) is workspace_class(other))


def _continued(before: Mapping[str, Any], settings: Mapping[str, Any], given: Collection[str]) -> dict[str, Any]:
    """Settings of a search that is continued: its own, except those given anew (which it may refuse)."""
    always = {"resume", "overwrite", "quiet", "assigned"}
    kept = {name: value for name, value in settings.items() if name in given or name in always}
    emitter = before["emitter"]
    own: dict[str, Any] = {
        "objective": before["objective"]["name"],
        "max_distance": before["objective"].get("max_distance"),
        "emitter": [one["name"] for one in emitter] if isinstance(emitter, list) else emitter["name"],
        "emitter_options": _options_before(emitter),
        "seed": before.get("seed", settings["seed"]),
    }
    if not {"evaluations", "iterations"} & set(given):
        own |= {"evaluations": before.get("evaluations"), "iterations": before.get("iterations")}
    return {"evaluations": None, "iterations": None, **own, **kept}


def _options_before(emitter: Any) -> Any:
    """The options of the emitter, or of each of several, in a manifest."""
    return (
        [_options_before(one) for one in emitter] if isinstance(emitter, list) else dict(emitter.get("options") or {})
    )


def _search_part(domain: str, part: Part, settings: Mapping[str, Any], out: Path) -> SearchResult:
    """One search of one folder."""
    from optimizers import EmitterError, SearchInterrupted, search

    if part.title and not settings["quiet"]:
        tell(part.title, err=True)
    iterations = settings.get("iterations")
    try:
        result = search(
            part.workspace,
            objective=settings["objective"],
            max_distance=settings["max_distance"],
            emitter=settings["emitter"],
            emitter_options=_emitter_options(settings),
            evaluations=settings["evaluations"],
            iterations=None if iterations is None else (int(iterations[0]), int(iterations[1])),
            seed=settings["seed"],
            checkpoint=part.folder,
            resume=("auto" if part.title else True) if settings["resume"] else False,
            overwrite=settings["overwrite"],
            progress=False if settings["quiet"] else None,
        )
    except EmitterError as error:
        if re.search("missing|option|required", str(error)) and "--emitter-option" not in str(error):
            raise EmitterError(f"{error} (--emitter-option NAME=VALUE sets an option)") from error
        raise
    except SearchInterrupted as stop:
        _tell_stopped(domain, part, out, saved=True, found=stop.partial)
        raise click.exceptions.Exit(STOPPED) from None
    except KeyboardInterrupt:  # the second Ctrl-C, which does not wait for the end of a batch
        _tell_stopped(domain, part, out, saved=is_run_folder(part.folder))
        raise click.exceptions.Exit(STOPPED) from None
    if result.best_genome is None:
        why = "" if settings["max_distance"] is None else "; is --max-distance too low?"
        tell(f"no layout scored in {plural(result.evaluations, 'evaluation')}{why}", err=True)
        raise click.exceptions.Exit(1)
    if part.folder != out:
        write_pictures(part.folder)
    return result


def _emitter_options(settings: Mapping[str, Any]) -> Any:
    """What ``search`` takes: options given on the command line, or those of the search that is continued."""
    given = settings.get("emitter_options", ())
    if isinstance(given, tuple):
        return settings_from(given, "--emitter-option") or None
    return given


def _tell_stopped(domain: str, part: Part, out: Path, *, saved: bool, found: SearchResult | None = None) -> None:
    """Say how to go on, then draw what was found, unless that is interrupted too."""
    after = "" if found is None else f" after {plural(found.evaluations, 'evaluation')}"
    tell(f"stopped{after}; {'everything is saved in' if saved else 'nothing was written to'} {out}", err=True)
    if saved:
        tell(f"to go on: legible optimize {domain} --resume --out {shlex.quote(str(out))}", err=True)
    if found is not None and found.best_genome is not None:
        with contextlib.suppress(KeyboardInterrupt):
            write_pictures(part.folder)


def _tell(presenter: Presenter, result: SearchResult, parts: Collection[Part]) -> None:
    """Print what the search of the folder itself found, and the files written."""
    from benchmarks.console import say

    assert result.folder is not None
    written = write_pictures(result.folder)
    console = say()
    console.print(presenter.text(console, result.best_layout))
    for line in found_lines(result, presenter):
        console.print(line, soft_wrap=True, markup=False)
    for name, path in written.items():
        console.print(f"{name:<8}{path}", soft_wrap=True, markup=False)
    if len(parts) > 1:
        console.print(f"each of the {plural(len(parts), 'search')} has a folder of its own there", style="dim")


def found_lines(result: SearchResult, presenter: Presenter) -> list[str]:
    """What a search found: the layout's score, and the objective where that is another number."""
    genome, name = result.require_genome(), str(result.config["objective"]["name"])
    summary = summary_of(result.workspace, genome)
    penalty = float(np.ravel(result.workspace.penalty(np.asarray(genome)[None]))[0])
    distance = f"{number(summary['distance'], presenter.texts.distance_digits)} {presenter.texts.distance_unit}".strip()
    effort = f"after {plural(result.evaluations, 'evaluation')} in {result.seconds:.1f} s"
    lines = [f"legibility {number(summary['score'])}, distance {distance}, {effort}"]
    if name != "legibility" or penalty:
        costs = f", net of costs of {number(penalty)} ({presenter.texts.costs})" if penalty else ""
        lines.append(f"objective  {number(result.best_objective)}: {name}{costs}")
    return lines


def write_pictures(folder: Path) -> dict[str, Path]:
    """Write pictures and report of a run; what was written, by what it is."""
    from benchmarks.reports.search_report import write_best_image, write_report
    from optimizers import load_run

    run = load_run(folder)
    pictures = {"picture": write_best_image(run), "panels": presenter_of_run(run).write_panels(run)}
    written = {name: path for name, path in pictures.items() if path is not None}
    return {**written, "report": write_report(run)}


def emitter_rows() -> list[dict[str, Any]]:
    """A row per emitter known by name: its name, its origin, and what it is."""
    from optimizers import list_emitters

    return _plugin_rows(list_emitters())


def workspace_rows() -> list[dict[str, Any]]:
    """A row per workspace known by name: its name, its origin, and what it is."""
    from legible_envs.workspace import list_workspaces

    return _plugin_rows(list_workspaces())


def _plugin_rows(plugins: Mapping[str, Plugin]) -> list[dict[str, Any]]:
    return [
        {"name": plugin.name, "from": plugin.origin, "class": plugin.target, "what": plugin.summary()}
        for plugin in plugins.values()
    ]
