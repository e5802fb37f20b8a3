"""``legible sweep``."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.cli.destinations import check_folder
from benchmarks.cli.options import out_folder, scheduler_option, workers_option
from benchmarks.cli.program import STOPPED
from benchmarks.console import tell

__all__ = ["sweep"]


@click.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@out_folder
@workers_option
@scheduler_option
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
    check_folder(folder, "--out")
    failed = None
    try:
        with TrialsProgress(False if quiet else None) as progress:
            rows = run_sweep(plan, folder, workers=workers, scheduler=scheduler, progress=progress)
    except TrialsFailed as error:
        rows, failed = error.table, error
    except KeyboardInterrupt:
        tell(f"stopped; finished trials are kept in {folder}; the same command continues from there", err=True)
        raise click.exceptions.Exit(STOPPED) from None
    if len(rows):
        say().print(table(for_reading(rows)))
    tell(f"results {folder / 'results.csv'}\nsummary {folder / 'summary.csv'}")
    if failed is not None:
        raise click.ClickException(str(failed))
