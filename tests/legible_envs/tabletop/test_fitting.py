"""Populations of people who reach are found again from their reaches, and from recorded ones."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from legible_envs.rollouts import Trajectory
from legible_envs.tabletop import TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.humans import Person, ReachModel, simulate_participants, simulate_reach
from legible_envs.tabletop.humans.fitting import fit_reaches
from predictors import StraightLineBayesian
from predictors.base import FRACTIONS, correctness
from tests.support.pointing import load_pointing, needs_pointing

ANGLES = np.arange(12) * np.pi / 6
PLACES = tuple(zip((0.3 * np.cos(ANGLES)).tolist(), (0.2 * np.sin(ANGLES)).tolist(), strict=True))
NAMES = tuple(f"t{k}" for k in range(12))


def around(model: ReachModel, people: int, repeats: int, seed: int = 0) -> list[Trajectory]:
    """Reaches from the middle of open space to targets all around it, in two distances."""
    rng, found = np.random.default_rng(seed), []
    for number in range(people):
        person = model.sample_person(rng)
        for goal, place in zip(NAMES * repeats, PLACES * repeats, strict=True):
            times, states = simulate_reach(None, (0, 0), place, person, rng)
            found.append(
                Trajectory(
                    states, times + 5.0, goal=goal, candidates=NAMES, participant=f"p{number}", goal_positions=PLACES
                )
            )
    return found


def test_a_population_is_found_again() -> None:
    true = ReachModel(
        Person(
            skew=1.6,
            skew_trial=0.2,
            bow=-0.06,
            bow_turns=(0.05, 0.0, -0.03, 0.02),
            bow_trial=0.04,
            aim=0.03,
            intercept=0.15,
            slope=0.2,
            duration_trial=0.15,
            endpoint_sd=0.01,
            start_sd=0.004,
            signal_sd=0.001,
        ),
        skew_spread=0.15,
        bow_spread=0.05,
        bow_target=0.04,
        duration_spread=0.2,
    )
    found = fit_reaches(around(true, people=60, repeats=3))
    for name, slack in {
        "skew": 0.1,
        "skew_trial": 0.03,
        "bow": 0.02,
        "bow_trial": 0.01,
        "aim": 0.01,
        "duration_trial": 0.03,
        "endpoint_sd": 0.002,
        "start_sd": 0.001,
        "signal_sd": 0.0003,
    }.items():
        assert getattr(found.median, name) == pytest.approx(getattr(true.median, name), abs=slack), name
    assert found.median.bow_turns == pytest.approx(true.median.bow_turns, abs=0.025)
    for name, slack in {"skew_spread": 0.04, "bow_spread": 0.02, "bow_target": 0.01, "duration_spread": 0.05}.items():
        assert getattr(found, name) == pytest.approx(getattr(true, name), abs=slack), name
    for length in (0.2, 0.3):
        assert found.median.duration(length, 0.045) == pytest.approx(true.median.duration(length, 0.045), rel=0.06)


def test_what_recordings_do_not_tell_stays() -> None:
    base = ReachModel(Person(corner_cost=0.37, corner_radius=0.02, crossing_rate=0.2, pause=1.0, slope=0.11))
    circle = [reach for reach in around(ReachModel(), 4, 2) if reach.goal in ("t0", "t6")]
    found = fit_reaches(circle, base=base).median
    assert (found.corner_radius, found.crossing_rate, found.pause) == (0.02, 0.2, 1.0)
    assert found.corner_cost / found.slope == pytest.approx(0.37 / 0.11, rel=0.5)
    assert found.bow_turns == (0.0,) * 4  # two directions tell no shape
    silent = [Trajectory(r.states, r.times, goal=r.goal, candidates=NAMES, participant=r.participant) for r in circle]
    assert fit_reaches(silent).median.endpoint_sd == 0.0
    assert fit_reaches(silent).median.bow == found.bow


def test_corners_of_obstacles_tell_their_price_and_nothing_of_bows() -> None:
    task = TabletopTask.named("columns")
    walls = [VirtualObstacle((0.45, 0.45), 1.5), VirtualObstacle((0.57, 0.45), 1.5)]
    layout = TabletopLayout(task.layout.objects, walls, task.layout.table)
    layout.validate()
    calm = ReachModel(Person(corner_cost=0.35, bow_trial=0.0), bow_spread=0.0, bow_target=0.0, duration_spread=0.02)
    reaches = simulate_participants(layout, 60, np.random.default_rng(0), task=task, population=calm)
    found = fit_reaches(reaches)
    assert found.median.corner_cost == pytest.approx(0.35, abs=0.06)
    assert found.median.bow == pytest.approx(-0.105, abs=0.02)
    corners = [
        len(layout.paths.polyline(layout.paths.nearest_free(r.states[:1])[0], r.goal or "")) - 2 for r in reaches
    ]
    bent = [reach for reach, count in zip(reaches, corners, strict=True) if count]
    assert len(bent) > 50
    with pytest.raises(ValueError, match="past no corner"):
        fit_reaches(bent)


@pytest.mark.parametrize(
    ("reach", "message"),
    [
        (Trajectory(np.zeros((9, 2)), candidates=("a",)), "known goal"),
        (Trajectory(np.zeros((9, 2)), candidates=("a",), goal="a", complete=False), "complete"),
        (Trajectory(np.zeros((9, 3)), candidates=("a",), goal="a"), r"\(x, y\)"),
        (Trajectory(np.zeros((9, 2), dtype=int), candidates=("a",), goal="a"), r"\(x, y\)"),
        (Trajectory(np.zeros((3, 2)), candidates=("a",), goal="a"), "3 states"),
        (Trajectory(np.ones((9, 2)), candidates=("a",), goal="a"), "ends where it begins"),
    ],
)
def test_what_is_no_reach_is_refused(reach: Trajectory, message: str) -> None:
    with pytest.raises(ValueError, match=rf"reach 1 .*{message}"):
        fit_reaches([*around(ReachModel(), 1, 1)[:1], reach])
    with pytest.raises(ValueError, match="no reach to fit"):
        fit_reaches([])


# -- recorded pointing -------------------------------------------------------------------------------------------------


@cache
def read_by_lines(model: ReachModel | None) -> npt.NDArray[np.float64]:
    """``(9,)`` accuracy of straight lines at 10..90 %: of every other recorded movement, or as many simulated."""
    walks = list(load_pointing())[::2]
    if model is not None:
        rng, people = np.random.default_rng(0), {}
        made = []
        for walk in walks:
            if walk.participant not in people:
                people[walk.participant] = model.sample_person(rng)
            place = (walk.goal_positions or ())[walk.candidates.index(walk.goal or "")]
            times, states = simulate_reach(None, (0, 0), place, people[walk.participant], rng)
            options = {name: getattr(walk, name) for name in ("goal", "candidates", "participant", "goal_positions")}
            made.append(Trajectory(states - states[0], times, **options))  # prepared like the recorded ones
        walks = made
    predictor = StraightLineBayesian().fit(walks)
    right = correctness(predictor.predict_proba_at(walks, FRACTIONS), predictor.goal_columns(walks))
    return np.asarray(right.mean(axis=0))


@pytest.mark.slow
@needs_pointing
def test_refitted_people_are_read_like_recorded_ones_and_plain_minimum_jerk_is_not() -> None:
    recorded = read_by_lines(None)
    model = fit_reaches(load_pointing())
    refitted = read_by_lines(model)
    assert refitted.mean() == pytest.approx(recorded.mean(), abs=0.05)
    assert np.abs(refitted - recorded).max() < 0.1
    straight = replace(model.median, skew=1.0, skew_trial=0.0, bow=0.0, bow_turns=(0.0,) * 4, bow_trial=0.0, aim=0.0)
    plain = ReachModel(replace(straight, start_sd=0.0, signal_sd=0.0), 0.0, 0.0, 0.0, model.duration_spread)
    assert read_by_lines(plain).mean() > recorded.mean() + 0.15
    # noise alone does not make them human either: the direction is told too late, then too well
    noisy = replace(plain, median=straight)
    assert np.abs(read_by_lines(noisy) - recorded).max() > 0.1


@needs_pointing
def test_recorded_pointing_has_the_properties_the_model_is_made_of() -> None:
    model = fit_reaches(load_pointing())
    assert 1.5 < model.median.skew < 3.0  # braking takes longer than speeding up
    assert 0.1 < model.median.bow_trial < 0.2
    assert model.bow_target > model.bow_spread  # bows depend on the direction more than on the person
    assert model.median.endpoint_sd < 0.012  # targets have a radius of 12 px
