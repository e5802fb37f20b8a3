"""``legible train``: a learner on the kitchen or the table, with checkpoints that it goes on from."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

import click

from benchmarks.cli.destinations import check_folder
from benchmarks.cli.options import Assignment, LayoutSource, given_options, out_folder, settings_from
from benchmarks.cli.program import STOPPED
from benchmarks.console import number, plural, tell

if TYPE_CHECKING:
    from benchmarks.experiments.learning.settings import TrainingSettings
    from benchmarks.experiments.learning.train import Moment

__all__ = ["train"]

_KITCHENS: Final = ("layouts", "shape", "recipe_list", "obs", "num_players")
"""Options that are about kitchens alone."""

_EPISODES: Final = 64
"""Of the evaluation at the end."""


@click.command()
@click.argument("domain", type=click.Choice(["overcooked", "tabletop"]), metavar="ENVIRONMENT")
@click.option("--layout", type=LayoutSource(), metavar="LAYOUT", help="Where to play. [default: the environment's own]")
@click.option("--layouts", type=click.Choice(["random", "random:train", "random:test"]),
              help="Kitchens: draw another for every episode.")  # fmt: skip
@click.option("--shape", nargs=2, type=click.IntRange(3, 64), metavar="ROWS COLS", help="Kitchens: their size.")
@click.option("--recipe", "recipe_list", multiple=True, metavar="A,B,…",
              help="Kitchens: an ordered soup by its ingredients; repeatable. [default: three]")  # fmt: skip
@click.option("--obs", type=click.Choice(["vector", "grid"]), help="Kitchens: what a cook sees. [default: vector]")
@click.option("--num-players", type=click.IntRange(1, 4), help="Kitchens: cooks, all played by one network.")
@click.option("--steps", type=click.IntRange(1, 10**12), help="Of all games. [default: 1000000]")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--set", "assigned", multiple=True, type=Assignment(), metavar="NAME=VALUE",
              help="Another setting, such as ppo.entropy=0.02 or environment.arguments.cook_time=10; "
              "repeatable.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on with the training in the --out folder, as it was begun.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
@out_folder
@click.pass_context
def train(ctx: click.Context, domain: str, out: Path | None, resume: bool, quiet: bool, **options: Any) -> None:
    """Train an agent by PPO.

    ENVIRONMENT is overcooked or tabletop. Writes checkpoint.npz, curve.csv, settings.json, speed.json and logs for
    TensorBoard into the --out folder, and tells how well the policy plays; in kitchens, beside the scripted cook.
    After an interruption, --resume goes on from the newest checkpoint, and ends with the same policy as without it.
    """
    from benchmarks.experiments.learning.checkpoints import FILE, load_checkpoint
    from benchmarks.experiments.learning.settings import require_torch

    given = set(given_options(ctx, options))
    if domain == "tabletop" and (wrong := [name for name in _KITCHENS if name in given]):
        name = {"recipe_list": "recipe"}.get(wrong[0], wrong[0]).replace("_", "-")
        raise click.UsageError(f"--{name} is about a kitchen, not about tabletop")
    if {"layout", "layouts"} <= given:
        raise click.UsageError("give either --layout (one kitchen) or --layouts (another for every episode), not both")
    folder = out or Path("runs") / f"train-{domain}-seed{options['seed']}"
    check_folder(folder, "--out")
    require_torch()
    asked = {name: value for name, value in options.items() if name in given}
    before = load_checkpoint(folder).settings if resume and (folder / FILE).exists() else None
    if resume and before is None:
        click.echo(f"there is no training in {click.format_filename(folder)} to go on with: one begins", err=True)
    settings = _settings(domain, asked, before)
    _run(settings, folder, resume, quiet)
    _tell_result(settings, folder)


def _settings(domain: str, asked: Mapping[str, Any], before: TrainingSettings | None) -> TrainingSettings:
    """The settings of a run: the recipe's, or those of the run that goes on, but for what was asked for."""
    from benchmarks.experiments.learning.recipes import DOMAINS, recipe

    if before is not None and before.environment.id != DOMAINS[domain]:
        raise click.UsageError(f"the folder holds a training of {before.environment.id}, not of {DOMAINS[domain]}")
    arguments = _arguments(domain, asked)
    if before is None:
        settings = recipe(domain, arguments)
    else:
        settings = before.replaced({f"environment.arguments.{name}": value for name, value in arguments.items()})
    changes = {name: asked[name] for name in ("steps", "seed") if name in asked}
    changes |= settings_from(asked.get("assigned", ()), "--set")
    return settings.replaced(changes)


