"""The commands ``legible study``: studies with people, in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.destinations import DestinationFolder
from benchmarks.cli.program import Commands
from benchmarks.console import tell

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.errors import Problem

__all__ = ["print_problems", "study", "study_folder"]

study_folder = click.argument(
    "folder", metavar="STUDY", type=click.Path(exists=True, file_okay=False, path_type=Path)
)  # shared by the commands of this group


@click.group(cls=Commands)
def study() -> None:
    """Run studies with real people in the browser, and analyse them."""


@study.command()
@click.argument("folder", metavar="STUDY", type=DestinationFolder())
@click.option("--domain", type=click.Choice(["overcooked", "tabletop"]), required=True, help="Kitchens or tables.")
@click.option("--from", "sources", multiple=True, metavar="[NAME=]RUN",
              help="Take layouts from the folder of a search or a reproduction, or from a file; repeatable. "
              "[default: four that come with the package]")  # fmt: skip
@click.option("--language", default="en", show_default=True, metavar="TAG", help="Of the texts, to be translated.")
def new(folder: Path, domain: str, sources: tuple[str, ...], language: str) -> None:
    """Write a new study: the paper's.

    A folder with the settings (study.toml), the texts as Markdown, and the layouts of the conditions. Edit what should
    be different, then `legible study check` it.
    """
    from benchmarks.study.design.new import new_study

    settings = new_study(folder, domain=domain, sources=sources, language=language)
    tell(f"settings {settings}\ntexts {folder / 'texts'}: fill in what stands in [brackets]")
    tell(f"next: legible study check {click.format_filename(folder)}")


@study.command()
@study_folder
@click.option("--rehearse/--no-rehearse", default=True, show_default=True,
              help="Let simulated participants play every round once: can it be finished?")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the rehearsal.")
def check(folder: Path, rehearse: bool, seed: int) -> None:
    """Say everything that is missing or wrong.

    A line for each problem: file, line and what was expected. Exit code 1 if the study cannot run; warnings alone let
    it.
    """
    from benchmarks.study.design.study import check_study, load_study

    problems = check_study(folder)
    print_problems(problems)
    if any(problem.is_error for problem in problems):
        raise click.exceptions.Exit(1)
    loaded = load_study(folder)
    is_fine = _rehearsed(loaded, seed) if rehearse else True
    for line in _summary(loaded):
        tell(line)
    if not is_fine:
        raise click.exceptions.Exit(1)


def print_problems(problems: Sequence[Problem]) -> None:
    """Print problems, a line each, and how many there are."""
    from benchmarks.console import plural

    for problem in problems:
        tell(f"{'error' if problem.is_error else 'warning'}: {problem}")
    errors = sum(problem.is_error for problem in problems)
    if problems:
        tell(f"{plural(errors, 'error')}, {plural(len(problems) - errors, 'warning')}")


def _rehearsed(study: Study, seed: int) -> bool:
    """Print how simulated participants play each round; whether all of them can be finished."""
    import numpy as np

    from benchmarks.console import say
    from benchmarks.study.games.rehearsal import rehearse

    is_fine = True
    with say().status("rehearsing with simulated participants …"):
        played = list(rehearse(study, np.random.default_rng(seed)))
    for each in played:
        what = "practice" if each.screen.kind == "practice" else f"condition {each.screen.condition!r}"
        if not each.screen.obstacles:
            what = f"{what} without obstacles"
        if each.finished:
            tell(f"rehearsed: {what}: {_length(study, each.steps)} of at most {_length(study, each.max_steps)}")
        else:
            is_fine = False
            tell(f"error: {what}: a simulated participant did not finish it in {_length(study, each.max_steps)}")
    return is_fine


def _length(study: Study, steps: int) -> str:
    return f"{steps:,} steps" if study.content.domain == "overcooked" else f"{steps / 30:,.0f} s"


def _summary(study: Study) -> list[str]:
    from benchmarks.console import plural
    from benchmarks.study.orders import make_policy
    from benchmarks.study.timeline import timeline

    content = study.content
    policy = make_policy(content.orders.policy, study.conditions)
    orders = plural(policy.num_orders, "order") if policy.num_orders else "orders drawn for everyone"
    screens = len(timeline(study, study.conditions))
    sittings = f" in {plural(len(content.sittings), 'sitting')}" if len(content.sittings) > 1 else ""
    return [
        f"ready: {plural(len(study.conditions), 'condition')}{sittings}, {orders} ({content.orders.policy}), "
        f"{plural(screens, 'screen')}; design {study.design_hash}"
    ]
