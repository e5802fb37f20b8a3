"""The parameters of :mod:`legible_envs.tabletop.humans.model`, estimated from recorded reaches."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop.humans.model import Person, ReachModel
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import CUBE, Point

__all__ = ["fit_reaches"]

Floats = npt.NDArray[np.float64]

_SKEWS: Final = np.exp(np.linspace(math.log(0.4), math.log(8.0), 200))
_TAIL: Final = 0.01
_LEAST_STATES: Final = 6
_LEAST_SPREAD: Final = 0.1  # of indices of difficulty, in bits, to tell slope from intercept
_WITHOUT: Final = (0.0, 0.0, 0.0, 0.0)


class _Shape(NamedTuple):
    """The shape of one reach in time and space."""

    log_skew: float = math.nan
    bow: float = math.nan
    aim: float = math.nan
    drift: float = math.nan
    """Estimate of the drift at the start, one standard normal."""
    noise: float = math.nan
    """Estimate of the noise, one standard normal."""


@dataclass(frozen=True)
class _Measured:
    """Measurements of one reach; the shape of its path is NaN where it passes corners."""

    participant: str
    goal: str
    direction: float
    shape: _Shape
    miss: Point
    duration: float
    difficulty: float
    corners: int


class _Target(NamedTuple):
    """Where a goal is, if that is known, and how wide."""

    at: Floats | None
    width: float


class _Deviations(NamedTuple):
    """Standard deviations."""

    between: float
    within: float


class _Bows(NamedTuple):
    """The mean bow, what directions add to it, and standard deviations."""

    mean: float
    turns: tuple[float, float, float, float]
    person: float
    target: float
    trial: float


class _Durations(NamedTuple):
    """The median person with durations by Fitts' law and corners, and how durations spread between participants."""

    median: Person
    spread: float


def fit_reaches(
    trajectories: Iterable[Trajectory], *, base: ReachModel | None = None, width: float = CUBE
) -> ReachModel:
    """Estimate a population from reaches.

    Skew, bow and aim are fitted to each reach by least squares, then split by the method of moments into the median
    person, spread between participants, and spread from reach to reach; the extreme 1 % at either end are clipped.
    Reaches that pass corners of obstacles count for durations only. Parameters that recordings do not tell stay as in
    ``base``: corner radius, pauses, the rate of crossing, ``drift_time``; Fitts' slope where all reaches are about
    equally difficult, and the cost of corners where none is passed.

    Args:
        trajectories: Complete reaches ``(x, y)`` with known goals and regular times, from the onset of movement to its
            end, by several participants with several reaches to each goal.
        base: The population that gives the other parameters; the default one if None.
        width: Of the objects, in metres, where no layout tells.

    Raises:
        ValueError: No reach can be used, or one is not as described above.

    Example:
        >>> from legible_envs.tabletop import TabletopTask
        >>> from legible_envs.tabletop.humans import simulate_participants
        >>> task, rng = TabletopTask.named("columns"), np.random.default_rng(0)
        >>> reaches = simulate_participants(task.layout, 40, rng, executions=4)
        >>> model = fit_reaches(reaches)
        >>> round(model.median.skew, 1), round(model.median.bow, 2), round(model.median.endpoint_sd, 3)
        (1.4, -0.11, 0.015)
    """
    base = base or ReachModel()
    found = [_measure(reach, number, width) for number, reach in enumerate(trajectories)]
    plain = [one for one in found if one.corners == 0]
    if not plain:
        raise ValueError("no reach to fit: at least one must go straight to its goal, past no corner of an obstacle")
    log_skew = _trimmed([one.shape.log_skew for one in plain])
    skew = _components(log_skew, [one.participant for one in plain])
    bows = _fit_bows(plain)
    misses = np.array([one.miss for one in plain])
    known = misses[np.isfinite(misses).all(axis=1)]
    median = replace(
        base.median,
        skew=math.exp(float(np.median(log_skew))),
        skew_trial=skew.within,
        bow=bows.mean,
        bow_turns=bows.turns,
        bow_trial=bows.trial,
        aim=_deviation([one.shape.aim for one in plain]),
        endpoint_sd=math.sqrt(np.mean([_deviation(axis) ** 2 for axis in known.T])) if len(known) > 1 else 0.0,
        start_sd=_robust([one.shape.drift for one in plain]),
        signal_sd=_robust([one.shape.noise for one in plain]),
    )
    durations = _fit_durations(found, median)
    return ReachModel(durations.median, skew.between, bows.person, bows.target, durations.spread)


