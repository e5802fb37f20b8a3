"""The field's open tabletop score, re-implemented in plain numpy to be measured beside this project's.

The definition is that of ``legibility_loss`` in ``src/envopt/legibility_metric.py`` of
https://github.com/cairo-robotics/tabletop_workspace_opt (commit 84edbbfe), which its MAP-Elites search for tables
maximises the negative of. For every stage of a task (a set of labels, all reached for from one start) and every object
of such a label, the hand goes straight there in steps of 2 cm, at most 100 points. At 25, 50 and 75 % of these points
the observer believes, with the softmax of ``walked - left + straight`` (path so far, straight line from its end to the
goal, straight line from the start to the goal), in each label of the stage, of which the object nearest to the start
stands for all others; the loss is the sum of ``share * -log P(true label)``. There are no obstacles, no stages that
shrink as a task goes on, and one start.

No line is taken over. :func:`straight_line_loss` goes through points, labels and objects one by one in numpy, as the
original does; :func:`straight_line_losses` is the same loss, for labels of one object each, of many tables in a few
operations on whole arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt

__all__ = ["stages_of", "straight_line_loss", "straight_line_losses"]

Floats = npt.NDArray[np.float64]

STEP: Final = 0.02
MOST_POINTS: Final = 100
SHARES: Final = (0.25, 0.5, 0.75)


def stages_of(task: Any) -> list[list[int]]:
    """Positions of the objects of each stage of a task: those of subtasks that wait for the same others.

    Args:
        task: A :class:`~legible_envs.tabletop.task.TabletopTask`.
    """
    stages: dict[frozenset[str], list[int]] = {}
    for subtask in task.graph.subtasks:
        stages.setdefault(frozenset(subtask.after), []).extend(task.layout.index(goal) for goal in subtask.goals)
    return list(stages.values())


def straight_line_loss(start: Floats, centres: Floats, labels: Sequence[int], stages: Sequence[Sequence[int]]) -> float:
    """The loss of one table.

    Args:
        start: ``(2,)`` where every reach begins.
        centres: ``(n, 2)`` of the objects.
        labels: ``(n,)`` of the objects.
        stages: Labels that are candidates together.
    """
    loss = 0.0
    for stage in stages:
        for number, label in enumerate(stage):
            for goal in (i for i, found in enumerate(labels) if found == label):
                path = _straight(start, centres[goal])
                for share in SHARES:
                    seen = path[: int(share * len(path))]
                    places = [goal if other == label else _nearest(start, centres, labels, other) for other in stage]
                    belief = np.array([_likelihood(start, seen, centres[place]) for place in places])
                    belief /= belief.sum()
                    loss -= share * np.log(belief[number])
    return float(loss)


def _nearest(start: Floats, centres: Floats, labels: Sequence[int], label: int) -> int:
    """The object of a label that is nearest to the start."""
    found = np.flatnonzero(np.asarray(labels) == label)
    return int(found[np.argmin([np.linalg.norm(centres[i] - start) for i in found])])


def _straight(start: Floats, goal: Floats) -> Floats:
    """``(T, 2)`` points every 2 cm, the goal last."""
    line = goal - start
    length = np.linalg.norm(line)
    steps = math.ceil(length / STEP)
    unit = line / length
    return np.array([*(start + i * STEP * unit for i in range(steps)), goal])[:MOST_POINTS]


def _likelihood(start: Floats, seen: Floats, goal: Floats) -> float:
    """Of the path seen if this is the goal, but for a factor."""
    if not len(seen):
        return 1.0
    walked = 0.0
    for before, after in pairwise(seen):
        walked += float(np.linalg.norm(after - before))
    return float(np.exp(walked - np.linalg.norm(seen[-1] - goal) + np.linalg.norm(start - goal)))


def straight_line_losses(start: Floats, centres: Floats, stages: Sequence[Sequence[int]]) -> Floats:
    """``(B,)`` the same of ``(B, n, 2)`` tables at once; the path so far is in every term and cancels."""
    losses = np.zeros(len(centres))
    shares = np.array(SHARES)
    for stage in stages:
        goals = centres[:, list(stage)]
        lines = goals - start
        lengths = np.sqrt((lines**2).sum(axis=-1))
        points = np.minimum(np.ceil(lengths / STEP) + 1, MOST_POINTS)
        last = (points[:, :, None] * shares).astype(np.int64) - 1
        seen = np.minimum(last * STEP / lengths[:, :, None], 1.0)
        at = start + seen[..., None] * lines[:, :, None]
        left = np.sqrt(((at[:, :, :, None] - goals[:, None, None]) ** 2).sum(axis=-1))
        logits = np.where(last[..., None] >= 0, lengths[:, None, None] - left, 0.0)
        own = np.einsum("bgsg->bgs", logits)
        losses += ((np.log(np.exp(logits).sum(axis=-1)) - own) * shares).sum(axis=(1, 2))
    return losses
