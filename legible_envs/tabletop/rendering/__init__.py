"""Pictures of tables: drawn off screen, the same pixels every time.

Nothing here opens a window or needs a display; pygame is imported when the first picture is drawn.

Example:
    >>> from legible_envs.tabletop import TabletopTask
    >>> task = TabletopTask.named("columns")
    >>> draw_table(task.layout, task=task, width=320).shape
    (217, 320, 3)
"""

from legible_envs.drawing.sheets import save_png
from legible_envs.tabletop.rendering.panels import draw_configuration, draw_panels
from legible_envs.tabletop.rendering.scene import draw_scene, scene_shape
from legible_envs.tabletop.rendering.table import draw_table

__all__ = ["draw_configuration", "draw_panels", "draw_scene", "draw_table", "save_png", "scene_shape"]
