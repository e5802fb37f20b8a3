"""Whether the predictor and the robot of a study can be made, and the task is one that a robot can help with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from benchmarks.study.design.draft import Draft

if TYPE_CHECKING:
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["check_partners", "task_of"]

_BUILT_IN: Final = "bayesian"
"""Always there, in both domains. Looking it up would load the learners: 80 MB in every server, a second in commands."""


def task_of(draft: Draft) -> TabletopTask | None:
    """What is built at the table; None where its file could not be read, which is said elsewhere.

    Raises:
        TaskError: It is no task.
        LayoutError: Its table is not valid.
    """
    from legible_envs.support.plain_data import parse_yaml
    from legible_envs.tabletop.task import TabletopTask, read_task

    name = draft.content.table.task
    if not name.endswith((".yaml", ".yml")):
        return read_task(name)
    return TabletopTask.from_dict(parse_yaml(draft.task)) if draft.task else None


def check_partners(draft: Draft) -> None:
    """Note predictors and partners that are unknown or of the other domain."""
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
    try:
        task = task_of(draft)
    except ValueError:
        return  # said elsewhere
    if task is not None and not task.configuration:
        draft.refuse(
            f"a robot puts objects in their places in the configuration; the task {task.name!r} has none", "partner"
        )


def _check_kitchen_predictor(draft: Draft) -> None:
    name = draft.content.predictor
    if name == _BUILT_IN:
        return
    from predictors.registry import BUILT_IN, PredictorError, make_predictor

    try:
        make_predictor(name)
    except PredictorError as error:
        draft.refuse(f"`predictor`: {error}", "predictor")
        return
    if BUILT_IN.get(name, "").startswith("predictors.reaching"):
        draft.refuse(f"`predictor`: {name!r} predicts reaches at tables, not where cooks go", "predictor")


def _check_table_predictor(draft: Draft, name: str, *path: str) -> None:
    if name == _BUILT_IN:
        return
    from legible_envs.tabletop.partner.intent import make_intent_predictor
    from predictors.registry import BUILT_IN

    try:
        make_intent_predictor(name)
    except (ValueError, TypeError) as error:
        draft.refuse(f"`{'.'.join(path)}`: {error}", *path)
        return
    if BUILT_IN.get(name, "").startswith("predictors.grid"):
        draft.refuse(f"`{'.'.join(path)}`: {name!r} predicts where cooks go, not reaches at tables", *path)
