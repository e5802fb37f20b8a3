"""Rows of trials: how well a predictor does on the participants of one layout, logged and read back.

>>> from benchmarks.experiments.predictor_settings import PredictorSetting
>>> from benchmarks.experiments.trial_rows import accuracy_rows
>>> predictor = PredictorSetting("Eq. 1", "reach-bayesian").make()                       # doctest: +SKIP
>>> accuracy_rows(predictor, reaches, folds=4, repeats=3, seed=0)                        # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from benchmarks.csv_tables import as_written

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from benchmarks.trials.store import Rows
    from legible_envs.rollouts.trajectory import Trajectory
    from predictors.base import GoalPredictor

__all__ = ["accuracy_rows", "by_table", "confusion_matrix", "curve_rows", "labelled", "logged_rows"]


def labelled(table: str, rows: pd.DataFrame) -> Rows:
    """Rows of one of several tables, told apart by ``table``."""
    return [{"table": table, **{str(k): v for k, v in row.items()}} for row in rows.to_dict("records")]


def accuracy_rows(
    predictor: GoalPredictor,
    trajectories: Sequence[Trajectory],
    *,
    folds: int,
    repeats: int,
    seed: int,
    starts: bool = True,
    confusion_over: Literal["mean", "sum"] = "mean",
) -> Rows:
    """How well a predictor predicts the goals of participants, by stratified cross-validation.

    Args:
        predictor: Unfitted.
        trajectories: Of one layout, with two goals or more to choose from.
        folds: Of the cross-validation.
        repeats: How often, with other splits.
        seed: Of the splits.
        starts: Whether to log accuracy by where trajectories start, too.
        confusion_over: Whether confusions are the mean or the sum over fractions observed.

    Returns:
        Rows of tables: ``accuracy`` (``participant, fraction, correct, chance, walks``: ``walks`` counts
        trajectories), ``start`` (the same by start in place of participant), ``metrics`` (per fraction, weighted by
        goal) and ``confusion`` (``goal, predicted, count``: trajectories, mean over repeats, mean or sum over
        fractions).
    """
    from predictors.evaluation.cross_validation import evaluate

    found = evaluate({"it": predictor}, trajectories, cv=folds, repeats=repeats, rare="keep", seed=seed)
    each = found.table.assign(
        chance=1 / found.table["candidates"],
        start=np.array([trajectory.start for trajectory in trajectories])[found.table["trajectory"]],
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
    trajectories: Sequence[Trajectory],
    *,
    shares: Sequence[float],
    repeats: int,
    seed: int,
    test_share: float = 0.25,
    rare: Literal["error", "redraw"] = "error",
) -> Rows:
    """A predictor's learning curve: ``split, size, share, accuracy`` (mean over fractions).

    Args:
        predictor: Unfitted.
        trajectories: Of one layout.
        shares: Of the trajectories not held out, to learn from.
        repeats: Splits.
        seed: Of the splits.
        test_share: Share of the trajectories held out.
        rare: What is done about goals that a split's smallest training set never mentions; see
            :func:`predictors.evaluation.learning_curve`.

    Raises:
        ValueError: There are no splits whose smallest training set mentions every goal.
    """
    from predictors.evaluation.cross_validation import learning_curve

    curve = learning_curve(
        {"it": predictor},
        trajectories,
        sizes=list(shares),
        test_share=test_share,
        repeats=repeats,
        rare=rare,
        seed=seed,
    )
    means = curve.table.groupby(["repeat", "size"])["accuracy"].mean().reset_index()
    share_of = dict(zip(sorted(means["size"].unique()), sorted(shares), strict=True))
    return [
        {"split": split, "size": size, "share": share_of[size], "accuracy": accuracy}
        for split, size, accuracy in means.itertuples(index=False, name=None)
    ]


# -- reading back -----------------------------------------------------------------------------------------------------


def logged_rows(folder: Path, name: str, experiment: str) -> pd.DataFrame:
    """The rows of one result file; none where nothing was logged into it.

    Only empty fields are missing values: participants and goals may have names such as "NA".

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
        return as_written(pd.read_csv(path, keep_default_na=False, na_values=[""], low_memory=False))
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
