"""Speed of alignment and prediction of reaches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.throughput.measure import Figure, alternate, rate
from legible_envs.rollouts.trajectory import Trajectory

if TYPE_CHECKING:
    from benchmarks.throughput.sweep import Settings

__all__ = ["reach_speed"]

_GOALS = tuple("abcdefgh")


def reach_speed(settings: Settings) -> list[Figure]:
    """Seconds per banded and unbanded alignment of two series, and per update of the Gaussian's belief."""
    from predictors import TimeSeriesGaussian
    from predictors.reaching.alignment_kernels import closed_cost

    rng = np.random.default_rng(0)
    reaches = _straight_reaches(rng)
    first, second = rng.normal(size=(100, 2)).cumsum(axis=0), rng.normal(size=(120, 2)).cumsum(axis=0)
    predictors = {str(velocity): TimeSeriesGaussian(velocity=velocity).fit(reaches) for velocity in (False, True)}

    def align(radius: int) -> int:
        closed_cost(first, second, radius)
        return 1

    def update(name: str) -> int:
        reach = reaches[0]
        stream = predictors[name].stream(reach)
        for point, time in zip(reach.states, reach.times, strict=True):
            stream.update(point, time)
        return reach.num_states

    samples = alternate(
        {
            "dtw": lambda: 1.0 / rate(lambda: align(5), settings.seconds),
            "dtw unbanded": lambda: 1.0 / rate(lambda: align(-1), settings.seconds),
            "gaussian update": lambda: 1.0 / rate(lambda: update("False"), settings.seconds),
            "gaussian velocity update": lambda: 1.0 / rate(lambda: update("True"), settings.seconds),
        },
        settings.rounds,
    )
    what = {
        "dtw": "aligning 100 x 120 points in a band of 5 %",
        "dtw unbanded": "aligning 100 x 120 points without a band",
        "gaussian update": f"one sample of a reach, {len(_GOALS)} goals, time-series Gaussian",
        "gaussian velocity update": "the same with velocities",
    }
    return [Figure(key, what[key], "s", values) for key, values in samples.items()]


def _straight_reaches(rng: np.random.Generator) -> list[Trajectory]:
    """Ten reaches to each goal, 100 samples long."""
    share = np.linspace(0.0, 1.0, 100)[:, None]
    ends = rng.uniform(-0.5, 0.5, (len(_GOALS), 2))
    return [
        Trajectory(share * (end + rng.normal(0, 0.02, 2)), share[:, 0], goal=goal, candidates=_GOALS)
        for goal, end in zip(_GOALS, ends, strict=True)
        for _ in range(10)
    ]
