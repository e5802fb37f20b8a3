"""Participants who cook with a robot: trials, the measures they log, and the words about them."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from benchmarks.experiments.overcooked import teams
from benchmarks.experiments.overcooked.sweep import CONDITIONS, QUICK, WALKERS, people_of

SETTINGS = replace(QUICK, team_participants=2)
ROOM = "XOXXTXX\nX     F\nX  1  X\nX     D\nXCPXXSX"


def trials_of(condition="Legible", layout=0):
    places = [{"condition": condition, "layout": layout, "drawing": ROOM}]
    return teams.team_trials(SETTINGS, places, people_of(pd.DataFrame()))


def test_every_robot_meets_the_same_participants() -> None:
    trials = trials_of()
    assert [trial["walker"] for trial in trials] == [w for w in WALKERS for _ in range(1 + len(teams.ROBOTS))]
    assert [t["robot"] for t in trials[:5]] == [teams.ALONE, *(robot.label for robot in teams.ROBOTS)]
    for walker in WALKERS:
        assert len({trial["seed"] for trial in trials if trial["walker"] == walker}) == 1
    assert trials[0]["seed"] != trials_of("Efficient")[0]["seed"] != trials_of("Efficient", 1)[0]["seed"]


@pytest.mark.slow
def test_what_is_logged_becomes_a_table_and_words() -> None:
    rows = []
    for condition in CONDITIONS:
        for layout in range(2):
            for trial in trials_of(condition, layout)[:5]:
                if condition == "Legible" or trial["robot"] in (teams.ALONE, "Eq. 1 (hard)"):
                    played = teams.play_with_robot(trial)
                    assert len(played) == SETTINGS.team_participants
                    assert all(row["deliveries"] == 3 for row in played)
                    assert ("conflicts" in played[0]) == (trial["robot"] != teams.ALONE)
                    keys = {key: trial[key] for key in ("condition", "layout", "walker", "robot")}
                    rows += [keys | row for row in played]
    logged = pd.DataFrame(rows)
    table = teams.team_table(logged)
    steps = table[table["measure"] == "steps"].set_index(["robot", "condition"])
    own = logged[(logged["robot"] == teams.ALONE) & (logged["condition"] == "Random")]
    assert steps.loc[(teams.ALONE, "Random"), "mean"] == pytest.approx(own["steps"].mean())
    known = table.dropna()
    assert len(known) > 0.8 * len(table)  # an interval needs two kitchens in which there was something to predict
    assert (known["low"] <= known["mean"]).all()
    # in an open room two cook faster than one
    assert (steps["mean"].loc["Eq. 1 (hard)"] < steps["mean"].loc[teams.ALONE]).all()
    wide = teams.wide_table(table)
    assert list(wide.columns) == ["walker", "robot", "measure", *CONDITIONS]
    words = teams.about_teams(logged, table)
    assert "Every game was finished." in words
    assert "boltzmann participants" in words