# -- one reach ---------------------------------------------------------------------------------------------------------


def _measure(reach: Trajectory, number: int, width: float) -> _Measured:
    if reach.goal is None or not reach.complete or reach.is_grid or reach.states.shape[1:] != (2,):
        raise ValueError(f"reach {number} must be a complete trajectory (x, y) with a known goal")
    if len(reach.states) < _LEAST_STATES or reach.times[-1] <= reach.times[0]:
        raise ValueError(f"reach {number} has {len(reach.states)} states; {_LEAST_STATES} and a duration are needed")
    chord = reach.states[-1] - reach.states[0]
    far = float(np.hypot(*chord))
    if far == 0:
        raise ValueError(f"reach {number} ends where it begins")
    target = _target(reach, width)
    length, corners = far if target.at is None else float(np.hypot(*(target.at - reach.states[0]))), 0
    if isinstance(reach.layout, TabletopLayout) and reach.layout.obstacles and reach.goal in reach.layout.goals:
        paths = reach.layout.paths
        path = paths.polyline(paths.nearest_free(reach.states[:1])[0], reach.goal)
        length, corners = float(np.hypot(*np.diff(path, axis=0).T).sum()), len(path) - 2
    x, y = (math.nan, math.nan) if target.at is None else (reach.states[-1] - target.at).tolist()
    return _Measured(
        participant=reach.participant,
        goal=reach.goal,
        direction=math.atan2(chord[1], chord[0]),
        shape=_shape(reach, chord / far, far) if corners == 0 else _Shape(),
        miss=(x, y),
        duration=float(reach.times[-1] - reach.times[0]),
        difficulty=math.log2(length / target.width + 1.0),
        corners=corners,
    )


def _target(reach: Trajectory, width: float) -> _Target:
    assert reach.goal is not None
    if isinstance(reach.layout, TabletopLayout) and reach.goal in reach.layout.goals:
        width = min(reach.layout.objects[reach.layout.index(reach.goal)].size)
        target: npt.ArrayLike = reach.layout.place(reach.goal)
    elif reach.goal_positions is None:
        return _Target(None, width)
    else:
        target = reach.goal_positions[reach.candidates.index(reach.goal)]
    return _Target(np.asarray(target, dtype=np.float64), width)


