"""Simulated participants in kitchens: models of how people walk, differences between them, and whole tasks.

:class:`BoltzmannWalker` is the noisily rational walker that ``human="boltzmann"`` scores and
:func:`fit_rationality` fits to recorded play. :class:`PlannerWalker` errs for other reasons: it sees only a few steps
ahead, dislikes turning, and avoids where it has just been. :class:`~legible_envs.overcooked.humans.ClonedWalker` walks
as recorded people were seen to. A layout, or a predictor, that was made with one model should be evaluated with the
others, too.

All walk from station to station: floor cells, then the goal station. Time passes in ticks. Before each step a person
stands idle or looks around for a while (each tick with probability ``idle`` and ``turn``); a step takes a tick and
turns the person, using the goal takes one, and one more where the person does not face it. In recorded play the
ticks of a trajectory are moves (23 %), turns on the spot (6 %), idle (63 %) and uses of stations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.humans.cloning import ClonedWalker
from legible_envs.overcooked.humans.fitting import (
    RationalityFit,
    RationalitySpread,
    fit_rationality,
    rationality_spread,
)
from legible_envs.overcooked.humans.kernels import BOLTZMANN, PLANNER
from legible_envs.overcooked.humans.walker import Walker, draw_one, draw_preferences, nearest_first
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.reach import Reach, reach_of
from legible_envs.overcooked.recipes import soup_task
from legible_envs.overcooked.scoring.boltzmann import DEFAULT_RATIONALITY
from legible_envs.rollouts.counts import check_participants
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import integer, real
from legible_envs.tasks import TaskGraph

__all__ = [
    "BoltzmannWalker",
    "PlannerWalker",
    "RationalityFit",
    "RationalitySpread",
    "Walker",
    "fit_rationality",
    "rationality_spread",
    "simulate_participants",
]

Floats = npt.NDArray[np.float64]


class BoltzmannWalker(Walker):
    r"""A noisily rational person: a local softmax over steps.

    From floor cell ``a``, the next step leads to ``b`` with probability
    ``P(b | a, G) ∝ exp(-rationality * (cost(b) + C*(b -> G)))``, where ``b`` is a free neighbouring cell (back, too)
    or, where it is beside ``a``, the goal station with ``cost = 1`` and ``C* = 0``. Standing still is no step; ``idle``
    and ``turn`` say how time passes. With ``preferences`` costs are this person's own; to an observer who does not know
    them, this person has unusual habits.

    Args:
        rationality: Per unit of cost; 0 walks at random. 1.1 to 1.7 in recorded play.
        **arguments: Of every :class:`Walker`: ``preferences``, ``idle``, ``turn``, ``tick``.

    Example:
        >>> import numpy as np
        >>> kitchen = OvercookedLayout.from_ascii("XOXXTX\nX    X\nXXXXSX")
        >>> BoltzmannWalker(rationality=9).walk(kitchen, "serving", "onion", np.random.default_rng(0))
        [(1, 4), (1, 3), (1, 2), (1, 1), (0, 1)]
    """

    kind = BOLTZMANN

    def __init__(self, rationality: float = DEFAULT_RATIONALITY, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.rationality = real("rationality", rationality, 0)

    @property
    def params(self) -> Floats:
        """``[rationality]``."""
        return np.array([self.rationality])

    def _parameters(self) -> tuple[str, ...]:
        return ("rationality", *super()._parameters())

    @classmethod
    def draw(
        cls,
        shape: tuple[int, int],
        rng: np.random.Generator,
        *,
        rationality: float = DEFAULT_RATIONALITY,
        spread: float = 0.35,
        preference: float = 0.2,
        **arguments: Any,
    ) -> BoltzmannWalker:
        """A random person.

        Args:
            shape: Of the kitchens the person has preferences in.
            rng: Source of randomness.
            rationality: Of the median person.
            spread: Standard deviation of log rationality between participants. :func:`rationality_spread` finds .13,
                .22, .40 and .25 in the four recorded kitchens.
            preference: Standard deviation of the log cost of each cell; 0 for a person without preferences.
            **arguments: Of every :class:`Walker`: ``idle``, ``turn``, ``tick``.
        """
        own = real("rationality", rationality, 0) * math.exp(real("spread", spread, 0) * rng.normal())
        return cls(own, preferences=draw_preferences(shape, rng, preference), **arguments)


class PlannerWalker(Walker):
    """A person who plans a few steps ahead, dislikes turning, and avoids where it was just before.

    At each step all paths of ``depth`` steps are compared (shorter ones that end in the goal, too) by the cost of their
    cells, ``turn_cost`` for every change of direction, ``recency`` times the memory of every cell on them, and the
    beeline (Manhattan distance) from their end to the goal: the person does not know what lies behind the next corner.
    They take the first step of a best path, ties broken at random; with probability ``slip`` any step. The memory of a
    cell grows by 1 with each visit and fades by ``fade`` with each step. In a kitchen with dead ends this person walks
    into them.

    Args:
        depth: Steps looked ahead, 1 to 6.
        turn_cost: Cost of a change of direction.
        recency: Cost of a cell that was just visited.
        fade: What is left of a memory after a step, in [0, 1).
        slip: Probability of a random step, in [0, 1]. With 0, they may circle for ever in kitchens with dead ends.
        **arguments: Of every :class:`Walker`: ``preferences``, ``idle``, ``turn``, ``tick``.
    """

    kind = PLANNER

    def __init__(
        self,
        depth: int = 3,
        turn_cost: float = 0.5,
        recency: float = 1.0,
        fade: float = 0.8,
        slip: float = 0.08,
        **arguments: Any,
    ) -> None:
        super().__init__(**arguments)
        self.depth = integer("depth", depth, 1, 6)
        self.turn_cost = real("turn_cost", turn_cost, 0)
        self.recency = real("recency", recency, 0)
        self.fade = real("fade", fade, 0, 1, closed="left")
        self.slip = real("slip", slip, 0, 1)

    @property
    def params(self) -> Floats:
        """``[depth, turn_cost, recency, fade, slip]``."""
        return np.array([self.depth, self.turn_cost, self.recency, self.fade, self.slip])

    def _parameters(self) -> tuple[str, ...]:
        return ("depth", "turn_cost", "recency", "fade", "slip", *super()._parameters())

    @classmethod
    def draw(
        cls, shape: tuple[int, int], rng: np.random.Generator, *, preference: float = 0.2, **arguments: Any
    ) -> PlannerWalker:
        """A random person: looks 2 to 4 steps ahead, dislikes turns more or less, slips in 2 to 15 % of steps.

        Args:
            shape: Of the kitchens the person has preferences in.
            rng: Source of randomness.
            preference: Standard deviation of the log cost of each cell.
            **arguments: Given instead of drawn: arguments of the class.
        """
        drawn = {
            "depth": int(rng.integers(2, 5)),
            "turn_cost": float(0.5 * np.exp(0.5 * rng.normal())),
            "slip": float(rng.uniform(0.02, 0.15)),
        }
        return cls(preferences=draw_preferences(shape, rng, preference), **{**drawn, **arguments})


PopulationName = Literal["boltzmann", "planner", "cloned"]
_POPULATIONS: Final[Mapping[str, Callable[..., Walker]]] = {
    "boltzmann": BoltzmannWalker.draw,
    "planner": PlannerWalker.draw,
    "cloned": ClonedWalker.draw,
}


def simulate_participants(
    layout: OvercookedLayout,
    n: int,
    rng: np.random.Generator,
    *,
    task: TaskGraph | None = None,
    player: int = 1,
    population: PopulationName | Callable[..., Walker] | None = None,
    executions: int = 1,
    participant: str = "person",
    condition: str = "simulated",
    layout_name: str = "",
    **settings: Any,
) -> list[Trajectory]:
    """Trajectories of simulated participants who each do a whole task, in a uniformly random valid sequence.

    At each stage of the task (start, valid goals) the person walks from the cell they stand on to the goal of the
    sequence: that is a trajectory, with the valid goals as candidates (candidate set ``task``). The legs that follow,
    such as back to the pot, take their time, but leave nothing to predict and give no trajectory; nothing waits for
    the cooking. Where a type of station repeats, each one in reach is a goal, equally likely; other stops are the
    nearest of their type. What is out of the player's reach is no goal (:mod:`legible_envs.overcooked.reach`).

    Args:
        layout: The kitchen.
        n: Number of participants, at most 100,000.
        rng: Source of all randomness.
        task: The task over station types; the paper's three soups if None.
        player: Whose part of the kitchen the participants are in, by the number of their start.
        population: Each participant is drawn anew from it: ``"boltzmann"`` (also None), ``"planner"`` or ``"cloned"``,
            or a callable that makes one participant's walker, called with (shape, rng).
        executions: How often each participant does the task; all together do at most a million.
        participant: Names are ``"{participant}/0"``, ``"{participant}/1"``, ….
        condition: Of all trajectories.
        layout_name: Of all trajectories.
        **settings: Of the population: arguments of :meth:`BoltzmannWalker.draw`, :meth:`PlannerWalker.draw` or
            :meth:`ClonedWalker.draw <legible_envs.overcooked.humans.ClonedWalker.draw>`.

    Raises:
        LayoutError: The player cannot do the task in this kitchen (names types and places), or there is no such player.
        ValueError: Unknown population, or a number out of range.
    """
    task = task or soup_task()
    if population is None:
        population = "boltzmann"
    n, executions = check_participants(n, executions)
    if isinstance(population, str) and population not in _POPULATIONS:
        raise ValueError(f"`population` must be one of {list(_POPULATIONS)} or a callable, got {population!r}")
    reach = reach_of(layout, player)
    reach.check_task(task)
    draw = _POPULATIONS[population] if isinstance(population, str) else population
    found: list[Trajectory] = []
    for number in range(n):
        person = draw(layout.shape, rng, **settings)
        labels = {"participant": f"{participant}/{number}", "condition": condition, "layout_name": layout_name}
        clock = 0
        for _ in range(executions):
            done, clock = _execute(reach, task, person, clock, rng, labels)
            found += done
    return found


def _execute(
    reach: Reach,
    task: TaskGraph,
    person: Walker,
    clock: int,
    rng: np.random.Generator,
    labels: Mapping[str, Any],
) -> tuple[list[Trajectory], int]:
    """One task execution: its trajectories, and the tick at its end."""
    layout, places = reach.layout, reach.named(task.start)
    place = places[int(rng.integers(len(places)))]
    cell = draw_one(reach.access(place), place, rng)
    found = []
    for step in task.sample(rng):
        candidates = tuple(name for kind in step.goals for name in nearest_first(reach, cell, kind))
        goals = [name for name in candidates if name in reach.named(step.goal)]
        goal = goals[int(rng.integers(len(goals)))]
        states, ticks = person.leg(layout, cell, place, goal, rng)
        found.append(
            Trajectory(
                states=states,
                times=person.seconds(clock + ticks),
                start=place,
                goal=goal,
                candidates=candidates,
                layout=layout,
                candidate_set="task",
                **labels,
            )
        )
        clock += int(ticks[-1])
        place, cell = goal, (int(states[-2][0]), int(states[-2][1]))
        for kind in step.then:
            stop = nearest_first(reach, cell, kind)[0]
            states, ticks = person.leg(layout, cell, place, stop, rng)
            clock += int(ticks[-1])
            place, cell = stop, (int(states[-2][0]), int(states[-2][1]))
    return found, clock
