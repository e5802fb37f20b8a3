"""Observing the intent of a person in the kitchen through any predictor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from legible_envs.overcooked.partner.belief import BayesianIntent
from legible_envs.overcooked.partner.interface import Senses
from legible_envs.overcooked.recipes import soup_task
from legible_envs.partner.intent import Predictor, ReachObserver, predictor_registry, read_predictor
from legible_envs.rollouts.trajectory import Trajectory

if TYPE_CHECKING:
    from legible_envs.overcooked.game.rules import GameRules
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["IntentObserver", "make_intent_predictor"]

_PARTICIPANTS: Final = 8

_registry = predictor_registry("legible_envs.overcooked.partner.belief:BayesianIntent")


def make_intent_predictor(spec: object = None) -> Predictor:
    """A predictor from what a user names.

    Args:
        spec: None or ``"bayesian"``: the built-in Bayesian goal inference along shortest paths,
            :class:`~legible_envs.overcooked.partner.belief.BayesianIntent`. Another text: a name in the entry point
            group ``legible.predictors``, such as ``"maxent-irl"``, or ``"module:Class"``; the class is made without
            arguments. Else the predictor itself: an object whose ``stream(context).update(cell, time)`` returns
            ``{goal: probability}``, or one with ``predict_proba([prefix])`` and ``classes_``.

    Raises:
        ValueError: It cannot be imported or made.
        TypeError: It is no predictor.
    """
    return read_predictor(spec, _registry, BayesianIntent)


class IntentObserver(ReachObserver):
    """Follows the reaches of a person in the kitchen; see :class:`~legible_envs.partner.intent.ReachObserver`.

    A predictor that must be fitted and is not is fitted on simulated participants who cook the ordered soups in this
    very kitchen. Where that cannot be (a divided kitchen, in which no one can cook alone), one that was given by name
    is a ``ValueError`` at ``reset``.

    Args:
        predictor: A predictor in any form that :func:`make_intent_predictor` takes.
    """

    place = "in this kitchen"

    def __init__(self, predictor: object = None) -> None:
        super().__init__(make_intent_predictor(predictor), predictor if isinstance(predictor, str) else None)

    def reset(self, layout: OvercookedLayout, rules: GameRules) -> None:
        """Begin an episode in a kitchen.

        Raises:
            ValueError: A predictor that was given by name must be fitted, and cannot be fitted on simulated
                participants in this kitchen. (An instance that cannot be fitted is reported by a ``RuntimeWarning``.)
        """
        self._layout, self._recipes = layout, rules.recipes
        self._begin((layout, rules.recipes))

    def _context(self, senses: Senses) -> Trajectory:
        return Trajectory(
            np.zeros((0, 2)),
            start=senses.start or "",
            candidates=senses.goals,
            layout=self._layout,
            candidate_set="game",
            complete=False,
        )

    def _simulate(self) -> list[Trajectory]:
        """Trajectories of a few simulated participants who cook the soups."""
        from legible_envs.overcooked.humans.simulation import simulate_participants

        task = soup_task(self._recipes)
        return simulate_participants(self._layout, _PARTICIPANTS, np.random.default_rng(0), task=task)
