"""Whether the layouts of a study can be played: of the domain, and everything that the task needs in reach."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.study.design.draft import SETTINGS, Draft
from legible_envs.errors import LayoutError

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["check_layouts"]

_LARGEST: Final = 24
"""Rows or columns of a kitchen whose cells can still be told apart on a phone of 360 points."""
_AROUND: Final = 32
"""Points around a place from which an object may still be put there."""

Path = tuple[str | int, ...]


def check_layouts(draft: Draft) -> None:
    """Note layouts that cannot be played, predictors and partners that are unknown, and files that nothing uses."""
    task = _task_of(draft) if draft.content.domain == "tabletop" else None
    for number, entry in enumerate(draft.content.conditions):
        _check_layout(draft, entry.layout, ("conditions", number, "layout"), f"condition {entry.name!r}", task)
    if draft.content.practice is not None:
        _check_layout(draft, draft.content.practice.layout, ("practice", "layout"), "the practice", task)
    _check_repeated(draft)
    _check_predictors(draft)
    _check_unused(draft)


def _check_layout(draft: Draft, file: str, path: Path, what: str, task: TabletopTask | None) -> None:
    text = draft.layouts.get(file)
    if text is None or (draft.content.domain == "tabletop" and task is None):
        return  # said elsewhere
    try:
        if task is None:
            soups = draft.content.practice.soups if path[0] == "practice" else draft.content.kitchen.soups  # type: ignore[union-attr]
            _check_kitchen(draft, file, text, soups)
        else:
            _check_table(draft, text, task)
    except (LayoutError, ValueError) as error:
        if not any(problem.file == file and str(error) in problem.message for problem in draft.problems):
            draft.refuse_file(file, f"{error} (the layout of {what})")


# -- kitchens ----------------------------------------------------------------------------------------------------------


def _check_kitchen(draft: Draft, file: str, text: str, soups: list[list[str]]) -> None:
    from legible_envs.overcooked.layouts import read_layout
    from legible_envs.overcooked.settings import KitchenSettings

    kitchen = read_layout(text)
    bare = read_layout(kitchen.to_ascii().replace("V", " "))
    for layout in _as_played(draft, kitchen, bare):
        settings = KitchenSettings(
            layout=layout,
            recipes=soups,
            cook_time=draft.content.kitchen.cook_time,
            virtual_obstacles=draft.content.kitchen.virtual_obstacles,
        )
        settings.pack(settings.preview())
    if max(kitchen.shape) > _LARGEST:
        rows, columns = kitchen.shape
        draft.refuse_file(
            file,
            f"{rows} x {columns} cells are small on a phone; up to {_LARGEST} x {_LARGEST} can be seen",
            warn=True,
        )


def _as_played(draft: Draft, layout: Any, bare: Any) -> list[Any]:
    """The layout as participants meet it: with its obstacles, and bare where a sitting is without."""
    sittings = draft.content.sittings
    with_obstacles = [layout] if not sittings or any(sitting.obstacles for sitting in sittings) else []
    return [*with_obstacles, *([bare] if any(not sitting.obstacles for sitting in sittings) else [])]


# -- tables ------------------------------------------------------------------------------------------------------------


def _task_of(draft: Draft) -> TabletopTask | None:
    from legible_envs.tabletop.task import TabletopTask, read_task

    name = draft.content.table.task
    try:
        if name.endswith((".yaml", ".yml")):
            if not draft.task:
                return None  # said elsewhere
            from legible_envs.support.plain_data import parse_yaml

            return TabletopTask.from_dict(parse_yaml(draft.task))
        task = read_task(name)
    except ValueError as error:
        draft.refuse(f"`table.task`: {error}", "table", "task")
        return None
    return task


def _check_table(draft: Draft, text: str, task: TabletopTask) -> None:
    from legible_envs.support.plain_data import parse_json
    from legible_envs.tabletop.env import TabletopEnv
    from legible_envs.tabletop.layout import MAX_OBSTACLES, TabletopLayout

    table = TabletopLayout.from_dict(parse_json(text))
    settings = draft.content.table.model_dump()
    settings.pop("task")
    for layout in _as_played(draft, table, table.with_obstacles(())):
        most = max(MAX_OBSTACLES, len(layout.obstacles))
        TabletopEnv(task=task, layout=layout, max_obstacles=most, **settings).close()
        if settings["virtual_obstacles"] == "hard":
            _check_places(layout, task, settings["release_distance"])


def _check_places(layout: TabletopLayout, task: TabletopTask, near: float) -> None:
    """Refuse a layout in which a hand cannot come near enough to a place to put its object there."""
    if not layout.obstacles:
        return
    turns = 2 * np.pi * np.arange(_AROUND) / _AROUND
    width, depth = layout.table.size
    for name, (x, y) in task.configuration.items():
        reach = near - 1e-6
        points = [(x, y), *((x + reach * math.cos(a), y + reach * math.sin(a)) for a in turns)]
        points = [(a, b) for a, b in points if 0 <= a <= width and 0 <= b <= depth]
        free = [point for point, ok in zip(points, layout.paths.is_free(np.array(points)), strict=True) if ok]
        lengths = layout.paths.lengths(np.array(free)) if free else np.empty((0, 0))
        if not free or not np.isfinite(lengths[:, layout.index(name)]).any():
            raise LayoutError(
                f"the place of {name} at ({x:g}, {y:g}) cannot be reached: virtual obstacles stop the hand more than "
                f"{near:g} m before it",
                rule="reachable",
            )


# -- what is the same for both ----------------------------------------------------------------------------------------


def _check_repeated(draft: Draft) -> None:
    seen: dict[str, str] = {}
    for number, entry in enumerate(draft.content.conditions):
        text = draft.layouts.get(entry.layout)
        if text is None:
            continue
        if text in seen:
            draft.refuse(
                f"conditions {seen[text]!r} and {entry.name!r} have the same layout",
                *("conditions", number, "layout"),
                warn=True,
            )
        seen.setdefault(text, entry.name)


_BUILT_IN: Final = "bayesian"
"""Always there, in both domains. Looking it up would load the learners: 80 MB in every server, a second in commands."""


def _check_predictors(draft: Draft) -> None:
    content = draft.content
    if content.domain == "overcooked":
        _check_kitchen_predictor(draft)
        return
    _check_table_predictor(draft, content.predictor, "predictor")
    partner = content.partner
    if partner is None:
        return
    if partner.kind == "robot":
        _check_table_predictor(draft, partner.predictor, "partner", "predictor")
    else:
        from legible_envs.tabletop.partner.team import make_partner

        try:
            make_partner(partner.kind, None, partner.threshold)
        except (ValueError, TypeError) as error:
            draft.refuse(f"`partner.kind`: {error}", "partner", "kind")
    task = _quiet_task(draft)
    if task is not None and not task.configuration:
        draft.refuse(
            f"a robot puts objects in their places in the configuration; the task {task.name!r} has none", "partner"
        )


def _quiet_task(draft: Draft) -> TabletopTask | None:
    """The task, whose problems are said elsewhere."""
    known = len(draft.problems)
    task = _task_of(draft)
    del draft.problems[known:]
    return task


def _check_kitchen_predictor(draft: Draft) -> None:
    name = draft.content.predictor
    if name == _BUILT_IN:
        return
    from predictors.registry import PredictorError, list_predictors, make_predictor

    try:
        make_predictor(name)
    except PredictorError as error:
        draft.refuse(f"`predictor`: {error}", "predictor")
        return
    known = list_predictors().get(name)
    if known is not None and known.target.startswith("predictors.reaching"):
        draft.refuse(f"`predictor`: {name!r} predicts reaches at tables, not where cooks go", "predictor")


def _check_table_predictor(draft: Draft, name: str, *path: str) -> None:
    if name == _BUILT_IN:
        return
    from legible_envs.tabletop.partner.intent import make_intent_predictor
    from predictors.registry import list_predictors

    try:
        make_intent_predictor(name)
    except (ValueError, TypeError) as error:
        draft.refuse(f"`{'.'.join(path)}`: {error}", *path)
        return
    known = list_predictors().get(name)
    if known is not None and name != "bayesian" and known.target.startswith("predictors.grid"):
        draft.refuse(f"`{'.'.join(path)}`: {name!r} predicts where cooks go, not reaches at tables", *path)


def _check_unused(draft: Draft) -> None:
    place, practice = draft.folder / "layouts", draft.content.practice
    used = {entry.layout for entry in draft.content.conditions} | ({practice.layout} if practice is not None else set())
    if not place.is_dir() or not place.resolve().is_relative_to(draft.folder.resolve()):
        return
    for entry in sorted(place.iterdir()):
        name = f"layouts/{entry.name}"
        if entry.is_file() and not entry.name.startswith(".") and entry.suffix != ".md" and name not in used:
            draft.refuse_file(name, f"nothing in {SETTINGS} uses this file", warn=True)
