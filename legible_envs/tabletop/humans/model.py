"""How people reach: the parameters of one person, and how these differ in a population.

A reach follows the shortest path of the hand (Tung et al., HRI 2024, assume as much) with what is known of hands:

* progress along it is a minimum-jerk profile (Flash and Hogan, 1985) whose peak of speed comes early,
  ``mj(1 - (1 - t) ** skew)`` at share ``t`` of the duration: people brake longer than they speed up, the more precisely
  they aim (Marteniuk et al., 1987);
* its legs are bowed sideways, by an amount that differs between participants and directions (Atkeson and Hollerbach,
  1985; Wolpert et al., 1995), as far as there is room between obstacles;
* its direction is off at first and corrected during the reach (Georgopoulos and Massey, 1988);
* its duration follows Fitts' law (Fitts, 1954, in the form of MacKenzie, 1992), with a price for every corner passed,
  whose roundness depends on the person;
* where it begins and ends is noisy (Harris and Wolpert, 1998).

The defaults are for hands over a table. Skew (median 1.35, sd of its logarithm .17 in all), bow
(-.06 to -.15 of the distance) and endpoints (sd 1.5 cm) were found to give simulated reaches the properties of recorded
ones: with plain minimum jerk a predictor by straight lines beats one that learns from the very participants, the
reverse of what recordings say. :func:`~legible_envs.tabletop.humans.fitting.fit_reaches` finds the numbers of recorded
reaches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace

import numpy as np

from legible_envs.support.validation import entries, is_real, real, shown
from legible_envs.tabletop.objects import Point

__all__ = ["Person", "ReachModel"]


@dataclass(frozen=True, kw_only=True)
class Person:
    """How one person reaches. Drawn by :meth:`ReachModel.sample_person`.

    Attributes:
        skew: Median exponent of time; 1 is minimum jerk, more is an earlier peak of speed.
        skew_trial: Standard deviation of its logarithm from reach to reach.
        bow: Mean lateral deviation in the middle of a leg, to the left, as a share of the leg's length.
        bow_turns: Addition to it in direction ``d`` (from start to goal, counter-clockwise from the x-axis):
            ``a cos d + b sin d + c cos 2d + e sin 2d``.
        bow_trial: Standard deviation from reach to reach.
        aim: Standard deviation of the deviation, as a share of the leg's length, that goes to one side in the first
            half of a leg and is corrected to the other in the second.
        intercept: Of Fitts' law, in seconds. With these defaults a reach of 54 cm to a cube takes 0.75 s, the pace of
            unhurried prehension (Jeannerod, 1984).
        slope: Of Fitts' law, in seconds per bit.
        corner_cost: Seconds per corner passed. An assumption, about the time by which submovements overlap.
        duration_trial: Standard deviation of the logarithm of durations from reach to reach.
        corner_radius: Metres before and after a corner within which it is rounded, where there is room.
        endpoint_sd: Standard deviation of where a reach ends about its goal, on each axis, in metres.
        start_sd: The same of where it begins; this deviation wanders, and fades towards the goal.
        drift_time: In how many seconds it wanders (time constant of its autocorrelation).
        signal_sd: Standard deviation of white noise on every sample, on each axis, in metres.
        pause: Seconds to grasp or to let go.
        crossing_rate: Probability that a reach ignores virtual obstacles as if there were none. It has not been
            measured yet: vary it.

    Raises:
        ValueError: A value is out of range.
    """

    skew: float = 1.35
    skew_trial: float = 0.12
    bow: float = -0.105
    bow_turns: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    bow_trial: float = 0.02
    aim: float = 0.02
    intercept: float = 0.2
    slope: float = 0.15
    corner_cost: float = 0.1
    duration_trial: float = 0.1
    corner_radius: float = 0.04
    endpoint_sd: float = 0.015
    start_sd: float = 0.005
    drift_time: float = 0.1
    signal_sd: float = 0.001
    pause: float = 0.25
    crossing_rate: float = 0.0

    def __post_init__(self) -> None:
        check_parameters(self, signed=("bow",), skipped=("bow_turns",))
        turns = entries(self.bow_turns)
        if len(turns) != 4 or not all(map(is_real, turns)):
            raise ValueError(f"`bow_turns` must be four finite numbers, got {shown(self.bow_turns)}")
        object.__setattr__(self, "bow_turns", tuple(map(float, turns)))
        if self.crossing_rate > 1:
            raise ValueError(f"crossing_rate is a probability, at most 1, got {self.crossing_rate!r}")
        if self.skew == 0 or self.drift_time == 0 or self.intercept + self.slope == 0:
            raise ValueError("skew, drift_time and intercept + slope must be greater than 0")

    def bow_towards(self, start: Point, goal: Point) -> float:
        """The person's mean bow for a reach between two points."""
        d = math.atan2(goal[1] - start[1], goal[0] - start[0])
        a, b, c, e = self.bow_turns
        return self.bow + a * math.cos(d) + b * math.sin(d) + c * math.cos(2 * d) + e * math.sin(2 * d)

    def duration(self, length: float, width: float, corners: int = 0) -> float:
        """Median duration of a reach in seconds.

        Args:
            length: Of the path, in metres.
            width: Of the object, in metres.
            corners: Number of corners passed.
        """
        return self.intercept + self.slope * math.log2(length / width + 1.0) + self.corner_cost * corners


