"""The environments as a study plays them: a step, what the page draws, and a digest of every state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from benchmarks.study.design.study import Study
    from benchmarks.study.games.base import Game
    from benchmarks.study.timeline import Screen

__all__ = ["make_game", "reaches_left"]


def make_game(study: Study, screen: Screen, seed: int, *, reaches_left: int | None = None) -> Game:
    """The game of a screen.

    Args:
        study: The design.
        screen: A ``practice`` or ``round``.
        seed: Of the environment.
        reaches_left: Tables: reaches of this condition that are still to be made; None: all that the design wants.
    """
    content, practice = study.content, study.content.practice if screen.kind == "practice" else None
    rules = practice or content.rounds
    common: dict[str, Any] = {
        "layout": study.layout_of("" if practice else screen.condition),
        "obstacles": screen.obstacles,
        "max_steps": rules.max_steps,
        "seed": seed,
    }
    if content.domain == "overcooked":
        from benchmarks.study.games.overcooked import KitchenGame

        kitchen = content.kitchen
        return KitchenGame(
            **common,
            soups=practice.soups if practice else kitchen.soups,
            cook_time=kitchen.cook_time,
            virtual_obstacles=kitchen.virtual_obstacles,
        )
    from benchmarks.study.games.tabletop import TableGame

    robot = None
    if content.partner is not None:
        robot = {"partner": content.partner.kind}
        if content.partner.kind == "robot":
            robot |= {"predictor": content.partner.predictor, "threshold": content.partner.threshold}  # type: ignore[dict-item]
    settings = content.table.model_dump()
    task = settings.pop("task")
    return TableGame(
        **common,
        task=str(study.folder / task) if task.endswith((".yaml", ".yml")) else task,
        partner=robot,
        predictor=content.predictor if content.look.show_belief else None,
        reaches=rules.reaches if reaches_left is None else reaches_left,
        **settings,
    )


def reaches_left(study: Study, screen: Screen, earlier: Iterable[tuple[Screen, Mapping[str, Any]]]) -> int | None:
    """How many reaches of a round's condition are still to be made; None where rounds alone count.

    Args:
        study: The design.
        screen: A ``round``.
        earlier: Finished rounds of the participant and their outcomes, in any order; those of other conditions and
            sittings do not count.
    """
    wanted = study.content.rounds.reaches
    if study.content.domain != "tabletop" or not wanted or screen.kind != "round":
        return None
    made = sum(
        int(outcome.get("reaches", 0))
        for other, outcome in earlier
        if other.kind == "round" and (other.condition, other.sitting) == (screen.condition, screen.sitting)
    )
    return max(0, wanted - made)
