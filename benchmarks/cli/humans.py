"""The command ``legible humans evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.destinations import DestinationFolder

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

__all__ = ["evaluate", "evaluate_predictors"]


@click.command()
@click.option("--from", "folder", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="The folder `legible humans fetch --out` wrote.")  # fmt: skip
@click.option("--pointing", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="A file of real pointing (.csv.gz): evaluate predictors of reaches on it too.")  # fmt: skip
@click.option("--neural/--no-neural", default=None, help="Evaluate networks too. [default: where torch is installed]")
@click.option("--layout", "layouts", multiple=True, metavar="NAME", help="Only this kitchen; repeatable.")
@click.option("--repeats", type=click.IntRange(1, 1_000), default=3, show_default=True, help="Of the cross-validation.")
@click.option("--out", type=DestinationFolder(), help="Folder to write tables to.")
def evaluate(
    folder: Path | None,
    pointing: Path | None,
    neural: bool | None,
    layouts: tuple[str, ...],
    repeats: int,
    out: Path | None,
) -> None:
    """Evaluate every predictor on the recorded games.

    Prints accuracy in each kitchen and, in brackets, the difference from what other implementations measured; takes
    minutes, or a quarter of an hour with networks. With --out, also writes it as Markdown, and all figures as CSV.
    """
    from benchmarks.console import say

    evaluate_predictors(say(), folder, pointing=pointing, neural=neural, layouts=layouts, repeats=repeats, out=out)


def evaluate_predictors(
    console: Console,
    folder: Path | None = None,
    *,
    pointing: Path | None = None,
    neural: bool | None = None,
    layouts: tuple[str, ...] = (),
    repeats: int = 3,
    out: Path | None = None,
) -> None:
    """Evaluate predictors on recorded participants, and print and write the tables.

    Args:
        console: Where to print.
        folder: Where the recordings are; None means the user's cache folder.
        pointing: The file of real pointing; None leaves it out.
        neural: Whether to evaluate networks; None means if torch is installed.
        layouts: Kitchens; none means all.
        repeats: Of the cross-validation.
        out: Folder to write to.

    Raises:
        ImportError: Networks are asked for without torch.
        RecordingsError: The recordings are not there.
        ValueError: A kitchen that was not recorded.
    """
    from benchmarks.experiments.prediction.run import score_pointing, score_recorded_play
    from benchmarks.experiments.prediction.sweep import (
        LAYOUTS,
        NEURAL,
        POINTING_NEURAL,
        POINTING_PREDICTORS,
        PREDICTORS,
        Experiment,
    )

    unknown = [name for name in layouts if name not in LAYOUTS]
    if unknown:
        raise ValueError(f"no trajectories are recorded in {unknown}; choose from {list(LAYOUTS)}")
    notes: list[str] = []
    with_networks = _networks_wanted(neural, notes)
    experiment = Experiment(
        predictors=(*PREDICTORS, *(NEURAL if with_networks else ())), layouts=layouts or LAYOUTS, repeats=repeats
    )
    with console.status("") as status:
        pointed = {}
        if pointing is None:
            notes.append("Real pointing was not evaluated: --pointing names its file.")
        else:  # first, so that what is wrong with the file is said before the kitchens take their minutes
            settings = (*POINTING_PREDICTORS, *(POINTING_NEURAL if with_networks else ()))
            pointed["pointing"] = score_pointing(pointing, predictors=settings, tell=status.update)
        found = {"kitchens": score_recorded_play(folder, experiment, tell=status.update), **pointed}
    for name, scores in found.items():
        _print(console, name, scores, out)
    for note in notes:
        console.print(note, style="yellow", markup=False)


def _networks_wanted(neural: bool | None, notes: list[str]) -> bool:
    """Whether networks are evaluated; where torch is not installed, a note says that they are left out."""
    from predictors.neural.training import require_torch

    if neural is False:
        return False
    try:
        require_torch()
    except ImportError as error:
        if neural:
            raise
        notes.append(f"Networks were not evaluated: {error}")
        return False
    return True


def _print(console: Console, name: str, scores: pd.DataFrame, out: Path | None) -> None:
    from benchmarks.console import plural, table
    from benchmarks.csv_tables import write_table
    from benchmarks.experiments.prediction.analysis import accuracy_table, reference_rows, to_markdown

    rows = reference_rows(scores)
    numbers = scores.groupby("layout", sort=False)["walks"].first()
    counts = ", ".join(f"{layout} {plural(int(count), 'trajectory')}" for layout, count in numbers.items())
    about = f"fraction f observed means {scores.attrs['definition']}; ties {scores.attrs['ties']}"
    console.print(f"{name}: mean accuracy over 10..90 % (difference from before)", style="bold")
    console.print(table(rows))
    console.print(f"{counts}; {about}", style="dim", markup=False)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / f"{name}.md").write_text(f"{to_markdown(rows)}\n{counts}; {about}.\n", encoding="utf-8")
        write_table(out / f"{name}.csv", accuracy_table(scores))
        console.print(f"tables: {out / name}.md, {out / name}.csv", markup=False)