@dataclass(frozen=True)
class ReachModel:
    """A population of people who reach; the module's docstring names the sources of the model and its numbers.

    Over participants and directions, bows have the variance ``bow_spread ** 2 + 2 bow_target ** 2 + bow_trial ** 2``,
    .035 squared with the defaults.

    Attributes:
        median: The person in the middle. Parameters without a spread here are the same for all.
        skew_spread: Standard deviation of the logarithm of ``skew`` between participants.
        bow_spread: Standard deviation of ``bow`` between participants.
        bow_target: Standard deviation of each of their four ``bow_turns``.
        duration_spread: Standard deviation of the logarithm of durations between participants.

    Raises:
        ValueError: A value is out of range.

    Example:
        >>> import numpy as np
        >>> ReachModel(Person(crossing_rate=0.1)).sample_person(np.random.default_rng(0)).crossing_rate
        0.1
    """

    median: Person = field(default_factory=Person)
    skew_spread: float = 0.12
    bow_spread: float = 0.02
    bow_target: float = 0.015
    duration_spread: float = 0.1

    def __post_init__(self) -> None:
        if not isinstance(self.median, Person):
            raise ValueError(f"median must be a Person, got {type(self.median).__name__}")
        check_parameters(self, skipped=("median",))

    def sample_person(self, rng: np.random.Generator) -> Person:
        """A random person."""
        skew, bow, pace, *turns = rng.standard_normal(7).tolist()
        median, pace = self.median, math.exp(self.duration_spread * pace)
        a, b, c, e = (turn + self.bow_target * own for turn, own in zip(median.bow_turns, turns, strict=True))
        return replace(
            median,
            skew=median.skew * math.exp(self.skew_spread * skew),
            bow=median.bow + self.bow_spread * bow,
            bow_turns=(a, b, c, e),
            intercept=median.intercept * pace,
            slope=median.slope * pace,
            corner_cost=median.corner_cost * pace,
        )


def check_parameters(
    parameters: Person | ReachModel, signed: tuple[str, ...] = (), skipped: tuple[str, ...] = ()
) -> None:
    """Refuse numbers that are not finite, and negative ones that are not ``signed``; make them plain floats.

    Raises:
        ValueError: Naming the parameter.
    """
    for entry in fields(parameters):
        if entry.name in skipped:
            continue
        value = getattr(parameters, entry.name)
        least = -math.inf if entry.name in signed else 0
        object.__setattr__(parameters, entry.name, real(entry.name, value, least))
