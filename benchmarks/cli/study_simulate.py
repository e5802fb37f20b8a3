"""``legible study simulate``."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.cli.program import STOPPED
from benchmarks.console import plural, tell

__all__ = ["simulate"]


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--participants", type=click.IntRange(1, 10_000), default=24, show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the simulated people.")
@click.option("--population", type=click.Choice(["boltzmann", "planner"]), default="boltzmann", show_default=True,
              help="Kitchens: how people walk; both are fitted to recorded participants.")  # fmt: skip
@click.option("--drop-out", type=click.FloatRange(0, 1), default=0.0, show_default=True,
              help="Share of participants who go away somewhere on the way.")  # fmt: skip
@click.option("--pace", type=click.FloatRange(0, 10), default=0.0, show_default=True,
              help="0: as fast as the server answers; 1: as fast as people.")  # fmt: skip
@click.option("--at-once", type=click.IntRange(1, 1000), default=16, show_default=True,
              help="How many take part at the same time.")  # fmt: skip
@click.option("--quiet", is_flag=True, help="Show no progress bar.")
def simulate(
    folder: Path,
    participants: int,
    seed: int,
    population: str,
    drop_out: float,
    pace: float,
    at_once: int,
    quiet: bool,
) -> None:
    """Let simulated people take part through the real server.

    FOLDER is a study. Bots join as debug participants, answer every page and play every round; the debug database is
    then checked row by row, and every game is played again. Run again, it adds further people. Gaps between sittings
    are left out. `legible study export --debug` and `analyse --debug` read what they did.
    """
    from benchmarks.study.bots.simulation import simulate as run
    from benchmarks.study.design.study import load_study
    from benchmarks.study.errors import StudyError

    try:
        study = load_study(folder)
        with _Bar(participants, show=False if quiet else None) as progress:
            found = run(
                study, participants, seed=seed, population=population, drop_out=drop_out, pace=pace, at_once=at_once,
                progress=progress,
            )  # fmt: skip
    except StudyError as error:
        raise click.ClickException(str(error)) from None
    except KeyboardInterrupt:
        tell(
            "stopped; the participants so far are in the debug database. Run the same command again to add others",
            err=True,
        )
        raise click.exceptions.Exit(STOPPED) from None
    endings = ", ".join(f"{count} {ending.replace('_', ' ')}" for ending, count in sorted(found.endings.items()))
    tell(f"{plural(participants, 'participant')}: {endings}")
    tell(f"{plural(found.steps, 'step')} in {found.seconds:.1f} s; {plural(found.states, 'state')} played again, alike")
    for order, count in sorted(found.orders.items(), key=lambda entry: (-entry[1], entry[0])):
        tell(f"  {count:3} x {', '.join(order)}")
    if found.had_gaps:
        tell("The gaps between sittings were left out.")
    tell(f"debug database: {click.format_filename(study.folder / 'data' / 'debug.sqlite')}")


class _Bar:
    """A progress bar on standard error: participants who are done, and steps."""

    def __init__(self, total: int, show: bool | None) -> None:
        import sys

        self._total = total
        self._shown = sys.stderr.isatty() if show is None else show
        self._bar: object = None

    def __enter__(self) -> _Bar:
        if self._shown:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[steps]:,} steps"),
                TimeElapsedColumn(),
            )
            self._bar = bar = Progress(*columns, console=Console(stderr=True))
            self._task = bar.add_task("participants", total=self._total, steps=0)
            bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()  # type: ignore[attr-defined]

    def __call__(self, done: int, steps: int) -> None:
        """Show how far it is."""
        if self._bar is not None:
            self._bar.update(self._task, completed=done, steps=steps)  # type: ignore[attr-defined]
