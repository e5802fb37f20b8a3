"""What ``study.toml`` may hold: keys, types, bounds and defaults."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Field

from benchmarks.study.design.names import Slug
from legible_envs.overcooked.drawings import INGREDIENTS
from legible_envs.support.models import Choice, FileModel, Flag, Length, Real, Text, Whole

__all__ = [
    "SCHEMA",
    "ConditionEntry",
    "DeviceEntry",
    "KitchenEntry",
    "LimitsEntry",
    "LookEntry",
    "OrdersEntry",
    "PartnerEntry",
    "PracticeEntry",
    "QuestionnaireUse",
    "RecruitmentEntry",
    "RoundsEntry",
    "SittingEntry",
    "StudyContent",
    "TableEntry",
]

SCHEMA: Final = 1
_MOST: Final = 64
"""Conditions, sittings, questionnaires."""
_DAYS: Final = 24 * 366
"""Hours of a year."""

Soup = Annotated[list[Annotated[str, Choice(*INGREDIENTS)]], Length(1, 8)]
PAPER_SOUPS: Final = [["tomato", "tomato", "onion"], ["onion", "onion", "cabbage"], ["fish", "fish", "fish"]]


class ConditionEntry(FileModel):
    """A named layout that participants work in.

    Attributes:
        name: Unique; what tables call it. The paper's names give the paper's figures beside ours.
        layout: File in the study's folder.
    """

    name: Annotated[str, Slug()]
    layout: Annotated[str, Text(200)]


class PracticeEntry(FileModel):
    """A round before the conditions, with an ending of its own.

    Attributes:
        layout: File in the study's folder.
        soups: Kitchens: what is to be cooked.
        reaches: Tables: objects to take and place; 0 for the whole task.
        attempts: How often it may be tried; who never finishes ends with ``practice_failed``.
        max_steps: Steps of an attempt.
    """

    layout: Annotated[str, Text(200)]
    soups: Annotated[list[Soup], Length(1, 16)] = [["onion", "onion", "onion"]]
    reaches: Annotated[int, Whole(0, 1000)] = 3
    attempts: Annotated[int, Whole(1, 20)] = 3
    max_steps: Annotated[int, Whole(1, 100_000)] = 1200


class RoundsEntry(FileModel):
    """What is played in each condition.

    Attributes:
        per_condition: Rounds (episodes) of a condition at most.
        reaches: Tables: the condition ends once the participant has finished so many reaches; 0: after its rounds.
        max_steps: Steps of a round at most (tables make 30 a second).
    """

    per_condition: Annotated[int, Whole(1, 100)] = 1
    reaches: Annotated[int, Whole(0, 1000)] = 0
    max_steps: Annotated[int, Whole(1, 100_000)] = 1200


class KitchenEntry(FileModel):
    """How kitchens are played.

    Attributes:
        soups: The ordered soups of a round, each cooked and delivered once.
        cook_time: Ticks a soup cooks.
        virtual_obstacles: ``"hard"`` or ``"soft"``.
        waiting: Seconds without a key after which a step of waiting passes while something cooks; 0: never.
    """

    soups: Annotated[list[Soup], Length(1, 16)] = PAPER_SOUPS
    cook_time: Annotated[int, Whole(1, 1000)] = 20
    virtual_obstacles: Annotated[str, Choice("hard", "soft")] = "hard"
    waiting: Annotated[float, Real(0, 60)] = 0.25


class TableEntry(FileModel):
    """How tables are played.

    Attributes:
        task: A built-in task or a YAML file in the study's folder.
        virtual_obstacles: ``"hard"`` or ``"soft"``.
        contact: When the hand pushes objects; see ``LegibleTabletop-v0``.
        slow_speed: Up to which the hand takes and places, m/s.
        grasp_distance: Up to which it takes, metres from an object's outline.
        release_distance: Up to which it places, metres from the place.
    """

    task: Annotated[str, Text(200)] = "columns"
    virtual_obstacles: Annotated[str, Choice("hard", "soft")] = "hard"
    contact: Annotated[str, Choice("slow", "always", "never")] = "never"
    slow_speed: Annotated[float, Real(0.01, 3)] = 0.2
    grasp_distance: Annotated[float, Real(0, 0.2)] = 0.03
    release_distance: Annotated[float, Real(0, 0.2)] = 0.05


class PartnerEntry(FileModel):
    """The robot at the table.

    Attributes:
        kind: ``"robot"``, or ``"module:Class"``.
        predictor: As ``LegibleTabletop-v0`` takes it.
        threshold: Probability that a goal must exceed for the robot to act.
    """

    kind: Annotated[str, Text(200)] = "robot"
    predictor: Annotated[str, Text(200)] = "bayesian"
    threshold: Annotated[float, Real(0, 1)] = 0.8


class OrdersEntry(FileModel):
    """In which order participants meet the conditions.

    Attributes:
        policy: ``"williams"``, ``"random"``, ``"fixed"``, or ``"module:function"``.
        recent_minutes: Participants who were seen so recently count as if they would finish.
    """

    policy: Annotated[str, Text(200)] = "williams"
    recent_minutes: Annotated[float, Real(0, 60 * _DAYS)] = 60


class SittingEntry(FileModel):
    """A block of conditions on its own day.

    Attributes:
        name: Unique.
        conditions: Those of this sitting; all where left out.
        obstacles: Whether virtual obstacles are there; without, the same layouts are bare.
        min_gap_hours: Earliest after the end of the sitting before.
        max_gap_hours: Latest after it; 0: at any time.
    """

    name: Annotated[str, Slug()]
    conditions: Annotated[list[Annotated[str, Text(200)]], Length(1, _MOST)] | None = None
    obstacles: Annotated[bool, Flag()] = True
    min_gap_hours: Annotated[float, Real(0, _DAYS)] = 0
    max_gap_hours: Annotated[float, Real(0, _DAYS)] = 0


class QuestionnaireUse(FileModel):
    """A questionnaire, and when it is shown.

    Attributes:
        name: Built in (``nasa-tlx``, ``fluency``, ``comments``), or ``questionnaires/NAME.toml`` of the study.
        after: ``"practice"``, ``"condition"`` (after each), ``"sitting"`` (at the end of each) or ``"study"``.
    """

    name: Annotated[str, Slug()]
    after: Annotated[str, Choice("practice", "condition", "sitting", "study")] = "condition"


class DeviceEntry(FileModel):
    """What a participant's device must have; who has not is told so in words, and the study stops for them.

    Attributes:
        keyboard: Whether a key must be pressed in the check.
        pointer: ``"any"``, ``"fine"`` (mouse, pen) or ``"touch"``.
        min_width: Of the page, CSS pixels.
        min_height: Of the page, CSS pixels.
        max_round_trip: Milliseconds to the server and back, median of several; 0: any.
    """

    keyboard: Annotated[bool, Flag()] = False
    pointer: Annotated[str, Choice("any", "fine", "touch")] = "any"
    min_width: Annotated[int, Whole(0, 10_000)] = 320
    min_height: Annotated[int, Whole(0, 10_000)] = 400
    max_round_trip: Annotated[float, Real(0, 10_000)] = 1000


class RecruitmentEntry(FileModel):
    """Where participants come from, and what they take back.

    Attributes:
        source: ``"none"``, ``"prolific"`` (PROLIFIC_PID, STUDY_ID, SESSION_ID) or ``"mturk"`` (workerId, hitId,
            assignmentId; the page renders as preview without a worker).
        wanted: Recruitment closes by itself once so many are complete; 0: never.
        one_per_worker: Whether a worker who has ended may not take part again.
        completion_url: Where a participant is sent after the last row is stored; ``{code}`` stands for the completion
            code, ``{ending}`` for the ending. Empty: the code is shown.
        codes: Fixed codes by ending (``complete``, ``practice_failed``, ``refused``, ``device_failed``,
            ``timed_out``, …) for platforms that want one code for all; others have one of their own (HMAC).
    """

    source: Annotated[str, Choice("none", "prolific", "mturk")] = "none"
    wanted: Annotated[int, Whole(0, 1_000_000)] = 0
    one_per_worker: Annotated[bool, Flag()] = True
    completion_url: Annotated[str, Text(2000, empty=True)] = ""
    codes: dict[Annotated[str, Text(40)], Annotated[str, Text(80)]] = {}


class LimitsEntry(FileModel):
    """How long a participant may be away.

    Attributes:
        idle_warning: Seconds without a sign of life after which they are warned; 0: never.
        idle_timeout: Seconds after which the session ends with ``timed_out``; 0: never.
        resume: What a reload does: ``"resume"`` at the same step, ``"restart"`` the round, or ``"block"``.
        resume_hours: Oldest session that can be resumed, hours since its last row.
    """

    idle_warning: Annotated[float, Real(0, 86_400)] = 120
    idle_timeout: Annotated[float, Real(0, 86_400)] = 300
    resume: Annotated[str, Choice("resume", "restart", "block")] = "resume"
    resume_hours: Annotated[float, Real(0, _DAYS)] = 24


Keys = Annotated[list[Annotated[str, Text(40)]], Length(1, 8)]


class LookEntry(FileModel):
    """How the page looks and is played.

    Attributes:
        theme: ``"auto"`` (the device's), ``"light"`` or ``"dark"``.
        accent: Colour of buttons and marks, ``#rrggbb``.
        show_belief: Whether participants see the predictor's belief over the objects.
        keys: Kitchens: keys (``KeyboardEvent.code``) by action: ``north``, ``south``, ``east``, ``west``, ``interact``,
            ``stay``.
    """

    theme: Annotated[str, Choice("auto", "light", "dark")] = "auto"
    accent: Annotated[str, Text(7)] = "#1f7a4d"
    show_belief: Annotated[bool, Flag()] = False
    keys: dict[Annotated[str, Choice("north", "south", "east", "west", "interact", "stay")], Keys] = {
        "north": ["ArrowUp", "KeyW"],
        "south": ["ArrowDown", "KeyS"],
        "east": ["ArrowRight", "KeyD"],
        "west": ["ArrowLeft", "KeyA"],
        "interact": ["Space", "KeyE"],
        "stay": ["Period", "KeyQ"],
    }


class StudyContent(FileModel):
    """The whole file; see :class:`~benchmarks.study.design.study.Study`.

    Attributes:
        predictor: Whose live belief the monitor shows; as ``legible predictors`` lists them.
        texts: Folder of the Markdown texts; a translation is another folder.
    """

    version: Annotated[int, Choice(SCHEMA)] = Field(alias="schema")
    name: Annotated[str, Slug()]
    title: Annotated[str, Text(200)]
    domain: Annotated[str, Choice("overcooked", "tabletop")]
    language: Annotated[str, Text(35)] = "en"
    texts: Annotated[str, Text(200)] = "texts"
    conditions: Annotated[list[ConditionEntry], Length(1, _MOST)]
    practice: PracticeEntry | None = None
    rounds: RoundsEntry = RoundsEntry()
    kitchen: KitchenEntry = KitchenEntry()
    table: TableEntry = TableEntry()
    partner: PartnerEntry | None = None
    predictor: Annotated[str, Text(200)] = "bayesian"
    orders: OrdersEntry = OrdersEntry()
    sittings: Annotated[list[SittingEntry], Length(0, _MOST)] = []
    questionnaires: Annotated[list[QuestionnaireUse], Length(0, _MOST)] = []
    device: DeviceEntry = DeviceEntry()
    recruitment: RecruitmentEntry = RecruitmentEntry()
    limits: LimitsEntry = LimitsEntry()
    look: LookEntry = LookEntry()


def plain(content: StudyContent) -> dict[str, Any]:
    """The settings as plain data, defaults included: what the design hash is taken of."""
    found: dict[str, Any] = content.model_dump(mode="json", by_alias=True)
    return found
