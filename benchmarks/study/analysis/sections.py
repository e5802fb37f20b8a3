"""The pieces of a study's report: prose, tables and figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.experiments.conditions import agreements, stacked
from benchmarks.experiments.trial_rows import confusion_matrix
from benchmarks.reports.experiment_report import Section
from benchmarks.reports.narrative import narrate
from benchmarks.study.analysis import figures
from benchmarks.study.analysis.findings import Findings, main_rows
from benchmarks.study.analysis.measures import MEASURES
from benchmarks.study.analysis.played import IDLE_SECONDS
from benchmarks.study.analysis.settings import AnalysisSettings
from benchmarks.study.design.study import Study

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.study.analysis.measures import Family

__all__ = ["result_tables", "sections_of"]

_LAYOUTS: Final = {
    "overcooked": "The kitchen of each condition. The darker a floor cell, the more often an observer who sees the "
    "person there would predict a wrong goal.",
    "tabletop": "The table of each condition. Ribbons are the shortest reaches: the darker, the less an observer who "
    "has seen the hand come so far believes in its true goal.",
}
"""What the pictures of layouts show, by domain."""


def result_tables(found: Findings) -> dict[str, pd.DataFrame]:
    """Everything that is written to ``tables``, by name."""
    import pandas as pd

    overall = {name: each.overall.anova for name, each in found.comparisons.items()}
    by_fraction = {name: each.each for name, each in found.comparisons.items()}
    tables = {
        "participants": found.data.tables["participants"],
        "excluded": found.data.excluded,
        "metrics": found.metrics,
        "published": found.published,
        "work_means": found.work.means,
        "work_tests": found.work.tests,
        "work_pairs": found.work.pairs,
        "scale_means": found.scales.means,
        "scale_tests": found.scales.tests,
        "scale_pairs": found.scales.pairs,
        "trends": found.trends,
        "spread": found.spread,
        "answers": _choices(found),
        "unsaid": pd.DataFrame({"unsaid": found.unsaid}),
    }
    if overall:
        tables["anova"] = stacked(overall, "predictor").drop(columns="fraction")
        tables["anova_by_fraction"] = stacked({name: one.anova for name, one in by_fraction.items()}, "predictor")
        tables["accuracy_by_fraction"] = stacked({name: one.means for name, one in by_fraction.items()}, "predictor")
        tables["accuracy_pairs"] = stacked(
            {n: each.overall.pairs for n, each in found.comparisons.items()}, "predictor"
        )
    if found.hypotheses:
        tables["verdicts"] = stacked({name: one.verdicts() for name, one in found.hypotheses.items()}, "treatment")
        tests = {name: one.tests.drop(columns="treatment") for name, one in found.hypotheses.items()}
        tables["hypotheses"] = stacked(tests, "treatment")
        points = {name: one.points for name, one in found.hypotheses.items()}
        tables["hypotheses_by_fraction"] = stacked(points, "treatment")
    if found.sittings is not None:
        tables["sitting_means"] = found.sittings.means.rename(columns={"condition": "sitting"})
        tables["sitting_tests"] = found.sittings.tests
        tables["sitting_pairs"] = found.sittings.pairs
    return tables


def _choices(found: Findings) -> pd.DataFrame:
    """Every answer of a questionnaire, and how often it was given; free texts among them."""
    answers = found.data.of_analysed("questionnaires")
    own = answers[
        answers["value"].notna() & answers["questionnaire"].isin(set(answers["questionnaire"]) - {"", "consent"})
    ]
    if not len(own):
        return own.head(0)
    keys = ["questionnaire", "condition", "item", "value"]
    return own.groupby(keys, sort=False).size().rename("times").reset_index()


def sections_of(study: Study, found: Findings, settings: AnalysisSettings, folder: Path) -> list[Section]:
    """All sections, their figures drawn into a folder."""
    parts = [
        _participants(study, found),
        Section("Layouts", "", {}, _layouts(study, folder), {"layouts": _LAYOUTS[study.content.domain]}),
        _accuracy(study, found, settings, folder),
        _published(found, folder),
        _hypotheses(found, study, folder),
        _confusions(study, found, folder),
        _spread(study, found, folder),
        _work(study, found, folder),
        _questionnaires(study, found, folder),
        _practice(study, found),
        Section(
            "What cannot be said", narrate("study/unsaid", people=len(found.data.participants), lines=found.unsaid)
        ),
    ]
    return [part for part in parts if part is not None]


def _participants(study: Study, found: Findings) -> Section:
    people = found.data.tables["participants"]
    analysed = people[people["participant"].isin(found.data.participants)]
    short = analysed[analysed["attention_passed"] < analysed["attention_checks"]]
    text = narrate(
        "study/participants",
        study=study.content.name,
        design=found.data.manifest["design"],
        debug=found.data.manifest["mode"] == "debug",
        joined=len(people),
        states=[(str(name).replace("_", " "), int(n)) for name, n in people["state"].value_counts(sort=False).items()],
        analysed=len(analysed),
        excluded=list(found.data.excluded["participant"]),
        orders=int(analysed["order"].nunique()),
        checks=int(analysed["attention_checks"].sum()),
        passed=int(analysed["attention_passed"].sum()),
        inattentive=short["participant"].tolist(),
        problems=len(found.data.tables["problems"]),
    )
    columns = ["participant", "state", "minutes", "screens_done", "screens", "order"]
    if people["attention_checks"].sum() > 0:
        columns += ["attention_passed", "attention_checks"]
    return Section(
        "Participants",
        text,
        {
            "Participants": people[columns],
            "Not analysed": found.data.excluded,
            "Problems": found.data.tables["problems"],
        },
    )


def _layouts(study: Study, folder: Path) -> list[Path]:
    return [figures.draw_layouts(study, folder / "layouts.png")]


def _accuracy(study: Study, found: Findings, settings: AnalysisSettings, folder: Path) -> Section:
    rows = found.readings.tables.get("accuracy")
    told, chances = [], {}
    for name, each in found.comparisons.items():
        own = each.each.anova
        assert rows is not None
        chances[name] = float(rows[rows["predictor"] == name]["chance"].mean())
        row = each.overall.anova.iloc[0]
        told.append(
            {
                "name": name,
                "means": list(each.overall.means[["condition", "mean"]].itertuples(index=False, name=None)),
                "percent": [f"{100 * f:.0f}" for f in own[own["p_holm"] < settings.alpha]["fraction"]],
                "p": float(row["p_corrected"]),
                **{key: float(row[key]) for key in ("F", "df1", "df2")},
            }
        )
    text = narrate(
        "study/accuracy",
        folds=settings.folds,
        repeats=settings.repeats,
        count=len(found.data.trajectories),
        predictors=told,
    )
    tables = {"Figures of merit, mean over 10 to 90 % observed": found.metrics}
    if found.comparisons:
        tables["Over all fractions: repeated-measures analyses of variance"] = result_tables(found)["anova"]
        tables["Every pair of conditions (Tukey)"] = result_tables(found)["accuracy_pairs"].drop(
            columns=["fraction", "cohens_d"]
        )
    drawn = figures.draw_accuracy(found.comparisons, chances, study.conditions[::-1], folder)
    return Section("How well goals are predicted", text, tables, drawn)


def _published(found: Findings, folder: Path) -> Section | None:
    table = found.published
    if not len(table):
        return None
    predictors = list(dict.fromkeys(str(c).removeprefix("f1, ") for c in table if str(c).startswith("f1, ")))[1:]
    claims = [
        (name, control)
        for name, one in found.hypotheses.items()
        for control in one.controls
        if {name, control} <= set(table["condition"])
    ]
    treatment, control = claims[-1] if claims else ("", "")
    agreed = agreements(table, treatment, control) if claims else {}
    text = narrate(
        "study/published",
        conditions=table["condition"].tolist(),
        treatment=treatment,
        control=control,
        agreements=[{"who": who, **vars(it)} for who, it in agreed.items()],
    )
    drawn = figures.draw_published(table, predictors, folder)
    return Section("Beside the paper", text, {"Weighted F1, precision and recall": table}, drawn)


def _hypotheses(found: Findings, study: Study, folder: Path) -> Section:
    claims = [{"treatment": name, "words": one.words()} for name, one in found.hypotheses.items()]
    text = narrate("study/hypotheses", claims=[{**each, "words": "@@"} for each in claims])
    for each in claims:
        text = text.replace("@@", each["words"], 1)  # its paragraphs stay apart
    tables = {}
    if claims:
        written = result_tables(found)
        tables = {"Verdicts": written["verdicts"], "Every test": written["hypotheses"]}
    drawn = figures.draw_learning(main_rows(study, found.readings.curves), study.conditions[::-1], folder)
    return Section("Hypotheses", text, tables, drawn)


def _confusions(study: Study, found: Findings, folder: Path) -> Section | None:
    if "confusion" not in found.readings.tables:
        return None
    predictor, rows = found.readings.predictors[0], main_rows(study, found.readings.tables["confusion"])
    matrices = {
        name: confusion_matrix(rows, predictor=predictor, condition=name)
        for name in study.conditions
        if len(rows[(rows["predictor"] == predictor) & (rows["condition"] == name)])
    }
    text = f"Trajectories by true and predicted goal, mean over fractions and repeats; predictions of {predictor}."
    return Section("Confusions", text, {}, figures.draw_confusions(matrices, predictor, folder))


def _spread(study: Study, found: Findings, folder: Path) -> Section | None:
    if not len(found.spread):
        return None
    from benchmarks.experiments.conditions import beside_published
    from benchmarks.experiments.tabletop.sweep import PUBLISHED_SPREAD

    names = {"none": "ours", "mean": "ours, warped"}
    ours = {label: found.spread[found.spread["alignment"] == key] for key, label in names.items()}
    there = set.intersection(*(set(part["condition"]) for part in ours.values()))
    known = {name: value for name, value in PUBLISHED_SPREAD.items() if name in there}
    text = narrate("study/spread", published=bool(known))
    tables, drawn = {"By alignment": found.spread}, []
    if known:
        beside = beside_published(known, ours)
        tables = {"Determinant (m⁴) and trace (m²) beside the paper": beside, **tables}
        drawn = figures.draw_spread(beside, {f"trace, {name}": name for name in ("paper", *names.values())}, folder)
    return Section("How much reaches differ", text, tables, drawn)


# -- measures ---------------------------------------------------------------------------------------------------------


def _different(family: Family, alpha: float = 0.05) -> list[str]:
    sure = family.tests[family.tests["p_holm"] < alpha]["measure"].tolist() if len(family.tests) else []
    return [str(name).partition(",")[0] for name in sure]  # without its unit


def _family_tables(family: Family, pairs: str) -> dict[str, pd.DataFrame]:
    return {
        "Means over participants and 95 % intervals": family.means,
        "Repeated-measures analyses of variance": family.tests,
        pairs: family.pairs,
    }


def _work(study: Study, found: Findings, folder: Path) -> Section:
    content = study.content
    kitchen = f"Idle time is spent in pauses of more than {IDLE_SECONDS:g} s between keys."
    table = "The hand is at rest where it is slower than 3 cm/s; measures of the team are those of Hoffman (2019)."
    text = narrate(
        "study/work",
        fixed=bool(content.domain == "tabletop" and content.rounds.reaches),
        reaches=content.rounds.reaches,
        idle=kitchen if content.domain == "overcooked" else table,
        tested=len(found.work.tests),
        different=_different(found.work),
    )
    drawn = []
    if len(found.work.means):
        varying = found.work.means.groupby("measure")["mean"].agg(lambda means: means.max() > means.min())
        shown = [name for name in MEASURES[content.domain].values() if varying.get(name, False)][:8]
        means = found.work.means[found.work.means["measure"].isin(shown)]
        path, title = folder / "work.svg", "How participants worked"
        drawn = [figures.interval_panels(means, "condition", study.conditions, title, path)] if shown else []
    return Section("How participants worked", text, _family_tables(found.work, "Every pair (Tukey)"), drawn)


def _questionnaires(study: Study, found: Findings, folder: Path) -> Section:
    text = narrate(
        "study/questionnaires",
        tested=len(found.scales.tests),
        asked=bool(len(found.scales.means)),
        different=_different(found.scales),
    )
    drawn = []
    if len(found.scales.means):
        path = folder / "questionnaires.svg"
        drawn = [figures.interval_panels(found.scales.means, "condition", study.conditions, "Questionnaires", path)]
    tables: dict[str, Any] = _family_tables(found.scales, "Every pair (Tukey)")
    tables["Every answer, and how often it was given"] = _choices(found)
    return Section("Questionnaires", text, tables, drawn)


def _practice(study: Study, found: Findings) -> Section:
    sure = found.trends[found.trends["p_holm"] < 0.05] if len(found.trends) else found.trends
    family = found.sittings
    text = narrate(
        "study/practice",
        tested=len(found.trends),
        sure=[f"{row.measure} ({row.slope:+.3g} per {row.over})" for row in sure.itertuples()],
        sittings=[sitting.name for sitting in study.content.sittings] if family is not None else [],
        moved=_different(family) if family is not None else [],
    )
    tables: dict[str, Any] = {"Slopes": found.trends}
    if family is not None:
        written = result_tables(found)
        tables["Sittings: means over participants"] = written["sitting_means"]
        tables["Sittings: repeated-measures analyses of variance"] = written["sitting_tests"]
        tables["Sittings: every pair (Tukey)"] = written["sitting_pairs"]
    return Section("Over rounds and sittings", text, tables)
