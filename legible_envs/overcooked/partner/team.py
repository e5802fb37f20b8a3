"""The team in the kitchen: the partner beside the person, what it is told, and how fluently both work."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.snapshot import name_goals
from legible_envs.overcooked.game.vectors import AT_PLAYERS, DISH, STAY, Kitchen, Vector
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, TICK, Command, Partner, Senses
from legible_envs.overcooked.partner.needs import item_at, needed_beside
from legible_envs.overcooked.partner.players import (
    BoltzmannPartner,
    PlannerPartner,
    PolicyPartner,
    RecordedPartner,
    ScriptedPartner,
)
from legible_envs.overcooked.partner.reaches import ReachLog
from legible_envs.overcooked.partner.robot import RobotPartner
from legible_envs.overcooked.settings import read_action
from legible_envs.partner.fluency import ReachPrediction, TeamMetrics, Tick, known_measures
from legible_envs.support.plugins import import_target
from legible_envs.support.validation import shown

if TYPE_CHECKING:
    from legible_envs.overcooked.game.rules import GameRules
    from legible_envs.overcooked.grid import Cell
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["Game", "Team", "make_partner"]

_KINDS: Final[dict[str, Callable[..., Partner]]] = {
    "robot": RobotPartner,
    "scripted": ScriptedPartner,
    "boltzmann": BoltzmannPartner,
    "planner": PlannerPartner,
    "recorded": RecordedPartner,
}


def make_partner(spec: object, predictor: object = None, threshold: float = 0.8) -> Partner:
    """A partner from what a user names.

    Args:
        spec: ``"robot"``, ``"scripted"``, ``"boltzmann"`` or ``"planner"``; a mapping of arguments of one of them, told
            apart by ``"kind"`` (``"robot"`` without), or ``{"kind": "recorded", "actions": [...]}``;
            ``"module:Class"``, made without arguments; an object with ``reset`` and ``step``, which is copied; or a
            policy, called with ``(observation, info)``.
        predictor: The predictor of a ``RobotPartner``.
        threshold: Of a ``RobotPartner``.

    Raises:
        ValueError: It cannot be imported or made, or there is none of this name.
        TypeError: It is no partner.
    """
    if isinstance(spec, str) and ":" not in spec:
        spec = {"kind": spec}
    if isinstance(spec, Mapping):
        return _make_kind(spec, predictor, threshold)
    if predictor is not None:
        raise ValueError("`predictor` is for partner='robot'; a partner of your own brings its own")
    if isinstance(spec, str):
        try:
            spec = import_target(spec)()
        except Exception as error:
            raise ValueError(f"partner {spec!r} cannot be made: {type(error).__name__}: {error}") from error
    if not isinstance(spec, type):
        if all(callable(getattr(spec, name, None)) for name in ("reset", "step")):
            return copy.deepcopy(spec)  # type: ignore[return-value]  # has the methods
        if callable(spec):
            return PolicyPartner(spec)
    raise TypeError(
        "a `partner` must be an object with the methods `reset` and `step`, or a policy to call with "
        f"(observation, info), got {shown(spec)}"
    )


def _make_kind(spec: Mapping[Any, Any], predictor: object, threshold: float) -> Partner:
    arguments = dict(spec)
    kind = arguments.pop("kind", "robot")
    if not isinstance(kind, str) or kind not in _KINDS:
        raise ValueError(
            f"`partner`: no partner named {shown(kind)}; there are {', '.join(_KINDS)}; or use 'module:Class', an "
            "object with `reset` and `step`, or a policy"
        )
    if kind == "robot":
        arguments = {"predictor": predictor, "threshold": threshold, **arguments}
    elif predictor is not None:
        raise ValueError(f"`predictor` is for partner='robot'; a {kind} partner predicts nothing")
    try:
        return _KINDS[kind](**arguments)
    except TypeError as error:
        if kind == "robot" and "`predictor`" in str(error):
            raise
        raise ValueError(f"`partner` has arguments that a {kind} partner does not take: {error}") from error


class Game(NamedTuple):
    """The running game as a team looks at it; not copies.

    Attributes:
        layout: The kitchen.
        state: See :mod:`legible_envs.overcooked.game.vectors`, as the next two.
        kitchen: See there.
        rules: See there.
        goals: ``(2, H*W)`` each player's valid goals.
        look: Makes the partner's ``(observation, info)``.
    """

    layout: OvercookedLayout
    state: Vector
    kitchen: Kitchen
    rules: Vector
    goals: npt.NDArray[np.bool_]
    look: Callable[[], tuple[Any, dict[str, Any]]]


class Team:
    """A person and a partner in one kitchen.

    Before every tick the partner senses the game and decides; then both act at once. A partner that raises an error, or
    answers anything but an action, is reported once by a ``RuntimeWarning``; it stays for that tick, and the episode
    goes on.

    An agent *acts* in a tick in which its action changes something; its actions are told apart by how often its hands
    were emptied before. A partner that goes for nothing, and only steps aside, is idle. A *conflict* is one of two
    things, counted for every partner: the person took what the partner was going to fetch, and it is of no more use
    now; or one took what the other held already, of which only one was of use (``goals_lost``: a duplicated fetch).

    Args:
        partner: As of :func:`make_partner`.

    Attributes:
        partner: The partner.
        command: Its last answer.
        belief: ``{station: probability}`` of the present reach, or None.
        failure: The partner's first error, or None.
        ticks: The log so far, one line for each tick, as :class:`.TeamMetrics` takes it.
    """

    def __init__(self, partner: Partner) -> None:
        self.partner = partner
        self.command = Command(STAY)
        self.belief: dict[str, float] | None = None
        self.failure: str | None = None
        self.ticks: list[Tick] = []
        self._metrics = TeamMetrics()
        self._works = True
        self._before: Vector | None = None

    def begin(self, game: Game, rules: GameRules, rng: np.random.Generator) -> None:
        """Begin an episode.

        Raises:
            ValueError: A predictor that was given by name cannot be fitted in this kitchen.
        """
        self._metrics, self.ticks, self._time = TeamMetrics(), [], 0.0
        self._steps = 0
        self._cells = {name: cell for cell, name in enumerate(game.layout.goal_names)}
        self._kitchen, self._rules = game.kitchen.copy(), game.rules.copy()
        self._reaches = [ReachLog(game.layout, self._place(game, number)[0]) for number in (PERSON, PARTNER)]
        self._works = True
        if self.has_robot:
            self.partner.reset(game.layout, rules, rng)
        else:
            try:
                self.partner.reset(game.layout, rules, rng)
            except Exception as error:
                self._works = False
                self._report(error)
        self._sense(game, None)

    @property
    def has_robot(self) -> bool:
        """Whether the partner is a robot, not another person."""
        return isinstance(self.partner, RobotPartner)

    @property
    def action(self) -> int:
        """What the partner does in the coming tick."""
        return self.command.action

    def follow(self, game: Game, person_action: int, *, is_over: bool) -> None:
        """Note what happened in a tick, and let the partner decide about the next.

        Args:
            game: After the tick.
            person_action: What the person did.
            is_over: Whether the task is done.
        """
        before = self._before
        assert before is not None
        self._steps += 1
        time = self._steps * TICK
        active = [self._has_acted(before, game, number) for number in (PERSON, PARTNER)]
        reach = self._reaches[PERSON]
        conflict, lost = self._conflicts(before, game)
        tick = Tick(
            time=self._time,
            human=reach.emptied if active[PERSON] else None,
            robot=self._reaches[PARTNER].emptied if active[PARTNER] and self.command.target is not None else None,
            reach=reach.number if reach.start is not None or reach.taken is not None else 0,
            taken=reach.taken,
            predicted=self.command.predicted,
            choices=len(self._goals),
            conflict=conflict,
            lost=lost,
        )
        self.ticks.append(tick)
        self._metrics.add(tick)
        for number in (PERSON, PARTNER):
            self._reaches[number].follow(self._place_in(before, game, number), self._place(game, number), time)
        self._time = time
        if is_over:
            self._metrics.complete(self._time)
        self._sense(game, person_action)

    def summary(self) -> dict[str, float]:
        """Measures of the team so far, see :meth:`~legible_envs.partner.fluency.TeamMetrics.summary`."""
        return self._metrics.summary()

    @property
    def predictions(self) -> tuple[ReachPrediction, ...]:
        """How the partner predicted each reach that ended at a station."""
        return tuple(self._metrics.predictions)

    def info(self, layout: OvercookedLayout) -> dict[str, Any]:
        """The part of ``info`` about belief and partner; ``inf`` where a measure is not known yet."""
        belief = np.zeros(len(self._cells))
        for goal, probability in (self.belief or {}).items():
            if goal in self._cells:  # a partner of somebody else may believe in other things
                belief[self._cells[goal]] = probability
        target = self.command.target
        return {
            "belief": belief.reshape(layout.shape),
            **known_measures(self._metrics.summary()),
            "robot_target": -1 if target is None else self._cells.get(target, -1),
        }

    # -- the partner --------------------------------------------------------------------------------------------------

    def _sense(self, game: Game, person_action: int | None) -> None:
        self._before = game.state.copy()
        self._goals = self._reaches[PERSON].candidates(name_goals(game.layout, game.goals[PERSON]))
        self.command, self.belief = Command(STAY, state="wait"), None
        if not self._works:
            return
        try:
            self.command = _checked(self.partner.step(self._senses(game, person_action)))
        except Exception as error:
            self._report(error)
            return
        self.belief = None if self.command.belief is None else dict(self.command.belief)

    def _senses(self, game: Game, person_action: int | None) -> Senses:
        reach = self._reaches[PERSON]
        return Senses(
            time=self._time,
            layout=game.layout,
            state=game.state.copy(),
            kitchen=self._kitchen,
            rules=self._rules,
            reach=reach.points,
            times=reach.times,
            reach_number=reach.number,
            start=reach.start,
            goals=self._goals,
            person_goals=game.goals[PERSON].copy(),
            partner_goals=game.goals[PARTNER].copy(),
            person_action=person_action,
            look=game.look,
        )

    def _report(self, error: Exception) -> None:
        if self.failure is None:
            self.failure = f"{type(error).__name__}: {error}"
            warnings.warn(
                f"partner {type(self.partner).__name__} failed, so it stays where it is; later failures are not "
                f"reported: {self.failure}",
                RuntimeWarning,
                stacklevel=2,
            )

    # -- the log ------------------------------------------------------------------------------------------------------

    def _place(self, game: Game, number: int) -> tuple[Cell, int, int]:
        return self._place_in(game.state, game, number)

    @staticmethod
    def _place_in(state: Vector, game: Game, number: int) -> tuple[Cell, int, int]:
        """A player's cell, facing and item held."""
        at = AT_PLAYERS + 3 * number
        cell, facing, held = state[at : at + 3].tolist()
        return divmod(cell, game.layout.shape[1]), facing, held

    def _has_acted(self, before: Vector, game: Game, number: int) -> bool:
        return self._place_in(before, game, number) != self._place(game, number)

    def _conflicts(self, before: Vector, game: Game) -> tuple[bool, bool]:
        """Whether the person took what the partner went for, and whether one took what the other held already."""
        held = [int(before[AT_PLAYERS + 3 * number + 2]) for number in (PERSON, PARTNER)]
        holds = [int(game.state[AT_PLAYERS + 3 * number + 2]) for number in (PERSON, PARTNER)]
        took = [h == 0 and 0 < now <= DISH for h, now in zip(held, holds, strict=True)]
        both = all(0 < now <= DISH for now in holds)
        lost = any(took) and both and not self._are_needed(game.state, *holds)
        conflict = False
        cell = self._cells.get(self.command.target or "", -1)
        if took[PERSON] and not holds[PARTNER] and cell >= 0:
            wanted = int(item_at(before, game.kitchen, game.rules, cell))
            left = int(item_at(game.state, game.kitchen, game.rules, cell))
            gone = left != wanted or not self._are_needed(game.state, wanted, holds[PERSON])
            conflict = 0 < wanted <= DISH and gone and self._was_needed(before, wanted)
        return conflict, lost

    def _are_needed(self, state: Vector, one: int, other: int) -> bool:
        """Whether two items are both of use; yes where the one of them alone is of none."""
        if not self._was_needed(state, one) or not self._was_needed(state, other):
            return True
        return bool(needed_beside(state, self._rules, one, np.array([other])))

    def _was_needed(self, state: Vector, item: int) -> bool:
        return bool(needed_beside(state, self._rules, item, np.zeros(0, dtype=np.int64)))


def _checked(answer: object) -> Command:
    """A partner's answer.

    Raises:
        ValueError: Not a command with an action 0..5, or an action.
    """
    if not isinstance(answer, Command):
        return Command(read_action(answer))
    action, belief = read_action(answer.action), answer.belief
    for name in (answer.target, answer.predicted):
        if name is not None and not isinstance(name, str):
            raise ValueError(f"the target and the predicted goal of a command must be names, got {shown(name)}")
    if belief is not None:
        belief = {str(goal): float(p) for goal, p in belief.items()}
        if not all(0 <= p < math.inf for p in belief.values()):
            raise ValueError(f"the belief of a command must be probabilities, got {shown(answer.belief)}")
    return Command(action, answer.target, belief, answer.predicted, str(answer.state))
