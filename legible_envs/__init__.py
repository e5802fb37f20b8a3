"""Workspaces in which people's motion can be read: Gymnasium environments and exact legibility scores.

Importing the package registers its environments: ``gymnasium.make("LegibleOvercooked-v0")``.
"""

from gymnasium.envs.registration import register, registry

from legible_envs.errors import LayoutError, TaskError

__all__ = ["LayoutError", "TaskError", "__version__", "register_environments"]
__version__ = "0.1.0"


def register_environments() -> None:
    """Register every environment of this package; doing so again changes nothing.

    Entry points are strings, so that specs stay JSON and nothing heavy is imported.
    """
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
            vector_entry_point="legible_envs.tabletop.vector_env:TabletopVectorEnv",
            max_episode_steps=1800,
        )
    if "LegibleDesign-v0" not in registry:
        register(id="LegibleDesign-v0", entry_point="legible_envs.design_game.env:DesignEnv")


register_environments()
