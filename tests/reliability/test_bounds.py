"""Absurd counts are refused before any work, with the bound; what has no bound streams and obeys its time limit."""

from __future__ import annotations

import json
import random
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from legible_envs.errors import TaskError
from legible_envs.task_states import MAX_STEPS
from legible_envs.tasks import AGENTS, Subtask, TaskGraph
from legible_envs.workspace import make_workspace
from optimizers import search

ROOT = Path(__file__).parents[2]
BOUND = r"(?i)at most|within 1000 m|from .* to |<= |in the range|larger than|smaller than|folds need at least"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="memory is limited by the module `resource`")
def test_absurd_counts_are_refused_at_once_with_the_bound() -> None:
    command = [sys.executable, "-m", "tests.reliability.bounded_calls"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=280)
    assert ended.returncode == 0, ended.stderr[-2000:]
    calls = [json.loads(line) for line in ended.stdout.splitlines()]
    assert len(calls) > 180
    for call, refused, seconds, mebibytes, kind, message in calls:
        assert refused, (call, kind, message)
        assert seconds < 1, call
        assert mebibytes < 1_000, call
        assert re.search(BOUND, message), (call, message)


@pytest.mark.parametrize("kitchen", [True, False])
@pytest.mark.parametrize("budget", [{"evaluations": 2**63 - 1}, {"iterations": (50, 2**63 - 1)}], ids=str)
def test_endless_searches_obey_their_time_limit(kitchen: bool, budget: dict[str, int]) -> None:
    workspace = make_workspace("overcooked", shape=(5, 5)) if kitchen else make_workspace("tabletop")
    initial = {} if "iterations" in budget else {"initial": 50}
    result = search(workspace, **budget, **initial, time_limit=0.01, progress=False, emitter_options={"climbs": 2})
    assert 50 <= result.evaluations < 10_000


# -- the states of a task ----------------------------------------------------------------------------------------------


def weights_by_definition(task: TaskGraph) -> tuple[int, dict, int]:
    """Number of sequences, weight of every transition, and number of steps, from the steps of single states alone."""
    space = task.states

    @cache
    def completions(done: tuple[int, ...]) -> int:
        if sum(done) == space.length:
            return 1
        return sum((space.classes[i].count - done[i]) * completions(one_more(done, i)) for i in space.ready(done))

    def one_more(done: tuple[int, ...], i: int) -> tuple[int, ...]:
        return (*done[:i], done[i] + 1, *done[i + 1 :])

    weights, visits, count = defaultdict(float), {space.initial: 1.0}, 0
    for _ in range(space.length):
        following = defaultdict(float)
        for state, visit in visits.items():
            steps = [step for step in space.steps(state) if completions(step[3][0])]
            goals = tuple(sorted({step[1] for step in steps} - {None}))
            count += len(steps)
            for i, goal, copies, then in steps:
                share = copies * completions(then[0]) / completions(state[0])
                following[then] += visit * share
                if goal is None:  # the robot's
                    assert state[1] == then[1]
                    continue
                weights[state[1], goals, goal, space.classes[i].then] += visit * share
        visits = following
    return completions(space.initial[0]), dict(weights), count


def random_task(rng: random.Random) -> TaskGraph | None:
    count = rng.randrange(1, 7)
    able = rng.choice([[AGENTS], [AGENTS, ("human",), ("robot",)]])
    subtasks = [
        Subtask(
            f"s{i}",
            tuple(rng.sample("abcd", rng.randrange(1, 4))),
            tuple(f"s{j}" for j in range(i) if rng.random() < 0.3),
            rng.choice([(), (), ("pot",), ("pot", "serving")]),
            rng.choice([1, 1, 2, 3]),
            rng.choice(able),
        )
        for i in range(count)
    ]
    groups, most = {}, None
    if count > 1 and rng.random() < 0.5:
        names = rng.sample([s.name for s in subtasks], count)
        cut = rng.randrange(1, count)
        groups, most = {"one": names[:cut], "two": names[cut:]}, rng.choice([None, 1, 2])
    try:
        return TaskGraph(subtasks, "home", groups, most)
    except TaskError:  # groups and precedence contradict each other, or nothing is left to the person
        return None


def test_states_of_random_tasks_are_those_of_the_definition(repeats) -> None:
    rng, tried = random.Random(0), 0
    while tried < repeats(150, 20_000):
        task = random_task(rng)
        if task is None:
            continue
        tried += 1
        number, weights, steps = weights_by_definition(task)
        assert task.num_sequences == number
        found = {(t.start, t.goals, t.goal, t.then): t.weight for t in task.transitions()}
        assert found == pytest.approx(weights, rel=1e-12)
        assert task.states._least_steps() <= max(steps, sum(len(c.goals) * c.count for c in task.states.classes))
        goals = [t.goal for t in task.sample(np.random.default_rng(tried))]
        assert len(goals) == task.num_choices


def test_the_largest_tasks_are_counted_and_the_next_refused() -> None:
    free = [Subtask(f"s{i}", (f"g{i}",), then=("there",)) for i in range(17)]
    assert TaskGraph(free[:13], "home").num_sequences == 6_227_020_800
    with pytest.raises(TaskError, match=f"at least [0-9,]+ steps .* at most {MAX_STEPS:,} steps .*`count`.*`after`"):
        TaskGraph(free, "home")
    chain = [Subtask(f"s{i}", (f"g{i}",), after=(f"s{i - 1}",) if i else ()) for i in range(129)]
    assert TaskGraph(chain[:128], "home").num_states == 129
    with pytest.raises(TaskError, match="at most 128 subtasks, got 129"):
        TaskGraph(chain, "home")
