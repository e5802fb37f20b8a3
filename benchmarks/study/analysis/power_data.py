"""What a power analysis draws participants from: a pilot's data, or people simulated in the study's layouts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.study.analysis.data import read_export
from benchmarks.study.analysis.evaluate import Readings, read_goals
from benchmarks.study.analysis.export import export
from benchmarks.study.analysis.findings import main_rows, settings_of
from benchmarks.study.analysis.measures import MEASURES, per_condition, scale_values
from benchmarks.study.analysis.settings import AnalysisSettings, settings_for
from benchmarks.study.analysis.simulating import simulate_people
from benchmarks.study.design.study import Study

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["ACCURACY", "measures_of", "pilot_values", "simulated_values"]

ACCURACY = "accuracy"

Progress = Callable[[str], object]


def measures_of(study: Study) -> list[str]:
    """What power can be told of: accuracy, measures of work, and ``QUESTIONNAIRE:SCALE``."""
    asked = [use.name for use in study.content.questionnaires if use.after == "condition"]
    scales = [
        f"{name}:{scale}"
        for name in asked
        for scale in dict.fromkeys(item.scale for item in study.questionnaires[name].items if item.scale)
    ]
    return [ACCURACY, *MEASURES[study.content.domain], *scales]


def pilot_values(
    study: Study,
    database: Path,
    measure: str,
    *,
    predictor: str | None = None,
    design: str | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """``participant, condition, value`` of the participants who are complete.

    Args:
        study: The design.
        database: Of the pilot.
        measure: One of :func:`measures_of`.
        predictor: Whose accuracy, by its label; None for the first.
        design: As for :func:`.export`.
        progress: Called with what comes next, in words.

    Raises:
        ValueError: There is no such measure or predictor, or nobody has a value.
    """
    _check(study, measure)

    def told(done: int, whole: int, name: str) -> None:
        if progress is not None:
            progress(f"export: {name} ({done + 1} of {whole})")

    with TemporaryDirectory() as folder:
        export(study, database, Path(folder), design=design, progress=told)
        data = read_export(Path(folder))
    if measure == ACCURACY:
        return _accuracy(study, data.trajectories, predictor, progress)
    if ":" in measure:
        table = scale_values(data)
        own = table[table["measure"] == measure.replace(":", ": ", 1)]
    else:
        fixed = bool(study.content.domain == "tabletop" and study.content.rounds.reaches)
        table = per_condition(data, study.content.domain, fixed_reaches=fixed, by=("sitting",))
        own = table.assign(value=table[measure]) if len(table) else table.assign(value=[])
    return _known(main_rows(study, own), measure)


def simulated_values(
    study: Study,
    participants: int,
    measure: str,
    rng: np.random.Generator,
    *,
    predictor: str | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """The same of people who are simulated directly.

    Raises:
        ValueError: There is no such measure, or simulated people have none: they answer no questionnaire.
    """
    import pandas as pd

    _check(study, measure)
    if ":" in measure or measure == "idle":
        raise ValueError(f"simulated people have no {measure!r}; take pilot data, or another measure")
    found = simulate_people(study, participants, rng, progress=progress)
    if measure == ACCURACY:
        return _accuracy(study, found.trajectories, predictor, progress)
    rounds = main_rows(study, pd.DataFrame(found.rounds))
    if measure not in rounds:
        raise ValueError(f"simulated people have no {measure!r} in this study")
    return _known(rounds.assign(value=rounds[measure].astype(float)), measure)


def _check(study: Study, measure: str) -> None:
    if measure not in measures_of(study):
        raise ValueError(f"there is no measure {measure!r}; there are {', '.join(measures_of(study))}")


def _accuracy(
    study: Study, trajectories: list[Trajectory], predictor: str | None, progress: Progress | None
) -> pd.DataFrame:
    """Each participant's accuracy, mean over fractions; the predictor is fitted as in the analysis."""
    settings = settings_for(study.content.domain)
    labels = [each.label for each in settings.predictors]
    chosen = labels[0] if predictor is None else predictor
    if chosen not in labels:
        raise ValueError(f"there is no predictor {chosen!r}; there are {', '.join(labels)}")
    only: AnalysisSettings = replace(
        settings, predictors=(settings.predictors[labels.index(chosen)],), repeats=1, curve_repeats=0
    )
    readings: Readings = read_goals(trajectories, settings_of(study), only, progress=progress)
    if not readings.predictors:
        raise ValueError(f"no accuracy is known: {' '.join(readings.unsaid)}")
    rows = main_rows(study, readings.tables["accuracy"])
    return _known(rows.rename(columns={"correct": "value"}), ACCURACY)


def _known(table: pd.DataFrame, measure: str) -> pd.DataFrame:
    own = table[["participant", "condition", "value"]].dropna()
    if not len(own):
        raise ValueError(f"nobody has a value of {measure!r}")
    return own.assign(value=own["value"].astype(float)).reset_index(drop=True)
