"""Settings that were found to work, by what is played; figures of runs with them are on the page "Train an agent"."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.experiments.learning.settings import Environment, NetworkShape, PPOSettings, TrainingSettings

__all__ = ["DOMAINS", "recipe"]

DOMAINS: Final = {"overcooked": "LegibleOvercooked-v0", "tabletop": "LegibleTabletop-v0"}
"""What can be trained, and the environment's id."""

_GRID: Final = NetworkShape(channels=[32, 16], hidden=[128])
_KITCHEN: Final = PPOSettings(
    num_envs=32, rollout=128, batch=512, entropy=0.02, final_entropy=0.003, guide=0.2, guide_until=1.0
)
_TABLE: Final = PPOSettings(
    rollout=512,
    batch=512,
    learning_rate=5e-4,
    gamma=0.995,
    entropy=0.0,
    final_entropy=0.0,
    normalise_observations=True,
    normalise_rewards=True,
)


def recipe(domain: str, arguments: Mapping[str, Any]) -> TrainingSettings:
    """Settings to begin with.

    Args:
        domain: ``"overcooked"`` or ``"tabletop"``.
        arguments: Of the environment, plain data; they win over the recipe's own.

    Raises:
        ValueError: Another domain, or arguments that are no plain data.
    """
    if domain == "overcooked":
        # Short episodes begin anew before a cook who is stuck fills the rollouts; the scripted cook needs 182 steps.
        kitchen = {"obs_type": "vector", "shaping": True, "max_episode_steps": 600, **arguments}
        network = _GRID if kitchen["obs_type"] == "grid" else NetworkShape()
        return TrainingSettings(
            environment=Environment(id=DOMAINS[domain], arguments=kitchen),
            network=network,
            ppo=_KITCHEN,
            steps=1_000_000,
            checkpoint_every=40_000,
        )
    if domain == "tabletop":
        table = {"max_speed": 0.5, "shaping": {"discount": _TABLE.gamma}, **arguments}
        return TrainingSettings(
            environment=Environment(id=DOMAINS[domain], arguments=table), ppo=_TABLE, steps=1_000_000
        )
    raise ValueError(f"`domain` must be one of {sorted(DOMAINS)}, got {domain!r}")
