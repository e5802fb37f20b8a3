"""Tables, figures and prose from logged results alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from benchmarks.csv_tables import write_tables
from benchmarks.experiments.recorded.sweep import BOOTSTRAPS, MIN_TRAJECTORIES
from benchmarks.experiments.trial_rows import logged_rows
from benchmarks.reports.experiment_report import Section
from predictors.evaluation.rank_correlation import detectable, spearman, spearman_rows

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["correlate", "places_of", "sections"]

Floats = npt.NDArray[np.float64]
Level = Literal["stage", "reach"]
LEVELS: Final[tuple[Level, ...]] = ("stage", "reach")


def sections(folder: str | Path, *, bootstraps: int = BOOTSTRAPS) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.recorded.run.reproduce` left its results.
        bootstraps: Resamples behind each interval.

    Raises:
        FileNotFoundError: There are no results.
    """
    import pandas as pd

    from benchmarks.experiments.recorded.figures import draw_all
    from benchmarks.experiments.recorded.narrative import about_correlations

    folder = Path(folder)
    scores, readings = (logged_rows(folder, name, "overcooked").fillna({"goal": ""}) for name in ("scores", "readings"))
    places = {level: places_of(scores, readings, level) for level in LEVELS}
    correlations = pd.concat(
        [correlate(scores, readings, level, bootstraps=bootstraps).assign(level=level) for level in LEVELS],
        ignore_index=True,
    )
    front = ["candidate_set", "level", "predictor"]
    correlations = correlations[[*front, *(c for c in correlations if c not in front)]]
    kitchens = _kitchens(places["stage"])
    tables = {"stages": places["stage"], "reaches": places["reach"], "correlations": correlations, "kitchens": kitchens}
    write_tables(folder / "tables", tables.items())
    figures = draw_all(places["stage"], correlations, folder / "figures")
    return [
        Section(
            "Recorded participants: does the score tell how predictable they are?",
            about_correlations(correlations),
            {"Rank correlation of legibility with accuracy": correlations, "By kitchen": kitchens},
            figures,
        )
    ]


# -- places -----------------------------------------------------------------------------------------------------------


def places_of(
    scores: pd.DataFrame, readings: pd.DataFrame, level: Level, min_trajectories: int = MIN_TRAJECTORIES
) -> pd.DataFrame:
    """Legibility and measured accuracy side by side.

    Args:
        scores: As logged.
        readings: As logged.
        level: A row per ``"stage"`` (start and set of goals) or per ``"reach"`` (the goal, too).
        min_trajectories: Places with fewer recorded trajectories are left out.

    Returns:
        ``candidate_set, kitchen, start, goals`` (and ``goal``), ``predictor, candidates, walks`` (trajectories),
        ``participants, score, accuracy, skill``; skill is the accuracy above guessing among the candidates, 1 if always
        right.
    """
    keys = _keys(level)
    own = scores[scores["goal"] == ""] if level == "stage" else scores[scores["goal"] != ""]
    weighted = readings.assign(hits=readings["correct"] * readings["walks"])
    found = weighted.groupby([*keys, "predictor"], sort=False).agg(
        walks=("walks", "sum"), hits=("hits", "sum"), participants=("participant", "nunique")
    )
    table = found.reset_index().merge(own[[*keys, "candidates", "score"]], on=keys)
    table = table[table["walks"] >= min_trajectories].reset_index(drop=True)
    table["accuracy"] = table.pop("hits") / table["walks"]
    table["skill"] = _skill(table["accuracy"].to_numpy(), table["candidates"].to_numpy())
    return table


def _keys(level: Level) -> list[str]:
    return ["candidate_set", "kitchen", "start", "goals", *(["goal"] if level == "reach" else [])]


def _skill(accuracy: Floats, candidates: Floats) -> Floats:
    chance = 1 / candidates
    return np.asarray((accuracy - chance) / (1 - chance))


def _kitchens(stages: pd.DataFrame) -> pd.DataFrame:
    """Means of stages by kitchen, each stage weighted by its trajectories: four kitchens are too few for a sample."""
    parts = stages.assign(**{f"_{name}": stages[name] * stages["walks"] for name in ("score", "accuracy", "skill")})
    sums = parts.groupby(["candidate_set", "kitchen", "predictor"], sort=False)[
        ["walks", "_score", "_accuracy", "_skill"]
    ].sum()
    for name in ("score", "accuracy", "skill"):
        sums[name] = sums.pop(f"_{name}") / sums["walks"]
    return sums.reset_index()


# -- correlation ------------------------------------------------------------------------------------------------------


