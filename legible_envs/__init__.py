"""Workspaces in which people's motion can be read: Gymnasium environments and exact legibility scores."""

from legible_envs.errors import LayoutError, TaskError

__all__ = ["LayoutError", "TaskError", "__version__"]
__version__ = "0.1.0"
