"""Tables of a sweep, from the results of its trials alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.csv_tables import write_table
from benchmarks.sweeps.sweep import Sweep
from benchmarks.trials import TrialName, TrialStore

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["SEARCH", "for_reading", "results", "summarise", "write_tables"]

SEARCH: Final = TrialName("sweep/search", ("benchmarks.sweeps.run:run_cell",))
"""The name that results of single searches are kept under."""

_SETTINGS: Final = ["workspace", "objective", "emitter", "evaluations"]
_UNSUMMARISED: Final = {*_SETTINGS, "seed", "scored", "best_genome"}


def results(sweep: Sweep, folder: str | Path) -> pd.DataFrame:
    """A row per finished trial under its labels, in the order of the sweep; as :func:`~benchmarks.sweeps.run_sweep`."""
    import pandas as pd

    store = TrialStore(folder, SEARCH)
    rows = [variant.labels | row for variant in sweep.variants() for row in store.load(variant.trial) or ()]
    return pd.DataFrame(rows, columns=None if rows else [*_SETTINGS, "seed"])


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """A row per setting: number of seeds, and mean and standard deviation over them of every result."""
    import pandas as pd

    rows = []
    for labels, part in table.groupby(_SETTINGS, sort=False):
        row = dict(zip(_SETTINGS, labels, strict=True)) | {"seeds": len(part)}
        for column in (name for name in part.columns if name not in _UNSUMMARISED):
            row |= {f"{column}_mean": part[column].mean(), f"{column}_sd": part[column].std()}
        rows.append(row)
    return pd.DataFrame(rows)


def for_reading(table: pd.DataFrame) -> list[dict[str, str]]:
    """The summary for a terminal: settings that vary, and mean ± standard deviation of what matters."""
    summary = summarise(table)
    varying = [name for name in _SETTINGS if summary[name].nunique() > 1] or ["workspace"]
    shown = ["best", "distance", "coverage", *(name for name in table.columns if name.startswith("accuracy."))]
    rows = []
    for entry in summary.to_dict("records"):
        row = {name: str(entry[name]) for name in [*varying, "seeds"]}
        for name in shown:
            mean, sd = entry[f"{name}_mean"], entry[f"{name}_sd"]
            row[name] = "–" if mean != mean else f"{mean:.4g}" + ("" if sd != sd else f" ± {sd:.2g}")
        rows.append(row)
    return rows


def write_tables(sweep: Sweep, folder: str | Path) -> pd.DataFrame:
    """Write ``results.csv`` and ``summary.csv``; return the former."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    table = results(sweep, folder)
    for name, rows in (("results", table), ("summary", summarise(table))):
        write_table(folder / f"{name}.csv", rows)
    return table
