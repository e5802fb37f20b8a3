"""The score of kitchens: one task, one observer and one model of human motion, for any layout."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.errors import TaskError
from legible_envs.observer import ObserverModel
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.recipes import soup_task
from legible_envs.overcooked.scoring import explanation
from legible_envs.overcooked.scoring.boltzmann import HumanModel, HumanName
from legible_envs.support.validation import shown
from legible_envs.tasks import TaskGraph

__all__ = ["OvercookedScorer"]


class OvercookedScorer:
    """How legible people's motion is in kitchens (Tung et al., HRI 2024, Eq. 1 to 3).

    Any kitchen can be scored, by the readable definition: stations may repeat, stand inside and have several access
    cells. :class:`~legible_envs.overcooked.design.workspace.OvercookedWorkspace` scores batches of genomes, by compiled
    code that agrees with this to 1e-9.

    A score is of a person: player 1, or the one asked for. Stations out of their reach are no goals
    (:mod:`legible_envs.overcooked.reach`).

    Args:
        task: The task, over station types; the paper's three soups if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
        human: How people move: a model, or ``"shortest"`` or ``"boltzmann"`` with its default settings.
        cell_costs: ``(H, W)`` cost of stepping on each cell, for people and observer alike; None for 1.

    Attributes:
        task: The task.
        observer: The observer.
        human: The model of human motion.
        cell_costs: The costs, or None.

    Raises:
        TaskError: ``task`` is no task.
        ValueError: ``human`` is unknown, or ``observer`` is no observer.

    Example:
        >>> kitchen = OvercookedLayout([[1, 1, 8, 1, 1], [4, 0, 0, 0, 1], [1, 0, 0, 0, 9], [1, 1, 7, 1, 1]])
        >>> scorer = OvercookedScorer(soup_task([("onion", "onion", "onion")]), observer=ObserverModel(beta=2))
        >>> scores = scorer.score_layout(kitchen)
        >>> scores["num_sequences"], round(scores["normalised"], 3)
        (6, 1.0)
    """

    def __init__(
        self,
        task: TaskGraph | None = None,
        *,
        observer: ObserverModel = ObserverModel(),
        human: HumanModel | HumanName = "shortest",
        cell_costs: npt.NDArray[np.float64] | None = None,
    ) -> None:
        self.task = soup_task() if task is None else task
        self.observer = observer
        if not isinstance(self.task, TaskGraph):
            raise TaskError(f"`task` must be None or a TaskGraph, got {shown(task)}")
        if not isinstance(observer, ObserverModel):
            raise ValueError(f"`observer` must be an ObserverModel, got {shown(observer)}")
        self.human = human if isinstance(human, HumanModel) else HumanModel(human)
        self.cell_costs = cell_costs

    def score_layout(self, layout: OvercookedLayout, *, player: int = 1) -> dict[str, Any]:
        """Score, distance and what belongs beside them.

        See :func:`~legible_envs.overcooked.scoring.explanation.score_layout` for what is returned.

        Args:
            layout: The kitchen.
            player: Number of the player whose score it is, from 1; what is out of their reach is no goal.

        Raises:
            LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
        """
        return explanation.score_layout(layout, self.task, player=player, **self._settings())

    def explain_layout(self, layout: OvercookedLayout, *, player: int = 1) -> list[dict[str, Any]]:
        """A row for every stage and goal, the greatest loss first.

        See :func:`~legible_envs.overcooked.scoring.explanation.explain_layout` for what is returned.

        Args:
            layout: The kitchen.
            player: Whose goals, by the player's number from 1.

        Raises:
            LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
        """
        return explanation.explain_layout(layout, self.task, player=player, **self._settings())

    def ambiguity(self, layout: OvercookedLayout, *, player: int = 1) -> npt.NDArray[np.float64]:
        """``(H, W)`` how often an observer would predict a wrong goal at each cell.

        See :func:`~legible_envs.overcooked.scoring.explanation.ambiguity` for what is returned.

        Args:
            layout: The kitchen.
            player: Whose goals, by the player's number from 1.

        Raises:
            LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
        """
        return explanation.ambiguity(layout, self.task, player=player, **self._settings())

    def _settings(self) -> dict[str, Any]:
        return {"observer": self.observer, "human": self.human, "cell_costs": self.cell_costs}
