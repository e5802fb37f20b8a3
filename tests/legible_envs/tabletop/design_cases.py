"""Workspaces, genomes and errors that the tests of the design of tables share."""

import numpy as np
import pytest

from legible_envs import LayoutError
from legible_envs.tabletop import TabletopLayout, TabletopTask
from legible_envs.tasks import TaskGraph

CONDITIONS = ("both", "placement", "obstacles")


def few_bins(keep=3):
    """`bins` with few pieces: reaches for bins start at pieces, reaches for pieces at bins."""
    whole = TabletopTask.named("bins")
    groups = {f"piece-{i}": (f"take-{i}", f"put-{i}") for i in range(keep)}
    graph = TaskGraph(whole.graph.subtasks[: 2 * keep], "home", groups, max_open=1)
    return TabletopTask("few", TabletopLayout(whole.layout.objects[: 2 + keep], table=whole.layout.table), graph)


TASKS_QUICK = ("columns", "tea", few_bins())


def name_of(value):
    return value if isinstance(value, str) else value.name


def rng(seed=0):
    return np.random.default_rng(seed)


def designed(ws, n, seed=0, rounds=12):
    """Valid genomes with obstacles, by a random walk through all phases."""
    genomes, generator = ws.sample(n, rng(seed)), rng(seed + 1)
    for _ in range(rounds):
        for phase in range(ws.phases):
            genomes = ws.perturb(genomes, 1, generator, phase=phase)
    return genomes


def rule_of(build):
    with pytest.raises(LayoutError) as caught:
        build()
    return caught.value.rule
