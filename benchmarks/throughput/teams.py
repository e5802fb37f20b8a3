"""Speed of kitchens with several cooks, in steps of agents: ``P`` of them in every tick of ``P`` cooks.

The loops that play are those of one cook, too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.throughput.measure import Figure, alternate, rate

if TYPE_CHECKING:
    from benchmarks.throughput.sweep import Settings

__all__ = ["steps_of", "team_games", "ticks_of"]

_COOKS = 2


def team_games(settings: Settings) -> list[Figure]:
    """Self-play in a batch, and agents of PettingZoo beside a single environment of one cook."""
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers)

    rng = np.random.default_rng(0)
    alone = gym.make("LegibleOvercooked-v0").unwrapped
    samplers: dict[str, Callable[[], float]] = {"alone": partial(rate, steps_of(alone, rng), settings.seconds)}
    for obs_type in ("grid", "vector"):
        envs = gym.make_vec("LegibleOvercooked-v0", num_envs=settings.num_envs, num_players=_COOKS, obs_type=obs_type)
        samplers[f"cooks {obs_type}"] = partial(rate, ticks_of(envs, rng), settings.seconds)
    agents = _agents(rng)
    if agents is not None:
        samplers["agents"] = partial(rate, agents, settings.seconds)
    samples = alternate(samplers, settings.rounds)
    figures = [
        Figure(
            f"cooks {obs_type}",
            f"agent-steps of {settings.num_envs} games of {_COOKS} cooks, {obs_type} observations",
            "/s",
            samples[f"cooks {obs_type}"],
        )
        for obs_type in ("grid", "vector")
    ]
    if agents is not None:
        one = Figure("alone", "steps of one game, not wrapped", "/s", samples["alone"])
        both = Figure("agents", f"agent-steps of parallel_env with {_COOKS} cooks", "/s", samples["agents"])
        figures += [both, one.over(both, "agents cost", "cost of an agent-step in parallel_env over a step alone")]
    return figures


def ticks_of(envs: Any, rng: np.random.Generator) -> Callable[[], int]:
    """A hundred random joint actions in a vector of games; how many actions of players those are."""
    actions = rng.integers(6, size=(100, *envs.action_space.shape))
    envs.reset(seed=0)

    def play() -> int:
        for joint in actions:
            envs.step(joint)
        return int(actions.size)

    return play


def steps_of(env: Any, rng: np.random.Generator) -> Callable[[], int]:
    """A thousand random actions in one game of one cook, episodes restarted as they end."""
    actions = rng.integers(6, size=1_000).tolist()
    env.reset(seed=0)

    def play() -> int:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return len(actions)

    return play


def _agents(rng: np.random.Generator) -> Callable[[], int] | None:
    """Turns of all agents; None where PettingZoo is not installed."""
    try:
        import pettingzoo  # noqa: F401
    except ModuleNotFoundError:
        return None
    from legible_envs.overcooked import parallel_env

    env = parallel_env(_COOKS, max_episode_steps=None)
    actions = [
        dict(zip(env.possible_agents, joint, strict=True)) for joint in rng.integers(6, size=(500, _COOKS)).tolist()
    ]
    env.reset(seed=0)

    def play() -> int:
        for joint in actions:
            env.step(joint)
            if not env.agents:
                env.reset()
        return len(actions) * _COOKS

    return play