def _arguments(domain: str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of the environment that the options ask for, plain data."""
    arguments: dict[str, Any] = {}
    if "layout" in asked:
        arguments |= _of_layout(domain, asked["layout"])
    for option, name in (("layouts", "layouts"), ("obs", "obs_type"), ("num_players", "num_players")):
        if option in asked:
            arguments[name] = asked[option]
    if "shape" in asked:
        arguments["shape"] = list(asked["shape"])
    if "recipe_list" in asked:
        arguments["recipes"] = [[part.strip() for part in text.split(",")] for text in asked["recipe_list"]]
    return arguments


def _of_layout(domain: str, source: str) -> dict[str, Any]:
    """Where to play, from a file or the folder of a search."""
    from benchmarks.presenters.registry import load_design
    from legible_envs.support.specs import plain

    if domain == "overcooked":
        from benchmarks.presenters.overcooked import load_kitchen

        kitchen = load_kitchen(source)
        soups = {} if kitchen.soups == "own" else {"recipes": plain(kitchen.soups)}
        return {"layout": kitchen.layout.to_ascii(), **soups}
    design = load_design(source)
    if design.noun != "table":
        raise click.UsageError(f"{source} is a {design.noun}; expected a table")
    return {"layout": plain(design.layout)}


def _run(settings: TrainingSettings, folder: Path, resume: bool, quiet: bool) -> None:
    from benchmarks.experiments.learning.checkpoints import FILE
    from benchmarks.experiments.learning.train import train as run_training

    try:
        with _Bar(not quiet and sys.stderr.isatty()) as bar:
            run_training(settings, folder, resume=resume, progress=bar)
    except KeyboardInterrupt:
        domain = "tabletop" if "Tabletop" in settings.environment.id else "overcooked"
        shown = click.format_filename(folder)
        kept = f"the checkpoint is kept in {shown}" if (folder / FILE).exists() else "there was no checkpoint yet"
        command = shlex.join(["legible", "train", domain, "--out", str(folder), "--resume"])
        tell(f"stopped; {kept}; to go on: {command}", err=True)
        raise click.exceptions.Exit(STOPPED) from None


def _tell_result(settings: TrainingSettings, folder: Path) -> None:
    """Print how well the policy plays, and the files."""
    from benchmarks.experiments.learning.evaluation import evaluate_policy, evaluate_scripted, summary
    from benchmarks.experiments.learning.policy import load_policy

    environment = settings.environment
    lines = [("policy", summary(evaluate_policy(load_policy(folder), environment, _EPISODES, 1)))]
    greedy = load_policy(folder, greedy=True)
    lines.append(("policy, most probable actions", summary(evaluate_policy(greedy, environment, _EPISODES, 1))))
    if "Overcooked" in environment.id and greedy.space.players == 1:
        lines.append(("scripted cook", summary(evaluate_scripted(environment, _EPISODES, 1))))
    for name, means in lines:
        tell(
            f"{name}: return {number(means['score'])} in {number(means['length'])} steps, all done in "
            f"{means['finished']:.0%} of {plural(int(means['episodes']), 'episode')}"
        )
    shown = click.format_filename(folder)
    tell(f"checkpoint {shown}/checkpoint.npz\ncurve {shown}/curve.csv")


class _Bar:
    """Progress on standard error, where that is a terminal."""

    def __init__(self, show: bool) -> None:
        self._bar: Any = None
        if show:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            status = TextColumn("{task.fields[status]}", markup=False)
            columns = (BarColumn(bar_width=None), MofNCompleteColumn(), status, TimeRemainingColumn(compact=True))
            self._bar = Progress(*columns, console=Console(stderr=True))
            self._task = self._bar.add_task("steps", total=None, status="")

    def __enter__(self) -> _Bar:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, moment: Moment) -> None:
        """Show where the training stands."""
        if self._bar is not None:
            row = moment.row
            status = "" if row["score"] != row["score"] else f"return {row['score']:.1f}, {row['length']:.0f} steps"
            self._bar.update(self._task, completed=moment.steps, total=moment.total, status=status)
