"""Whether the layouts of a study can be played: of the domain, and everything that the task needs in reach."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.study.design.draft import SETTINGS, Draft
from benchmarks.study.design.partner_checks import task_of
from legible_envs.errors import LayoutError
from legible_envs.subtasks import HUMAN, ROBOT

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
    """Note layouts that cannot be played, and files that nothing uses."""
    task = _checked_task(draft) if draft.content.domain == "tabletop" else None
    if draft.content.domain == "overcooked":
        _check_soups(draft)
    elif task is not None:
        _check_reaches(draft, task)
    for number, entry in enumerate(draft.content.conditions):
        _check_layout(draft, entry.layout, ("conditions", number, "layout"), f"condition {entry.name!r}", task)
    if draft.content.practice is not None:
        _check_layout(draft, draft.content.practice.layout, ("practice", "layout"), "the practice", task)
    _check_repeated(draft)
    _check_unused(draft)


def _check_layout(draft: Draft, file: str, path: Path, what: str, task: TabletopTask | None) -> None:
    text = draft.layouts.get(file)
    if text is None or (draft.content.domain == "tabletop" and task is None):
        return  # said elsewhere
    try:
        if task is None:
            _check_kitchen(draft, file, text, _soups_of(draft, is_practice=path[0] == "practice"))
        else:
            _check_table(draft, text, task)
    except (LayoutError, ValueError) as error:
        if not any(problem.file == file and str(error) in problem.message for problem in draft.problems):
            draft.refuse_file(file, f"{error} (the layout of {what})")


# -- kitchens ----------------------------------------------------------------------------------------------------------


def _soups_of(draft: Draft, *, is_practice: bool) -> list[list[str]]:
    """What is cooked; one onion where that itself is wrong, so that the layout is checked all the same."""
    practice = draft.content.practice
    soups = practice.soups if is_practice and practice is not None else draft.content.kitchen.soups
    return soups if _soups_problem(soups) is None else [["onion"]]


def _soups_problem(soups: list[list[str]]) -> str | None:
    from legible_envs.overcooked.recipes import check_recipes

    try:
        check_recipes(soups)
    except ValueError as error:
        return str(error)
    return None


def _check_soups(draft: Draft) -> None:
    practice = draft.content.practice
    asked = {"kitchen": draft.content.kitchen.soups} | ({} if practice is None else {"practice": practice.soups})
    for table, soups in asked.items():
        if (wrong := _soups_problem(soups)) is not None:
            draft.refuse(f"`{table}.soups`: {wrong}", table, "soups")


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


def _checked_task(draft: Draft) -> TabletopTask | None:
    try:
        return task_of(draft)
    except ValueError as error:
        draft.refuse(f"`table.task`: {error}", "table", "task")
        return None


def _check_reaches(draft: Draft, task: TabletopTask) -> None:
    """Warn where more reaches are wanted than a participant can make; a robot makes some of them, too."""
    content, objects = draft.content, len(task.graph.goals_of(HUMAN))
    shared = "; the robot takes some of them, too" if content.partner is not None else ""
    most = objects * content.rounds.per_condition
    if content.rounds.reaches > most:
        draft.refuse(
            f"{content.rounds.reaches} reaches cannot be made in {content.rounds.per_condition} rounds with {objects} "
            f"objects each{shared}: the condition ends after its rounds",
            *("rounds", "reaches"),
            warn=True,
        )
    if content.practice is not None and content.practice.reaches > objects:
        draft.refuse(
            f"{content.practice.reaches} reaches cannot be made with {objects} objects{shared}: nobody could finish "
            "the practice",
            *("practice", "reaches"),
        )


def _check_table(draft: Draft, text: str, task: TabletopTask) -> None:
    from legible_envs.support.plain_data import parse_json
    from legible_envs.tabletop.env import TabletopEnv
    from legible_envs.tabletop.layout import MAX_OBSTACLES, TabletopLayout

    table = TabletopLayout.from_dict(parse_json(text))
    settings = draft.content.table.model_dump()
    settings.pop("task")
    if draft.content.partner is not None and task.graph.reserved_for(ROBOT):
        settings["partner"] = "robot"  # any will do to see that there is one
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


def _check_unused(draft: Draft) -> None:
    place, practice = draft.folder / "layouts", draft.content.practice
    used = {entry.layout for entry in draft.content.conditions} | ({practice.layout} if practice is not None else set())
    if not place.is_dir() or not place.resolve().is_relative_to(draft.folder.resolve()):
        return
    for entry in sorted(place.iterdir()):
        name = f"layouts/{entry.name}"
        if entry.is_file() and not entry.name.startswith(".") and entry.suffix != ".md" and name not in used:
            draft.refuse_file(name, f"nothing in {SETTINGS} uses this file", warn=True)
