"""Workspaces in which people's motion can be read: Gymnasium environments and exact legibility scores.

Importing the package registers its environments: ``gymnasium.make("LegibleOvercooked-v0")``.
"""

from legible_envs.errors import LayoutError, TaskError
from legible_envs.registration import register_environments

__all__ = ["LayoutError", "TaskError", "__version__"]
__version__ = "0.1.0"

register_environments()