def correlate(
    scores: pd.DataFrame, readings: pd.DataFrame, level: Level, *, bootstraps: int = BOOTSTRAPS, seed: int = 0
) -> pd.DataFrame:
    """Rank correlations of legibility with accuracy, with intervals over participants and over places.

    Args:
        scores: As logged.
        readings: As logged.
        level: ``"stage"`` or ``"reach"``, as for :func:`places_of`.
        bootstraps: Resamples: of participants, whose trajectories go together; and of places.
        seed: Of the resamples.

    Returns:
        ``candidate_set, predictor, places, rho`` (with accuracy), ``people_low, people_high, places_low, places_high``
        (95 % percentile intervals), ``p`` (two-sided, by permutation of places), ``rho_skill`` (with the accuracy above
        chance: a stage with fewer goals is both more legible and easier) with ``skill_low, skill_high`` (over places),
        ``rho_within`` (of differences from the mean of each kitchen: kitchens differ in more than legibility),
        and ``detectable``, the correlation that so many places find with a power of 80 %.
    """
    import pandas as pd

    places = places_of(scores, readings, level)
    keys = _keys(level)
    rows = []
    for (candidate_set, predictor), part in places.groupby(["candidate_set", "predictor"], sort=False):
        rng = np.random.default_rng(seed)
        own = readings[(readings["candidate_set"] == candidate_set) & (readings["predictor"] == predictor)]
        hits, walks = _by_person(own, part, keys)
        score, candidates = (part[name].to_numpy(dtype=np.float64) for name in ("score", "candidates"))
        accuracy = part["accuracy"].to_numpy()
        skill = part["skill"].to_numpy()
        by_participant, lots = _resampled(hits, walks, score, bootstraps, rng)
        above = spearman_rows(score[lots], skill[lots])
        rho = spearman(score, accuracy)
        orders = np.stack([rng.permutation(accuracy) for _ in range(bootstraps)])
        shuffled = spearman_rows(np.broadcast_to(score, orders.shape), orders)
        rows.append(
            {
                "candidate_set": candidate_set,
                "predictor": predictor,
                "places": len(part),
                "rho": rho,
                **_interval("people", by_participant),
                **_interval("places", spearman_rows(score[lots], accuracy[lots])),
                "p": float((1 + (np.abs(shuffled) >= abs(rho) - 1e-12).sum()) / (1 + bootstraps)),
                "rho_skill": spearman(score, _skill(accuracy, candidates)),
                **_interval("skill", above),
                "rho_within": spearman(_centred(score, part["kitchen"]), _centred(accuracy, part["kitchen"])),
                "detectable": detectable(len(part)),
            }
        )
    return pd.DataFrame(rows)


def _by_person(readings: pd.DataFrame, places: pd.DataFrame, keys: Sequence[str]) -> tuple[Floats, Floats]:
    """Right predictions and numbers of trajectories, each ``(places, participants)``."""
    weighted = readings.assign(hits=readings["correct"] * readings["walks"])
    index = places.set_index(list(keys)).index
    tables = [
        weighted.pivot_table(index=list(keys), columns="participant", values=name, aggfunc="sum", fill_value=0)
        .reindex(index)
        .to_numpy(dtype=np.float64)
        for name in ("hits", "walks")
    ]
    return tables[0], tables[1]


def _resampled(
    hits: Floats, walks: Floats, score: Floats, bootstraps: int, rng: np.random.Generator
) -> tuple[Floats, npt.NDArray[np.intp]]:
    """``(bootstraps,)`` correlations with participants drawn anew, and ``(bootstraps, places)`` draws of places."""
    participants, number = hits.shape[1], np.empty((bootstraps, hits.shape[1]))
    lots = np.empty((bootstraps, len(score)), dtype=np.intp)
    for i in range(bootstraps):
        number[i] = rng.multinomial(participants, np.full(participants, 1 / participants))
        lots[i] = rng.integers(len(score), size=len(score))
    right, count = number @ hits.T, number @ walks.T
    found = np.full(bootstraps, np.nan)
    # A place counts only if a participant that was drawn has been there.
    for seen in np.unique(count > 0, axis=0):
        rows = ((count > 0) == seen).all(axis=1)
        shares = right[np.ix_(rows, seen)] / count[np.ix_(rows, seen)]
        found[rows] = spearman_rows(np.broadcast_to(score[seen], shares.shape), shares)
    return found, lots


def _centred(values: Floats, groups: pd.Series[Any]) -> Floats:
    """Values without the mean of their group."""
    _, number = np.unique(groups.to_numpy(dtype=str), return_inverse=True)
    return np.asarray(values - (np.bincount(number, values) / np.bincount(number))[number])


def _interval(name: str, values: Floats) -> dict[str, float]:
    known = values[~np.isnan(values)]
    low, high = np.percentile(known, [2.5, 97.5]) if len(known) else (np.nan, np.nan)
    return {f"{name}_low": float(low), f"{name}_high": float(high)}
