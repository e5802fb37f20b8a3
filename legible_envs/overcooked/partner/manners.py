"""How a robot makes way for a person in the kitchen: when it steps aside, where to, and for how long."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from legible_envs.overcooked.game.vectors import STAY
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, Senses
from legible_envs.overcooked.partner.ways import Floor

__all__ = ["Manners"]

_NEAR = 3
"""Steps; one who is farther away than this is in nobody's way."""
_SOME = 0.01
"""Weight of a goal that the belief does not speak of, beside probabilities."""


class Manners:
    """Keeps track of whether the robot is in the person's way.

    Args:
        hold: Ticks that a person stands before the robot until it steps aside, and that it then stays aside at most.
    """

    def __init__(self, hold: int) -> None:
        self._hold = hold
        self.stood = 0
        self._person_at = -1
        self._refuge = -1
        self._left = 0
        self._kept = 0

    @property
    def is_aside(self) -> bool:
        """Whether the robot steps aside, or waits there."""
        return self._refuge >= 0

    def see(self, senses: Senses) -> None:
        """Look at the person: ``stood`` is then for how many ticks they have not moved."""
        person = senses.player(PERSON)[0]
        self.stood = self.stood + 1 if person == self._person_at else 0
        self._person_at = person

    def make_way(self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None) -> int | None:
        """The action that makes way for the person; None where none is due."""
        here, person = senses.player(PARTNER)[0], senses.player(PERSON)[0]
        pushed = self._is_pushed(senses, floor, here, person)
        if pushed or (not self.is_aside and self._is_waited_for(senses, floor, here, person)):
            self._begin(senses, floor, belief)
        if not self.is_aside:
            return None
        if here != self._refuge:
            action = _step(floor, here, self._refuge, person)
            if action is not None:
                return action
            self._refuge = -1
            return None
        self._left -= 1
        if self._left < 0 or int(floor.steps_from(person)[here]) > _NEAR:
            self._refuge = -1
            return None
        return STAY

    def keep_off(self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None) -> int:
        """What an idle robot does: goes off the ways of a person who is near, and stays there."""
        here, person = senses.player(PARTNER)[0], senses.player(PERSON)[0]
        is_near = 0 <= int(floor.steps_from(person)[here]) <= _NEAR
        if not is_near and not floor.depth[here]:
            return STAY
        goals, weights = self._goals(senses, floor, belief, here=-1)
        if floor.depth[person]:  # they have to get out again
            goals, weights = [*goals, int(floor.mouth[person])], [*weights, 1.0]
        cost = floor.in_the_way(person, goals, weights)
        if cost[here] == 0 and not floor.depth[here]:
            return STAY
        refuge = floor.refuge(here, person, cost)
        is_better = cost[refuge] < cost[here] or floor.depth[refuge] < floor.depth[here]
        action = _step(floor, here, refuge, person) if is_better else STAY
        return STAY if action is None else action

    def is_kept_out(self, senses: Senses, floor: Floor, access: int, ticks: int, patience: int) -> bool:
        """Whether to stay out of a pocket: in it is the person, or they could come to its mouth too soon.

        Args:
            senses: What the robot senses.
            floor: Of the kitchen.
            access: Where the robot is to go.
            ticks: How long it takes to go there and do what is to be done.
            patience: After so many ticks, only a person who goes for something in the pocket is waited for; none who
                stood still for so long.
        """
        here, person = senses.player(PARTNER)[0], senses.player(PERSON)[0]
        mouth, depth = int(floor.mouth[access]), int(floor.depth[access])
        if not depth or (floor.depth[here] and floor.mouth[here] == mouth):
            self._kept = 0
            return False
        self._kept += 1
        if floor.mouth[person] == mouth:
            return True
        if self.stood > patience or not 0 <= int(floor.steps_from(person)[mouth]) <= ticks + depth + 1:
            return False
        goals = np.flatnonzero(senses.person_goals).tolist()
        return self._kept <= patience or floor.in_the_way(person, goals, [1.0] * len(goals))[access] > 0

    def leave_pocket(self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None) -> None:
        """Begin to leave a pocket in time, if the person is about to come in."""
        here, person = senses.player(PARTNER)[0], senses.player(PERSON)[0]
        depth, mouth = int(floor.depth[here]), int(floor.mouth[here])
        if self.is_aside or not depth or floor.mouth[person] == mouth:
            return
        if int(floor.steps_from(person)[mouth]) > depth + 2:
            return
        goals, weights = self._goals(senses, floor, belief, here=-1)
        if floor.in_the_way(person, goals, weights)[here] > 0:
            self._begin(senses, floor, belief)

    def _is_pushed(self, senses: Senses, floor: Floor, here: int, person: int) -> bool:
        """Whether the person walks against the robot."""
        direction = senses.person_action
        if direction is None or direction >= STAY or self.stood == 0:
            return False
        return floor.beside(person, direction) == here

    def _is_waited_for(self, senses: Senses, floor: Floor, here: int, person: int) -> bool:
        """Whether the person has stood for a while before a robot that is in all their ways."""
        if self.stood < self._hold or floor.steps_from(person)[here] != 1:
            return False
        return floor.blocks(here, person, np.flatnonzero(senses.person_goals).tolist())

    def _begin(self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None) -> None:
        here, person = senses.player(PARTNER)[0], senses.player(PERSON)[0]
        goals, weights = self._goals(senses, floor, belief, here)
        cost = floor.in_the_way(person, goals, weights)
        cost[here] = np.inf
        self._refuge = floor.refuge(here, person, cost)
        self._left = self._hold

    def _goals(
        self, senses: Senses, floor: Floor, belief: Mapping[str, float] | None, here: int
    ) -> tuple[list[int], list[float]]:
        """The person's goals and how likely they are; only those that lie behind the robot, if any do."""
        goals = np.flatnonzero(senses.person_goals).tolist()
        if here >= 0:
            person = senses.player(PERSON)[0]
            behind = [goal for goal in goals if 0 < floor.steps_from(goal)[here] < floor.steps_from(goal)[person]]
            goals = behind or goals
        if belief is None:
            return goals, [1.0] * len(goals)
        names = senses.layout.goal_names
        return goals, [belief.get(names[goal], 0.0) + _SOME for goal in goals]


def _step(floor: Floor, here: int, there: int, person: int) -> int | None:
    """The first step of a shortest way over the floor that does not lead past the person; None without any."""
    steps = floor.steps_from(there, without=person)
    for direction in range(4):
        after = floor.beside(here, direction)
        if after >= 0 and 0 <= steps[after] < steps[here]:
            return direction
    return None
