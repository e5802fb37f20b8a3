"""What the tables say, in sentences computed from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from benchmarks.experiments.conditions import agreements
from benchmarks.experiments.tabletop.sweep import CONDITIONS, HAVE_OBSTACLES, PUBLISHED, PUBLISHED_SPREAD

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.hypotheses import Hypotheses
    from benchmarks.experiments.tabletop.tables import Results

__all__ = [
    "PEOPLE",
    "UNITS",
    "about_compliance",
    "about_hypotheses",
    "about_layouts",
    "about_reading",
    "about_spread",
    "about_teams",
    "agreement",
]

_WHY_LONGER: Final = (
    " A robot that understands sooner does not yet make a task shorter: the person's hand takes its own time, on ways "
    "that are longer at some tables (see Tables), for what it fetches and for what it carries round obstacles, while "
    "the robot passes over them."
)

PEOPLE: Final = (
    "People are simulated, and not by the model that tables are scored with (which reaches along a shortest path at "
    "one speed): their reaches bow to one side and set out a little wrong, speed up fast and brake slowly, round the "
    "corners of obstacles, end beside the middle of the cube, and differ between people and from reach to reach. The "
    "numbers are those of recorded hands where such were found (see the documentation of the model of reaches). Each "
    "person builds both columns once, in a random valid order: eight reaches, the first from home, the others from the "
    "assembly zone. Two of them, the last of each column, have one valid goal; there is nothing to predict, and they "
    "are left out. Here everybody goes round virtual obstacles; those who do not have a section of their own."
)
UNITS: Final = (
    "Every searched condition has several tables, each searched anew with people of its own. Tests take tables as "
    "units (the nested analysis of variance), so that a difference holds for other tables found in the same way, not "
    "only for other people at these. The sorted Baseline is one table by definition; its units are groups of other "
    "people. With people as units at one table per condition, as in the paper, luck in the one search cannot be told "
    "from the effect of the condition; that analysis stands beside it."
)


def about_layouts(results: Results) -> str:
    """Which tables there are, and what they cost."""
    means = results.layouts.groupby("condition")[["score", "distance", "mean_detour", "num_obstacles"]].mean()
    count = int(results.layouts.groupby("condition").size().min())
    initial = int(results.layouts[results.layouts["condition"] == "Random"]["found_after"].max())
    evaluations = int(results.layouts[results.layouts["condition"] == "Both"]["found_after"].max())
    scores = ", ".join(f"{name} {means['score'][name]:.1f}" for name in CONDITIONS)
    ways = ", ".join(f"{name} {means['distance'][name]:.1f} m" for name in CONDITIONS)
    return (
        f"{count} tables per searched condition, each from a search of its own of {evaluations:,} evaluations for "
        "legibility. Placement moves cubes, Virtual Obstacle lays up to four obstacles between the sorted cubes, Both "
        f"does both; Random is the median by legibility of {initial:,} random placements, a reference "
        f"that the paper lacks. Shown is the best of each, a middle one of the random. Legibility (Eq. 3, at most 20): "
        f"{scores}. It is paid for by the way of the hand in one task: {ways}. People go round obstacles: mean "
        "detours of "
        + ", ".join(f"{means['mean_detour'][name]:.2f} ({name})" for name in HAVE_OBSTACLES)
        + f" with {means['num_obstacles']['Virtual Obstacle']:.1f} and {means['num_obstacles']['Both']:.1f} obstacles."
    )


def about_reading(results: Results, metrics: pd.DataFrame, anova: pd.DataFrame) -> str:
    """Who reads whom how well."""
    wide = metrics.pivot_table(index="predictor", columns="condition", values="accuracy", sort=False)
    lines = ["Accuracy (mean over 10 to 90 % of the movement) changes from the Baseline"]
    for name in ("Placement", "Virtual Obstacle", "Both"):
        gain = wide[name] - wide["Baseline"]
        lines.append(f"to {name} by " + ", ".join(f"{value:+.3f} ({who})" for who, value in gain.items()))
    text = "; ".join([" ".join(lines[:2]), *lines[2:]])
    best = wide["Both"].idxmax()
    text += f". The best reader of Both is {best} ({wide['Both'].max():.3f}). "
    random = (wide["Baseline"] - wide["Random"]).sort_values()
    span = f"{random.iloc[0]:+.3f} ({random.index[0]}) to {random.iloc[-1]:+.3f} ({random.index[-1]})"
    if random.iloc[-1] <= 0:
        text += (
            f"Sorting cubes is no help by itself: from random placements to the Baseline accuracy changes by {span}."
        )
    else:
        whom = "every predictor" if random.iloc[0] > 0 else "some predictors, not others"
        text += f"Sorting cubes helps {whom}: from random placements to the Baseline accuracy changes by {span}."
    each = anova[(anova["unit"] == "layout") & anova["fraction"].notna()]
    lines = []
    for name in results.predictors[:2]:
        own = each[each["predictor"] == name]
        differ = own[own["p_holm"] < 0.05]["fraction"]
        points = ", ".join(f"{100 * f:.0f}" for f in differ)
        lines.append(f"{name}: conditions differ " + (f"at {points} % observed" if points else "at no point alone"))
    return f"{text}\n\n{'; '.join(lines)} (one-way ANOVA over tables, Holm over points).{_starts(results)}"


def _starts(results: Results) -> str:
    rows = results.complying("start")
    means = rows[rows["predictor"] == results.predictors[0]].groupby("start")["correct"].mean()
    if not {"home", "assembly"} <= set(means.index):
        return ""
    return (
        f"\n\nPredictors that learn look at motion relative to its start and hold reaches from home and from the "
        f"assembly zone for one kind. From home, where only the first reach of each person begins, the "
        f"{results.predictors[0]} is right in {means['home']:.3f}, from the assembly zone in {means['assembly']:.3f}."
    )


def agreement(published: pd.DataFrame, metrics: pd.DataFrame, predictors: list[str]) -> str:
    """What agrees with the paper's F1 and what differs.

    Args:
        published: As of :func:`benchmarks.experiments.tabletop.tables.beside_published`.
        metrics: As of :func:`benchmarks.experiments.tabletop.tables.metrics_table`.
        predictors: In order, the paper's first.
    """
    order, lines = sorted(PUBLISHED, key=lambda name: -PUBLISHED[name]["f1"]), []
    for who, it in agreements(published, "Both", "Baseline").items():
        same = f"{it.swapped} of 6 pairs in another order than the paper's" if it.swapped else "in the paper's order"
        lines.append(
            f"{who}: conditions {same} ({', '.join(it.ranked)}, the best read first). Both changes F1 by "
            f"{it.gain:+.3f} from the Baseline, {it.gain_said} the paper's {it.published_gain:+.3f}; over all "
            f"conditions our F1 is {it.level_said}."
        )
    wide = metrics.pivot_table(index="predictor", columns="condition", values="f1", sort=False)[list(PUBLISHED)]
    same_order = [name for name in predictors if sorted(order, key=lambda c: -wide[c][name]) == order]
    best = [name for name in predictors if max(order, key=lambda c: wide[c][name]) == "Both"]
    lines.append(
        f"Of our {len(predictors)} predictors {len(best)} read Both best of the four ({', '.join(best) or 'none'}), "
        f"and {len(same_order)} order all four as the paper does ({', '.join(same_order) or 'none'})."
    )
    gains = (wide["Both"] - wide["Baseline"]).drop(predictors[1])
    change = float(wide["Both"][predictors[1]] - wide["Baseline"][predictors[1]])
    lines.append(
        f"The heuristic of the nearest cube looks at the hand alone. Both changes its F1 by {change:+.3f}, that of the "
        f"others by {gains.min():+.3f} ({gains.idxmin()}) to {gains.max():+.3f} ({gains.idxmax()}). The search makes "
        "plain which shortest way a reach has taken; to see that one must know where it began, and the nearest cube to "
        "a hand that is still on its way may be another."
    )
    lines.append(
        "Why values may differ: the paper's are of human participants, who hesitate, look and change their minds; ours "
        "are simulated. Ours are means over several searched tables, not one. Our predictors know which cubes are "
        "still valid, so that chance is higher; what a figure of the paper is averaged over we do not know, ours is "
        "the mean over 10 to 90 % of the movement. Our tables obey rules that the paper does not state (no detour "
        "above 1.3 times the straight line, obstacles clear of cubes and of one another)."
    )
    return "\n\n".join(lines)


def about_spread(spread: pd.DataFrame, beside: pd.DataFrame) -> str:
    """Whether reaches to one goal are more alike at legible tables, and more unlike those to others."""
    table = beside.set_index("condition")
    lines = [
        "Mean and covariance of the reaches to each cube: every person reaches for every cube once from the assembly "
        "zone, so that as many reaches stand behind each covariance in all conditions; with the same number of steps, "
        "and, where reaches are warped, inside the same band. (Warping lowers both figures by itself.) The floor that "
        "predictors add is left out."
    ]
    for column in ("trace, ours", "trace, ours, warped"):
        ours, paper = table[column], table["trace, paper"]
        ranked = sorted(PUBLISHED_SPREAD, key=lambda name: -ours[name])
        same = "the paper's order" if ranked == list(PUBLISHED_SPREAD) else "not the paper's order"
        how = "Warped" if "warped" in column else "As they are"
        lines.append(
            f"{how}: trace from most to least {', '.join(ranked)}, {same} "
            f"({', '.join(PUBLISHED_SPREAD)}). From Baseline to Both it changes by a factor of "
            f"{ours['Both'] / ours['Baseline']:.2f}, the paper's by {paper['Both'] / paper['Baseline']:.2f}; our "
            f"determinants by {_ratio(table, column.replace('trace', 'determinant')):.2f}, the paper's by "
            f"{_ratio(table, 'determinant, paper'):.2f}. Our Baseline has {ours['Baseline'] / paper['Baseline']:.2f} "
            "times the paper's trace."
        )
    own = spread[spread["alignment"] == "none"].set_index("condition")
    ratio = own["apart"] / own["trace"] ** 0.5
    lines.append(
        "What makes people predictable is spread against distance. Mean reaches to two cubes are on average "
        + ", ".join(f"{100 * own['apart'][name]:.1f} cm ({name})" for name in CONDITIONS)
        + " apart at the same share of the movement; in units of the square root of the trace that is "
        + ", ".join(f"{ratio[name]:.1f} ({name})" for name in CONDITIONS)
        + "."
    )
    lines.append(
        "Why ours can differ: a simulated person's ways vary in proportion to their length (bow, aim) and around every "
        "corner, so that longer ways round obstacles spread more, whereas people may keep closer to a way that "
        "obstacles prescribe; and people of the paper differ in more than the shape of reaches."
    )
    return "\n\n".join(lines)


def _ratio(table: pd.DataFrame, column: str) -> float:
    return float(table[column]["Both"] / table[column]["Baseline"])


def about_hypotheses(found: dict[str, Hypotheses]) -> str:
    """The verdicts, and whether they hold for every predictor."""
    from benchmarks.experiments.hypotheses import __doc__ as about

    parts = [" ".join((about or "").split("\n\n")[1].split())]
    parts.append(
        'Units are tables, and few: "not supported" means not shown with so many, not that there is no difference. '
        "Sizes of effects stand beside every test."
    )
    for treatment, result in found.items():
        first = result.tests[(result.tests["hypothesis"] == "H1") & (result.tests["control"] == "Baseline")]
        good = first[first["supported"]]["predictor"].tolist()
        other = first[~first["supported"]]["predictor"].tolist()
        worse = first[first["high"] < 0]["predictor"].tolist()
        said = (
            "yes, every predictor reads its people better than the Baseline's"
            if not other
            else f"no. H1 against the Baseline holds for {', '.join(good) or 'none'}, not for {', '.join(other)}"
        )
        said += f"; significantly worse for {', '.join(worse)}" if worse else ""
        parts.append(f"{treatment}.\n\n{result.words()}\n\nClassifier-agnostic: {said}.")
    return "\n\n".join(parts)


def about_compliance(table: pd.DataFrame) -> str:
    """What happens to the gain of obstacles when people ignore them."""
    lines = []
    for predictor, own in table.groupby("predictor", sort=False):
        first, last = own.iloc[0], own.iloc[-1]
        parts = []
        for name in HAVE_OBSTACLES:
            below = own[own[name] < own["Placement"]]["crossing"]
            parts.append(f"{name} goes from {first[name]:.3f} to {last[name]:.3f}, {_since(below.tolist())}")
        lines.append(f"{predictor} (Placement {first['Placement']:.3f}): {'; '.join(parts)}.")
    most = float(table["crossing"].max())
    return (
        "Virtual obstacles bind nobody. The same people at the same tables, but now each reach crosses obstacles with "
        "the probability given, as if they were not there; predictors learn from such people too, while Eq. 1 goes on "
        f"to believe in obstacles. From all complying to {100 * most:.0f} % of reaches crossing:\n\n"
        + "\n\n".join(lines)
    )


def _since(rates: list[float]) -> str:
    """From which rate of crossing on obstacles are worth less than better places."""
    if not rates:
        return "never below Placement"
    return "below Placement even if all comply" if rates[0] == 0 else f"below Placement from {100 * rates[0]:.0f} % on"


def about_teams(results: Results, teams: pd.DataFrame, differences: pd.DataFrame) -> str:
    """What a robot that reads people makes of the tables."""
    readers = list(dict.fromkeys(teams["reader"]))
    mean = teams.set_index(["reader", "measure", "condition"])["mean"]
    first = readers[0]
    whole = int(results.teams.groupby(["reader", "condition"])["participant"].nunique().min())
    unfinished = int(results.teams["completion_time"].isna().sum())
    parts = [
        f"{whole} people per condition and robot build both columns in the environment, a robot beside them takes "
        "another cube as soon as it is sure which one they reach for. It reads them by "
        + ", ".join(name for name in readers if name != "alone")
        + "; alone is without it. People are the units here. "
        + (f"{unfinished} games were not finished in a minute." if unfinished else "Every game was finished.")
    ]
    parts += _significant(differences, first)
    times = ", ".join(
        f"{name} {mean[first, 'completion_time', name]:.1f} s" for name in CONDITIONS if name in set(teams["condition"])
    )
    early = ", ".join(
        f"{mean[first, 'decision_time', name]:.2f} s ({name}; rightly in {mean[first, 'decided_rightly', name]:.2f})"
        for name in CONDITIONS
    )
    parts.append(f"Reading by {first}: the task takes {times}. The robot is first sure after {early}.")
    if "alone" in readers:
        saved = [mean["alone", "completion_time", name] - mean[first, "completion_time", name] for name in CONDITIONS]
        parts.append(
            "Against working alone the robot saves "
            + ", ".join(f"{value:.1f} s ({name})" for value, name in zip(saved, CONDITIONS, strict=True))
            + "."
        )
    blind = "reads nothing"
    if blind in readers:
        gain = [mean[blind, "completion_time", name] - mean[first, "completion_time", name] for name in CONDITIONS]
        lost = [mean[blind, "goals_lost", name] - mean[first, "goals_lost", name] for name in CONDITIONS]
        parts.append(
            f"What reading itself is worth, {first} against a robot that {blind} and acts when it sees a cube in the "
            "hand: "
            + ", ".join(
                f"{time:+.2f} s and {count:+.2f} goals taken from the person ({name})"
                for time, count, name in zip(gain, lost, CONDITIONS, strict=True)
            )
            + "; positive is better with reading."
        )
    sooner = mean[first, "decision_time", "Baseline"] - mean[first, "decision_time", "Both"]
    slower = mean[first, "completion_time", "Both"] - mean[first, "completion_time", "Baseline"]
    parts.append(
        f"At Both the robot is sure {abs(sooner):.2f} s {'earlier' if sooner > 0 else 'later'} than at the Baseline, "
        f"and the task takes {abs(slower):.1f} s {'longer' if slower > 0 else 'less'}."
        + (_WHY_LONGER if slower > 0 else "")
    )
    return "\n\n".join(parts)


def _significant(differences: pd.DataFrame, reader: str) -> list[str]:
    """Which measures change from the Baseline to Both, in a sentence."""
    own = differences[differences["condition"] == "Both"]
    sure = own[own["p"] < 0.05]
    if not len(sure):
        return [f"From Baseline to Both no measure changes significantly (robot reading by {reader})."]
    said = ", ".join(f"{row['measure'].replace('_', ' ')} {row['difference']:+.2f}" for row in sure.to_dict("records"))
    same = [name.replace("_", " ") for name in own[own["p"] >= 0.05]["measure"]]
    rest = f" No significant change: {', '.join(same)}." if same else ""
    return [f"From Baseline to Both (robot reading by {reader}) these change significantly: {said}.{rest}"]
