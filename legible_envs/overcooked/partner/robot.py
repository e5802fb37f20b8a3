"""A robot that cooks with a person: it waits until it is sure what they fetch, then does something else that is needed.

An environment calls :meth:`RobotPartner.step` with what the robot senses before every tick. Any object with the two
methods of :class:`~legible_envs.overcooked.partner.interface.Partner` can take the robot's place.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from legible_envs.overcooked.game.dynamics import interaction, pot_at
from legible_envs.overcooked.game.vectors import COOK_TIME, DISH, INTERACT, NOTHING_HAPPENS, POT_CELL, STAY
from legible_envs.overcooked.humans.kernels import choose_action
from legible_envs.overcooked.partner.intent import IntentObserver
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, Command, Senses
from legible_envs.overcooked.partner.jobs import Job, choose_job
from legible_envs.overcooked.partner.manners import Manners
from legible_envs.overcooked.partner.ways import Floor
from legible_envs.support.validation import integer, real

if TYPE_CHECKING:
    from legible_envs.overcooked.game.rules import GameRules
    from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["RobotPartner"]

_TIE: Final = 1e-9


class RobotPartner:
    """A robot that cooks with a person, and does not do what they are about to do.

    It is *sure* of the person's goal when one is more probable than ``threshold``, or when it sees what they hold. With
    empty hands it takes the nearest of the things that are of use *beside* what the person brings (see
    :mod:`~legible_envs.overcooked.partner.needs`): one more onion is none where one is needed and the person fetches
    it. While it is not sure it takes only what is needed whatever the person fetches, and else waits. Its states:

    ========  ==============================================  ==========================================================
    state     action                                          end of it
    ========  ==============================================  ==========================================================
    wait      stands still, off the person's ways             something is needed: *fetch*
    fetch     goes to a station or counter, and takes         its hands are full: *use*; the person takes it, or is sure
                                                              to bring what is needed once: *wait*
    use       puts an ingredient in the pot, waits there      its hands are empty: *wait*
              with a dish for the soup, serves it
    away      puts back, or on a counter, what is of no use   its hands are empty: *wait*
    yield     steps aside for the person                      they have passed, or after ``hold`` ticks
    ========  ==============================================  ==========================================================

    **Ways.** It walks by shortest paths round the person, and lets them go first where both want to step on a cell.
    When they walk against it, or stand before it for ``hold`` ticks without another way to any of their goals, it steps
    aside: to the nearest cell that lies on no shortest path of theirs, or back to where one branches off. While it
    waits it keeps off these paths, too, so that it blocks no doorway for long; and it does not go into a dead end one
    cell wide while the person could soon stand at its mouth. What it cannot help: a person who stands for good where it
    has to pass, or walks against it for good in a kitchen without a way round.

    All of it is deterministic.

    Args:
        predictor: Predicts what the person fetches: None or ``"bayesian"`` for the built-in Bayesian goal inference,
            the name of another predictor, ``"module:Class"``, or a predictor; see
            :class:`~legible_envs.overcooked.partner.intent.IntentObserver`. Where it fails the robot is not sure, and
            the episode goes on.
        threshold: Probability that a goal must exceed, 0 to 1. 0: it goes by whatever goal is most probable (of tied
            ones by the first in reading order); 1: it never predicts, and goes by what the person holds.
        patience: Ticks after which it no longer waits for a person who stands still.
        hold: Ticks that a person stands before it until it steps aside, and that it then stays aside at most.

    Attributes:
        failure: The first error of the predictor, or None.

    Raises:
        ValueError: An argument out of range, or a predictor that cannot be imported.
        TypeError: An object that is no predictor.
    """

    def __init__(self, predictor: object = None, *, threshold: float = 0.8, patience: int = 20, hold: int = 4) -> None:
        self.threshold = real("the robot's `threshold`", threshold, 0, 1)
        self.patience = integer("the robot's `patience`", patience, 1, 10_000)
        self.hold = integer("the robot's `hold`", hold, 1, 10_000)
        self._observer = IntentObserver(predictor)

    def __repr__(self) -> str:
        return f"RobotPartner({self._observer.name}, threshold={self.threshold!r}, patience={self.patience!r})"

    @property
    def failure(self) -> str | None:
        """The first error of the predictor, or None."""
        return self._observer.failure

    def reset(self, layout: OvercookedLayout, rules: GameRules, rng: np.random.Generator | None = None) -> None:
        """Begin an episode.

        Args:
            layout: The kitchen.
            rules: The rules of the game.
            rng: Ignored: this robot does nothing at random.

        Raises:
            ValueError: A predictor that was given by name cannot be fitted in this kitchen.
        """
        self._observer.reset(layout, rules)
        self._names = layout.goal_names
        self._number = {name: cell for cell, name in enumerate(self._names)}
        self._floor: Floor | None = None
        self._manners = Manners(self.hold)
        self._job = Job()
        self._last = (-1, STAY)

    def step(self, senses: Senses) -> Command:
        """What to do in this tick."""
        floor = self._floor = self._floor or Floor(senses.kitchen, senses.rules)
        self._manners.see(senses)
        belief = self._observer.observe(senses)
        predicted = None if belief is None else self._sure_of(belief)
        station = -1 if predicted is None else self._number[predicted]
        impatient = self._manners.stood >= self.patience
        self._job = choose_job(senses, floor, self._job, station, impatient=impatient)
        here = senses.player(PARTNER)[0]
        action = self._walk(senses, floor)
        if action != INTERACT:  # what is done with one more tick is done before making way
            action = self._give_way(senses, floor, belief, action)
            if action < STAY and self._last == (here, action) and floor.open[floor.beside(here, action)]:
                action = STAY  # both wanted to step on the same cell: the person goes first
        self._last = here, action
        if self._manners.is_aside or self._job.target < 0:
            return Command(action, None, belief, predicted, "yield" if self._manners.is_aside else "wait")
        return Command(action, self._names[self._job.target], belief, predicted, self._job.state)

    def _walk(self, senses: Senses, floor: Floor) -> int | None:
        """The next action on the way to the target, round the person and not against them; None where there is none."""
        here, facing, _ = senses.player(PARTNER)
        person, target = senses.player(PERSON)[0], self._job.target
        if target < 0:
            return None
        can_interact = interaction(senses.state, senses.kitchen, senses.rules, PARTNER) != NOTHING_HAPPENS
        steps = floor.way(target, here, person, stands=self._manners.stood >= self.hold)
        if steps[here] > 0:
            ticks = int(steps[here]) + 1 + self._ticks_to_wait(senses)
            if self._manners.is_kept_out(senses, floor, floor.access(steps, here), ticks, self.patience):
                return None
        action = int(choose_action(here, facing, target, steps, floor.height, floor.width, can_interact, 0.0))
        return STAY if action < STAY and floor.beside(here, action) == person else action

    def _ticks_to_wait(self, senses: Senses) -> int:
        """How long the soup that the robot is going to take still cooks."""
        state, rules = senses.state, senses.rules
        if senses.kitchen[self._job.target] != POT_CELL or senses.player(PARTNER)[2] != DISH:
            return 0
        return max(0, int(rules[COOK_TIME] - state[pot_at(state, rules, self._job.target) + 5]))

    def _give_way(self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None, action: int | None) -> int:
        self._manners.leave_pocket(senses, floor, belief)
        aside = self._manners.make_way(senses, floor, belief)
        if aside is not None:
            return aside
        return self._manners.keep_off(senses, floor, belief) if action is None else action

    def _sure_of(self, belief: Mapping[str, float]) -> str | None:
        most = max(belief.values())
        if not most > self.threshold:
            return None
        return min((goal for goal, p in belief.items() if p >= most - _TIE), key=lambda goal: self._number[goal])