def _shape(reach: Trajectory, ahead: Floats, far: float) -> _Shape:
    moved = reach.states - reach.states[0]
    along, aside = moved @ ahead, moved @ np.array([-ahead[1], ahead[0]])
    share = (reach.times - reach.times[0]) / (reach.times[-1] - reach.times[0])
    early = 1.0 - (1.0 - share) ** _SKEWS[:, None]
    curves = early**3 * (10.0 - 15.0 * early + 6.0 * early**2)
    best = int(((curves - along / far) ** 2).sum(axis=1).argmin())
    progress = np.clip(along / far, 0.0, 1.0)
    waves = np.column_stack([np.sin(np.pi * progress), np.sin(2.0 * np.pi * progress)])
    bow, aim = np.linalg.lstsq(waves, aside / far, rcond=None)[0].tolist()
    # A drift that keeps `k` of itself from sample to sample changes by sqrt(2 (1 - k)) of its standard deviation.
    keep = math.exp(-float(reach.times[1] - reach.times[0]) / Person.drift_time)
    third = np.diff(aside[-max(len(aside) // 3, 4) :], 3)  # of white noise: sqrt(20) of its standard deviation
    return _Shape(
        log_skew=math.log(_SKEWS[best]),
        bow=bow,
        aim=aim,
        drift=float(aside[1]) / math.sqrt(max(2.0 * (1.0 - keep), 1e-9)),
        noise=float(third[len(third) // 2]) / math.sqrt(20.0),
    )


# -- populations -------------------------------------------------------------------------------------------------------


def _fit_bows(plain: Sequence[_Measured]) -> _Bows:
    """The spread is split into that between participants, between the directions of a person, and between reaches."""
    bows = _trimmed([one.shape.bow for one in plain])
    d = np.array([one.direction for one in plain])
    waves = np.column_stack([np.ones(len(d)), np.cos(d), np.sin(d), np.cos(2 * d), np.sin(2 * d)])
    if len({one.goal for one in plain}) > 2 * waves.shape[1] - 1:
        level, *turns = np.linalg.lstsq(waves, bows, rcond=None)[0].tolist()
    else:  # too few directions to tell their shape
        level, turns = float(bows.mean()), list(_WITHOUT)
    rest = bows - waves @ np.array([level, *turns])
    trial = _components(rest, [(one.participant, one.goal) for one in plain]).within
    person = _components(rest, [one.participant for one in plain]).between
    target = math.sqrt(max(float(rest.var()) - trial**2 - person**2, 0.0) / 2.0)
    a, b, c, e = turns
    return _Bows(level, (a, b, c, e), person, target, trial)


def _fit_durations(found: Sequence[_Measured], median: Person) -> _Durations:
    from scipy.optimize import nnls

    durations = np.array([one.duration for one in found])
    difficulty = np.array([one.difficulty for one in found])
    corners = np.array([one.corners for one in found], dtype=np.float64)
    intercept, slope, price = median.intercept, median.slope, median.corner_cost
    if difficulty.std() > _LEAST_SPREAD:
        columns = [np.ones(len(found)), difficulty, corners][: 3 if corners.std() > 0 else 2]
        values = nnls(np.column_stack(columns), durations)[0].tolist()
        intercept, slope, price = (*values, price)[:3]
    else:
        intercept = max(float(durations.mean()) - slope * float(difficulty.mean()), 0.0)
    expected = intercept + slope * difficulty + price * corners
    if expected.min() <= 0:
        intercept, slope = float(durations.mean()), 0.0
        expected = intercept + price * corners
    logs = np.log(durations / expected)
    pace = math.exp(float(logs.mean()))
    spread = _components(_trimmed(logs), [one.participant for one in found])
    person = replace(
        median, intercept=pace * intercept, slope=pace * slope, corner_cost=pace * price, duration_trial=spread.within
    )
    return _Durations(person, spread.between)


def _components(values: Floats, groups: Sequence[Hashable]) -> _Deviations:
    """Between groups and within them, by the method of moments."""
    number = {group: i for i, group in enumerate(dict.fromkeys(groups))}
    index = np.array([number[group] for group in groups])
    sizes = np.bincount(index).astype(np.float64)
    means = np.bincount(index, values) / sizes
    freedom = len(values) - len(sizes)
    if freedom == 0:
        return _Deviations(0.0, float(values.std()))
    within = float(((values - means[index]) ** 2).sum()) / freedom
    between = float(means.var(ddof=1)) - within * float((1.0 / sizes).mean()) if len(sizes) > 1 else 0.0
    return _Deviations(math.sqrt(max(between, 0.0)), math.sqrt(within))


def _trimmed(values: npt.ArrayLike) -> Floats:
    """Values with the extreme 1 % at either end clipped."""
    array = np.asarray(values, dtype=np.float64)
    low, high = np.quantile(array, [_TAIL, 1.0 - _TAIL])
    return np.clip(array, low, high)


def _deviation(values: npt.ArrayLike) -> float:
    return float(_trimmed(values).std())


def _robust(values: npt.ArrayLike) -> float:
    """Standard deviation by the interquartile range."""
    low, high = np.quantile(np.asarray(values, dtype=np.float64), [0.25, 0.75])
    return float(high - low) / 1.349
