"""Evaluation of goal predictors on the trajectories of a file: tables, figures and the section of a report."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.csv_tables import write_tables
from benchmarks.reports.pages import page_environment, table_of
from legible_envs.support.digests import broken_seal, sealed
from legible_envs.support.files import write_text
from legible_envs.support.plain_data import parse_json
from legible_envs.support.text import read_text

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from benchmarks.reports.prediction_file import EvaluationContent
    from legible_envs.drawing.charts import Chart
    from legible_envs.rollouts.trajectory import Cut, Trajectory
    from predictors.evaluation.cross_validation import Comparison, Evaluation, LearningCurve
    from predictors.evaluation.splits import Groups

__all__ = [
    "FOLDER",
    "PredictionResults",
    "evaluate_trajectories",
    "evaluation_section",
    "print_evaluation",
    "write_evaluation",
]

FOLDER: Final = "people"
"""Where in a run's folder ``legible score RUN --predictor`` writes."""
_FILE: Final = "reading.json"
_FIGURES: Final = {
    "accuracy": "Accuracy against the fraction of a trajectory observed, a line for each predictor",
    "learning_curve": "Accuracy against the number of trajectories learned from, a line for each predictor",
    "confusion": "Confusion matrix: true goals as rows, predicted goals as columns",
}
"""Figures by name, and what each shows, for readers who cannot see it."""
_TABLES: Final = (
    "predictions",
    "accuracy",
    "metrics",
    "confusion",
    "omitted",
    "learning_curve",
    "comparison_anova",
    "comparison_means",
    "comparison_pairs",
)
_CONFUSION_AT: Final = 0.5


@dataclass(frozen=True, eq=False)
class PredictionResults:
    """What :func:`evaluate_trajectories` found.

    Attributes:
        evaluation: By cross-validation.
        curve: The learning curve, or None where it was not wanted or there are too few trajectories for one.
        comparisons: By what was compared: ``"predictor"``, or ``"condition"`` and whose values.
        notes: Predictors that could not be evaluated and analyses that were left out, and why.
    """

    evaluation: Evaluation
    curve: LearningCurve | None
    comparisons: dict[str, tuple[Comparison, Comparison]]
    notes: list[str] = field(default_factory=list)


def evaluate_trajectories(
    trajectories: Sequence[Trajectory],
    predictors: Sequence[str],
    *,
    cut: Cut = "steps",
    folds: int = 4,
    repeats: int = 3,
    groups: Groups | None = None,
    keep_rare: bool = False,
    curve: bool = True,
    seed: int = 0,
) -> PredictionResults:
    """Evaluate predictors on trajectories, compare them, and compare the conditions among the trajectories.

    Args:
        trajectories: Complete, with goals.
        predictors: Names or ``"module:Class"``.
        cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        groups: ``"participant"`` keeps each participant on one side of every split.
        keep_rare: Whether to keep goals with fewer examples than folds.
        curve: Whether to make a learning curve, which fits each predictor fifteen times more.
        seed: Of the splits.

    Raises:
        PredictorError: A predictor that cannot be found or made.
        ValueError: None of the predictors can be evaluated on these trajectories.
    """
    from predictors.evaluation.cross_validation import evaluate, learning_curve
    from predictors.evaluation.omissions import omission_notes

    names = list(dict.fromkeys(predictors))
    found = evaluate(
        names,
        trajectories,
        cv=folds,
        repeats=repeats,
        cut=cut,
        groups=groups,
        rare="keep" if keep_rare else "error",
        seed=seed,
    )
    notes = omission_notes(found.omitted)
    grown = None
    if curve:
        try:
            grown = learning_curve(names, trajectories, cut=cut, groups=groups, repeats=3, seed=seed)
            left_out = [note for note in omission_notes(grown.omitted) if note not in notes]
            notes += [f"learning curve: {note}" for note in left_out]
        except ValueError as error:
            notes.append(f"no learning curve: {error}")
    comparisons: dict[str, tuple[Comparison, Comparison]] = {}
    if len(found.predictors) > 1:
        _compare(comparisons, notes, "predictor", found, factor="predictor")
    if len({trajectory.condition for trajectory in trajectories}) > 1:
        for name in found.predictors:
            _compare(comparisons, notes, f"condition ({name})", found, factor="condition", predictor=name)
    return PredictionResults(found, grown, comparisons, notes)


def _compare(
    comparisons: dict[str, tuple[Comparison, Comparison]],
    notes: list[str],
    what: str,
    found: Evaluation,
    **options: Any,
) -> None:
    from predictors.evaluation.cross_validation import compare_conditions

    try:
        each = compare_conditions(found, correct_fractions="holm", **options)
        comparisons[what] = each, compare_conditions(found, at="mean", **options)
    except ValueError as error:
        notes.append(f"no comparison by {what}: {error}")


