"""Observing the intent of a person at the table through any predictor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from legible_envs.partner.intent import Predictor, ReachObserver, predictor_registry, read_predictor
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop.partner.belief import BayesianIntent
from legible_envs.tabletop.partner.interface import Senses

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["IntentObserver", "Predictor", "make_intent_predictor"]

_PARTICIPANTS: Final = 3

_registry = predictor_registry("legible_envs.tabletop.partner.belief:BayesianIntent")


def make_intent_predictor(spec: object = None) -> Predictor:
    """A predictor from what a user names.

    Args:
        spec: None or ``"bayesian"``: the built-in Bayesian goal inference along shortest paths among the obstacles,
            :class:`~legible_envs.tabletop.partner.belief.BayesianIntent` (the predictor that
            ``predictors.list_predictors()`` calls ``bayesian`` knows kitchens only). Another text: a name in the entry
            point group ``legible.predictors``, such as ``"reach-gaussian"``, or ``"module:Class"``; the class is made
            without arguments. Else the predictor itself: an object whose ``stream(context).update(point, time)``
            returns ``{goal: probability}``, or one with ``predict_proba([prefix])`` and ``classes_``.

    Raises:
        ValueError: It cannot be imported or made.
        TypeError: It is no predictor.
    """
    return read_predictor(spec, _registry, BayesianIntent)


class IntentObserver(ReachObserver):
    """Follows the reaches of a person at the table; see :class:`~legible_envs.partner.intent.ReachObserver`.

    Args:
        predictor: A predictor in any form that :func:`make_intent_predictor` takes.
    """

    place = "at this table"

    def __init__(self, predictor: object = None) -> None:
        super().__init__(make_intent_predictor(predictor), predictor if isinstance(predictor, str) else None)

    def reset(self, layout: TabletopLayout, task: TabletopTask) -> None:
        """Begin an episode on a table.

        Raises:
            ValueError: A predictor that was given by name must be fitted, and cannot be fitted on simulated
                participants at this table. (An instance that cannot be fitted is reported by a ``RuntimeWarning``.)
        """
        self._layout, self._task = layout, task
        self._begin((layout, task))

    def _context(self, senses: Senses) -> Trajectory:
        starts = self._layout.table.starts
        nearest = min(starts, key=lambda name: math.dist(starts[name], senses.start))
        rows = [self._layout.index(goal) for goal in senses.goals]
        return Trajectory(
            np.zeros((0, 2)),
            start=nearest,
            candidates=senses.goals,
            layout=self._layout,
            candidate_set="game",
            complete=False,
            goal_positions=tuple(map(tuple, senses.positions[rows].tolist())),
        )

    def _simulate(self) -> list[Trajectory]:
        """Reaches of a few simulated participants who build the task."""
        from legible_envs.tabletop.humans.simulation import sample_person, simulate_task

        rng = np.random.default_rng(0)
        # Drawn one by one between their reaches, as ever: the same participants, and the same fit.
        return [
            reach
            for _ in range(_PARTICIPANTS)
            for reach in simulate_task(self._layout, sample_person(rng), rng, task=self._task)
        ]
