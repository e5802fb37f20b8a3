"""``legible demo``: the project's main job, on real input, in under a minute.

Search a legible kitchen, set it beside a random one and the efficient one, and measure how well predictors predict the
goals of recorded participants.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from benchmarks.console import plural, table
from benchmarks.presenters.base import Panel
from benchmarks.presenters.overcooked import DOUBT, RANDOM_LAYOUTS, panels_text
from benchmarks.reports.numbers import fixed
from benchmarks.reports.search_report import write_best_image, write_report

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from legible_envs.workspace import Workspace

__all__ = ["RANDOM_LAYOUTS", "make_panels", "recorded_play", "run_demo", "write_panels_image"]

SHAPE = (7, 7)
EVALUATIONS = 600_000
"""Of the search for legibility."""
EFFICIENT_EVALUATIONS = 60_000
"""Of the search for efficiency, which is easy: it levels off after some 20,000."""


def run_demo(
    out: Path,
    *,
    console: Console,
    seed: int = 0,
    offline: bool = False,
    shape: tuple[int, int] = SHAPE,
    evaluations: int = EVALUATIONS,
    efficient_evaluations: int = EFFICIENT_EVALUATIONS,
) -> Path:
    """Run the demonstration and write its folder.

    Args:
        out: Folder to write; a run that lies there is replaced.
        console: Where to print.
        seed: Seed of everything random.
        offline: Whether to leave the recordings alone unless they are already there.
        shape: Rows and columns of the kitchen.
        evaluations: Layouts scored in the search for legibility.
        efficient_evaluations: Layouts scored in the search for efficiency.

    Returns:
        The path of the report.
    """
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from optimizers import search

    workspace = OvercookedWorkspace(shape=shape)
    rows, columns = shape
    with _step(console, "Compiling (once; later runs find the compiled code)"):
        workspace.scores(
            workspace.perturb(workspace.sample(2, np.random.default_rng(seed)), 2, np.random.default_rng(0))
        )
    console.print(f"Searching a legible {rows}x{columns} kitchen: {plural(evaluations, 'layout')}, exact scores")
    result = search(workspace, evaluations=evaluations, seed=seed, checkpoint=out, overwrite=True)
    if result.best_genome is None:
        raise ValueError(f"no layout scored in {plural(evaluations, 'evaluation')}; allow more")
    with _step(console, "Searching the efficient kitchen, drawing random ones"):
        found = make_panels(workspace, result.best_genome, seed=seed, evaluations=efficient_evaluations)
    with _step(console, "Predicting the goals of recorded participants"):
        people = recorded_play(fetch=not offline)
    write_best_image(out)
    image = write_panels_image(out, workspace, found)
    page = write_report(out, panels=found, recorded_play=people)
    console.print()
    console.print(panels_text(console, found))
    console.print()
    if people.get("table"):
        rows_of_table = [dict(zip(people["table"]["columns"], row, strict=True)) for row in people["table"]["rows"]]
        console.print("Recorded participants: goals predicted correctly", style="bold")
        console.print(table(rows_of_table))
    console.print(people["note"], style="dim", markup=False)
    console.print(f"\npicture {image}\nreport  {page}", markup=False)
    return page


@contextmanager
def _step(console: Console, what: str) -> Iterator[None]:
    """Print what is going on while it lasts."""
    with console.status(what):
        if not console.is_terminal:
            console.print(what)
        yield


def make_panels(workspace: Workspace, best: npt.NDArray[Any], *, seed: int, evaluations: int) -> list[Panel]:
    """The random, the efficient and the legible layout, ready to be shown side by side.

    Args:
        workspace: The design problem.
        best: ``(d,)`` the legible genome.
        seed: Seed of the random layouts and of the search for efficiency.
        evaluations: Layouts that search scores.
    """
    from benchmarks.presenters.panels import median_of_random, panel_of
    from optimizers import search

    median = median_of_random(workspace, RANDOM_LAYOUTS, np.random.default_rng(seed))
    efficient = search(
        workspace, objective="efficiency", evaluations=evaluations, seed=seed, progress=False
    ).best_genome
    assert efficient is not None  # efficiency is defined for every valid layout
    return [
        panel_of(workspace, "random", median, f"the median of {RANDOM_LAYOUTS:,} random layouts by legibility"),
        panel_of(workspace, "efficient", efficient, "the shortest task that a search found"),
        panel_of(workspace, "legible", best, "the best layout of this search"),
    ]


def write_panels_image(out: Path, workspace: OvercookedWorkspace, found: list[Panel]) -> Path:
    """Write ``boards.png``: the panels side by side, each with the cells where the goal is confused."""
    from legible_envs.overcooked.rendering import draw_ambiguity, draw_side_by_side, save_png

    return save_png(
        out / "boards.png",
        draw_side_by_side(
            [draw_ambiguity(p.layout, workspace.ambiguity(p.layout), tile=44, legend=DOUBT) for p in found],
            [p.name for p in found],
            [f"legibility {fixed(p.score, 1)}\ndistance {fixed(p.distance, 0)} steps" for p in found],
        ),
    )


def recorded_play(folder: Path | None = None, *, fetch: bool = True) -> dict[str, Any]:
    """How well two predictors predict recorded participants' goals.

    In the form that :func:`~benchmarks.reports.search_report.write_report` takes.

    Args:
        folder: Where the recordings are or shall be; None means the user's cache folder.
        fetch: Whether to fetch them if they are not there yet.

    Returns:
        ``note`` and, where there are recordings, ``fractions``, ``curves`` and ``table``.
    """
    from legible_envs.datasets.overcooked_2019 import RecordingsError, fetch_recordings, load_recorded_games

    try:
        if fetch:
            fetch_recordings(folder)
        else:
            load_recorded_games(folder, layouts=())
    except (RecordingsError, OSError) as error:
        return {"note": f"Recorded play was left out: {' '.join(str(error).split())}"}
    from benchmarks.experiments.prediction.run import score_recorded_play
    from benchmarks.experiments.prediction.sweep import UNTRAINED

    return _summed_up(score_recorded_play(folder, predictors=UNTRAINED, repeats=1))


def _summed_up(scores: pd.DataFrame) -> dict[str, Any]:
    """Accuracy by share observed over all trajectories, and by kitchen over all shares."""
    kitchens, predictors = list(scores["layout"].unique()), list(scores["predictor"].unique())
    weighted = scores.assign(hits=scores["accuracy"] * scores["walks"])
    summed = weighted.groupby(["predictor", "fraction"], sort=False)[["hits", "walks"]].sum()
    curve = summed["hits"] / summed["walks"]
    fractions = sorted(float(f) for f in scores["fraction"].unique())
    means = scores.groupby(["layout", "predictor"], sort=False)[["accuracy", "chance", "walks"]].mean()
    rows = [
        [
            kitchen.replace("_", " "),
            int(means["walks"][kitchen, predictors[0]]),
            *(float(means["accuracy"][kitchen, predictor]) for predictor in predictors),
            float(means["chance"][kitchen, predictors[0]]),
        ]
        for kitchen in kitchens
    ]
    return {
        "note": (
            f"{plural(sum(row[1] for row in rows), 'recorded trajectory')} of real players (Carroll et al., NeurIPS "
            f"2019) in {plural(len(kitchens), 'kitchen')} that were not designed to be legible. Accuracy by share "
            f"observed (in {scores.attrs['cut']}), ties shared out; every dispenser in reach is a candidate. Neither "
            "predictor has learned anything from these players; chance is a guess among the candidates. The table "
            f"averages over {fractions[0]:.0%} to {fractions[-1]:.0%}."
        ),
        "fractions": fractions,
        "curves": [{"label": p, "values": [float(curve[p, f]) for f in fractions]} for p in predictors],
        "table": {"columns": ["kitchen", "trajectories", *predictors, "chance"], "rows": rows},
    }