# -- the terminal -----------------------------------------------------------------------------------------------------


def print_evaluation(console: Console, results: PredictionResults) -> None:
    """Print the figures of merit, accuracy against fraction observed, comparisons, and what they mean."""
    from benchmarks.console import plural, table

    found = results.evaluation
    number = found.table["trajectory"].nunique()
    console.print(
        f"\n{plural(number, 'trajectory')}: prediction of their goals, mean over fractions observed", style="bold"
    )
    console.print(table(_summary_rows(found)))
    console.print("Accuracy by fraction observed", style="bold")
    console.print(table(_accuracy_rows(found)))
    for what, (_, mean) in results.comparisons.items():
        console.print(f"Differences by {what}", style="bold", markup=False)
        console.print(table(_pair_rows(mean)))
        console.print(_verdict(mean), style="dim", markup=False)
    for note in results.notes:
        console.print(note, style="yellow", markup=False)
    console.print(f"definition: {found.definition}", style="dim", markup=False)


def _summary_rows(found: Evaluation) -> list[dict[str, Any]]:
    columns = ["predictor", "accuracy", "f1", "precision", "recall", "log_loss", "calibration_error"]
    return _records(found.summary()[columns])


def _accuracy_rows(found: Evaluation) -> list[dict[str, Any]]:
    wide = found.accuracy().pivot_table(index="predictor", columns="fraction", values="accuracy", sort=False)
    wide = wide.reindex([*wide.index, *found.omitted["predictor"]], columns=sorted(wide.columns))
    return [
        {"predictor": name, **{f"{100 * fraction:.3g}%": float(row[fraction]) for fraction in wide.columns}}
        for name, row in wide.iterrows()
    ]


def _pair_rows(comparison: Comparison) -> list[dict[str, Any]]:
    columns = ["a", "b", "difference", "low", "high", "p", "hedges_g"]
    return _records(comparison.pairs[columns])


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _verdict(comparison: Comparison) -> str:
    """The analysis of variance as a paper reports it."""
    row = comparison.anova.iloc[0]
    kind = "repeated-measures" if comparison.design == "within" else "one-way"
    p = float(row["p_corrected"] if comparison.design == "within" else row["p"])
    said = "p < .001" if p < 0.001 else f"p = {p:.3f}".replace("0.", ".", 1)
    corrected = ", Greenhouse-Geisser" if comparison.design == "within" and len(comparison.means) > 2 else ""
    return (
        f"{kind} ANOVA of means over fractions, {comparison.unit}s as units (each counts once): "
        f"F({row['df1']:.0f}, {row['df2']:.0f}) = {row['F']:.2f}, {said}{corrected}, eta^2 = "
        f"{row['eta_squared']:.3f}; pairs by Tukey's HSD"
    )


# -- files ------------------------------------------------------------------------------------------------------------


def write_evaluation(results: PredictionResults, folder: Path, *, title: str = "Goal prediction") -> list[Path]:
    """Write tidy tables (CSV), figures (SVG), ``reading.json`` and a page ``report.html`` into a folder.

    Returns:
        The files written.

    Raises:
        OSError: The folder cannot be made or written to.
    """
    from legible_envs.drawing.charts import save_figure

    folder.mkdir(parents=True, exist_ok=True)
    # Files of an earlier evaluation must not stand beside those of this one, also where this is interrupted: what says
    # that there is an evaluation goes first and comes last.
    for name in (_FILE, *(f"{name}.svg" for name in _FIGURES), *(f"{name}.csv" for name in _TABLES)):
        (folder / name).unlink(missing_ok=True)
    written = write_tables(folder, _tables(results).items())
    figures = [save_figure(folder / f"{name}.svg", figure) for name, figure in _drawn(results).items()]
    about = {**_about(results), "figures": {path.stem: _digest_of_file(path) for path in figures}}
    write_text(folder / _FILE, json.dumps(sealed(about), indent=1))
    written += figures
    write_text(folder / "report.html", _page(folder, title))
    return [*written, folder / _FILE, folder / "report.html"]


def _tables(results: PredictionResults) -> dict[str, pd.DataFrame]:
    import pandas as pd

    found = results.evaluation
    tables = {
        "predictions": found.table,
        "accuracy": found.accuracy(),
        "metrics": found.metrics(),
        "confusion": found.confusion,
    }
    if len(found.omitted):
        tables["omitted"] = found.omitted
    if results.curve is not None:
        tables["learning_curve"] = results.curve.table
    for part in ("anova", "means", "pairs"):
        found_parts = []
        for what, (each, mean) in results.comparisons.items():
            for at, comparison in (("each", each), ("mean", mean)):
                table = getattr(comparison, part).rename(columns={comparison.factor: "level"})
                found_parts.append(table.assign(compared=what, at=at, unit=comparison.unit, design=comparison.design))
        if found_parts:
            tables[f"comparison_{part}"] = pd.concat(found_parts, ignore_index=True)
    return tables


