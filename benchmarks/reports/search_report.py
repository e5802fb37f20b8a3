"""``report.html``: one self-contained page about a search, readable from disk, from mail, in ten years.

The page makes no request of any kind. Numbers and layouts travel in one JSON block that the page can save as a file;
a script in the page draws them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.presenters.base import Panel, Presenter, summary_of, template
from benchmarks.presenters.losses import explains_stages, loss_row, losses_and_gains
from benchmarks.presenters.registry import presenter_of_run
from benchmarks.reports.numbers import fixed, significant
from benchmarks.reports.pages import PageTable, page_environment, table_of
from benchmarks.reports.prediction_report import FOLDER, evaluation_section
from benchmarks.reports.variety import pick_varied
from legible_envs.drawing.palette import HEAT
from legible_envs.support.files import write_text
from optimizers import Elites, SearchResult, load_run
from optimizers.errors import SearchError

__all__ = ["report_data", "write_best_image", "write_report"]

MAX_LAYOUTS = 1_000
"""At most so many cells, the best ones, carry their layouts."""
LAYOUT_BYTES = 120_000
"""And at most so many bytes of layouts, so that large kitchens do not outgrow the page."""
MAX_ROWS, MAX_COLUMNS = 80, 120
"""Finer archives are drawn with several cells in one, each showing the best of them."""
WORST_ROWS, BEST_ROWS = 10, 3
"""Reaches of the best layout that are listed."""
VARIED = 8
"""Good layouts that differ from one another, to be shown."""
MAX_POINTS = 240
"""Points of a search curve; longer histories are thinned."""


def write_report(
    run: str | Path | SearchResult,
    *,
    panels: Sequence[Panel] | None = None,
    recorded_play: Mapping[str, Any] | None = None,
) -> Path:
    """Write ``report.html`` into a run folder, from the files that :func:`optimizers.search` left there.

    The results of ``legible score RUN --predictor NAME`` are a section of it.

    Args:
        run: The folder of a finished, interrupted or running search, or what :func:`optimizers.load_run` read there.
        panels: Layouts to show side by side; None shows those that the run itself compares, if any.
        recorded_play: How well predictors predict recorded participants' goals (see
            :func:`benchmarks.cli.demo.recorded_play`): ``note``, ``fractions``, ``curves`` (each ``label``,
            ``values``) and ``table`` (``columns``, ``rows``). None leaves the section out; a mapping with only a
            ``note`` says why there are no results.

    Returns:
        The path of the page.

    Raises:
        SearchError: A file of the run is missing or damaged, or no layout has scored yet.
    """
    folder, run = _read(run)
    path = folder / "report.html"
    presenter = presenter_of_run(run)
    data = report_data(run, panels, recorded_play)
    rows = run.workspace.explain(run.require_genome())
    page = _render(data, presenter, rows, evaluation_section(folder / FOLDER) or "")
    write_text(path, page)
    return path


def write_best_image(run: str | Path | SearchResult, **options: Any) -> Path | None:
    """Write ``best.png``, a drawing of the run's best layout, into its folder; ``options`` are those of the drawing.

    Returns:
        The path; None where layouts of this workspace have no picture.
    """
    from legible_envs.drawing import save_png

    folder, run = _read(run)
    picture = presenter_of_run(run).draw(run.workspace.decode(run.require_genome()), run.workspace, **options)
    return None if picture is None else save_png(folder / "best.png", picture)


def _read(run: str | Path | SearchResult) -> tuple[Path, SearchResult]:
    """The folder of a search, and what lies there."""
    if isinstance(run, str | Path):
        return Path(run), load_run(run)
    if run.folder is None:
        raise SearchError("a search without a folder has no place for its report: give search() a checkpoint folder")
    return run.folder, run


def report_data(
    run: SearchResult,
    panels: Sequence[Panel] | None = None,
    recorded_play: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Everything the page shows, as JSON-ready data; this is also what its download button saves."""
    config, presenter, elites = run.config, presenter_of_run(run), run.elites()
    rows, columns = (int(n) for n in config["archive"]["dims"])
    found = presenter.panels(run) if panels is None else panels
    cells, genomes = _cells(run, elites, presenter, rows, columns)
    carried = sum(cell[-1] is not None for cell in cells)
    return {
        "schema": 4,
        "workspace": presenter.name,
        "place": presenter.place(run.workspace),
        "texts": {**asdict(presenter.texts), "panels": presenter.about_panels(found)},
        "objective": dict(config["objective"]),
        "best": _best(run, presenter),
        "axes": _axes(run, elites, rows, columns),
        "cells": cells,
        "varied": pick_varied(genomes[:carried], VARIED),
        "archive_size": len(elites),
        "archive_dims": [rows, columns],
        "history": _history(run),
        "panels": [_panel(panel, presenter, run.workspace) for panel in found],
        "recorded_play": _plain({**_NO_PLAY, **recorded_play}) if recorded_play else None,
        "config": {key: value for key, value in config.items() if key != "result"},
        "result": {key: _plain(value) for key, value in (config.get("result") or {}).items() if key != "best_genome"},
    }


