"""Kitchens for libraries of reinforcement learning that have an interface of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from legible_envs.overcooked.vector_env import OvercookedVectorEnv
from legible_envs.support.validation import shown

if TYPE_CHECKING:
    from legible_envs.overcooked.parallel import OvercookedParallelEnv
    from legible_envs.overcooked.stable_baselines3 import StableBaselinesVecEnv

__all__ = ["as_sb3", "parallel_env"]


def as_sb3(envs: Any) -> StableBaselinesVecEnv:
    """The batched kitchen as a ``VecEnv`` of Stable-Baselines3, many times faster than its own of single kitchens.

    It behaves as Stable-Baselines3's ``DummyVecEnv``, whatever the autoreset mode of the batch: a game that ends starts
    again in the same step, its last observation is ``infos[i]["terminal_observation"]``, and ``"TimeLimit.truncated"``
    tells an episode that was cut off. ``seed`` and ``set_options`` count for the next reset,
    ``env_method("action_masks")`` serves ``MaskablePPO``, ``get_attr`` and ``env_method`` reach each game as if it were
    an :class:`.OvercookedEnv`, and ``set_attr("layout", kitchen, indices)`` changes kitchens. For episode returns in a
    learner's log wrap it in ``VecMonitor``.

    Args:
        envs: Made by ``gymnasium.make_vec("LegibleOvercooked-v0", num_envs=…)``, not wrapped.

    Raises:
        ImportError: Stable-Baselines3 is not installed (``pip install "legible-envs[rl]"``).
        ValueError: Not the batched kitchen.

    Example:
        >>> import gymnasium as gym, legible_envs
        >>> envs = gym.make_vec("LegibleOvercooked-v0", num_envs=16)
        >>> model = PPO("MlpPolicy", as_sb3(envs)).learn(100_000)  # doctest: +SKIP
    """
    if not isinstance(envs, OvercookedVectorEnv):
        raise ValueError(
            f"`envs` must be the batched kitchen, made by gymnasium.make_vec('LegibleOvercooked-v0', num_envs=...) and "
            f"not wrapped, got {shown(envs)}; for single environments and tables use make_vec_env of Stable-Baselines3"
        )
    try:
        from legible_envs.overcooked.stable_baselines3 import StableBaselinesVecEnv
    except ModuleNotFoundError as error:
        raise ImportError(
            'as_sb3 needs Stable-Baselines3, which is not installed: pip install "legible-envs[rl]"'
        ) from error
    return StableBaselinesVecEnv(envs)


def parallel_env(num_players: int = 2, **kwargs: Any) -> OvercookedParallelEnv:
    """A kitchen of several cooks as a PettingZoo ``ParallelEnv``, for learners of many agents.

    Args:
        num_players: 1 to 4 cooks, the agents ``player_0``, ``player_1``, ….
        **kwargs: As for :class:`.OvercookedParallelEnv`: ``max_episode_steps``, ``render_mode``, and the arguments of
            ``gymnasium.make("LegibleOvercooked-v0")``.

    Raises:
        ImportError: PettingZoo is not installed (``pip install "legible-envs[multiagent]"``).
        LayoutError: See :class:`.OvercookedEnv`.
        ValueError: Likewise.

    Example:
        >>> from legible_envs.overcooked import parallel_env
        >>> env = parallel_env(num_players=2, shaping=True)
        >>> observations, infos = env.reset(seed=0)
        >>> while env.agents:
        ...     actions = {agent: env.action_space(agent).sample(infos[agent]["action_mask"]) for agent in env.agents}
        ...     observations, rewards, terminations, truncations, infos = env.step(actions)
    """
    from legible_envs.overcooked.parallel import OvercookedParallelEnv

    return OvercookedParallelEnv(num_players, **kwargs)
