"""Tables, figures and prose from logged results alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.csv_tables import as_written, write_tables
from benchmarks.experiments.conditions import slug
from benchmarks.experiments.learning.figures import curve_figure
from benchmarks.experiments.learning.narrative import about_curves, about_places, about_results
from benchmarks.reports.experiment_report import Section
from legible_envs.drawing.charts import save_figure

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["bands", "beside_scripted", "elsewhere", "sections"]

ENOUGH = 0.95
"""Share of episodes in which everything must be done."""
AT_MOST = 1.1
"""Steps, as a multiple of the scripted cook's."""


def sections(folder: str | Path) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*.svg``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.learning.run.reproduce` left its results.

    Raises:
        FileNotFoundError: There are no results.
    """
    import pandas as pd

    folder = Path(folder)
    rows = as_written(pd.read_csv(folder / "learning.csv"))
    curves, results, places = bands(rows), beside_scripted(rows), elsewhere(rows)
    speed = rows[rows["table"] == "speed"].dropna(axis=1, how="all").drop(columns="table")
    speed = speed.groupby("task", sort=False, as_index=False).mean(numeric_only=True).drop(columns="seed")
    tables = {"curves": curves, "results": results, "places": places, "speed": speed}
    write_tables(folder / "tables", tables.items())
    drawn = []
    for task, part in curves.groupby("task", sort=False):
        own = results[results["task"] == task]
        reference = float(own["scripted_score"].iloc[0]) if len(own) else float("nan")
        path = folder / "figures" / f"{slug('curve', str(task))}.svg"
        drawn.append(save_figure(path, curve_figure(part, reference, title=f"Learning: {task}")))
    found = [
        Section("How fast is it learned?", about_curves(curves), {"Speed": speed}, drawn),
        Section("Beside the scripted cook", about_results(results, ENOUGH, AT_MOST), {"At the end": results}),
    ]
    if len(places):
        found.append(Section("In other kitchens", about_places(places), {"Where policies were tried": places}))
    return found


def bands(rows: pd.DataFrame) -> pd.DataFrame:
    """Learning curves over seeds.

    Args:
        rows: As logged.

    Returns:
        ``task, steps, score, low, high, finished, seeds``: mean, least and greatest over seeds.
    """
    curves = rows[rows["table"] == "curve"]
    grouped = curves.groupby(["task", "steps"], sort=False)
    table = grouped.agg(
        score=("score", "mean"), low=("score", "min"), high=("score", "max"), finished=("finished", "mean"),
        seeds=("seed", "nunique"),
    )  # fmt: skip
    return table.reset_index().astype({"steps": np.int64})


def beside_scripted(rows: pd.DataFrame) -> pd.DataFrame:
    """Policies where they were trained, beside the scripted cook there.

    Args:
        rows: As logged.

    Returns:
        ``task, player, seeds, score, finished, worst_finished`` (of a seed)``, length, scripted_score,
        scripted_length, ratio`` (of lengths)``, reached`` (seeds with 95 % of episodes finished, in at most 1.1 times
        the scripted cook's steps; where there is none, by the share alone).
    """
    import pandas as pd

    played = rows[(rows["table"] == "played") & (rows["where"] == "trained")]
    found = []
    for (task, player), part in played[played["player"] != "scripted"].groupby(["task", "player"], sort=False):
        cook = played[(played["task"] == task) & (played["player"] == "scripted")]
        length = float(cook["length"].mean()) if len(cook) else float("nan")
        fast = (part["length"] <= AT_MOST * length) | np.isnan(length)
        found.append(
            {
                "task": task,
                "player": player,
                "seeds": len(part),
                "score": part["score"].mean(),
                "finished": part["finished"].mean(),
                "worst_finished": part["finished"].min(),
                "length": part["length"].mean(),
                "scripted_score": float(cook["score"].mean()) if len(cook) else float("nan"),
                "scripted_length": length,
                "ratio": part["length"].mean() / length,
                "reached": int(((part["finished"] >= ENOUGH) & fast).sum()),
            }
        )
    return pd.DataFrame(found)


def elsewhere(rows: pd.DataFrame) -> pd.DataFrame:
    """Policies in other kitchens than those they were trained in.

    Args:
        rows: As logged.

    Returns:
        ``task, where, player, score, finished, length, scripted_score, share`` (of the scripted cook's return); empty
        where nothing was tried elsewhere.
    """
    import pandas as pd

    played = rows[rows["table"] == "played"]
    tried = played[played["task"].isin(played[played["where"] != "trained"]["task"])]
    found = []
    for (task, where), part in tried.groupby(["task", "where"], sort=False):
        cook = float(part[part["player"] == "scripted"]["score"].mean())
        for player, own in part[part["player"] != "scripted"].groupby("player", sort=False):
            means = {name: own[name].mean() for name in ("score", "finished", "length")}
            found.append(
                {"task": task, "where": where, "player": player, **means, "scripted_score": cook}
                | {"share": means["score"] / cook}
            )
    return pd.DataFrame(found)
