"""The figure of the paper: the layouts that searches found for a task, and its configuration, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from legible_envs.drawing.canvas import Canvas, Image, Sprite, paste, rgb, text_sprite
from legible_envs.drawing.sheets import draw_side_by_side, fit_text
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.rendering.frame import Frame, check_width
from legible_envs.tabletop.rendering.objects import outline, paste_object
from legible_envs.tabletop.rendering.palette import TABLE
from legible_envs.tabletop.rendering.surface import surface_of
from legible_envs.tabletop.rendering.table import draw_ambiguity_scale, draw_table
from legible_envs.tabletop.task import TabletopTask
from legible_envs.tasks import TaskGraph

if TYPE_CHECKING:
    from legible_envs.tabletop.scoring.scorer import TabletopScorer

__all__ = ["draw_configuration", "draw_panels", "stage_of"]


def draw_panels(
    panels: Mapping[str, TabletopLayout],
    task: TabletopTask,
    *,
    captions: Mapping[str, str] | None = None,
    scorer: TabletopScorer | None = None,
    width: int = 560,
    columns: int = 3,
    ambiguity: bool = True,
    grown: bool = False,
    beta: float = 20.0,
) -> Image:
    """Draw layouts of one task side by side, then the configuration to be built and a legend.

    With the baseline and the best layouts of the three conditions this is the figure of Tung et al. (HRI 2024).

    Args:
        panels: Layouts by title, such as ``{"Baseline": …, "Placement Optimized": …}``.
        task: The task of all layouts.
        captions: Lines beneath each panel, by title. None writes legibility, mean detour and length of the path.
        scorer: Scores the layouts for the captions; one with the field's defaults if None.
        width: Pixels of a panel.
        columns: Panels in a row.
        ambiguity: Whether to draw shortest reaches, coloured by how unsure an observer is of their goal.
        grown: Whether to show where an obstacle keeps the centre of the hand away.
        beta: Rationality per metre, of ``ambiguity``.

    Returns:
        ``(h, w, 3)`` uint8.

    Raises:
        ValueError: No panel, a width out of range, or captions for other panels.
        LayoutError: A panel lacks an object of the task.
    """
    check_width(width)
    if captions is not None and set(captions) != set(panels):
        raise ValueError(f"expected captions for the panels {list(panels)}, got some for {list(captions)}")
    if not panels:
        raise ValueError("expected at least one panel")
    texts = {title: captions[title] if captions else _caption(panels[title], task, scorer) for title in panels}
    text = max(13, round(width * 0.047))
    images = [
        draw_table(layout, task=task, width=width, ambiguity=ambiguity, beta=beta, grown=grown, scale=False)
        for layout in panels.values()
    ]
    titles, below = [*panels], [texts[title] for title in panels]
    if task.configuration:
        images.append(draw_configuration(task, width=width))
        titles.append("Desired configuration")
        below.append(_order_words(task))
    has_obstacles = any(layout.obstacles for layout in panels.values())
    images.append(_legend(task, width, round(0.8 * text), ambiguity, has_obstacles))
    return draw_side_by_side(
        images, [*titles, ""], [*below, ""], columns=min(columns, len(images)), gap=text, text=text
    )


def _caption(layout: TabletopLayout, task: TabletopTask, scorer: TabletopScorer | None) -> str:
    scores = (scorer or _default_scorer(task)).score_layouts([layout])
    return (
        f"legibility {scores.legibility[0]:.2f}\n".replace("-", "\u2212")
        + f"mean detour {scores.mean_detour[0]:.2f} ×, {scores.distance[0]:.2f} m in all"
    )


@cache
def _default_scorer(task: TabletopTask) -> TabletopScorer:
    from legible_envs.tabletop.scoring.scorer import TabletopScorer

    return TabletopScorer(task)


def stage_of(graph: TaskGraph) -> dict[str, int]:
    """When each goal may be reached for at the earliest: 1 where nothing comes before, 2 after those, and so on."""
    after = {subtask.name: subtask.after for subtask in graph.subtasks}
    depth: dict[str, int] = {}

    def depth_of(name: str) -> int:
        if name not in depth:
            depth[name] = 1 + max((depth_of(before) for before in after[name]), default=0)
        return depth[name]

    first: dict[str, int] = {}
    for subtask in graph.subtasks:
        for goal in subtask.goals:
            first[goal] = min(first.get(goal, depth_of(subtask.name)), depth_of(subtask.name))
    return first


def draw_configuration(task: TabletopTask, *, width: int = 560) -> Image:
    """Draw the configuration of a task: every object in its place, beside it the stage in which it is fetched.

    Returns:
        ``(h, width, 3)`` uint8, as high as a table.

    Raises:
        ValueError: The task has no configuration.
    """
    if not task.configuration:
        raise ValueError(f"task {task.name!r} has no configuration to draw")
    built = TabletopLayout(
        [replace(o, at=task.configuration.get(o.name, o.at)) for o in task.layout.objects], (), task.layout.table
    )
    frame = Frame.of(built.table, width)
    image = surface_of(built, None, frame.width).copy()
    stages = stage_of(task.graph)
    for obj in built.objects:
        paste_object(image, frame, obj, *obj.at, faded=obj.name not in task.configuration)
    for name in task.configuration:
        if len(set(stages.values())) > 1 and name in stages:
            _badge(image, frame, built, name, stages[name])
    return image


def _badge(image: Image, frame: Frame, layout: TabletopLayout, name: str, stage: int) -> None:
    """The number of a stage at the upper left of an object."""
    obj = layout.objects[layout.index(name)]
    size = max(10, round(0.042 * frame.scale))
    column, row = frame.pixel(*obj.at)
    words = text_sprite(str(stage), size, TABLE["ink"])
    at = (row - len(words.colour) / 2, column - obj.size[0] / 2 * frame.scale - words.colour.shape[1] - 0.3 * size)
    paste(image, words, round(at[0]), round(at[1]))


def _order_words(task: TabletopTask) -> str:
    stages = max(stage_of(task.graph).values(), default=1)
    if stages == 1:
        return "in any order"
    return f"all of {' before '.join(str(i) for i in range(1, stages + 1))}, in any order within"


def _legend(task: TabletopTask, width: int, size: int, ambiguity: bool, obstacles: bool) -> Image:
    """The legend, on a card as large as a panel."""
    marks = [("where the hand starts a reach", _start_mark)]
    if obstacles:
        marks.append(("virtual obstacle, which the hand goes round", _obstacle_mark))
    if task.configuration:
        marks.append(("where an object belongs", _slot_mark))
    row = round(2.1 * size)
    card = np.empty((Frame.of(task.layout.table, width).height, width, 3), np.uint8)
    card[...] = rgb(TABLE["page"])
    scale = draw_ambiguity_scale(width) if ambiguity else card[:0]
    words = fit_text("shortest reaches, by how ambiguous their goal is", size, TABLE["ink_soft"], width)
    top = max(0, (len(card) - row * len(marks) - (len(scale) + row if ambiguity else 0)) // 2)
    for text, mark in marks:
        paste(card, mark(row), top, size)
        line = fit_text(text, size, TABLE["ink_soft"], max(1, width - row - 2 * size))
        paste(card, line, top + (row - len(line.colour)) // 2 + 1, row + round(1.4 * size))
        top += row
    if ambiguity and top + row + len(scale) <= len(card):
        paste(card, words, top + row - len(words.colour), (width - words.colour.shape[1]) // 2)
        card[top + row : top + row + len(scale)] = scale
    return card


def _start_mark(height: int) -> Sprite:
    canvas = Canvas(height)
    canvas.arc(0.5, 0.5, 0.24, (0, 1), 0.06, TABLE["start"])
    canvas.circle(0.5, 0.5, 0.06, TABLE["start"])
    return canvas.sprite()


def _obstacle_mark(height: int) -> Sprite:
    canvas = Canvas(height)
    canvas.polygon(outline(0.5, 0.5, 0.9, 0.2, 0.35), TABLE["obstacle_edge"])
    canvas.polygon(outline(0.5, 0.5, 0.84, 0.12, 0.35), TABLE["obstacle"])
    return canvas.sprite()


def _slot_mark(height: int) -> Sprite:
    canvas = Canvas(height)
    for grow, colour in ((0.06, TABLE["slot_line"]), (0.0, TABLE["slot"])):
        canvas.polygon(outline(0.5, 0.5, 0.5 + grow, 0.5 + grow, 0.0, 0.08), colour)
    return canvas.sprite()
