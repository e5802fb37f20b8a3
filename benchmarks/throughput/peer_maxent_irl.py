"""Runs in the environment of imitation or irl-maxent, on the problem in the file named second.

To "rate SECONDS" it answers with gradients per second, to "gradient" with the gradient itself. The problem, made by
:func:`.save_problem`: ``next`` ``(n, 4)`` cells beside each cell (-1: none), ``goals`` ``(n, 4, K)`` whether that move
enters a station, ``starts`` ``(K, n)`` number of trajectories to each station that begin in each cell, ``visits``
``(n,)`` how often each cell was entered or begun in, ``rewards`` ``(n,)`` of the cells, ``horizon`` the most steps of a
trajectory (imitation needs such a limit). Both packages know one task at a time: there is one for each station, with
two states more. The station's state absorbs, and its reward of ``-log 4`` makes its four actions weigh 1 together.
Impossible moves lead to the last state, whose cost is prohibitive. Stated so, both compute the gradient of this
project, which is compared with theirs.
"""

import json
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

DEAD = -300.0


def tasks(problem: Any) -> Iterator[tuple[Any, Any, Any]]:
    """For each station: ``(S, 4, S)`` transitions, ``(S,)`` number of starts in each state, ``(S,)`` rewards."""
    count = len(problem["next"])
    for goal, starts in enumerate(problem["starts"]):
        moves = np.zeros((count + 2, 4, count + 2))
        for cell in range(count):
            for move in range(4):
                to = problem["next"][cell, move]
                to = count if problem["goals"][cell, move, goal] else to if to >= 0 else count + 1
                moves[cell, move, to] = 1.0
        moves[count, :, count] = moves[count + 1, :, count + 1] = 1.0
        yield moves, np.r_[starts, 0.0, 0.0], np.r_[problem["rewards"], -np.log(4.0), DEAD]


def with_imitation(problem: Any) -> Callable[[], Any]:
    """The gradient as ``MCEIRL`` computes it before each step of its optimiser."""
    from imitation.algorithms.mce_irl import mce_occupancy_measures  # type: ignore[import-not-found]
    from seals.base_envs import TabularModelPOMDP  # type: ignore[import-not-found]

    made = []
    for moves, starts, reward in tasks(problem):
        env = TabularModelPOMDP(
            transition_matrix=moves,
            observation_matrix=np.eye(len(moves)),
            reward_matrix=reward,
            horizon=int(problem["horizon"]),
            initial_state_dist=starts / starts.sum(),
        )
        made.append((env, starts.sum(), reward))
    visits = problem["visits"]

    def gradient() -> Any:
        expected = np.zeros(len(visits))
        for env, weight, reward in made:
            expected += weight * mce_occupancy_measures(env, reward=reward)[1][: len(visits)]
        return visits - expected

    return gradient


def with_irl_maxent(problem: Any) -> Callable[[], Any]:
    """The gradient as ``irl`` computes it before each step of its optimiser."""
    from irl_maxent.maxent import compute_expected_svf  # type: ignore[import-not-found]

    # It wants transitions as (from, to, action).
    # It needs no state for impossible moves: transitions without any probability do.
    made = [
        (np.moveaxis(moves, 1, 2)[:-1, :-1].copy(), starts[:-1], reward[:-1])
        for moves, starts, reward in tasks(problem)
    ]
    visits = problem["visits"]

    def gradient() -> Any:
        expected = np.zeros(len(visits))
        for moves, starts, reward in made:
            weight = starts.sum()
            svf = compute_expected_svf(moves, starts / weight, [len(visits)], reward)
            expected += weight * svf[: len(visits)]
        return visits - expected

    return gradient


def requests() -> Iterator[str]:
    """Lines of standard input. Where it is closed, nobody waits for an answer any more, and the process ends."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield lines.get()


def main() -> None:
    """Answer requests until there are no more."""
    make = {"imitation": with_imitation, "irl-maxent": with_irl_maxent}[sys.argv[1]]
    with np.load(sys.argv[2]) as file:
        gradient = make({name: file[name] for name in file.files})
    gradient()
    print("ready", flush=True)
    for line in requests():
        if line.startswith("gradient"):
            print("gradient", json.dumps(gradient().tolist()), flush=True)
            continue
        seconds, done, start, passed = float(line.split()[1]), 0, time.process_time(), 0.0
        while passed < seconds or not done:
            gradient()
            done += 1
            passed = time.process_time() - start
        print("rate", done / passed, flush=True)


if __name__ == "__main__":
    main()
