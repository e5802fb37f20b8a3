"""The command ``legible``: every command of the project, thin over the libraries, with errors of one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from benchmarks.cli.datasets import datasets
from benchmarks.cli.destinations import DestinationFile, DestinationFolder, check_folder
from benchmarks.cli.humans import evaluate
from benchmarks.cli.options import (
    Assignment,
    PositiveNumber,
    Prefix,
    given_options,
    layout_argument,
    of_one_layout,
    out_folder,
    pots_option,
)
from benchmarks.cli.program import STOPPED, Commands, Program
from benchmarks.cli.reproduce import reproduce
from benchmarks.cli.study import study
from benchmarks.cli.study_data import DATA_COMMANDS
from benchmarks.cli.study_server import code, recruit, serve
from benchmarks.cli.study_simulate import simulate
from benchmarks.cli.sweep import sweep
from benchmarks.console import tell
from legible_envs import __version__

__all__ = ["main"]


CONTENTS = {
    "Search": ("optimize", "report"),
    "Layouts": ("score", "show", "play"),
    "Participants and predictors": ("humans fetch", "humans stats", "humans evaluate", "datasets make"),
    "Experiments": ("sweep", "reproduce", "bench"),
    "Studies with people": (
        "study new", "study check", "study simulate", "study serve", "study recruit", "study progress", "study code",
        "study export", "study analyse", "study power", "study replay", "study verify", "study hand-out",
        "study forget",
    ),
    "About": ("demo", "workspaces", "emitters"),
}  # fmt: skip
"""Sections of ``legible --help``: every command, in order."""


class _Contents(Program):
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


@click.group(cls=_Contents, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="legible")
@click.option("--traceback", is_flag=True, help="Show where in the program an error arose.")
def main(traceback: bool) -> None:
    """Design workspaces in which people's motion can be read.

    LAYOUT is a file with the drawing of a kitchen, an Overcooked-AI .layout, the JSON of a table or the layout of a
    workspace you installed; the folder of a search; or - for standard input.
    """


main.add_command(datasets)
main.add_command(sweep)
main.add_command(reproduce)
main.add_command(study)
for command in (simulate, serve, recruit, code, *DATA_COMMANDS):
    study.add_command(command)


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
@click.option("--prefix", type=Prefix(), help="Which prefixes of a trajectory count. [default: mean]")
@pots_option
@click.option("--emitter", default="improve", show_default=True, metavar="NAME|MODULE:CLASS")
@click.option("--emitter-option", "emitter_options", multiple=True, type=Assignment(), metavar="NAME=VALUE",
              help="An option of the emitter, such as sigma=0.5; repeatable.")  # fmt: skip
@click.option("--evaluations", type=click.IntRange(min=1), help="Layouts to score. [default: 200000]")
@click.option("--iterations", nargs=2, type=click.IntRange(0, 1_000_000), metavar="RANDOM CLIMBS",
              help="The paper's budget instead: random layouts, then climbs, each to its end.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option(
    "--max-distance", type=PositiveNumber(), help="Refuse layouts whose task takes longer than this (steps, metres)."
)
@click.option("--start-from", metavar="LAYOUT", help="Begin with this layout; a kitchen also sets the shape.")
@click.option("--lock", multiple=True, metavar="STATION", help="Kitchens: leave this station where it is; repeatable.")
@click.option(
    "--relocation-cost",
    type=PositiveNumber(zero=True),
    default=0.0,
    help="Kitchens: cost of each moved station, in score.",
)
@click.option("--set", "assigned", multiple=True, type=Assignment(), metavar="NAME=VALUE",
              help="Another setting of the workspace; repeatable.")  # fmt: skip
@click.option("--resume", is_flag=True,
              help="Continue the search in the --out folder, as it was begun; begin one if it is empty.")  # fmt: skip
@click.option("--overwrite", is_flag=True, help="Replace a search that lies in the --out folder.")
@click.option("--quiet", is_flag=True, help="Show no progress bar.")
@out_folder
@click.pass_context
def optimize(ctx: click.Context, domain: str, out: Path | None, **settings: Any) -> None:
    """Search for legible layouts.

    WORKSPACE is overcooked, tabletop, one you installed (see `legible workspaces`), or MODULE:CLASS. Writes the
    archive, curves, pictures and a report into the --out folder. For tables it searches object placement, virtual
    obstacles, and both, one after the other.
    """
    from benchmarks.cli.optimize import check_options, default_folder, run_search

    given = set(given_options(ctx, settings))
    check_options(domain, given)
    if {"evaluations", "iterations"} <= given:
        raise click.UsageError("give either --evaluations or --iterations, not both")
    if settings["resume"] and settings["overwrite"]:
        raise click.UsageError("give either --resume (go on with the search there) or --overwrite (replace it)")
    folder = out or default_folder(domain, settings)
    check_folder(folder, "--out")
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

    check_folder(run)
    tell(f"report: {click.format_filename(write_pictures(run)['report'])}")


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
@of_one_layout
@click.option("--trajectories", metavar="FILE|FOLDER|ID",
              help="Trajectories (.npz, CSV, recorded play, a Minari data set): also predict their goals.")  # fmt: skip
@click.option("--predictor", "predictors", multiple=True, metavar="NAME|MODULE:CLASS",
              help="Evaluate this predictor by cross-validation; repeatable.")  # fmt: skip
@click.option("--cut", type=click.Choice(["steps", "cells", "time", "arc"]), default="steps", show_default=True,
              help="The quantity that fractions observed refer to.")  # fmt: skip
@click.option("--folds", type=click.IntRange(2, 1_000), default=4, show_default=True, help="Of the cross-validation.")
@click.option("--repeats", type=click.IntRange(1, 1_000), default=3, show_default=True, help="Of the cross-validation.")
@click.option("--by-participant", is_flag=True, help="Evaluate on participants whom it did not learn from.")
@click.option("--keep-rare", is_flag=True, help="Keep goals with fewer examples than folds.")
@click.option("--curve/--no-curve", default=True, show_default=True, help="Draw a learning curve.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the splits.")
@out_folder
@click.pass_context
def score(
    ctx: click.Context,
    layout: str,
    workspace: str | None,
    prefix: Any,
    pots: int | None,
    player: int | None,
    task: str | None,
    trajectories: str | None,
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
    from benchmarks.cli.layouts import (
        evaluation_folder,
        print_predictions,
        save_evaluation,
        score_lines,
        trajectories_in,
    )
    from benchmarks.presenters.registry import load_design

    given = given_options(ctx, (*settings, "by_participant", "out"))
    if predictors and trajectories is None:
        raise click.UsageError("--predictor needs --trajectories to evaluate it on")
    if given and not predictors:
        raise click.UsageError(f"--{given[0].replace('_', '-')} is about --predictor, which is not given")
    design = load_design(layout, workspace=workspace, prefix=prefix, pots=pots, task=task, player=player)
    if predictors and (folder := evaluation_folder(layout, out)) is not None:
        check_folder(folder, "--out")
    recorded = None if trajectories is None else trajectories_in(design, trajectories)
    for line in score_lines(design):
        tell(line)
    if recorded is None:
        return
    from benchmarks.console import say

    if not predictors:
        print_predictions(say(), design, recorded)
        return
    from benchmarks.reports.prediction_report import evaluate_trajectories, print_evaluation

    results = evaluate_trajectories(recorded, predictors, groups="participant" if by_participant else None, **settings)
    print_evaluation(say(), results)
    for line in save_evaluation(results, layout, out):
        tell(line)


@main.command()
@of_one_layout
@click.option("--out", type=DestinationFile(".png"), help="Where to write the picture (.png).")
def show(
    layout: str,
    workspace: str | None,
    prefix: Any,
    pots: int | None,
    player: int | None,
    task: str | None,
    out: Path | None,
) -> None:
    """Draw a layout and explain its score.

    Which reaches win and lose it, and where goals are confused. For the search of a table draws its panels: the
    baseline, the best layout of every condition, and the desired configuration.
    """
    from benchmarks.cli.layouts import show_design
    from benchmarks.console import say
    from benchmarks.presenters.registry import load_design

    design = load_design(layout, workspace=workspace, prefix=prefix, pots=pots, task=task, player=player)
    show_design(say(), design, out)


@main.command()
@layout_argument
@click.option("--fps", type=click.IntRange(1, 60), default=8, show_default=True, help="Steps per second.")
@click.option("--record", type=DestinationFile(".npz"), help="Write your actions to this .npz file.")
def play(layout: str, fps: int, record: Path | None) -> None:
    """Cook in a kitchen yourself.

    Arrow keys or W A S D move, space or E interacts, Esc ends.
    """
    from benchmarks.console import plural
    from benchmarks.presenters.overcooked import load_kitchen
    from legible_envs.overcooked.human_play import play as play_layout

    kitchen = load_kitchen(layout)
    played = play_layout(kitchen.layout, recipes=kitchen.soups, fps=fps, record=record)
    tell(f"{plural(len(played.actions), 'step')}, reward {played.rewards.sum():g}")
    if record is not None and len(played.actions):
        tell(f"recorded: {click.format_filename(record)}")
    if played.interrupted:
        raise click.exceptions.Exit(STOPPED)


# -- recordings, demonstration, speed -------------------------------------------------------------------------


@main.group(cls=Commands)
def humans() -> None:
    """Fetch recordings of people, and evaluate predictors on them."""


@humans.command()
@click.option("--from", "source", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="A copy of the source distribution, instead of the package index.")  # fmt: skip
@out_folder
def fetch(source: Path | None, out: Path | None) -> None:
    """Fetch recorded games of real people, once.

    They come from the package index, are checked and converted; nothing in the download is executed.
    """
    from legible_envs.datasets.overcooked_2019 import fetch_recordings

    tell(f"recordings: {fetch_recordings(out, source=source)}")


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
@click.option("--out", type=DestinationFolder(), default="runs/demo", show_default=True)
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
@click.option("--peers-dir", type=DestinationFolder(), help="Where these environments live.")
@click.option("--out", type=DestinationFile(".md"), help="Write the table as Markdown (.md).")
def bench(quick: bool, peers: bool, peers_dir: Path | None, out: Path | None) -> None:
    """Measure speed, as ratios within one run."""
    from benchmarks.console import say
    from benchmarks.throughput.run import run_benchmark

    run_benchmark(say(), quick=quick, peers=peers, peers_folder=peers_dir, out=out)


if __name__ == "__main__":
    main(prog_name="legible")
