"""Several cooks as the agents of a PettingZoo environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.settings import read_action
from legible_envs.support.parallel import TeamParallelEnv

__all__ = ["OvercookedParallelEnv"]


class OvercookedParallelEnv(TeamParallelEnv):
    """One to four cooks in one kitchen, each an agent; made by :func:`~legible_envs.overcooked.learners.parallel_env`.

    The game is that of :class:`.OvercookedEnv` with as many players, which documents actions, observations and infos:
    agent ``player_i`` sees the kitchen as player ``i``, has its own ``goal_mask`` and ``action_mask`` in ``infos``, and
    gets the reward of the team. All agents end together.

    Args:
        num_players: 1 to 4 cooks.
        max_episode_steps: Steps after which an episode is truncated; None or -1: never.
        render_mode: None, ``"human"``, ``"rgb_array"`` or ``"ansi"``.
        **kwargs: As for :class:`.OvercookedEnv`.

    Raises:
        LayoutError: See :class:`.OvercookedEnv`.
        ValueError: Likewise.
    """

    metadata = {**OvercookedEnv.metadata, "name": "legible_overcooked_v0", "is_parallelizable": True}  # noqa: RUF012

    def __init__(
        self,
        num_players: int = 2,
        *,
        max_episode_steps: int | None = 1200,
        render_mode: str | None = None,
        **kwargs: Any,
    ) -> None:
        self.kitchen = OvercookedEnv(num_players=num_players, render_mode=render_mode, **kwargs)
        players = self.kitchen.num_players
        super().__init__(self.kitchen, [f"player_{i}" for i in range(players)], max_episode_steps, render_mode)
        for agent in self.possible_agents:
            self._observation_spaces[agent] = self.kitchen.settings.player_observation_space()
            self._action_spaces[agent] = self.kitchen.settings.player_action_space()
        self.state_space = self.kitchen.observation_space

    def state(self) -> npt.NDArray[Any]:
        """What all players see, for a critic that sees everything: the joint environment's observation."""
        return self.kitchen.observe()

    def action_masks(self, agent: str) -> npt.NDArray[np.bool_]:
        """``(6,)`` actions of an agent that do something now, staying always.

        Raises:
            ResetNeeded: Before the first reset.
        """
        return np.atleast_2d(self.kitchen.action_masks())[self.possible_agents.index(agent)]

    def _begin(
        self, seed: int | None, options: dict[str, Any] | None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        return self._deal(*self.kitchen.reset(seed=seed, options=options))

    def _advance(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], float, bool, dict[str, dict[str, Any]]]:
        moves = [read_action(actions[agent]) for agent in self.possible_agents]
        observation, reward, is_over, _, info = self.kitchen.play(moves)
        observations, infos = self._deal(observation, info)
        return observations, reward, is_over, infos

    def _deal(
        self, observation: npt.NDArray[Any], info: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Each agent's part of what the joint environment returns."""
        agents = self.possible_agents
        if len(agents) == 1:
            return {agents[0]: observation}, {agents[0]: info}
        goals, masks = info["goal_mask"], info["action_mask"]
        infos = {agent: {**info, "goal_mask": goals[i], "action_mask": masks[i]} for i, agent in enumerate(agents)}
        return dict(zip(agents, observation, strict=True)), infos
