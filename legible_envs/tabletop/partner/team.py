"""The person's team at the table: an observer that only predicts, or a robot that also acts."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.partner.fluency import TeamMetrics, known_measures, tick_of
from legible_envs.support.plugins import import_target
from legible_envs.support.validation import shown
from legible_envs.tabletop.game.game import DT, RATE, TableGame
from legible_envs.tabletop.partner.intent import IntentObserver
from legible_envs.tabletop.partner.interface import Command, Partner, Senses, gripper_home
from legible_envs.tabletop.partner.robot import RobotPartner

__all__ = ["GRIPPER_SPEED", "Team", "make_partner"]

GRIPPER_SPEED: Final = 1.0
"""No gripper is faster, m/s."""

GRIPPER_REACH: Final = 0.03
"""How near to an object or its place a gripper can close or open, m."""

_IDLE_SPEED: Final = 0.01


def make_partner(spec: object, predictor: object, threshold: float) -> Partner:
    """A robot partner from what a user names.

    Args:
        spec: ``"robot"``; a mapping of arguments of :class:`~legible_envs.tabletop.partner.robot.RobotPartner`;
            ``"module:Class"``, made without arguments; or an object with ``reset`` and ``step``, which is copied.
        predictor: The predictor of a ``RobotPartner``.
        threshold: Of a ``RobotPartner``.

    Raises:
        ValueError: It cannot be imported or made.
        TypeError: It is no partner.
    """
    if isinstance(spec, str) and spec == "robot":
        spec = {}
    if isinstance(spec, Mapping):
        try:
            return RobotPartner(predictor, **{"threshold": threshold, "rate": float(RATE), **spec})
        except TypeError as error:
            raise ValueError(f"`partner` has arguments that RobotPartner does not take: {error}") from error
    if predictor is not None:
        raise ValueError("`predictor` is for partner='robot'; a partner of your own brings its own")
    if isinstance(spec, str):
        if ":" not in spec:
            raise ValueError(f"`partner` must be None, 'robot', a mapping, 'module:Class' or an object, got {spec!r}")
        try:
            spec = import_target(spec)()
        except Exception as error:
            raise ValueError(f"partner {spec!r} cannot be made: {type(error).__name__}: {error}") from error
    if isinstance(spec, type) or not all(callable(getattr(spec, name, None)) for name in ("reset", "step")):
        raise TypeError(f"a `partner` must be an object with the methods `reset` and `step`, got {shown(spec)}")
    return copy.deepcopy(spec)  # type: ignore[return-value]  # has the methods


class Team:
    """A robot or an observer that shares the table with the person.

    Time goes in ticks: the team senses at the end of each; a robot's command holds for the next tick.

    Args:
        partner: As of :func:`make_partner`, or None.
        observer: Used where there is no partner; may be None too.

    Attributes:
        gripper: ``(x, y)``, or None where there is no robot.
        velocity: ``(x, y)`` of the gripper in the last tick, m/s.
        command: The robot's last command, or None.
        belief: ``{goal: probability}`` of the present reach, or None.
    """

    def __init__(self, partner: Partner | None = None, observer: IntentObserver | None = None) -> None:
        self.partner = partner
        self.observer = observer
        self.gripper: tuple[float, float] | None = None
        self.velocity = (0.0, 0.0)
        self.command: Command | None = None
        self.belief: dict[str, float] | None = None
        self._metrics = TeamMetrics()
        self._senses: Senses | None = None
        self._lost = False

    @property
    def is_there(self) -> bool:
        """Whether there is a partner or an observer."""
        return self.partner is not None or self.observer is not None

    def begin(self, game: TableGame, rng: np.random.Generator) -> None:
        """Begin an episode."""
        if self.observer is not None:
            self.observer.reset(game.layout, game.task)
        if self.partner is not None:
            at = self.partner.reset(game.layout, game.task, rng)
            self.gripper = gripper_home(game.layout) if at is None else _pair(at, "what a partner's `reset` returns")
            self.velocity = (0.0, 0.0)
            self._metrics = TeamMetrics()
        self.sense(game)

    def instruct(self, command: Command) -> None:
        """Give the robot another command for the next tick than the one it chose."""
        self.command = command

    def act(self, game: TableGame) -> int:
        """Carry out the robot's command for one tick; returns how many subtasks this finished."""
        command = self.command
        if command is None or self.gripper is None:
            return 0
        done = 0
        wanted, held = game.goal, game.robot_holding
        if command.release:
            done = game.robot_put(self.gripper, GRIPPER_REACH)
        if command.grasp is not None and command.grasp in game.index:
            there = game.positions[game.index[command.grasp]]
            if math.dist(self.gripper, there) <= GRIPPER_REACH:
                game.robot_take(command.grasp)
        self._lost = wanted is not None and game.robot_holding == game.index[wanted] != held
        self._move(command, game)
        return done

    def log(self, game: TableGame, has_acted: bool) -> None:
        """Add the tick that ends now to the log.

        Args:
            game: As it is at the end of the tick.
            has_acted: Whether the person took or placed something in it.
        """
        if self._senses is not None and self.command is not None:
            active = has_acted or game.speed > _IDLE_SPEED
            self._metrics.add(tick_of(self._senses, self.command, active, self._lost))
            if game.progress.is_over:
                self._metrics.complete(game.time)

    def sense(self, game: TableGame) -> None:
        """Look at the table as it is now."""
        if not self.is_there:
            return
        senses = self._sensed(game)
        if self.partner is not None:
            self._senses, self.command = senses, self.partner.step(senses)
            belief = self.command.belief
        else:
            assert self.observer is not None
            belief = self.observer.observe(senses) if senses.person_holding is None or senses.goals else None
        self.belief = None if belief is None else {goal: float(p) for goal, p in belief.items()}

    def info(self, index: Mapping[str, int]) -> dict[str, Any]:
        """The part of ``info`` about belief and robot; ``inf`` where a measure is not known yet.

        Args:
            index: Number of each object.
        """
        if not self.is_there:
            return {}
        belief = np.zeros(len(index))
        for goal, probability in (self.belief or {}).items():
            if goal in index:  # a partner of somebody else may believe in other things
                belief[index[goal]] = probability
        info: dict[str, Any] = {"belief": belief}
        if self.command is not None:
            info |= known_measures(self._metrics.summary())
            target = self.command.target
            info["robot_target"] = -1 if target is None else index.get(target, -1)
        return info

    def summary(self) -> dict[str, float]:
        """Measures of the team so far, see :meth:`~legible_envs.partner.fluency.TeamMetrics.summary`."""
        return self._metrics.summary()

    def _move(self, command: Command, game: TableGame) -> None:
        assert self.gripper is not None
        x, y = _pair(command.velocity, "the velocity of a command")
        speed = math.hypot(x, y)
        if speed > GRIPPER_SPEED:
            x, y = x * GRIPPER_SPEED / speed, y * GRIPPER_SPEED / speed
        width, depth = game.layout.table.size
        there = min(max(self.gripper[0] + x * DT, 0.0), width), min(max(self.gripper[1] + y * DT, 0.0), depth)
        self.velocity = (there[0] - self.gripper[0]) * RATE, (there[1] - self.gripper[1]) * RATE
        self.gripper = there
        game.carry_along(there)

    def _sensed(self, game: TableGame) -> Senses:
        held, gripped = game.holding, game.robot_holding
        reaches = game.reaches
        gripper = game.hand if self.gripper is None else self.gripper
        return Senses(
            time=game.time,
            hand=np.array(game.hand),
            reach=reaches.points,
            times=reaches.times,
            reach_number=reaches.number,
            start=reaches.points[0],
            goals=game.goals,
            free=game.robot_goals,
            positions=game.positions.copy(),
            person_holding=game.names[held] if held >= 0 else None,
            gripper=np.array(gripper),
            holding=game.names[gripped] if gripped >= 0 else None,
        )


def _pair(value: npt.ArrayLike, what: str) -> tuple[float, float]:
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (2,) or not np.isfinite(array).all():
        raise ValueError(f"{what} must be two finite numbers, got {value!r}")
    return float(array[0]), float(array[1])
