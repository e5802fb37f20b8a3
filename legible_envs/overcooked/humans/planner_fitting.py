"""Walkers fitted to the participants of recorded play: the noisily rational one, and the planner."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.humans.fitting import fit_rationality, rationality_spread, walked_paths
from legible_envs.overcooked.humans.kernels import GoalField, step_probabilities
from legible_envs.overcooked.humans.simulation import BoltzmannWalker, PlannerWalker, Walker

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["PlannerFit", "best_slip", "draw_person", "fit_boltzmann", "fit_planner"]

Floats = npt.NDArray[np.float64]
Recorded = list[tuple[npt.NDArray[np.int64], GoalField, str]]

GRID: Final[Mapping[str, tuple[float, ...]]] = {
    "depth": (2, 3, 4),
    "turn_cost": (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0),
    "recency": (0.5, 1.0, 2.0, 3.0, 4.0),
    "fade": (0.5, 0.7, 0.8, 0.9, 0.95),
}
"""Values of the planner's parameters that are tried. Costs decide what is best alone, not by how much: between two
values of the grid the likelihood hardly changes, but in steps, so that nothing smooth could be climbed. A depth of one
step would fit the recorded kitchens, which have no dead ends, better still, but such participants get lost for hundreds
of steps among virtual obstacles; two is the least."""
MIN_TRAJECTORIES: Final = 10
"""Fewest trajectories of a participant who is fitted alone."""


@dataclass(frozen=True)
class PlannerFit:
    """Maximum likelihood estimates of the planner.

    Attributes:
        depth: Steps looked ahead, the best of ``GRID``, as all but the slips.
        turn_cost: Of all participants together.
        recency: Of all participants together.
        fade: Of all participants together.
        slip: Of all participants together.
        log_likelihood: Of all steps, at these.
        num_steps: Steps taken.
        people: ``{participant: (turn_cost, slip)}``, the rest as for all.
    """

    depth: int
    turn_cost: float
    recency: float
    fade: float
    slip: float
    log_likelihood: float
    num_steps: int
    people: dict[str, tuple[float, float]]


def fit_boltzmann(trajectories: Sequence[Trajectory]) -> list[dict[str, Any]]:
    """The rationality of recorded participants.

    Returns:
        A row for all of them (``median``, ``spread`` between participants on the log scale with the error of each
        estimate taken out, and the ``log_likelihood`` of all steps at one common rationality), with empty
        ``participant``; then one for each participant with ``rationality``.
    """
    spread = rationality_spread(trajectories, min_trajectories=MIN_TRAJECTORIES)
    common = fit_rationality(trajectories)
    whole = {
        "walker": "boltzmann",
        "participant": "",
        "rationality": spread.median,
        "spread": spread.sd,
        "log_likelihood": common.log_likelihood,
        "steps": common.num_steps,
        "walks": common.num_trajectories,
        "people": common.num_participants,
    }
    each = [
        {"walker": "boltzmann", "participant": name, "rationality": fit.rationality, "walks": fit.num_trajectories}
        for name, fit in spread.fits.items()
    ]
    return [whole, *each]


def fit_planner(trajectories: Sequence[Trajectory], grid: Mapping[str, Sequence[float]] = GRID) -> PlannerFit:
    """Fit the planner to recorded trajectories.

    All parameters are fitted for all participants together, one after the other over a grid until none is better
    changed alone (the rate of slips exactly, for each); then each participant's own cost of turning and rate of slips.

    Args:
        trajectories: Trajectories with a kitchen, a goal and a participant.
        grid: Values tried.

    Raises:
        ValueError: No trajectories or no steps; a trajectory without a kitchen or a goal, that does not fit its
            kitchen, or that jumps.
    """
    if not len(trajectories):
        raise ValueError("the planner is fitted to at least one trajectory, got none")
    recorded = _prepared(trajectories)
    who = np.repeat([name for *_, name in recorded], [len(path) - 1 for path, *_ in recorded])
    seen: dict[tuple[float, ...], tuple[Floats, Floats]] = {}

    def steps(values: Mapping[str, float]) -> tuple[Floats, Floats]:
        key = tuple(values[name] for name in grid)
        if key not in seen:
            seen[key] = _step_probabilities(recorded, np.array([*key, 0.0]))
        return seen[key]

    best = {name: values[0] for name, values in grid.items()}
    slip, value = best_slip(*steps(best))
    moved = True
    while moved:
        moved = False
        for name, values in grid.items():
            for other in values:
                found = best_slip(*steps({**best, name: other}))
                if found[1] > value + 1e-9:
                    best, (slip, value), moved = {**best, name: other}, found, True
    turning = [(turn, *steps({**best, "turn_cost": turn})) for turn in grid["turn_cost"]]
    people = {}
    for name, number in Counter(trajectory.participant for trajectory in trajectories).items():
        if number >= MIN_TRAJECTORIES:
            own = [(turn, *best_slip(planned[who == name], slipped[who == name])) for turn, planned, slipped in turning]
            turn, own_slip, _ = max(own, key=lambda fit: fit[2])
            people[name] = (float(turn), own_slip)
    return PlannerFit(
        int(best["depth"]), best["turn_cost"], best["recency"], best["fade"], slip, value, len(who), people
    )


def best_slip(planned: Floats, slipped: Floats) -> tuple[float, float]:
    """The rate of slips that makes steps most likely, and their log-likelihood; it is concave in the rate.

    Args:
        planned: ``(m,)`` probability of each step without slips.
        slipped: ``(m,)`` probability of each step where every step is a slip.
    """
    from scipy.optimize import minimize_scalar

    def loss(slip: float) -> float:
        return -float(np.log((1 - slip) * planned + slip * slipped).sum())

    found = minimize_scalar(loss, bounds=(1e-6, 1.0), method="bounded", options={"xatol": 1e-6})
    return float(found.x), -float(found.fun)


def _prepared(trajectories: Sequence[Trajectory]) -> Recorded:
    """Paths as cell numbers, the costs to go to each goal, and the participant."""
    paths = zip(trajectories, walked_paths(trajectories), strict=True)
    found = [
        (np.array(cells, dtype=np.int64), field, trajectory.participant)
        for trajectory, (cells, field) in paths
        if len(cells) > 1
    ]
    if not found:
        raise ValueError(f"the planner is fitted to steps; {len(trajectories)} trajectories have none")
    return found


def _step_probabilities(recorded: Recorded, params: Floats) -> tuple[Floats, Floats]:
    """``(m,)`` each of all steps of all trajectories, as :func:`step_probabilities` gives them."""
    ends = np.cumsum([0, *(len(path) - 1 for path, *_ in recorded)])
    planned, slipped = np.empty(ends[-1]), np.empty(ends[-1])
    for (path, field, _), a, b in zip(recorded, ends, ends[1:], strict=False):
        step_probabilities(path, field, params, planned[a:b], slipped[a:b])
    return planned, slipped


def draw_person(people: Mapping[str, Any]) -> Callable[..., Walker]:
    """A function that draws participants for :func:`~legible_envs.overcooked.humans.simulate_participants`.

    Args:
        people: Plain data: ``walker``, ``"boltzmann"`` or ``"planner"``, and its parameters. Boltzmann walkers have
            lognormal rationality (``rationality``, ``spread``, ``preference``); planners share ``depth``, ``recency``,
            ``fade`` and ``preference``, and have the ``(turn_cost, slip)`` of one recorded participant each, drawn at
            random from ``people``.
    """
    kind, preference = people["walker"], float(people["preference"])
    if kind == "boltzmann":

        def draw(shape: tuple[int, int], rng: np.random.Generator) -> Walker:
            return BoltzmannWalker.draw(
                shape, rng, rationality=people["rationality"], spread=people["spread"], preference=preference
            )

    elif kind == "planner":

        def draw(shape: tuple[int, int], rng: np.random.Generator) -> Walker:
            turn_cost, slip = people["people"][int(rng.integers(len(people["people"])))]
            shared = {key: people[key] for key in ("depth", "recency", "fade")}
            return PlannerWalker.draw(shape, rng, preference=preference, turn_cost=turn_cost, slip=slip, **shared)

    else:
        raise ValueError(f"`walker` must be 'boltzmann' or 'planner', got {kind!r}")
    return draw
