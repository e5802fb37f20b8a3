"""What the PettingZoo environments of kitchen and table share: agents' dictionaries, episodes, time limits."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

try:
    from pettingzoo import ParallelEnv
except ModuleNotFoundError as error:
    raise ImportError(
        'parallel environments need PettingZoo, which is not installed: pip install "legible-envs[multiagent]"'
    ) from error

from gymnasium.error import ResetNeeded

from legible_envs.support.per_env import read_step_limit
from legible_envs.support.validation import shown

__all__ = ["TeamParallelEnv"]


class TeamParallelEnv(ParallelEnv[str, Any, Any]):
    """Several agents in one episode that all of them begin and end together, paid as a team.

    Subclasses say by :meth:`_begin` and :meth:`_advance` what happens in the environment that they wrap.

    Args:
        env: The single environment underneath, never truncated by itself.
        agents: Names of the agents.
        max_episode_steps: Steps after which an episode is truncated; None or -1: never.
        render_mode: Of the environment.

    Attributes:
        env: The single environment underneath.
        possible_agents: All agents.
        agents: Those of the running episode: all, and none between episodes.
    """

    metadata: dict[str, Any]
    known_options: tuple[str, ...] = ("layout",)
    """Keys of the options of ``reset``."""

    def __init__(
        self, env: gym.Env[Any, Any], agents: list[str], max_episode_steps: int | None, render_mode: str | None
    ) -> None:
        self.env = env
        self.possible_agents = list(agents)
        self.agents: list[str] = []
        self.render_mode = render_mode
        self.max_episode_steps = read_step_limit(max_episode_steps)
        self._steps = 0
        self._begun = False
        self._observation_spaces: dict[str, gym.Space[Any]] = {}
        self._action_spaces: dict[str, gym.Space[Any]] = {}

    def observation_space(self, agent: str) -> gym.Space[Any]:
        """The space of an agent's observations; always the same object."""
        return self._observation_spaces[agent]

    def action_space(self, agent: str) -> gym.Space[Any]:
        """The space of an agent's actions; always the same object."""
        return self._action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start an episode.

        Args:
            seed: Seed of the environment's generator; None goes on with the one there is.
            options: As of the single environment's ``reset``. Keys it does not know are ignored with a warning, as
                PettingZoo's tests of its interface ask for.

        Returns:
            ``(observations, infos)`` by agent.
        """
        if isinstance(options, Mapping) and (unknown := [key for key in options if key not in self.known_options]):
            said = f"unknown reset options {unknown} are ignored; known: {list(self.known_options)}"
            warnings.warn(said, UserWarning, stacklevel=2)
            options = {key: value for key, value in options.items() if key not in unknown}
        observations, infos = self._begin(seed, options)
        self.agents = list(self.possible_agents)
        self._steps, self._begun = 0, True
        return observations, infos

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Advance by one step.

        Args:
            actions: One for every agent.

        Returns:
            ``(observations, rewards, terminations, truncations, infos)`` by agent. Every agent gets the team's reward.

        Raises:
            ResetNeeded: Before the first reset.
            ValueError: Actions of other agents than all there are, or of another kind.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call env.step() before calling env.reset()")
        if not self.agents:  # PettingZoo's wrappers step once more after the end
            return {}, {}, {}, {}, {}
        if not isinstance(actions, Mapping) or set(actions) != set(self.agents):
            raise ValueError(f"expected an action for each of {self.agents}, got {shown(actions)}")
        observations, reward, is_over, infos = self._advance(actions)
        self._steps += 1
        is_late = self.max_episode_steps is not None and self._steps >= self.max_episode_steps
        agents = self.agents
        if is_over or is_late:
            self.agents = []
        return (
            observations,
            dict.fromkeys(agents, reward),
            dict.fromkeys(agents, is_over),
            dict.fromkeys(agents, is_late),
            infos,
        )

    def render(self) -> Any:
        """See the single environment's ``render``."""
        return self.env.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self.env.close()

    @property
    def np_random(self) -> np.random.Generator:
        """The generator that layouts are drawn with."""
        return self.env.unwrapped.np_random

    def _begin(
        self, seed: int | None, options: dict[str, Any] | None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        raise NotImplementedError

    def _advance(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], float, bool, dict[str, dict[str, Any]]]:
        raise NotImplementedError
