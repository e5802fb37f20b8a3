"""What a participant goes through, screen by screen: a plain list, made of the design and their order of conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from benchmarks.study.design.endings import ENDINGS, Ending
from benchmarks.study.design.study import Study

__all__ = ["ENDINGS", "GAMES", "Ending", "Kind", "Screen", "timeline"]

Kind = Literal["device", "consent", "text", "practice", "round", "questionnaire", "pause"]
GAMES: Final = ("practice", "round")


@dataclass(frozen=True, slots=True)
class Screen:
    """One screen.

    Attributes:
        name: Unique in the timeline, such as ``round#Legible#1``; with several sittings behind ``SITTING#``.
        kind: What is on it.
        text: Name of the Markdown text, for ``consent``, ``text``, ``practice``, ``round`` (shown before it begins) and
            ``pause``.
        condition: Of a round or questionnaire; ``""`` for none.
        round: Of the condition, from 1; 0 for none.
        questionnaire: Its name.
        sitting: Index of the sitting.
        obstacles: Whether virtual obstacles are there.
    """

    name: str
    kind: Kind
    text: str = ""
    condition: str = ""
    round: int = 0
    questionnaire: str = ""
    sitting: int = 0
    obstacles: bool = True


def timeline(study: Study, order: Sequence[str]) -> list[Screen]:
    """All screens of a participant, the endings left out.

    Device check, consent, instructions, practice and its questionnaires; then for each sitting its conditions in the
    participant's order, each with its rounds and questionnaires, those of the sitting, and a pause before the next;
    last the questionnaires of the study.

    Args:
        study: The design.
        order: All conditions, as the participant meets them.
    """
    content = study.content
    screens = [Screen("device", "device"), Screen("consent", "consent", "consent")]
    screens.append(Screen("instructions", "text", "instructions"))

    def asked(after: str, prefix: str, **where: object) -> list[Screen]:
        return [
            Screen(f"{prefix}{use.name}", "questionnaire", questionnaire=use.name, **where)  # type: ignore[arg-type]
            for use in content.questionnaires
            if use.after == after
        ]

    if content.practice is not None:
        screens += [Screen("practice", "practice", "practice"), *asked("practice", "practice#")]
    sittings = content.sittings
    for number in range(max(1, len(sittings))):
        sitting = sittings[number] if sittings else None
        prefix = f"{sitting.name}#" if sitting is not None else ""
        obstacles = sitting is None or sitting.obstacles
        if number:
            screens.append(Screen(f"{prefix}pause", "pause", "pause", sitting=number))
        own = None if sitting is None else sitting.conditions
        for condition in [name for name in order if own is None or name in own]:
            where = {"condition": condition, "sitting": number, "obstacles": obstacles}
            screens += [
                Screen(f"{prefix}round#{condition}#{turn}", "round", "round", round=turn, **where)  # type: ignore[arg-type]
                for turn in range(1, content.rounds.per_condition + 1)
            ]
            screens += asked("condition", f"{prefix}{condition}#", **where)
        screens += asked("sitting", f"{prefix}", sitting=number, obstacles=obstacles)
    last = max(0, len(sittings) - 1)
    return [*screens, *asked("study", "study#", sitting=last)]
