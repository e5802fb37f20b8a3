"""``legible sweep``."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.cli.destinations import check_folder
from benchmarks.cli.options import out_folder

__all__ = ["sweep"]


@click.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@out_folder
@click.option("--workers", type=click.IntRange(min=1), help="Processes on this machine. [default: all cores]")
@click.option("--scheduler", metavar="ADDRESS", help="Run on a Dask cluster, e.g. tcp://10.0.0.1:8786.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def sweep(file: Path, out: Path | None, workers: int | None, scheduler: str | None, quiet: bool) -> None:
    """Run a grid of workspaces, objectives, emitters and seeds.

    FILE is TOML: `workspaces` (required), `emitters`, `objectives`, `evaluations`, `seeds`, `predictors`, `people`
    (the last two also inside a workspace, for it alone).
    Every finished search is kept at once; running the same file again runs only what is missing.
    """
    from benchmarks.console import say, table
    from benchmarks.sweeps.analysis import for_reading
    from benchmarks.sweeps.run import run_sweep
    from benchmarks.sweeps.sweep import Sweep
    from benchmarks.trials import TrialsFailed
    from benchmarks.trials.progress import TrialsProgress

    plan = Sweep.from_toml(file)
    folder = out or Path("runs") / plan.name
    failed = None
    try:
        with TrialsProgress(False if quiet else None) as progress:
            rows = run_sweep(plan, folder, workers=workers, scheduler=scheduler, progress=progress)
    except TrialsFailed as error:
        rows, failed = error.table, error
    except KeyboardInterrupt:
        click.echo(f"stopped; finished trials are kept in {folder}; the same command continues from there", err=True)
        raise click.exceptions.Exit(130) from None
    if len(rows):
        say().print(table(for_reading(rows)))
    click.echo(f"results {folder / 'results.csv'}\nsummary {folder / 'summary.csv'}")
    if failed is not None:
        raise click.ClickException(str(failed))
