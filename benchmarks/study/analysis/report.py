"""The analysis of a study: tables, figures and the report, in the form of the experiments' own."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.csv_tables import write_tables
from benchmarks.study.analysis.data import read_export
from benchmarks.study.analysis.export import export
from benchmarks.study.analysis.findings import Findings, find
from benchmarks.study.analysis.sections import result_tables, sections_of
from benchmarks.study.analysis.settings import AnalysisSettings, claims_of, settings_for
from benchmarks.study.design.study import Study

if TYPE_CHECKING:
    from benchmarks.study.analysis.settings import Claim

__all__ = ["Analysed", "analyse"]


@dataclass(frozen=True, eq=False)
class Analysed:
    """What an analysis wrote.

    Attributes:
        report: The page.
        findings: What stands in it.
    """

    report: Path
    findings: Findings


def analyse(
    study: Study,
    database: Path,
    out: Path,
    *,
    settings: AnalysisSettings | None = None,
    quick: bool = False,
    include_incomplete: bool = False,
    exclude: Sequence[str] = (),
    treatment: str | None = None,
    controls: Sequence[str] = (),
    design: str | None = None,
    progress: Callable[[str], object] | None = None,
) -> Analysed:
    """Export a study's data into ``out/data`` and analyse them: ``tables``, ``figures`` and ``report.html``.

    Args:
        study: The design.
        database: Its database.
        out: Folder.
        settings: How much is done; None for the domain's.
        quick: The quick version of these.
        include_incomplete: Whether participants count who did not get to the end.
        exclude: Participants to leave out.
        treatment: The condition in which goals should be predicted better; None for the reproduction's.
        controls: The conditions to beat.
        design: As for :func:`.export`.
        progress: Called with what comes next, in words.

    Raises:
        ValueError: What :func:`.export` refuses, an unknown participant or condition.
    """
    from benchmarks.reports.experiment_report import write_experiment_report

    chosen = settings or settings_for(study.content.domain, quick=quick)
    claims: list[Claim] = claims_of(study.content.domain, study.conditions, treatment, controls)

    def told(done: int, whole: int, name: str) -> None:
        if progress is not None:
            progress(f"export: {name} ({done + 1} of {whole})")

    export(study, database, out / "data", include_incomplete=include_incomplete, design=design, progress=told)
    data = read_export(out / "data", exclude=exclude)
    with warnings.catch_warnings():
        # What predictors warn of on little data, such as a fit that has not converged, is no matter of a user's.
        warnings.simplefilter("ignore")
        findings = find(study, data, chosen, claims, progress=progress)
        for folder in (out / "tables", out / "figures"):
            folder.mkdir(parents=True, exist_ok=True)
            for old in folder.iterdir():
                old.unlink()
        write_tables(out / "tables", [(name, table) for name, table in result_tables(findings).items() if len(table)])
        sections = sections_of(study, findings, chosen, out / "figures")
    mode = data.manifest["mode"]
    people = len(data.participants)
    lede = f"{people} {'participant' if people == 1 else 'participants'}, design {data.manifest['design']}."
    if mode == "debug":
        lede += " These are debug data: of simulated participants, or of people who tried the study."
    report = write_experiment_report(out, sections, title=study.content.title, lede=lede, eyebrow="study")
    return Analysed(report, findings)