_NO_PLAY: dict[str, Any] = {"note": "", "fractions": [], "curves": [], "table": None}


# -- the parts of the data ---------------------------------------------------------------------------------------------


def _best(run: SearchResult, presenter: Presenter) -> dict[str, Any]:
    genome = run.require_genome()
    summary = {key: _plain(value) for key, value in summary_of(run.workspace, genome).items()}
    return {**summary, "layout": presenter.encode(run.workspace.decode(genome))}


def _axes(run: SearchResult, elites: Elites, rows: int, columns: int) -> list[dict[str, Any]]:
    """Names and labels of both axes; ``step`` is how many archive cells share one drawn cell.

    Rows beyond the first and the last one with a layout in it are left out: rooms allow far fewer obstacles than they
    have cells, and tables no objects that all lie far apart.
    """
    archive = run.config["archive"]
    names = archive.get("measure_names") or ["first measure", "second measure"]
    filled = min(rows, int(elites.index.max()) // columns + 2) if len(elites) else rows
    order_names = list(getattr(run.workspace, "order_names", ()))
    axes = []
    for i, (name, count, whole, most, labels) in enumerate(
        (
            (names[0], filled, rows, MAX_ROWS, None),
            (names[1], columns, columns, MAX_COLUMNS, order_names if len(order_names) == columns else None),
        )
    ):
        step = math.ceil(whole / most)
        low, high = archive["ranges"][i] if "ranges" in archive else (-0.5, whole - 0.5)
        numbers = labels or _cell_labels(low, high, whole)
        shown = [str(numbers[n]) for n in range(0, count, step)]
        axes.append({"name": str(name), "count": len(shown), "step": step, "labels": shown, "whole": whole})
    return axes


def _cell_labels(low: float, high: float, count: int) -> list[str]:
    """For every cell the whole number in its middle, if each has one, else its lower edge."""
    width = (high - low) / count
    if math.isclose(width, 1.0) and math.isclose(low % 1.0, 0.5):
        return [str(round(low + 0.5) + n) for n in range(count)]
    digits = max(0, math.ceil(-math.log10(width)))
    return [f"{low + n * width:.{digits}f}" for n in range(count)]


def _cells(
    run: SearchResult, elites: Elites, presenter: Presenter, rows: int, columns: int
) -> tuple[list[list[Any]], npt.NDArray[Any]]:
    """The archive as ``[row, column, objective, legibility, distance, layout or None]``, best first, and genomes."""
    steps = (math.ceil(rows / MAX_ROWS), math.ceil(columns / MAX_COLUMNS))
    drawn: dict[tuple[int, int], int] = {}
    for i, index in enumerate(elites.index):
        row, column = divmod(int(index), columns)
        drawn.setdefault((row // steps[0], column // steps[1]), i)
    if not drawn:
        return [], elites.solution
    genomes = elites.solution[list(drawn.values())]
    legibility, distance = run.workspace.legibility(genomes), run.workspace.distance(genomes)
    carried = min(MAX_LAYOUTS, presenter.carried(run.workspace, LAYOUT_BYTES))
    cells = [
        [
            *cell,
            _plain(elites.objective[i]),
            _plain(legibility[n]),
            _plain(distance[n]),
            presenter.encode(run.workspace.decode(genomes[n])) if n < carried else None,
        ]
        for n, (cell, i) in enumerate(drawn.items())
    ]
    return cells, genomes


def _history(run: SearchResult) -> dict[str, list[float | None]]:
    names = ("evaluations", "best", "qd_score", "coverage")
    table = run.metrics()
    if table.empty:
        return {}
    picked = np.unique(np.linspace(0, len(table) - 1, min(len(table), MAX_POINTS)).round().astype(int))
    return {name: [_plain(v) for v in table[name].to_numpy(np.float64)[picked]] for name in names}


def _panel(panel: Panel, presenter: Presenter, workspace: Any) -> dict[str, Any]:
    return {
        "name": panel.name,
        "note": panel.note,
        "layout": presenter.encode(panel.layout),
        "paths": presenter.paths(workspace, panel.layout),
        "score": _plain(panel.score),
        "distance": _plain(panel.distance),
        "normalised": _plain(panel.normalised),
        "detour": _plain(panel.detour),
    }


def _explained(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The rows that lose and win most, under a heading each; without headings where rows are no stages."""
    if not explains_stages(rows):
        shown = (*rows[:WORST_ROWS], *rows[WORST_ROWS:][-BEST_ROWS:])
        return [("", [loss_row(row) for row in shown])] if shown else []
    worst, best, title = losses_and_gains(rows, WORST_ROWS, BEST_ROWS)
    groups = ((title, worst), ("Reaches that win most", best))
    return [(name, [loss_row(row) for row in part]) for name, part in groups if part]


def _plain(value: Any) -> Any:
    """The same in types that JSON has; numbers to nine digits, NaN and infinities as null."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(f"{value:.9g}") if math.isfinite(value) else None
    return value if value is None or isinstance(value, str) else str(value)


# -- the page ----------------------------------------------------------------------------------------------------------


def _render(
    data: dict[str, Any], presenter: Presenter, explanation: Sequence[Mapping[str, Any]], people: str = ""
) -> str:
    from markupsafe import Markup

    return (
        page_environment()
        .get_template("report.html.j2")
        .render(
            title=presenter.title(data),
            lede=_lede(data, presenter),
            figures=_figures(data, presenter),
            data=data,
            texts=data["texts"],
            heat=Markup(json.dumps(HEAT)),
            workspace=presenter.name,
            table=table_of(_explained(explanation), 2),
            people_table=_people_table(data["recorded_play"]),
            stages=explains_stages(explanation),
            people=Markup(people),
            best=data["best"],
            settings=_settings(data["config"]),
            created=_date(data["config"].get("created")),
            icons=Markup(presenter.icons()),
            drawing=Markup(presenter.script()),
            script=Markup(template("report.js")),
            payload=Markup(_json_for_script(data)),
        )
    )


def _people_table(play: Mapping[str, Any] | None) -> PageTable | None:
    """Accuracy by kitchen, as a table for the page."""
    if not play or not play["table"]:
        return None
    columns, rows = play["table"]["columns"], play["table"]["rows"]
    return table_of([("", [dict(zip(columns, row, strict=True)) for row in rows])], 3)


def _json_for_script(data: dict[str, Any]) -> str:
    """JSON that cannot end the script element it stands in, nor begin a comment there."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False, default=str)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _lede(data: dict[str, Any], presenter: Presenter) -> str:
    """What was found, in two sentences."""
    best, panels = data["best"], {panel["name"].lower(): panel for panel in data["panels"]}
    texts = presenter.texts

    def far(value: Any) -> str:
        return f"{fixed(value, texts.distance_digits)} {texts.distance_unit}".strip()

    score, length = fixed(best.get("score")), far(best.get("distance"))
    if data["objective"]["name"] == "efficiency":
        text = f"The task of the best {presenter.noun} found takes {length} on average; its legibility is {score}."
    else:
        text = f"The best {presenter.noun} found scores {score} in legibility"
        bounded = data["config"]["workspace"].get("prefix") != "sum"
        if bounded and (best.get("normalised") or -1) > 0:
            text += f", {fixed(100 * best['normalised'], 0)} % of the highest conceivable score"
        text += f", and its task takes {length} on average."
    if "random" in panels:
        other = panels["random"]
        text += f" A median random one scores {fixed(other['score'])} and takes {far(other['distance'])}."
    if "baseline" in panels:
        other = panels["baseline"]
        text += f" The sorted baseline scores {fixed(other['score'])} and takes {far(other['distance'])}."
    cap = data["objective"].get("max_distance")
    return text if cap is None else f"{text} Layouts above a distance of {far(cap)} were not allowed."


def _figures(data: dict[str, Any], presenter: Presenter) -> list[tuple[str, str, str]]:
    """Key figures under the title: name, value, remark."""
    best, result, config = data["best"], data["result"], data["config"]
    filled, cells = data["archive_size"], math.prod(data["archive_dims"])
    evaluations = result.get("evaluations") or (data["history"].get("evaluations") or [None])[-1]
    single = best.get("single_goal_score")
    bounded, texts = config["workspace"].get("prefix") != "sum", presenter.texts
    return [
        (
            "Legibility",
            fixed(best.get("score")),
            f"{fixed(single)} of it from single-goal reaches" if "single_goal_score" in best else "",
        ),
        *(
            [("Normalised", fixed(best["normalised"]), "of at most 1" if bounded else "per reach")]
            if "normalised" in best
            else []
        ),
        ("Distance", fixed(best.get("distance"), texts.distance_digits), texts.distance),
        *([("Mean detour", fixed(best["mean_detour"]), "times the straight line")] if "mean_detour" in best else []),
        ("Evaluations", fixed(evaluations, 0), f"seed {config.get('seed')}"),
        (
            "Archive",
            f"{fixed(filled, 0)} layouts",
            f"{fixed(100 * filled / cells, 0)} % of {fixed(cells, 0)} cells",
        ),
    ]


def _settings(config: Mapping[str, Any]) -> list[tuple[str, list[tuple[str, str]]]]:
    """The manifest as titled lists of name and value, for users."""

    def flat(value: Any, prefix: str = "") -> list[tuple[str, str]]:
        if isinstance(value, Mapping):
            return [row for key, item in value.items() for row in flat(item, f"{prefix}{key} ")]
        text = _words(value)
        return [(prefix.strip().replace("_", " "), text if len(text) <= 240 else text[:239] + "…")] if text else []

    searched = {key: config.get(key) for key in ("objective", "emitter", "seed", "evaluations", "calibration")}
    archive = {key: config["archive"].get(key) for key in ("dims", "measure_names")}
    made = {key: config.get(key) for key in ("created", "git_revision", "platform")}
    if made["git_revision"]:
        revision, *dirty = str(made["git_revision"]).split("-")
        made["git_revision"] = "-".join([revision[:12], *dirty])
    groups = [
        ("Search", {**searched, "archive": archive}),
        ("Workspace", config["workspace"]),
        ("Versions", {**made, **(config.get("versions") or {})}),
    ]
    return [(title, flat(group)) for title, group in groups]


def _words(value: Any) -> str:
    """A setting for reading; empty where nothing was set."""
    if isinstance(value, list):
        return ("; " if any(isinstance(item, list) for item in value) else ", ").join(_words(item) for item in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return significant(value, 6)
    if isinstance(value, int):
        return fixed(value, 0)
    return "" if value is None else str(value)


def _date(text: Any) -> str:
    try:
        moment = datetime.fromisoformat(str(text))
    except ValueError:
        return ""
    zone = f" {moment.tzname()}" if moment.tzname() else ""
    return f"{moment.day} {moment:%B %Y, %H:%M}{zone}"
