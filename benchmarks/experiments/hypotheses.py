"""The hypotheses of the paper as explicit tests: does the workspace help, early, with less data, with every predictor?

The paper (Tung et al., HRI 2024) claims in its abstract that optimised workspaces give "higher robot prediction
accuracy using less training data", and that the gain is "classifier-agnostic". H1, H2 and H3 below put these claims,
and the early prediction that they are made for, into words of our own; they are not quotations.

>>> found = assess_hypotheses(rows, treatment="Legible", controls=["Random"], curves=curves)      # doctest: +SKIP
>>> found.verdicts()                                                                            # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["HYPOTHESES", "Hypotheses", "assess_hypotheses", "reached_at"]

HYPOTHESES: Final = {
    "H1": "Goals are predicted more accurately, averaged over all points of observation.",
    "H2": (
        "Goals are predicted earlier: more accurately over the first half of what is observed, and nowhere less so "
        "significantly."
    ),
    "H3": "Less data is needed: more accurate with a part of the training data than others with all of theirs.",
}
EARLY: Final = 0.5
"""Fractions observed up to this one are the first half."""

Unit = Literal["layout", "participant"]


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """What :func:`assess_hypotheses` found.

    Attributes:
        tests: A row per hypothesis, predictor and control: ``hypothesis, predictor, treatment, control, mean, control
            mean, difference, low, high, p, g_units, g_people, supported`` and ``note``. ``low`` to ``high`` is Tukey's
            simultaneous interval, ``p`` Tukey's; ``g_units`` is Hedges' g between units, ``g_people`` between
            participants whatever their layout (NaN where participants are not told apart).
        points: ``predictor, control, fraction, difference, low, high, p``: H1 at every fraction observed.
        treatment: The condition in which goals should be predicted better.
        controls: The conditions to beat.
        unit: What counted as independent.
        alpha: Level of the tests.
        share: Of the training data, that H3 takes of the treatment.
    """

    tests: pd.DataFrame = field(repr=False)
    points: pd.DataFrame = field(repr=False)
    treatment: str
    controls: tuple[str, ...]
    unit: str
    alpha: float
    share: float | None

    def verdicts(self) -> pd.DataFrame:
        """A row per hypothesis, a column per predictor: ``supported``, ``not supported`` or ``–`` (says nothing).

        A hypothesis is supported for a predictor if every single test of it is significant in the right direction: a
        conjunction, which needs no correction for the number of tests. The last column is the same over predictors.
        """
        import pandas as pd

        rows = []
        for name in HYPOTHESES:
            part = self.tests[self.tests["hypothesis"] == name]
            row: dict[str, Any] = {"hypothesis": name}
            for predictor in dict.fromkeys(self.tests["predictor"]):
                own = part[part["predictor"] == predictor]["supported"]
                row[predictor] = _said(bool(own.all())) if len(own) else "–"
            row["every predictor"] = _said(bool(part["supported"].all())) if len(part) else "–"
            rows.append(row)
        return pd.DataFrame(rows)

    def words(self) -> str:
        """The verdicts in sentences."""
        found = [self._figures(name, statement) for name, statement in HYPOTHESES.items()]
        controls = list(self.controls)
        return narrate("verdicts", hypotheses=found, treatment=self.treatment, controls=controls, unit=self.unit)

    def _figures(self, name: str, statement: str) -> dict[str, Any]:
        """What a sentence about one hypothesis tells; ``tested`` is 0 where nothing was tested."""
        part = self.tests[self.tests["hypothesis"] == name]
        row = self.verdicts().set_index("hypothesis").loc[name].drop("every predictor")
        return {
            "name": name,
            "statement": statement,
            "tested": sum(said != "–" for said in row),
            "against": [str(predictor) for predictor, said in row.items() if said == "not supported"],
            "difference": _range(part["difference"]),
            "between_units": _range(part["g_units"]),
            "between_people": _range(part["g_people"].dropna()),
        }


def _range(values: pd.Series[float]) -> dict[str, float] | None:
    return {"low": float(values.min()), "high": float(values.max())} if len(values) else None


def _said(supported: bool) -> str:
    return "supported" if supported else "not supported"


def assess_hypotheses(
    rows: pd.DataFrame,
    *,
    treatment: str,
    controls: Sequence[str],
    curves: pd.DataFrame | None = None,
    unit: Unit | None = None,
    share: float = 0.25,
    alpha: float = 0.05,
) -> Hypotheses:
    """Test H1, H2 and H3 for every predictor.

    Args:
        rows: One per predictor, participant and fraction observed: ``predictor, condition, participant, fraction,
            correct`` (mean over the participant's trajectories), and ``layout`` where a condition has several.
        treatment: The condition in which goals should be predicted better.
        controls: The conditions to beat, each of them.
        curves: Learning curves: ``predictor, condition, share`` (of the training data, up to 1), ``accuracy``, and a
            column named after ``unit``. Without them H3 is not tested, nor for predictors that are not in them.
        unit: What counts as independent. ``"layout"``: each layout's participants are averaged first, so that what is
            found holds for other layouts of the condition; exactly the nested analysis of variance. ``"participant"``:
            holds for other participants in these layouts alone. None: layouts if every condition has two or more.
        share: Of the training data of the treatment in H3; the nearest one in ``curves`` is taken.
        alpha: Level of the tests.

    Raises:
        ValueError: A condition or column is missing, or a condition has fewer than two units.
    """
    import pandas as pd

    wanted = [treatment, *controls]
    _check(rows, {"predictor", "condition", "participant", "fraction", "correct"}, wanted, "rows")
    rows = rows[rows["condition"].isin(wanted)]
    chosen: Unit = unit or _unit_of(rows)
    taken = None
    tests: list[dict[str, Any]] = []
    points = []
    for predictor, part in rows.groupby("predictor", sort=False):
        pairs, each = _pairs(part, treatment, controls, chosen, alpha)
        early, _ = _pairs(part[part["fraction"] <= EARLY + 1e-9], treatment, controls, chosen, alpha)
        points.append(each.assign(predictor=predictor))
        for control in controls:
            own = each[each["control"] == control]
            tests.append({"hypothesis": "H1", "predictor": predictor, **pairs[control]})
            worse = own[own["high"] < 0]["fraction"]
            tests.append({"hypothesis": "H2", "predictor": predictor, **early[control], "note": _points(own)})
            tests[-1]["supported"] &= not len(worse)
    if curves is not None and len(curves):
        _check(curves, {"predictor", "condition", "share", "accuracy", chosen}, wanted, "curves")
        taken = float(min(sorted(curves["share"].unique()), key=lambda known: abs(known - share)))
        for predictor, part in curves.groupby("predictor", sort=False):
            found = _less_data(part, treatment, controls, chosen, taken, alpha)
            tests += [{"hypothesis": "H3", "predictor": predictor, **row} for row in found.values()]
    table = pd.DataFrame(tests).sort_values("hypothesis", kind="stable", ignore_index=True)
    front = ["predictor", "control", "fraction"]
    all_points = pd.concat(points, ignore_index=True)
    all_points = all_points[[*front, *(c for c in all_points if c not in front)]]
    return Hypotheses(table, all_points, treatment, tuple(controls), chosen, alpha, taken)


def _check(table: pd.DataFrame, columns: set[str], conditions: Sequence[str], what: str) -> None:
    missing = sorted(columns - set(table.columns))
    if missing:
        raise ValueError(f"{what} need the columns {sorted(columns)}; {missing} are missing")
    unknown = [name for name in conditions if name not in set(table["condition"])]
    if unknown:
        raise ValueError(f"{what} hold no condition {unknown[0]!r}; they hold {sorted(set(table['condition']))}")


def _unit_of(rows: pd.DataFrame) -> Unit:
    if "layout" not in rows or rows.groupby("condition")["layout"].nunique().min() < 2:
        return "participant"
    return "layout"


def _units(table: pd.DataFrame, unit: str) -> pd.DataFrame:
    """The table with units as participants; layouts are numbered within conditions, participants keep their names."""
    if unit == "participant":
        return table
    return table.assign(participant=table["condition"] + "/" + table[unit].astype(str))


def _balanced(table: pd.DataFrame, unit: str, value: str) -> pd.DataFrame:
    """One value per unit (and fraction), participants of a layout counting equally."""
    keys = ["condition", "participant", *(["fraction"] if "fraction" in table else [])]
    return _units(table, unit).groupby(keys, sort=False)[[value]].mean().reset_index()


def _pairs(
    part: pd.DataFrame, treatment: str, controls: Sequence[str], unit: str, alpha: float
) -> tuple[dict[str, dict[str, Any]], pd.DataFrame]:
    """The treatment against each control: the mean over fractions, and each fraction."""
    from predictors.evaluation.comparison import compare_conditions
    from predictors.evaluation.statistics import hedges_g

    table = _balanced(part, unit, "correct")
    mean = compare_conditions(table, at="mean", alpha=alpha)
    each = compare_conditions(table, alpha=alpha)
    participants = {name: own.groupby("participant")["correct"].mean() for name, own in part.groupby("condition")}
    rows = {}
    for control in controls:
        row = _oriented(mean.pairs, treatment, control).iloc[0]
        means = mean.means.set_index("condition")["mean"]
        g = hedges_g(participants[treatment].to_numpy(), participants[control].to_numpy())
        rows[control] = _row(treatment, control, means, row, g, alpha)
    columns = ["fraction", "control", "difference", "low", "high", "p"]
    import pandas as pd

    points = pd.concat([_oriented(each.pairs, treatment, c).assign(control=c)[columns] for c in controls])
    return rows, points


def _row(
    treatment: str, control: str, means: pd.Series[float], pair: pd.Series[Any], g_people: float, alpha: float
) -> dict[str, Any]:
    return {
        "treatment": treatment,
        "control": control,
        "mean": float(means[treatment]),
        "control mean": float(means[control]),
        **{key: float(pair[key]) for key in ("difference", "low", "high", "p")},
        "g_units": float(pair["hedges_g"]),
        "g_people": g_people,
        "supported": bool(pair["difference"] > 0 and pair["p"] < alpha),
        "note": "",
    }


def _oriented(pairs: pd.DataFrame, treatment: str, control: str) -> pd.DataFrame:
    """Rows of a pair as treatment minus control."""
    ahead = pairs[(pairs["a"] == treatment) & (pairs["b"] == control)]
    if len(ahead):
        return ahead
    behind = pairs[(pairs["a"] == control) & (pairs["b"] == treatment)]
    return behind.assign(
        difference=-behind["difference"],
        low=-behind["high"],
        high=-behind["low"],
        hedges_g=-behind["hedges_g"],
        cohens_d=-behind["cohens_d"],
    )


def _points(points: pd.DataFrame) -> str:
    """At which points the treatment is significantly better, or worse, in words."""
    better = points[points["low"] > 0]["fraction"]
    worse = points[points["high"] < 0]["fraction"]
    said = f"better at {_percentages(better)}" if len(better) else "better at no point alone"
    return said + (f", worse at {_percentages(worse)}" if len(worse) else "")


def _percentages(fractions: pd.Series[float]) -> str:
    return ", ".join(f"{100 * fraction:.3g}" for fraction in sorted(fractions)) + " %"


def _less_data(
    part: pd.DataFrame, treatment: str, controls: Sequence[str], unit: str, share: float, alpha: float
) -> dict[str, dict[str, Any]]:
    """The treatment with a share of its data against each control with all."""
    import pandas as pd

    from predictors.evaluation.comparison import compare_conditions

    some = part[(part["condition"] == treatment) & np.isclose(part["share"], share)]
    whole = part[part["condition"].isin(controls) & np.isclose(part["share"], part["share"].max())]
    table = _balanced(pd.concat([some, whole]), unit, "accuracy")
    # Participants may be the same in all conditions; layouts never are.
    design: Literal["between", "auto"] = "between" if unit == "layout" else "auto"
    found = compare_conditions(table, value="accuracy", at="mean", design=design, alpha=alpha)
    means = found.means.set_index("condition")["mean"]
    rows = {}
    for control in controls:
        pair = _oriented(found.pairs, treatment, control).iloc[0]
        rows[control] = _row(treatment, control, means, pair, float("nan"), alpha)
        rows[control]["note"] = f"{share:.0%} of the data against all of it".replace("%", " %")
    return rows


def reached_at(fractions: Sequence[float], accuracy: Sequence[float], level: float) -> float:
    """The fraction observed at which an accuracy is first reached, linear in between; NaN if it never is."""
    order = np.argsort(fractions)
    x, y = np.asarray(fractions, dtype=float)[order], np.asarray(accuracy, dtype=float)[order]
    reached = np.flatnonzero(y >= level)
    if not len(reached):
        return float("nan")
    i = int(reached[0])
    return float(x[0] if i == 0 else x[i - 1] + (level - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1]))
