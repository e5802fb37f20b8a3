"""A round at a table: the pointer is the hand."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.layout import TabletopLayout

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["TableGame", "velocity_to"]

RATE: Final = 30
MAX_SPEED: Final = 3.0
"""The environment's default, m/s."""


def velocity_to(hand: tuple[float, float], target: tuple[float, float], max_speed: float = MAX_SPEED) -> list[float]:
    """The action that takes the hand to a point within a step, or towards it as fast as it may go.

    Args:
        hand: ``(x, y)`` in metres.
        target: The same.
        max_speed: Of the hand, m/s.

    Returns:
        ``[vx, vy]`` in units of ``max_speed``, of length 1 at most, each rounded to float32: the same numbers on every
        machine, in the database and in a replay.
    """
    reach = max_speed / RATE
    x, y = (target[0] - hand[0]) / reach, (target[1] - hand[1]) / reach
    length = math.hypot(x, y)
    if length > 1.0:
        x, y = x / length, y / length
    return [float(np.float32(x)), float(np.float32(y))]


class TableGame:
    """A round at a table; see :class:`~benchmarks.study.games.base.Game`.

    Args:
        layout: JSON of the layout.
        task: As ``LegibleTabletop-v0`` takes it.
        partner: Arguments of the environment for the robot: ``partner``, ``predictor``, ``threshold``; None: alone.
        predictor: Whose belief is followed where there is no robot; None: nobody's.
        obstacles: Whether the layout's virtual obstacles are there.
        reaches: The round ends once the participant has put down so many objects; 0: when the task is done.
        max_steps: The round ends after so many.
        seed: Of the environment.
        **settings: Of the environment: ``virtual_obstacles, contact, slow_speed, grasp_distance, release_distance``.
    """

    def __init__(
        self,
        layout: str,
        *,
        task: object = "columns",
        partner: Mapping[str, Any] | None = None,
        predictor: object = None,
        obstacles: bool = True,
        reaches: int = 0,
        max_steps: int = 1800,
        seed: int = 0,
        **settings: Any,
    ) -> None:
        table = TabletopLayout.from_json(layout)
        self.layout = table if obstacles else table.with_obstacles(())
        robot = dict(partner) if partner is not None else {"predictor": predictor}
        self.env = TabletopEnv(
            task=task,
            layout=self.layout,
            max_obstacles=max(4, len(self.layout.obstacles)),
            max_speed=MAX_SPEED,
            **robot,
            **settings,
        )
        self.wanted = reaches
        self.max_steps = max_steps
        self.steps = 0
        self.finished = False
        self.obs, self.info = self.env.reset(seed=seed)

    @property
    def reaches(self) -> int:
        """Objects that the participant has taken and, where they belong somewhere, put down."""
        made = len(self.env.game.reaches.finished)
        return made - (1 if self.env.holding is not None else 0)

    @property
    def is_over(self) -> bool:
        """Whether the task is done, the reaches that are wanted are made, or ``max_steps`` are taken."""
        return self.finished or self.steps >= self.max_steps or bool(self.wanted and self.reaches >= self.wanted)

    def read_action(self, value: object) -> list[float]:
        """The action of a message: two finite numbers, rounded to float32."""
        if not isinstance(value, list) or len(value) != 2:
            raise ValueError(f"an action at a table is [vx, vy], got {value!r:.80}")
        with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, and is refused as such
            pair = [float(np.float32(v)) for v in value if type(v) in (int, float) and math.isfinite(v)]
        if len(pair) != 2 or not all(math.isfinite(v) for v in pair):
            raise ValueError(f"an action at a table is two finite numbers, got {value!r:.80}")
        return pair

    def action_to(self, x: float, y: float) -> list[float]:
        """The action that takes the hand to a point, as far as its speed allows."""
        return velocity_to(self.env.game.hand, (x, y))

    def step(self, action: Any) -> None:
        """Take a step of 1/30 s."""
        if self.is_over:
            raise ValueError("the round is over")
        self.obs, _, self.finished, _, self.info = self.env.step(np.array(action, dtype=np.float32))
        self.steps += 1

    def digest(self) -> str:
        """Of the observation, and of positions, hand, speeds and gripper in full precision."""
        game, team = self.env.game, self.env.team
        rest = [*game.hand, *game.velocity, game.path_length, *(team.gripper or ()), *team.velocity]
        content = b"".join(
            [
                self.obs.tobytes(),
                game.positions.tobytes(),
                game.physics.angles.tobytes(),
                game.status.tobytes(),
                np.array(rest, dtype=np.float64).tobytes(),
                json.dumps([game.crossings, self.steps, self.env.robot_state, self.env.robot_target]).encode(),
            ]
        )
        return blake2b(content, digest_size=8).hexdigest()

    def scene(self) -> dict[str, Any]:
        """``kind, layout`` (as its JSON), ``slots`` (``{name: [x, y]}``), ``rate``, ``hand`` (radius), ``robot``."""
        return {
            "kind": "table",
            "layout": self.layout.to_dict(),
            "slots": {name: list(at) for name, at in self.env.task.configuration.items()},
            "rate": RATE,
            "hand": self.layout.table.hand,
            "slow_speed": self.env.settings.rules.slow_speed,
            "soft": self.env.settings.rules.virtual_obstacles == "soft",
            "robot": self.env.team.gripper is not None,
            "wanted": self.wanted,
            "max_steps": self.max_steps,
        }

    def state(self, belief: bool = False) -> dict[str, Any]:
        """What the page draws.

        Returns:
            ``n, over``; ``positions`` (``[x, y, angle]`` of each object), ``status`` (0 free, 1 hand, 2 robot, 3
            placed), ``goals`` (mask), ``hand`` (``[x, y]``), ``holding`` (index or -1), ``low``, ``carry_to``
            (``[x, y]`` or None), ``robot`` (``[x, y, holding, target]`` or None), ``crossings``, ``done``, ``reaches``;
            and ``belief`` (a number for each object, or None) if it is asked for.
        """
        game, team = self.env.game, self.env.team
        carry_to = self.env.carry_to
        found: dict[str, Any] = {
            "n": self.steps,
            "over": self.is_over,
            "positions": [
                [round(x, 4), round(y, 4), round(a, 4)]
                for (x, y), a in zip(game.positions.tolist(), game.physics.angles.tolist(), strict=True)
            ],
            "status": game.status.tolist(),
            "goals": [int(name in game.goals) for name in game.names],
            "hand": [round(v, 4) for v in game.hand],
            "holding": game.holding,
            "low": bool(game.is_low),
            "carry_to": None if carry_to is None else [round(float(v), 4) for v in carry_to],
            "robot": None,
            "crossings": game.crossings,
            "done": game.progress.num_done,
            "reaches": self.reaches,
        }
        if team.gripper is not None:
            target = self.env.robot_target
            found["robot"] = [
                *(round(v, 4) for v in team.gripper),
                game.robot_holding,
                -1 if target is None else game.index[target],
            ]
        if belief:
            known = self.env.belief
            found["belief"] = None if known is None else [round(known.get(name, 0.0), 4) for name in game.names]
        return found

    def outcome(self) -> dict[str, Any]:
        """``steps, finished, done, reaches, crossings, path_length, time``, and with a robot the team's measures."""
        measures = {k: _finite(v) for k, v in self.env.team_measures().items()} if self.env.team.gripper else {}
        return {
            **measures,
            "steps": self.steps,
            "finished": bool(self.finished),
            "done": int(self.info["num_done"]),
            "reaches": self.reaches,
            "crossings": int(self.info["crossings"]),
            "path_length": float(self.info["path_length"]),
            "time": float(self.info["time"]),
        }

    def trajectories(self, *, participant: str, condition: str, seconds: Any = None) -> list[Trajectory]:
        """The reaches of the round, 30 points a second."""
        return self.env.trajectories(participant=participant, condition=condition)

    def close(self) -> None:
        """Let go of the environment."""
        self.env.close()


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
