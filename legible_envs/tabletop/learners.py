"""Tables for libraries of reinforcement learning that have an interface of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from legible_envs.tabletop.parallel import TabletopParallelEnv

__all__ = ["parallel_env"]


def parallel_env(**kwargs: Any) -> TabletopParallelEnv:
    """A table with a person and a robot as the agents of a PettingZoo ``ParallelEnv``.

    Args:
        **kwargs: As for :class:`.TabletopParallelEnv`: ``max_episode_steps``, ``render_mode``, and the arguments of
            ``gymnasium.make("LegibleTabletop-v0")`` without those of a robot that decides for itself.

    Raises:
        ImportError: PettingZoo is not installed (``pip install "legible-envs[multiagent]"``).
        LayoutError: See :class:`.TabletopEnv`.
        ValueError: Likewise.

    Example:
        >>> from legible_envs.tabletop import parallel_env
        >>> env = parallel_env(shaping=True)
        >>> observations, infos = env.reset(seed=0)
        >>> while env.agents:
        ...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        ...     observations, rewards, terminations, truncations, infos = env.step(actions)
    """
    from legible_envs.tabletop.parallel import TabletopParallelEnv

    return TabletopParallelEnv(**kwargs)