def _drawn(results: PredictionResults) -> dict[str, Chart]:
    from predictors.evaluation.figures import accuracy_figure, confusion_figure, learning_curve_figure

    found = results.evaluation
    best = str(found.summary().set_index("predictor")["accuracy"].idxmax())
    at = min(found.fractions, key=lambda fraction: abs(fraction - _CONFUSION_AT))
    matrix = found.confusion_matrix(best, fraction=at)
    figures = {
        "accuracy": accuracy_figure(found),
        "confusion": confusion_figure(matrix, title=f"Predictions of {best}, {100 * at:.0f} % observed"),
    }
    if results.curve is not None:
        figures["learning_curve"] = learning_curve_figure(results.curve)
    return figures


def _about(results: PredictionResults) -> dict[str, Any]:
    """The content of the section of a report, as JSON."""
    from benchmarks.reports.prediction_file import SCHEMA

    found = results.evaluation
    return {
        "schema": SCHEMA,
        "definition": found.definition,
        "walks": int(found.table["trajectory"].nunique()),
        "participants": int(found.table["participant"].nunique()),
        "summary": _finite(_summary_rows(found)),
        "comparisons": [
            {"what": what, "verdict": _verdict(mean), "pairs": _finite(_pair_rows(mean))}
            for what, (_, mean) in results.comparisons.items()
        ],
        "notes": results.notes,
    }


def _finite(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows for JSON, which has no infinite effect sizes and no missing numbers: None instead."""
    return [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in rows
    ]


# -- HTML -------------------------------------------------------------------------------------------------------------


def evaluation_section(folder: Path) -> str | None:
    """The section of a report about what :func:`write_evaluation` wrote into a folder, or None if there is none.

    Figures become images within the page, so that no script in their files can run. Where one of the files is damaged
    or was changed, a warning names it and the section is left out.
    """
    from jinja2 import TemplateError

    from benchmarks.reports.prediction_file import EvaluationContent
    from legible_envs.support.models import validated

    file = folder / _FILE
    try:
        text = read_text(file)
    except FileNotFoundError:
        return None
    except ValueError as error:
        _warn_of(file, str(error))
        return None
    try:
        content = parse_json(text)
        about = validated(EvaluationContent, content)
        _check(about, content, folder)
        figures = [
            (name, _FIGURES[name], _as_image(folder / f"{name}.svg"))
            for name in _FIGURES
            if (folder / f"{name}.svg").exists()
        ]
        template = page_environment().get_template("people.html.j2")
        return template.render(
            about=about,
            figures=figures,
            summary=table_of([("", about.summary)], 3),
            comparisons=[(each, table_of([("", _in_words(each.pairs))], 3)) for each in about.comparisons],
        )
    except (OSError, ValueError) as error:
        _warn_of(file, str(error))
    except (KeyError, TypeError, TemplateError):  # rows of a comparison without what is said of each
        _warn_of(file, "it is no evaluation")
    return None


def _warn_of(file: Path, why: str) -> None:
    said = f"{file}: {why}; its section is left out of the report: evaluate again"
    warnings.warn(said, stacklevel=3)


def _check(about: EvaluationContent, content: Mapping[str, Any], folder: Path) -> None:
    """Refuse an evaluation that is not what was written; those of earlier versions have no digests.

    Raises:
        ValueError: It was changed, or a figure beside it was.
    """
    from benchmarks.reports.prediction_file import UNSEALED

    if about.version == UNSEALED:
        return
    if why := broken_seal(content):
        raise ValueError(why)
    for name in _FIGURES:
        if name in about.figures and _digest_of_file(folder / f"{name}.svg") != about.figures[name]:
            raise ValueError(f"{name}.svg beside it was changed since it was written, or damaged")


def _digest_of_file(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _in_words(pairs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of pairs with columns that say what they hold."""
    words = {"a": "first", "b": "second", "difference": "first − second", "low": "95 % from", "high": "95 % to"}
    return [{words.get(key, key): value for key, value in row.items()} for row in pairs]


def _as_image(path: Path) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def _page(folder: Path, title: str) -> str:
    from markupsafe import Markup

    section = Markup(evaluation_section(folder) or "")
    return page_environment().get_template("people_page.html.j2").render(title=title, section=section)
