"""A person and a robot at a table as the agents of a PettingZoo environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from legible_envs.support.parallel import TeamParallelEnv
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.partner.agent import SteeredRobot
from legible_envs.tabletop.partner.team import GRIPPER_REACH, GRIPPER_SPEED
from legible_envs.tabletop.settings import read_action

__all__ = ["TabletopParallelEnv"]

HUMAN: Final = "human"
ROBOT: Final = "robot"


class TabletopParallelEnv(TeamParallelEnv):
    """A person and a robot who build together, each an agent.

    Made by :func:`~legible_envs.tabletop.learners.parallel_env`.

    The game is that of :class:`.TabletopEnv`, which documents rewards and infos. Both agents get the team's reward, and
    all measures of the team in their infos. So a learned robot stands beside ``partner="robot"``, which waits until it
    is sure of the person's goal: put a policy of the person in the place of agent ``human``, and train ``robot``.

    **Agent** ``human``: actions and observations of :class:`.TabletopEnv` with a partner.

    **Agent** ``robot``: ``Box(-1, 1, (3,))``, the gripper's velocity along ``x`` and ``y`` in units of 1 m/s (a longer
    vector than 1 is shortened) and its jaws. Above 0 they close on the nearest object that the robot may take within
    3 cm; at 0 and below they open, and what they held stays at its place if that is within 3 cm, else where it is
    dropped. It observes what the person does, with two differences: of each object, "valid" says whether the *robot*
    may take it, and the person's goal is hidden; and three numbers follow: where the object in the gripper belongs,
    ``x``, ``y`` and 1 (zeros while the gripper is empty). ``info["goal_mask"]`` is that of the robot's objects.

    Args:
        max_episode_steps: Steps after which an episode is truncated; None or -1: never.
        render_mode: None, ``"human"`` or ``"rgb_array"``.
        **kwargs: As for :class:`.TabletopEnv` without ``partner``, ``predictor`` and ``threshold``.

    Raises:
        LayoutError: See :class:`.TabletopEnv`.
        ValueError: Likewise.
    """

    metadata = {**TabletopEnv.metadata, "name": "legible_tabletop_v0", "is_parallelizable": True}  # noqa: RUF012
    known_options = ("layout", "start", "goal")

    def __init__(self, *, max_episode_steps: int | None = 1800, render_mode: str | None = None, **kwargs: Any) -> None:
        if taken := sorted({"partner", "predictor", "threshold"} & set(kwargs)):
            raise ValueError(f"the robot is an agent here, which needs no {' and no '.join(taken)}")
        partner = SteeredRobot(GRIPPER_SPEED, GRIPPER_REACH)
        self.table = TabletopEnv(partner=partner, render_mode=render_mode, **kwargs)
        super().__init__(self.table, [HUMAN, ROBOT], max_episode_steps, render_mode)
        names = self.table.observation_names
        self._valid = np.array([name.endswith(": valid") for name in names])
        self._goal = np.array([name.endswith(": goal") for name in names])
        own = self.table.observation_space
        assert isinstance(own, spaces.Box)
        size = self.table.task.layout.table.size
        self._observation_spaces = {
            HUMAN: own,
            ROBOT: spaces.Box(
                np.concatenate([own.low, np.zeros(3, dtype=np.float32)]),
                np.concatenate([own.high, np.array([*size, 1.0], dtype=np.float32)]),
                dtype=np.float32,
            ),
        }
        self._action_spaces = {HUMAN: self.table.action_space, ROBOT: spaces.Box(-1.0, 1.0, (3,), np.float32)}
        self.state_space = own

    @property
    def observation_names(self) -> dict[str, tuple[str, ...]]:
        """The name of each number that an agent observes."""
        names = self.table.observation_names
        return {HUMAN: names, ROBOT: (*names, "gripper carries to x", "gripper carries to y", "gripper carries")}

    def state(self) -> npt.NDArray[np.float32]:
        """What the person observes, their goal included."""
        return self.table.observe()

    def _begin(
        self, seed: int | None, options: dict[str, Any] | None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        return self._deal(*self.table.reset(seed=seed, options=options))

    def _advance(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], float, bool, dict[str, dict[str, Any]]]:
        read_action(actions[HUMAN])  # before anything changes
        team = self.table.team
        robot: Any = team.partner
        team.instruct(robot.command(actions[ROBOT]))
        observation, reward, is_over, _, info = self.table.step(actions[HUMAN])
        observations, infos = self._deal(observation, info)
        return observations, reward, is_over, infos

    def _deal(
        self, observation: npt.NDArray[np.float32], info: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Each agent's part of what the single environment returns."""
        game = self.table.game
        valid = np.isin(game.names, game.robot_goals)
        seen = observation.copy()
        seen[self._valid] = valid
        seen[self._goal] = 0.0
        place = np.zeros(3, dtype=np.float32)
        if game.robot_holding >= 0:
            place[:] = (*self.table.task.configuration[game.names[game.robot_holding]], 1.0)
        infos = {HUMAN: info, ROBOT: {**info, "goal_mask": valid}}
        return {HUMAN: observation, ROBOT: np.concatenate([seen, place])}, infos
