"""The numbers of :mod:`legible_envs.tabletop.humans.model`, estimated from recorded reaches."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop.humans.model import Person, ReachModel
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import CUBE

__all__ = ["fit_reaches"]

Floats = npt.NDArray[np.float64]

_SKEWS: Final = np.exp(np.linspace(math.log(0.4), math.log(8.0), 200))
_TAIL: Final = 0.01
_LEAST_STATES: Final = 6
_LEAST_SPREAD: Final = 0.1  # of indices of difficulty, in bits, to tell slope from intercept
_WITHOUT: Final = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _Measured:
    """What is measured on one reach; the shape of its way is NaN where it passes corners."""

    participant: str
    goal: str
    direction: float
    log_skew: float
    bow: float
    aim: float
    drift: float
    noise: float
    miss: tuple[float, float]
    duration: float
    difficulty: float
    corners: int


def fit_reaches(
    trajectories: Iterable[Trajectory], *, base: ReachModel | None = None, width: float = CUBE
) -> ReachModel:
    """Estimate a population of people from reaches.

    Skew, bow and aim are fitted to each reach by least squares, then split by the method of moments into the median
    person, spread between people, and spread from reach to reach; the extreme 1 % at either end count as the last but
    them. Reaches that pass corners of obstacles count for durations only. What recordings do not tell stays as in
    ``base``: corner radius, pauses, the rate of crossing, ``drift_time``; Fitts' slope where all reaches are about
    equally difficult, and the cost of corners where none is passed.

    Args:
        trajectories: Complete reaches ``(x, y)`` with known goals and regular times, from the onset of movement to its
            end, by several participants with several reaches to each goal.
        base: What is kept; the default population if None.
        width: Of what is reached for, in metres, where no layout tells.

    Raises:
        ValueError: No reach can be used, or one is not what is expected.

    Example:
        >>> from legible_envs.tabletop import TabletopTask
        >>> from legible_envs.tabletop.humans import simulate_participants
        >>> task, rng = TabletopTask.named("columns"), np.random.default_rng(0)
        >>> people = simulate_participants(task, task.layout, 40, rng, executions=4)
        >>> model = fit_reaches(people)
        >>> round(model.median.skew, 1), round(model.median.bow, 2), round(model.median.endpoint_sd, 3)
        (1.3, -0.1, 0.015)
    """
    base = base or ReachModel()
    found = [_measure(walk, number, width) for number, walk in enumerate(trajectories)]
    plain = [one for one in found if one.corners == 0]
    if not plain:
        raise ValueError("no reach to fit: at least one must go straight to its goal, past no corner of an obstacle")
    people = [one.participant for one in plain]
    log_skew = _trimmed([one.log_skew for one in plain])
    skew_spread, skew_trial = _components(log_skew, people)
    bow, turns, spreads = _fit_bows(plain)
    misses = np.array([one.miss for one in plain])
    known = misses[np.isfinite(misses).all(axis=1)]
    median = replace(
        base.median,
        skew=math.exp(float(np.median(log_skew))),
        skew_trial=skew_trial,
        bow=bow,
        bow_turns=turns,
        bow_trial=spreads[2],
        aim=_deviation([one.aim for one in plain]),
        endpoint_sd=math.sqrt(np.mean([_deviation(axis) ** 2 for axis in known.T])) if len(known) > 1 else 0.0,
        start_sd=_robust([one.drift for one in plain]),
        signal_sd=_robust([one.noise for one in plain]),
    )
    median, duration_spread = _fit_durations(found, median)
    return ReachModel(median, skew_spread, spreads[0], spreads[1], duration_spread)


# -- one reach ---------------------------------------------------------------------------------------------------------


def _measure(walk: Trajectory, number: int, width: float) -> _Measured:
    if walk.goal is None or not walk.complete or walk.is_grid or walk.states.shape[1:] != (2,):
        raise ValueError(f"reach {number} must be a complete trajectory (x, y) with a known goal")
    if len(walk.states) < _LEAST_STATES or walk.times[-1] <= walk.times[0]:
        raise ValueError(f"reach {number} has {len(walk.states)} states; {_LEAST_STATES} and a duration are needed")
    chord = walk.states[-1] - walk.states[0]
    far = float(np.hypot(*chord))
    if far == 0:
        raise ValueError(f"reach {number} ends where it begins")
    target, size = _target(walk, width)
    length, corners = far if target is None else float(np.hypot(*(target - walk.states[0]))), 0
    if isinstance(walk.layout, TabletopLayout) and walk.layout.obstacles and walk.goal in walk.layout.goals:
        paths = walk.layout.paths
        way = paths.polyline(paths.nearest_free(walk.states[:1])[0], walk.goal)
        length, corners = float(np.hypot(*np.diff(way, axis=0).T).sum()), len(way) - 2
    miss = (math.nan, math.nan) if target is None else tuple((walk.states[-1] - target).tolist())
    shape = _shape(walk, chord / far, far) if corners == 0 else (math.nan,) * 5
    return _Measured(
        walk.participant,
        walk.goal,
        math.atan2(chord[1], chord[0]),
        *shape,
        miss,  # type: ignore[arg-type]
        float(walk.times[-1] - walk.times[0]),
        math.log2(length / size + 1.0),
        corners,
    )


def _target(walk: Trajectory, width: float) -> tuple[Floats | None, float]:
    """Where the goal is and how wide, as far as it is known."""
    assert walk.goal is not None
    if isinstance(walk.layout, TabletopLayout) and walk.goal in walk.layout.goals:
        width = min(walk.layout.objects[walk.layout.index(walk.goal)].size)
        target: npt.ArrayLike = walk.layout.place(walk.goal)
    elif walk.goal_positions is None:
        return None, width
    else:
        target = walk.goal_positions[walk.candidates.index(walk.goal)]
    return np.asarray(target, dtype=np.float64), width


def _shape(walk: Trajectory, ahead: Floats, far: float) -> tuple[float, float, float, float, float]:
    """Log skew, bow and aim, and estimates of the drift at the start and of the noise, one standard normal each."""
    moved = walk.states - walk.states[0]
    along, aside = moved @ ahead, moved @ np.array([-ahead[1], ahead[0]])
    share = (walk.times - walk.times[0]) / (walk.times[-1] - walk.times[0])
    early = 1.0 - (1.0 - share) ** _SKEWS[:, None]
    curves = early**3 * (10.0 - 15.0 * early + 6.0 * early**2)
    best = int(((curves - along / far) ** 2).sum(axis=1).argmin())
    progress = np.clip(along / far, 0.0, 1.0)
    waves = np.column_stack([np.sin(np.pi * progress), np.sin(2.0 * np.pi * progress)])
    bow, aim = np.linalg.lstsq(waves, aside / far, rcond=None)[0].tolist()
    # A drift that keeps `k` of itself from sample to sample changes by sqrt(2 (1 - k)) of its standard deviation.
    keep = math.exp(-float(walk.times[1] - walk.times[0]) / Person.drift_time)
    third = np.diff(aside[-max(len(aside) // 3, 4) :], 3)  # of white noise: sqrt(20) of its standard deviation
    return (
        math.log(_SKEWS[best]),
        bow,
        aim,
        float(aside[1]) / math.sqrt(max(2.0 * (1.0 - keep), 1e-9)),
        float(third[len(third) // 2]) / math.sqrt(20.0),
    )


# -- populations -------------------------------------------------------------------------------------------------------


def _fit_bows(
    plain: Sequence[_Measured],
) -> tuple[float, tuple[float, float, float, float], tuple[float, float, float]]:
    """Mean bow, what directions add to it, and spreads between people, between one's directions, between reaches."""
    bows = _trimmed([one.bow for one in plain])
    d = np.array([one.direction for one in plain])
    waves = np.column_stack([np.ones(len(d)), np.cos(d), np.sin(d), np.cos(2 * d), np.sin(2 * d)])
    if len({one.goal for one in plain}) > 2 * waves.shape[1] - 1:
        level, *turns = np.linalg.lstsq(waves, bows, rcond=None)[0].tolist()
    else:  # too few directions to tell their shape
        level, turns = float(bows.mean()), list(_WITHOUT)
    rest = bows - waves @ np.array([level, *turns])
    _, trial = _components(rest, [(one.participant, one.goal) for one in plain])
    person, _ = _components(rest, [one.participant for one in plain])
    target = math.sqrt(max(float(rest.var()) - trial**2 - person**2, 0.0) / 2.0)
    a, b, c, e = turns
    return level, (a, b, c, e), (person, target, trial)


