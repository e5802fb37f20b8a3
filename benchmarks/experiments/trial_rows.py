"""Judging predictors on the people of one layout: the rows that experiments about conditions log, and read back.

>>> from benchmarks.experiments.trial_rows import Judge, judged_rows, make_judge
>>> judge = make_judge(Judge("Eq. 1", "reach-bayesian").how)                    # doctest: +SKIP
>>> judged_rows(judge, reaches, folds=4, repeats=3, seed=0)                    # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory
    from predictors.base import GoalPredictor

__all__ = [
    "Judge",
    "by_table",
    "confusion_matrix",
    "curve_rows",
    "judged_rows",
    "labelled",
    "logged_rows",
    "make_judge",
]

Rows = list[dict[str, Any]]

_TRIES = 1000


@dataclass(frozen=True)
class Judge:
    """One predictor of a comparison.

    Attributes:
        label: What tables call it.
        predictor: Its name, or ``"module:Class"``.
        parameters: Its parameters.
        learns: Whether more data can make it better, so that it has a learning curve.
        repeats: Most repeats of a cross-validation, for those that take long; 0: as many as for others.
    """

    label: str
    predictor: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    learns: bool = True
    repeats: int = 0

    @property
    def how(self) -> dict[str, Any]:
        """How to make it, as plain data for cells."""
        return {"name": self.predictor, "parameters": dict(self.parameters)}


def make_judge(how: Mapping[str, Any]) -> GoalPredictor:
    """The predictor that :attr:`Judge.how` describes."""
    from predictors.registry import make_predictor

    return make_predictor(how["name"], **how["parameters"])


def labelled(table: str, rows: pd.DataFrame) -> Rows:
    """Rows of one of several tables, told apart by ``table``."""
    return [{"table": table, **{str(k): v for k, v in row.items()}} for row in rows.to_dict("records")]


def judged_rows(
    predictor: GoalPredictor,
    walks: Sequence[Trajectory],
    *,
    folds: int,
    repeats: int,
    seed: int,
    starts: bool = True,
    confusion_over: Literal["mean", "sum"] = "mean",
) -> Rows:
    """How well a predictor reads people, by stratified cross-validation.

    Args:
        predictor: Unfitted.
        walks: Of one layout, with two goals or more to choose from.
        folds: Of the cross-validation.
        repeats: How often, with other splits.
        seed: Of the splits.
        starts: Whether to log accuracy by where walks began, too.
        confusion_over: Whether confusions are the mean or the sum over fractions observed.

    Returns:
        Rows of tables: ``accuracy`` (``participant, fraction, correct, chance, walks``), ``start`` (the same by
        where walks began in place of who walked), ``metrics`` (per fraction, weighted by goal) and ``confusion``
        (``goal, predicted, count``: walks, mean over repeats, mean or sum over fractions).
    """
    from predictors.evaluation.cross_validation import evaluate

    found = evaluate({"it": predictor}, walks, cv=folds, repeats=repeats, rare="keep", seed=seed)
    each = found.table.assign(
        chance=1 / found.table["candidates"],
        start=np.array([walk.start for walk in walks])[found.table["trajectory"]],
    )
    count: dict[str, Any] = {"correct": ("correct", "mean"), "chance": ("chance", "mean")}
    count["walks"] = ("trajectory", "nunique")
    confusion = found.confusion.groupby(["goal", "predicted"])["count"].sum().reset_index()
    confusion["count"] /= repeats * (len(found.fractions) if confusion_over == "mean" else 1)
    keys = {"accuracy": "participant", **({"start": "start"} if starts else {})}
    by = {name: each.groupby([key, "fraction"], sort=False).agg(**count).reset_index() for name, key in keys.items()}
    return [
        *(row for name, table in by.items() for row in labelled(name, table)),
        *labelled("metrics", found.metrics().drop(columns="predictor")),
        *labelled("confusion", confusion),
    ]


def curve_rows(
    predictor: GoalPredictor,
    walks: Sequence[Trajectory],
    *,
    shares: Sequence[float],
    repeats: int,
    seed: int,
    test_share: float = 0.25,
) -> Rows:
    """A predictor's learning curve: ``split, size, share, accuracy`` (mean over fractions).

    Splits whose smallest training set never mentions some goal, so that it could not even be named, are drawn anew.

    Args:
        predictor: Unfitted.
        walks: Of one layout.
        shares: Of the walks not held out, to learn from.
        repeats: Splits.
        seed: Of the splits.
        test_share: Share of the walks held out.

    Raises:
        ValueError: Hardly any split has a training set of the smallest share that mentions every goal.
    """
    from predictors.evaluation.cross_validation import learning_curve

    rows: Rows = []
    for split, number in enumerate(_usable_seeds(walks, min(shares), test_share, repeats, seed)):
        curve = learning_curve(
            {"it": predictor}, walks, sizes=list(shares), test_share=test_share, repeats=1, seed=number
        )
        means = curve.table.groupby("size")["accuracy"].mean()
        for share, (size, accuracy) in zip(sorted(shares), means.items(), strict=True):
            rows.append({"split": split, "size": size, "share": share, "accuracy": accuracy})
    return rows


def _usable_seeds(walks: Sequence[Trajectory], least: float, test_share: float, count: int, seed: int) -> list[int]:
    from predictors.evaluation.splits import nested_training_sets

    seeds = np.random.default_rng(seed).integers(2**31, size=_TRIES).tolist()
    names = {name for walk in walks for name in walk.candidates}
    found: list[int] = []
    for number in seeds:
        pool, _ = nested_training_sets(walks, test_share, np.random.default_rng(number))
        learned = [walks[i] for i in pool[: round(least * len(pool))]]
        if {name for walk in learned for name in walk.candidates} == names:
            found.append(number)
        if len(found) == count:
            return found
    raise ValueError(
        f"of {_TRIES} splits only {len(found)} have {least:.0%} of the walks mention every goal; {count} are needed: "
        "begin with a larger share"
    )


# -- reading back -----------------------------------------------------------------------------------------------------


def logged_rows(folder: Path, name: str, experiment: str) -> pd.DataFrame:
    """The rows of one result file; none where nothing was logged into it.

    Only empty fields are missing values: people and goals may have names such as "NA".

    Args:
        folder: Of the experiment.
        name: Of the file, without ``.csv``.
        experiment: As ``legible reproduce`` calls it.

    Raises:
        FileNotFoundError: There is no such file; the message says how to run the experiment.
    """
    import pandas as pd

    path = folder / f"{name}.csv"
    try:
        return pd.read_csv(path, keep_default_na=False, na_values=[""], low_memory=False)
    except pd.errors.EmptyDataError:
        return pd.DataFrame()
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{path} is missing; run `legible reproduce {experiment}` first") from error


def by_table(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Rows of several tables, as of :func:`labelled`, taken apart; each without the columns of others."""
    return {
        str(name): part.dropna(axis=1, how="all").reset_index(drop=True)
        for name, part in rows.groupby("table", sort=False)
    }


def confusion_matrix(rows: pd.DataFrame, **only: Any) -> pd.DataFrame:
    """A square table: true goals as rows, predicted ones as columns.

    Args:
        rows: ``confusion`` rows.
        only: Values of columns, for which rows are counted.
    """
    for name, value in only.items():
        rows = rows[rows[name] == value]
    goals = sorted({*rows["goal"], *rows["predicted"]})
    wide = rows.pivot_table(index="goal", columns="predicted", values="count", aggfunc="sum", fill_value=0.0)
    return wide.reindex(index=goals, columns=goals, fill_value=0.0)
