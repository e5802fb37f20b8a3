"""The command ``legible``: every command of the project, thin over the libraries, with errors of one line."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.humans import evaluate
from benchmarks.cli.reproduce import reproduce
from benchmarks.cli.sweep import sweep
from legible_envs import __version__

__all__ = ["main"]


class _Commands(click.Group):
    """A group whose commands answer bad input with one line and exit code 2 instead of a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        with _one_line_errors(bool(ctx.params.get("traceback"))):
            return super().invoke(ctx)


CONTENTS = {
    "Search": ("optimize", "report"),
    "Layouts": ("score", "show", "play"),
    "Participants and predictors": ("humans fetch", "humans stats", "humans evaluate"),
    "Experiments": ("sweep", "reproduce", "bench"),
    "About": ("demo", "workspaces", "emitters"),
}
"""Sections of ``legible --help``: every command, in order."""


class _Contents(_Commands):
    """The whole command, whose help reads like a table of contents."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """A section for each group of commands, a line for each command."""
        longest = max(len(name) for names in CONTENTS.values() for name in names)
        for title, names in CONTENTS.items():
            with formatter.section(title):
                formatter.write_dl([(f"{name:<{longest}}", self._line(ctx, name)) for name in names])

    def _line(self, ctx: click.Context, name: str) -> str:
        command: click.Command | None = self
        for part in name.split():
            assert isinstance(command, click.Group)
            command = command.get_command(ctx, part)
        assert command is not None
        return command.get_short_help_str(limit=200)


class _BadInput(click.ClickException):
    exit_code = 2


@contextlib.contextmanager
def _one_line_errors(show_traceback: bool) -> Iterator[None]:
    """Turn the errors that the libraries raise about input, files and settings into clicks of exit code 2."""
    try:
        yield
    except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
        raise
    except (ValueError, OSError, RuntimeError, ImportError) as error:
        if show_traceback:
            raise
        raise _BadInput(_message(error)) from error


def _message(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return " ".join(str(error).split()) or type(error).__name__


@click.group(cls=_Contents, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="legible")
@click.option("--traceback", is_flag=True, help="Show where in the program an error arose.")
def main(traceback: bool) -> None:
    """Design workspaces in which people's motion can be read.

    LAYOUT is a file with the drawing of a kitchen, an Overcooked-AI .layout, the JSON of a table or the layout of a
    workspace you installed; the folder of a search; or - for standard input.
    """


main.add_command(sweep)
main.add_command(reproduce)


_out = click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder to write to.")
_layout = click.argument("layout", metavar="LAYOUT")
_pots = click.option(
    "--pots", type=click.IntRange(min=1), help="Kitchens: soups in progress at once. [default: no limit]"
)
_workspace = click.option(
    "--workspace", metavar="NAME", help="Workspace of the layout. [default: the one that recognises it]"
)
_task = click.option("--task", metavar="NAME|FILE.yaml", help="Tables: what is built. [default: the one that fits]")


class _Assignment(click.ParamType):
    """``NAME=VALUE``, the value as JSON where it is JSON, else as text."""

    name = "name=value"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        name, equals, text = str(value).partition("=")
        if not name or not equals:
            self.fail(f"{value!r} is not NAME=VALUE", param, ctx)
        try:
            return name, json.loads(text)
        except ValueError:
            return name, text


class _Prefix(click.ParamType):
    """``mean``, ``sum``, or fractions such as ``0.25,0.5``."""

    name = "mean|sum|fractions"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value in ("mean", "sum") or isinstance(value, tuple):
            return value
        try:
            return tuple(float(part) for part in str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is neither 'mean', 'sum' nor fractions such as 0.25,0.5", param, ctx)


# -- search ------------------------------------------------------------------------------------------------------------


@main.command()
@click.argument("domain", metavar="WORKSPACE")
@click.option("--shape", nargs=2, type=click.IntRange(min=4), default=(7, 7), show_default=True, metavar="ROWS COLS",
              help="Kitchens: their size.")  # fmt: skip
@click.option("--task", default="columns", show_default=True, metavar="NAME|FILE.yaml", help="Tables: what is built.")
@click.option(
    "--condition",
    type=click.Choice(["all", "both", "placement", "obstacles"]),
    default="all",
    show_default=True,
    help="Tables: what is designed; all searches each of the three.",
)
@click.option(
    "--objective",
    type=click.Choice(["legibility", "efficiency", "legible-efficient"]),
    default="legibility",
    show_default=True,
)
@click.option("--prefix", type=_Prefix(), help="Which prefixes of a trajectory count. [default: mean]")
@_pots
@click.option("--emitter", default="improve", show_default=True, metavar="NAME|MODULE:CLASS")
@click.option("--evaluations", type=click.IntRange(min=1), help="Layouts to score. [default: 200000]")
@click.option("--iterations", nargs=2, type=click.IntRange(min=0), metavar="RANDOM CLIMBS",
              help="The paper's budget instead: random layouts, then climbs, each to its end.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--max-distance", type=float, help="Refuse layouts whose task takes longer than this (steps, metres).")
@click.option("--start-from", metavar="LAYOUT", help="Begin with this layout; a kitchen also sets the shape.")
@click.option("--lock", multiple=True, metavar="STATION", help="Kitchens: leave this station where it is; repeatable.")
@click.option("--relocation-cost", type=float, default=0.0, help="Kitchens: cost of each moved station, in score.")
@click.option("--set", "assigned", multiple=True, type=_Assignment(), metavar="NAME=VALUE",
              help="Another setting of the workspace; repeatable.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Continue the search in the --out folder, with its own settings.")
@click.option("--overwrite", is_flag=True, help="Replace a search that lies in the --out folder.")
@click.option("--quiet", is_flag=True, help="Show no progress bar.")
@_out
@click.pass_context
def optimize(ctx: click.Context, domain: str, out: Path | None, **settings: Any) -> None:
    """Search for legible layouts.

    WORKSPACE is overcooked, tabletop, one you installed (see `legible workspaces`), or MODULE:CLASS. Writes the
    archive, curves, pictures and a report into the --out folder. For tables it searches object placement, virtual
    obstacles, and both, one after the other.
    """
    from benchmarks.cli.optimize import check_options, default_folder, run_search

    given = {name for name in settings if ctx.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT}
    check_options(domain, given)
    if {"evaluations", "iterations"} <= given:
        raise click.UsageError("give either --evaluations or --iterations, not both")
    folder = out or default_folder(domain, settings)
    if settings["evaluations"] is None and settings["iterations"] is None:
        settings["evaluations"] = 200_000
    run_search(domain, folder, settings, given)


@main.command()
@click.argument("run", type=click.Path(exists=True, file_okay=False, path_type=Path))
def report(run: Path) -> None:
    """Write the report of a search again.

    RUN is its folder; the search may be finished or not. Writes report.html and the pictures beside it.
    """
    from benchmarks.cli.optimize import write_pictures

    click.echo(f"report: {write_pictures(run)['report']}")


@main.command()
def emitters() -> None:
    """List the emitters that can be named."""
    from benchmarks.cli.optimize import emitter_rows
    from benchmarks.console import say, table

    say().print(table(emitter_rows()))


@main.command()
def workspaces() -> None:
    """List the workspaces that can be named."""
    from benchmarks.cli.optimize import workspace_rows
    from benchmarks.console import say, table

    say().print(table(workspace_rows()))


# -- single layouts ----------------------------------------------------------------------------------------------------


@main.command()
@_layout
@_workspace
@click.option("--prefix", type=_Prefix(), help="Which prefixes count. [default: mean, or the run's own]")
@_pots
@_task
@click.option("--trajectories", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="Trajectories (.npz, .csv, or recorded play): also predict their goals.")  # fmt: skip
@click.option("--predictor", "predictors", multiple=True, metavar="NAME|MODULE:CLASS",
              help="Evaluate this predictor by cross-validation; repeatable.")  # fmt: skip
@click.option("--cut", type=click.Choice(["steps", "cells", "time", "arc"]), default="steps", show_default=True,
              help="The quantity that fractions observed refer to.")  # fmt: skip
@click.option("--folds", type=click.IntRange(min=2), default=4, show_default=True, help="Of the cross-validation.")
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True, help="Of the cross-validation.")
@click.option("--by-participant", is_flag=True, help="Evaluate on participants whom it did not learn from.")
@click.option("--keep-rare", is_flag=True, help="Keep goals with fewer examples than folds.")
@click.option("--curve/--no-curve", default=True, show_default=True, help="Draw a learning curve.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the splits.")
@_out
@click.pass_context
def score(
    ctx: click.Context,
    layout: str,
    workspace: str | None,
    prefix: Any,
    pots: int | None,
    task: str | None,
    trajectories: Path | None,
    predictors: tuple[str, ...],
    by_participant: bool,
    out: Path | None,
    **settings: Any,
) -> None:
    """Score a layout exactly, and predictors on it.

    Prints legibility, distance, and what belongs beside them. With --predictor, evaluates predictors on the
    trajectories in the --trajectories file, and writes tables, figures and a page into the --out folder; where LAYOUT
    is the folder of a search, into its people folder, and a section into its report.
    """
    from benchmarks.cli.layouts import print_predictions, save_evaluation, score_lines, trajectories_in
    from benchmarks.presenters.registry import load_design

    given = [
        name
        for name in (*settings, "by_participant", "out")
        if ctx.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT
    ]
    if predictors and trajectories is None:
        raise click.UsageError("--predictor needs --trajectories to evaluate it on")
    if given and not predictors:
        raise click.UsageError(f"--{given[0].replace('_', '-')} is about --predictor, which is not given")
    design = load_design(layout, workspace=workspace, prefix=prefix, pots=pots, task=task)
    for line in score_lines(design):
        click.echo(line)
    if trajectories is None:
        return
    from benchmarks.console import say

    if not predictors:
        print_predictions(say(), design, trajectories)
        return
    from benchmarks.reports.prediction_report import evaluate_trajectories, print_evaluation

    recorded = trajectories_in(design, trajectories)
    results = evaluate_trajectories(recorded, predictors, groups="participant" if by_participant else None, **settings)
    print_evaluation(say(), results)
    for line in save_evaluation(results, layout, out):
        click.echo(line)


@main.command()
@_layout
@_workspace
@click.option("--prefix", type=_Prefix(), help="Which prefixes count. [default: mean, or the run's own]")
@_pots
@_task
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="Where to write the picture (.png).")
def show(layout: str, workspace: str | None, prefix: Any, pots: int | None, task: str | None, out: Path | None) -> None:
    """Draw a layout and explain its score.

    Which reaches win and lose it, and where goals are confused. For the search of a table draws its panels: the
    baseline, the best layout of every condition, and the desired configuration.
    """
    from benchmarks.cli.layouts import show_design
    from benchmarks.console import say
    from benchmarks.presenters.registry import load_design

    show_design(say(), load_design(layout, workspace=workspace, prefix=prefix, pots=pots, task=task), out)


@main.command()
@_layout
@click.option("--fps", type=click.IntRange(1, 60), default=8, show_default=True, help="Steps per second.")
@click.option("--record", type=click.Path(dir_okay=False, path_type=Path), help="Write your actions to this .npz file.")
def play(layout: str, fps: int, record: Path | None) -> None:
    """Cook in a kitchen yourself.

    Arrow keys or W A S D move, space or E interacts, Esc ends.
    """
    from benchmarks.presenters.overcooked import load_kitchen
    from legible_envs.overcooked.human_play import play as play_layout

    kitchen = load_kitchen(layout)
    played = play_layout(kitchen.layout, recipes=kitchen.soups, fps=fps, record=record)
    click.echo(f"{len(played.actions):,} steps, reward {played.rewards.sum():g}")
    if record is not None and len(played.actions):
        click.echo(f"recorded: {record}")


# -- recordings, demonstration, speed -------------------------------------------------------------------------


@main.group(cls=_Commands)
def humans() -> None:
    """Fetch recordings of people, and evaluate predictors on them."""


@humans.command()
@click.option("--from", "source", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="A copy of the source distribution, instead of the package index.")  # fmt: skip
@_out
def fetch(source: Path | None, out: Path | None) -> None:
    """Fetch recorded games of real people, once.

    They come from the package index, are checked and converted; nothing in the download is executed.
    """
    from legible_envs.datasets.overcooked_2019 import fetch_recordings

    click.echo(f"recordings: {fetch_recordings(out, source=source)}")


@humans.command()
@click.option("--from", "folder", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="The folder `legible humans fetch --out` wrote.")  # fmt: skip
def stats(folder: Path | None) -> None:
    """Count games, participants, transitions and trajectories."""
    from benchmarks.console import say, table
    from legible_envs.datasets.overcooked_2019 import recording_stats

    say().print(table(recording_stats(folder)))


humans.add_command(evaluate)


@main.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("runs/demo"), show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--offline", is_flag=True, help="Do not fetch recorded play.")
def demo(out: Path, seed: int, offline: bool) -> None:
    """Search, compare, predict: the whole in a minute.

    Searches a legible kitchen, compares it with a random and an efficient one, and predicts the goals of recorded
    participants.
    """
    from benchmarks.cli.demo import run_demo
    from benchmarks.console import say

    run_demo(out, seed=seed, offline=offline, console=say())


@main.command()
@click.option("--quick", is_flag=True, help="A tenth of the repeats: rough figures in a minute.")
@click.option(
    "--peers",
    is_flag=True,
    help="Measure Overcooked-AI, imitation and irl-maxent beside it, each in an environment of its own (2 GB).",
)
@click.option("--peers-dir", type=click.Path(path_type=Path, file_okay=False), help="Where these environments live.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as Markdown.")
def bench(quick: bool, peers: bool, peers_dir: Path | None, out: Path | None) -> None:
    """Measure speed, as ratios within one run."""
    from benchmarks.console import say
    from benchmarks.throughput.run import run_benchmark

    run_benchmark(say(), quick=quick, peers=peers, peers_folder=peers_dir, out=out)


if __name__ == "__main__":
    main(prog_name="legible")
