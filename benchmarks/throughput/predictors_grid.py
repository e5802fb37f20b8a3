"""Speed of prediction in kitchens: maximum-entropy IRL beside other packages, updates of beliefs, whole evaluations."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from benchmarks.throughput.measure import Figure, alternate, rate
from benchmarks.throughput.peers import Peer
from benchmarks.throughput.sweep import Settings
from legible_envs.overcooked.grid import NEIGHBOURS

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory
    from predictors.base import GoalPredictor
    from predictors.grid.walk_likelihood import Evidence

__all__ = ["PEER_PROBLEM", "evaluation_speed", "noisy_trajectories", "prediction_speed", "save_problem"]

PEER_PROBLEM: Final = "problem.npz"
_COST: Final = 1.8
"""Per step, where gradients are taken: about the best uniform cost of the trajectories."""
_HORIZON: Final = 60
"""Length limit that imitation needs: at 40 steps its gradient is wrong in the third digit."""
_PEERS: Final = {
    "imitation": f"the same gradient by imitation (tabular, a task per goal, {_HORIZON} steps)",
    "irl-maxent": "the same gradient by irl-maxent (a task per goal)",
}

_KITCHEN = "\n".join(["XOXXTXXDX", *["X       X"] * 7, "XXPXXXCXX"])
_RING = "\n".join(["XOXXTXXDX", "X       X", "X XXXXX X", "X       X", "XXPXXXCXX"])
_UPDATES = {
    "update Eq. 1": ("bayesian", "one update of Bayesian goal inference (Eq. 1)"),
    "update MaxEnt": ("maxent-irl", "one update of maximum-entropy IRL"),
    "update n-gram": ("grid-ngram", "one update of the n-gram"),
    "update k-NN": ("grid-knn", "one update of nearest neighbours"),
    "update logistic": ("grid-logistic", "one update of logistic regression"),
}


def prediction_speed(
    settings: Settings, peers: Mapping[str, Peer] | None = None, remarks: list[str] | None = None
) -> list[Figure]:
    """Seconds per gradient, per fit and per update, on 200 trajectories to 5 goals in a kitchen of 9 x 9.

    Args:
        settings: Sizes and repeats.
        peers: Other packages by name, started on the file of :func:`save_problem`.
        remarks: Gets a line for each of them that computes another gradient.
    """
    from predictors.grid.maxent_irl import MaxEntIRL
    from predictors.registry import make_predictor

    trajectories = noisy_trajectories(200, np.random.default_rng(0))
    evidence, costs = _evidence(trajectories)

    def gradients() -> int:
        for _ in range(50):
            evidence.loss(costs)
        return 50

    def fit() -> int:
        MaxEntIRL().fit(trajectories)
        return 1

    works: dict[str, Callable[[], int]] = {"maxent gradient": gradients, "maxent fit": fit}
    works |= {
        key: _updater(make_predictor(name).fit(trajectories), trajectories) for key, (name, _) in _UPDATES.items()
    }
    samplers = {key: lambda work=work: 1 / rate(work, settings.seconds) for key, work in works.items()}  # type: ignore[misc]
    agreeing = _agreeing(peers or {}, evidence.loss(costs)[1], [] if remarks is None else remarks)
    samplers |= {name: partial(_seconds_of, peer, settings.seconds) for name, peer in agreeing.items()}
    samples = alternate(samplers, settings.rounds)
    what = {
        "maxent gradient": "gradient of maximum-entropy IRL, 9x9, 5 goals, 200 trajectories",
        "maxent fit": "whole fit of maximum-entropy IRL, 9x9, 5 goals, 200 trajectories",
        **{key: text for key, (_, text) in _UPDATES.items()},
        **_PEERS,
    }
    figures = {key: Figure(key, what[key], "s", values) for key, values in samples.items()}
    own = figures["maxent gradient"]
    ratios = [figures[name].over(own, f"{name} / gradient", f"that of {name} over our gradient") for name in agreeing]
    return [*figures.values(), *ratios]


def _evidence(trajectories: list[Trajectory]) -> tuple[Evidence, npt.NDArray[np.float64]]:
    """The statistics of trajectories in one kitchen, and costs at which to take the gradient."""
    from predictors.grid.walk_likelihood import collect_evidence

    (evidence,) = collect_evidence(trajectories).values()
    return evidence, np.full(len(evidence.visits), _COST)


def _agreeing(peers: Mapping[str, Peer], gradient: npt.NDArray[np.float64], remarks: list[str]) -> dict[str, Peer]:
    """The peers that compute this gradient too."""
    found = {}
    for name, peer in peers.items():
        theirs = np.array(json.loads(peer.ask("gradient", "gradient")))
        error = np.abs(theirs - gradient).max() / np.abs(gradient).max()
        if error < 1e-3:
            found[name] = peer
        else:
            remarks.append(f"{name} was not measured: its gradient differs from ours by {error:.1%} of the greatest")
    return found


def _seconds_of(peer: Peer, seconds: float) -> float:
    return 1 / peer.rate(f"rate {seconds}")


def save_problem(folder: Path) -> Path:
    """Write what other packages need to compute the gradient of :func:`prediction_speed` into a folder.

    The docstring of ``peer_maxent_irl.py`` beside this file defines its arrays.
    """
    evidence, costs = _evidence(noisy_trajectories(200, np.random.default_rng(0)))
    graph = evidence.graph
    starts = np.zeros((len(graph.goals), len(costs)))
    np.add.at(starts, (evidence.goals, evidence.starts), evidence.weights)
    beside = graph.cells[:, None] + np.array(NEIGHBOURS)
    stations = np.array([graph.layout.stations[goal] for goal in graph.goals])
    path = folder / PEER_PROBLEM
    np.savez(
        path,
        next=graph.neighbours,
        goals=(beside[:, :, None] == stations).all(axis=-1),
        starts=starts,
        visits=evidence.visits + starts.sum(axis=0),
        rewards=-costs,
        horizon=_HORIZON,
    )
    return path


def evaluation_speed(settings: Settings) -> list[Figure]:
    """Seconds that cross-validating every predictor for kitchens takes in one kitchen."""
    from benchmarks.experiments.prediction.sweep import PREDICTORS
    from predictors.evaluation.cross_validation import evaluate
    from predictors.registry import make_predictor

    trajectories = noisy_trajectories(settings.trajectories, np.random.default_rng(1), drawing=_RING)
    named = {setting.label: make_predictor(setting.predictor, **setting.parameters) for setting in PREDICTORS}
    samples = []
    for number in range(settings.evaluations + 1):
        start = time.process_time()
        evaluate(named, trajectories, cv=4, repeats=3)
        if number:  # the first one compiles
            samples.append(time.process_time() - start)
    what = f"4-fold x 3 cross-validation, {len(named)} kitchen predictors, 5x9, {len(trajectories)} trajectories"
    return [Figure("evaluation", what, "s", tuple(samples))]


def _updater(predictor: GoalPredictor, trajectories: list[Trajectory]) -> Callable[[], int]:
    def update() -> int:
        steps = 0
        for trajectory in trajectories[:20]:
            stream = predictor.stream(trajectory)
            for cell in trajectory.states[:-1]:
                stream.update(cell)
                steps += 1
        return steps

    return update


def noisy_trajectories(
    count: int, rng: np.random.Generator, stray: float = 0.2, drawing: str = _KITCHEN
) -> list[Trajectory]:
    """Trajectories of steps nearer to the goal or, with probability ``stray``, of any step."""
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.rollouts.trajectory import Trajectory
    from predictors.grid.base import remaining_steps

    layout = OvercookedLayout.from_ascii(drawing)
    goals = tuple(layout.stations)
    away, floor = remaining_steps(layout, goals), np.argwhere(layout.cells == 0)
    trajectories = []
    for _ in range(count):
        goal = int(rng.integers(len(goals)))
        row, col = (int(i) for i in rng.choice(floor))
        cells = [(row, col)]
        while away[row, col, goal] > 1:
            beside = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
            steps = [cell for cell in beside if layout.is_floor(cell)]
            nearer = [cell for cell in steps if away[cell][goal] < away[row, col, goal]]
            options = steps if rng.random() < stray else nearer
            row, col = options[rng.integers(len(options))]
            cells.append((row, col))
        states = np.array([*cells, layout.stations[goals[goal]]])
        trajectories.append(Trajectory(states, start="serving", goal=goals[goal], candidates=goals, layout=layout))
    return trajectories
