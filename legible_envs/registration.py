"""Registers the environments with Gymnasium: strings only, so that specs stay JSON and nothing heavy is imported."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

__all__ = ["register_environments"]


def register_environments() -> None:
    """Register every environment of this package; doing so again changes nothing."""
    if "LegibleOvercooked-v0" not in registry:
        register(
            id="LegibleOvercooked-v0",
            entry_point="legible_envs.overcooked.env:OvercookedEnv",
            vector_entry_point="legible_envs.overcooked.vector_env:OvercookedVectorEnv",
            max_episode_steps=1200,
        )
    if "LegibleTabletop-v0" not in registry:
        register(
            id="LegibleTabletop-v0",
            entry_point="legible_envs.tabletop.env:TabletopEnv",
            max_episode_steps=1800,
        )
