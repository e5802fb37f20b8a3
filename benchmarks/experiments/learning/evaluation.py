"""How well somebody plays: a trained policy, or the scripted cook that it is set beside."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv

from benchmarks.experiments.learning.environments import PlayerSpace, make_envs
from benchmarks.experiments.learning.policy import TrainedPolicy
from benchmarks.experiments.learning.settings import Environment

__all__ = ["Player", "evaluate_policy", "evaluate_scripted", "play_episodes", "summary"]

Player = Callable[[Any, dict[str, Any]], Any]

_AT_A_TIME = 16
"""Games."""


def play_episodes(envs: VectorEnv[Any, Any, Any], player: Player, each: int, seed: int) -> list[dict[str, float]]:
    """Play the same number of episodes of every game: counting the first that end would favour short ones.

    Args:
        envs: Games, as :func:`.make_envs` makes them.
        player: Called with observations and infos of all.
        each: Episodes of each game.
        seed: Of the first reset.

    Returns:
        A row for each episode: ``score`` (sum of rewards), ``length`` (steps), ``finished`` (1: it terminated), and
        ``done`` (subtasks done at its end, NaN where the environment does not say).
    """
    obs, infos = envs.reset(seed=seed)
    count = envs.num_envs
    scores, lengths, left = np.zeros(count), np.zeros(count, dtype=int), np.full(count, each)
    rows = []
    while left.any():
        obs, rewards, terminated, truncated, infos = envs.step(player(obs, infos))
        scores += rewards
        lengths += 1
        for i in np.flatnonzero(terminated | truncated):
            if left[i]:
                left[i] -= 1
                last = infos.get("final_info", {}).get("num_done")
                rows.append(
                    {
                        "score": float(scores[i]),
                        "length": float(lengths[i]),
                        "finished": float(terminated[i]),
                        "done": float("nan") if last is None else float(last[i]),
                    }
                )
            scores[i], lengths[i] = 0.0, 0
    return rows


def evaluate_policy(
    policy: TrainedPolicy, environment: Environment, episodes: int, seed: int
) -> list[dict[str, float]]:
    """Episodes of a trained policy; see :func:`play_episodes`.

    Args:
        policy: It plays all players.
        environment: Which game.
        episodes: At least so many.
        seed: Of the games.

    Raises:
        CheckpointError: The policy was trained for another space.
    """
    envs = make_envs(environment, min(episodes, _AT_A_TIME))
    try:
        policy.check_space(PlayerSpace.of(envs))
        return play_episodes(envs, policy, -(-episodes // envs.num_envs), seed)
    finally:
        envs.close()


def evaluate_scripted(environment: Environment, episodes: int, seed: int) -> list[dict[str, float]]:
    """Episodes of the scripted cook, who walks to valid goals by shortest paths; see :func:`play_episodes`.

    Args:
        environment: A kitchen for one.
        episodes: At least so many.
        seed: Of the games and the cook.
    """
    from legible_envs.overcooked.policies import ScriptedPlayer

    envs = make_envs(environment, min(episodes, _AT_A_TIME))
    try:
        cook = ScriptedPlayer(envs, np.random.default_rng(seed))
        return play_episodes(envs, cook, -(-episodes // envs.num_envs), seed)
    finally:
        envs.close()


def summary(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Means over episodes, by column, and how many there are.

    Example:
        >>> summary([{"score": 1.0, "finished": 1.0}, {"score": 2.0, "finished": 0.0}])
        {'episodes': 2, 'score': 1.5, 'finished': 0.5}
    """
    means = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    return {"episodes": len(rows), **means}
