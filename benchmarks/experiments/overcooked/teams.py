"""Participants who cook with a robot: does a legible kitchen make a better team, and at which price in steps?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.experiments.overcooked.sweep import CONDITIONS, WALKERS, Settings
from benchmarks.experiments.predictor_settings import PredictorSetting, predictor_from
from benchmarks.experiments.running import Rows
from benchmarks.reports.narrative import narrate
from benchmarks.trials import TrialName, trial_function

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["ALONE", "MEASURES", "ROBOTS", "about_teams", "play_with_robot", "team_table", "team_trials"]

ALONE: Final = "alone"
"""Name, in tables, of work without a robot."""

ROBOTS: Final = (
    PredictorSetting("Eq. 1 (hard)", "bayesian", {"costs": "hard"}),
    PredictorSetting("Eq. 1 (soft)", "bayesian", {"costs": "soft"}),
    PredictorSetting("Eq. 1 (IRL costs)", "bayesian", {"cell_costs": "learned"}),
    PredictorSetting("no prediction", "predictors.uniform:UniformPredictor"),
)
"""How robots predict; costs are learned from simulated participants in the same kitchen."""

MEASURES: Final = (
    "steps",
    "conflicts",
    "goals_lost",
    "decision_time",
    "decided_rightly",
    "human_idle",
    "robot_idle",
    "concurrent_activity",
    "functional_delay",
)
"""What is told of teams: steps until all soups are served, then as :meth:`.TeamMetrics.summary` names it."""

_THRESHOLD: Final = 0.8
_LONGEST: Final = 6000
"""Steps after which an episode is given up."""


def team_trials(
    settings: Settings, layouts: Sequence[Mapping[str, Any]], people: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """The same participants of every kind at work in every layout, alone and with every robot.

    Args:
        settings: The settings.
        layouts: ``condition``, ``layout`` (its number) and ``drawing``.
        people: As of :func:`.people_of`.
    """
    trials = []
    for place in layouts:
        condition, number = str(place["condition"]), int(place["layout"])
        for walker, numbers in people.items():
            seed = np.random.SeedSequence(
                (settings.seed, CONDITIONS.index(condition), number, WALKERS.index(walker), 1)
            )
            trial = {
                "condition": condition,
                "layout": number,
                "walker": walker,
                "drawing": str(place["drawing"]),
                "people": dict(numbers),
                "participants": settings.team_participants,
                "threshold": _THRESHOLD,
                "seed": int(seed.generate_state(1)[0]),
            }
            trials.append(trial | {"robot": ALONE, "how": {}})
            trials += [trial | {"robot": setting.label, "how": setting.how} for setting in ROBOTS]
    return trials


@trial_function(TrialName("overcooked/team"))
def play_with_robot(trial: dict[str, Any]) -> Rows:
    """A row per participant, who cooks all soups once: steps, and with a robot the measures of the team."""
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers the environment)
    from legible_envs.overcooked.humans.planner_fitting import draw_person
    from legible_envs.overcooked.policies import WalkingPlayer

    robot: dict[str, Any] = {}
    if trial["how"]:
        robot = {"partner": "robot", "predictor": predictor_from(trial["how"]), "threshold": trial["threshold"]}
    env = gym.make("LegibleOvercooked-v0", layout=trial["drawing"], max_episode_steps=_LONGEST, **robot)
    draw, shape = draw_person(trial["people"]), env.unwrapped.shape  # type: ignore[attr-defined]
    rows: Rows = []
    for number, source in enumerate(np.random.SeedSequence(trial["seed"]).spawn(trial["participants"])):
        rng = np.random.default_rng(source)
        player, over, steps = WalkingPlayer(env, draw(shape, rng), rng), False, 0
        obs, info = env.reset(seed=number)
        while not over:
            obs, _, terminated, truncated, info = env.step(player(obs, info))
            over, steps = terminated or truncated, steps + 1
        measures = dict(env.unwrapped.team_measures())  # type: ignore[attr-defined]
        who = {"participant": f"{trial['condition']}/{trial['layout']}/{number}", "deliveries": info["deliveries"]}
        rows.append(who | {"steps": steps if terminated else None} | measures)
    env.close()
    return rows


def load_teams(folder: Path) -> pd.DataFrame | None:
    """The logged rows; None for a run of before there were teams."""
    from benchmarks.experiments.trial_rows import logged_rows

    return logged_rows(folder, "teams", "overcooked") if (folder / "teams.csv").exists() else None


def team_table(teams: pd.DataFrame) -> pd.DataFrame:
    """Mean and 95 % interval of each measure, layouts as units: a row per walker, robot, measure and condition."""
    import pandas as pd
    from scipy import stats

    rows = []
    keys = ["walker", "robot", "condition"]
    for (walker, robot, condition), part in teams.groupby(keys, sort=False):
        means = part.groupby("layout")[[name for name in MEASURES if name in part]].mean()
        for measure in means:
            values = means[measure].dropna().to_numpy(dtype=np.float64)
            if not len(values):
                continue
            reach = np.nan  # one kitchen says nothing about others
            if len(values) > 1:
                reach = float(stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
            mean = float(values.mean())
            row = {"walker": walker, "robot": robot, "measure": measure, "condition": condition, "layouts": len(values)}
            rows.append(row | {"mean": mean, "low": mean - reach, "high": mean + reach})
    return pd.DataFrame(rows)


def wide_table(table: pd.DataFrame) -> pd.DataFrame:
    """The means, a column per condition."""
    wide = table.pivot_table(index=["walker", "robot", "measure"], columns="condition", values="mean", sort=False)
    return wide[[name for name in CONDITIONS if name in wide]].reset_index()


def about_teams(teams: pd.DataFrame, table: pd.DataFrame) -> str:
    """What comes out, in words."""
    first = ROBOTS[0].label
    mean = table.set_index(["walker", "robot", "measure", "condition"])["mean"]
    conditions = [name for name in CONDITIONS if name in set(teams["condition"])]

    def of(walker: str, robot: str, measure: str) -> list[tuple[str, float]]:
        return [(name, float(mean.get((walker, robot, measure, name), np.nan))) for name in conditions]

    walkers = []
    for walker in dict.fromkeys(teams["walker"]):
        alone, team, blind = (of(walker, robot, "steps") for robot in (ALONE, first, ROBOTS[-1].label))
        walkers.append(
            {
                "name": walker,
                "alone": alone,
                "team": team,
                "saved": [(name, a - t) for (name, a), (_, t) in zip(alone, team, strict=True)],
                "worth": [(name, b - t) for (name, b), (_, t) in zip(blind, team, strict=True)],
                "decisions": of(walker, first, "decision_time"),
                "rightly": of(walker, first, "decided_rightly"),
                "conflicts": of(walker, first, "conflicts"),
                "doubled": of(walker, first, "goals_lost"),
                "best": min(team, key=lambda pair: pair[1])[0],
            }
        )
    return narrate(
        "overcooked/teams",
        participants=int(teams.groupby(["walker", "robot", "condition", "layout"])["participant"].nunique().min()),
        layouts=int(teams.groupby("condition")["layout"].nunique().min()),
        first=first,
        blind=ROBOTS[-1].label,
        threshold=_THRESHOLD,
        unfinished=int(teams["steps"].isna().sum()),
        walkers=walkers,
    )