def _fit_durations(found: Sequence[_Measured], median: Person) -> tuple[Person, float]:
    """The person with durations by Fitts' law and corners, and how durations spread between people."""
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
    spread, trial = _components(_trimmed(logs), [one.participant for one in found])
    person = replace(
        median, intercept=pace * intercept, slope=pace * slope, corner_cost=pace * price, duration_trial=trial
    )
    return person, spread


def _components(values: Floats, groups: Sequence[Hashable]) -> tuple[float, float]:
    """Standard deviations between groups and within them, by the method of moments."""
    number = {group: i for i, group in enumerate(dict.fromkeys(groups))}
    index = np.array([number[group] for group in groups])
    sizes = np.bincount(index).astype(np.float64)
    means = np.bincount(index, values) / sizes
    freedom = len(values) - len(sizes)
    if freedom == 0:
        return 0.0, float(values.std())
    within = float(((values - means[index]) ** 2).sum()) / freedom
    between = float(means.var(ddof=1)) - within * float((1.0 / sizes).mean()) if len(sizes) > 1 else 0.0
    return math.sqrt(max(between, 0.0)), math.sqrt(within)


def _trimmed(values: npt.ArrayLike) -> Floats:
    """Values with the extreme 1 % at either end put back to the last but them."""
    array = np.asarray(values, dtype=np.float64)
    low, high = np.quantile(array, [_TAIL, 1.0 - _TAIL])
    return np.clip(array, low, high)


def _deviation(values: npt.ArrayLike) -> float:
    return float(_trimmed(values).std())


def _robust(values: npt.ArrayLike) -> float:
    """Standard deviation by the interquartile range."""
    low, high = np.quantile(np.asarray(values, dtype=np.float64), [0.25, 0.75])
    return float(high - low) / 1.349
