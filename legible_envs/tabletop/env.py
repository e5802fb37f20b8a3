"""The playable table as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from legible_envs.drawing.rendered import Rendered
from legible_envs.errors import LayoutError, TaskError
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.subtasks import ROBOT
from legible_envs.support.per_env import own_entry
from legible_envs.support.specs import JsonSpec, check_options
from legible_envs.support.validation import shown
from legible_envs.tabletop.game.game import DT, RATE, TableGame
from legible_envs.tabletop.game.shaping import Shaping
from legible_envs.tabletop.game.view import TableView
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.observations import ObservationBuilder
from legible_envs.tabletop.partner.intent import IntentObserver
from legible_envs.tabletop.partner.team import Team, make_partner
from legible_envs.tabletop.settings import (
    ELSEWHERE,
    TableSettings,
    keys_to_action,
    layout_entries,
    read_action,
    read_start,
)
from legible_envs.tabletop.task import TabletopTask

__all__ = ["TabletopEnv"]

Floats = npt.NDArray[np.float64]


class TabletopEnv(JsonSpec, Rendered, gym.Env[npt.NDArray[np.float32], npt.NDArray[np.float32]]):
    """A person builds something from objects on a table, alone or beside a robot that predicts their goals.

    ## Description

    A hand takes one object after another and carries each to its place, in an order that a task allows: by default
    eight cubes to two columns of four, the first column before the second, as in Tung, Luebbers, Roncone and Hayes,
    *Workspace Optimization Techniques to Improve Prediction of Human Motion During Human-Robot Collaboration* (HRI
    2024). The layout says where the objects lie and which virtual obstacles are projected on the table; it can
    change from episode to episode.

    Points are `(x, y)` in metres, origin front-left as the person sits, `x` to the right, `y` away from the person. One
    step lasts 1/30 s.

    **The hand** moves exactly as told, stays on the table, and slides along obstacles that stop it. It flies over
    objects and comes down when it is slower than `slow_speed`, beside objects, never onto one: then it *touches*.

    - *Take*: an empty, slow hand whose centre is at most `grasp_distance` from the outline of an object that is valid
      now (the nearest, if several) takes it. It never takes an object that is not valid.
    - *Push*: an empty, slow hand pushes the objects it runs into and cannot take (`pymunk`: dry friction with the
      table, collisions among objects, a rim round the table). `contact="always"` keeps the hand down at every speed,
      `"never"` keeps it up. A hand that carries an object is always up. Placed objects are solid. A hand that runs into
      an object that cannot give way (placed, fixed, or held fast by the rim or by others) is not stopped: it rises,
      passes over it, and comes down beyond.
    - *Carry* and *place*: a held object moves with the hand. A slow hand at most `release_distance` from the place of
      the object it holds puts it exactly there, for good; what lies there is pushed aside. This place is the one in the
      task's configuration; for an object without, any point of the assembly zone with room (in the task `bins`: the
      next goal that is touched).

    At the end of every step all of each object that lies on the table is on it, and none that can be moved overlaps
    with another by 1 mm or more, at any speed of the hand (what lies in a bin lies in it).

    **Virtual obstacles** are projected for the person alone: objects and the robot do not feel them. `"hard"` ones stop
    the hand at their outline grown by the hand's half-width, which shortest paths keep clear of too; `"soft"` ones can
    be crossed, and the environment counts how often the hand's centre enters the drawn rectangle.

    **The robot** (`partner="robot"`) decides 30 times a second. It waits until its predictor is sure of the person's
    goal, then takes another valid object, the nearest to its gripper, and puts it in its place. An object belongs to
    the first to take it; in the same step, to the person. Where the task says who can perform a subtask
    (`Subtask(agents=...)`), the hand takes nothing that only the robot may, nor the robot what only the person may. For
    an object that only the robot may take the robot waits for no prediction, and the person, where nothing else is
    valid, waits for the robot.

    ## Action Space

    `Box(-1, 1, (2,), float32)`: velocity of the hand along `x` and `y`, in units of `max_speed`; a longer vector than 1
    is shortened to 1.

    ## Observation Space

    A `Box` of `float32` and shape `(11 + 10 n + 7 m,)` for the `n` objects of the task and `m = max_obstacles`, with 4
    more with a partner; `env.unwrapped.observation_names` names every index. Metres, and masks of 0 and 1:

    | Index | Content |
    | ----- | ------- |
    | 0, 1  | hand `x`, `y` |
    | 2, 3  | velocity of the hand in the last step / `max_speed` |
    | 4     | the hand is down, at the height of the objects |
    | 5     | the hand holds an object |
    | 6 - 8 | where it belongs, `x`, `y`, and 1; or 0, 0, 0 if it has no such point, or the hand is empty |
    | 9, 10 | where the present reach began, `x`, `y` |
    | 11 + 10 i | object i: `x` |
    | 12 + 10 i | object i: `y` |
    | 13 + 10 i, 14 + 10 i | object i: cosine and sine of its angle |
    | 15 + 10 i | object i lies free |
    | 16 + 10 i | object i is in the hand |
    | 17 + 10 i | object i is in the robot's gripper |
    | 18 + 10 i | object i has been placed |
    | 19 + 10 i | object i may validly be reached for now |
    | 20 + 10 i | object i is the goal that was set, see `reset` |
    | 11 + 10 n + 7 j | obstacle j is there; if not, its other numbers are 0 |
    | 12 + 10 n + 7 j, 13 + 10 n + 7 j | obstacle j: `x`, `y` |
    | 14 + 10 n + 7 j, 15 + 10 n + 7 j | obstacle j: cosine and sine of its angle in [0, pi) |
    | 16 + 10 n + 7 j, 17 + 10 n + 7 j | obstacle j: length and width |
    | 11 + 10 n + 7 m … 14 + 10 n + 7 m | with a partner only: its gripper's `x`, `y`, and velocity in m/s |

    ## Rewards

    `done_reward` (1) for every subtask that the person or the robot finishes: each object placed. `time_cost` (0.05) per
    second and `crossing_cost` (0) per crossing of a soft obstacle are subtracted.

    A learner that starts from nothing never meets a reward: it would have to stop beside an object, then beside its
    place. `shaping=True` adds `discount * potential(after) - potential(before)` to every step, where `potential` is
    `taking` (1) while the hand carries an object, less `placing` (2) for every subtask left and `distance` (2) for
    every metre of the hand's shortest path to the nearest valid object or, while it carries one, to its place; 0 when
    the task is done. Potential-based shaping leaves the optimal policies as they are: the return of every finished
    episode is shifted by the same constant at the default `discount` of 1, and the optima of a learner that discounts
    are exactly its own at that learner's `discount` (Ng, Harada and Russell 1999); never choose a smaller one, with
    which waiting pays. A mapping with some of these four keys sets other values.

    ## Starting State

    Objects lie where the layout has them; the hand is where the task starts (`home`), empty and at rest.

    The layout of an episode is, first match first: the one in `reset(options={"layout": ...})` or set by
    `env.unwrapped.layout = ...` (from the next reset on), which stays until replaced (by None: until then as if never
    set); the one given as `layout`; the task's own sorted arrangement.

    ## Episode End

    The episode terminates when the task is done. It is truncated after 1,800 steps, one minute (Gymnasium's
    `max_episode_steps`).

    ## Information

    Every `reset` and `step` returns fresh numbers and arrays of fixed shape, so that wrappers can stack, convert and
    record them:

    | Key             | Content |
    | --------------- | ------- |
    | `goal_mask`     | `(n,)` bool: the objects that may validly be reached for now in the running game (candidate set `game`), in the order of the layout; none while the hand carries an object to its place |
    | `start`         | int: where the present reach began in the task, an index into `env.unwrapped.start_names` |
    | `stage`         | int: index in `task.graph.stages()` of the pair of this start and these goals; -1 if none |
    | `holding`       | int: index of the object in the hand, -1 for none |
    | `num_done`      | int: subtasks finished, such as objects placed |
    | `crossings`     | int: crossings of soft obstacles |
    | `path_length`   | float: metres the hand has moved |
    | `time`          | float: seconds since the episode began |
    | `layout_id`     | int: identifies the layout; the number that the twelve hexadecimal digits of `layout.layout_id` write, `int(layout.layout_id, 16)` |
    | `belief`        | with a predictor or partner: `(n,)` float, the probability of each object to be the goal of the present reach; zeros where there is no belief |
    | `robot_target`  | with a partner: int, index of the object it goes for or carries, -1 for none |
    | `completion_time`, `human_idle`, `robot_idle`, `concurrent_activity`, `functional_delay`, `conflicts`, `goals_lost`, `decision_time`, `decision_fraction`, `decided`, `decided_rightly` | with a partner: floats, measures of the team so far, see `legible_envs.partner.fluency`; `inf` where not known yet |

    Names are told when asked for: `env.unwrapped.goals` names the valid goals, `goal_names` all objects, so that
    `env.unwrapped.goal_names[info["goal_mask"]]` names the valid ones from the mask; `start`, `holding`,
    `robot_target`, `robot_state` and `belief` are those of this moment in words.

    Actions are continuous and all of them are allowed at any time, so there are no action masks.

    ## Vectors

    `gymnasium.make_vec` makes `TabletopVectorEnv`, environments one after another in one process, or Gymnasium's own
    vectors with `vectorization_mode="sync"` or `"async"`. In all three, `reset(options={"layout": ...})` takes one
    layout for all environments, or a list, tuple or array with one for each: in any form that `layout` takes, or None,
    which keeps the one there is. So `ws.sample(num_envs, rng)`, an array `(n, d)` of genomes, gives each environment
    its own. The autoreset mode is given as `make_vec(id, num_envs, autoreset_mode="SameStep")`, and as
    `vector_kwargs={"autoreset_mode": "SameStep"}` with `"sync"` and `"async"`.

    ## Arguments

    Args:
        task: The task: `"columns"`, `"tea"`, `"bins"`, the path of a YAML file, a mapping, or a `TabletopTask`.
        layout: The arrangement: a `TabletopLayout`, JSON text or a path, a mapping, or a genome with `max_obstacles`
            obstacles.
        virtual_obstacles: `"hard"`: they stop the hand; `"soft"`: they can be crossed, and crossings are counted.
        contact: When the hand pushes: `"slow"`, `"always"` or `"never"`. A step in which a fast hand pushes costs more,
            up to some milliseconds.
        max_obstacles: Most obstacles a layout has.
        max_speed: Of the hand, m/s. The default lets people's fastest reaches pass; 0.5 is easier to explore and learn.
        slow_speed: Up to which the hand takes, places and pushes, m/s.
        grasp_distance: Up to which it takes, metres from an object's outline.
        release_distance: Up to which it places, metres from the place.
        done_reward: For a finished subtask.
        time_cost: Per second.
        crossing_cost: Per crossing of a soft obstacle.
        shaping: False, True, or a mapping of weights; see Rewards.
        partner: None, `"robot"`, a mapping of arguments of `RobotPartner`, `"module:Class"`, or an object with its
            methods `reset` and `step`.
        predictor: Predicts the person's goals: `"bayesian"`, the built-in Bayesian goal inference (Eq. 1) along
            shortest paths among the obstacles; a name that `predictors.list_predictors()` lists, such as
            `"reach-gaussian"`; `"module:Class"`; or a predictor. None means no belief without a partner, and
            `"bayesian"` with one. On the table `"bayesian"` always means the built-in belief: the predictor of this
            name in `predictors` is for kitchens. A predictor that must be fitted and is not learns from simulated
            participants at this very table; to use other trajectories, pass a fitted predictor. A predictor that fails
            during an episode is reported once by a warning; the robot waits and the episode goes on.
        threshold: Probability a goal must exceed for the robot to be sure; at 1 it never is.
        render_mode: None, `"human"` (a window) or `"rgb_array"`.

    Raises:
        LayoutError: A layout that cannot be read, breaks a rule (`rule` names it), or is of another task.
        TaskError: Not a task; or it has subtasks that only a robot can perform, and there is no partner.
        ValueError: Any other bad argument, options of `reset` or actions; at `reset`, a predictor given by name that
            cannot be fitted at this table.
        ResetNeeded: `step` before the first `reset`.
        TypeError: A partner or predictor that lacks the methods.

    ## Version History

    * v0: first version.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": RATE}  # noqa: RUF012
    _window_title = "Legible table"

    def __init__(
        self,
        *,
        task: object = "columns",
        layout: object = None,
        virtual_obstacles: str = "hard",
        contact: str = "slow",
        max_obstacles: int = 4,
        max_speed: float = 3.0,
        slow_speed: float = 0.2,
        grasp_distance: float = 0.03,
        release_distance: float = 0.05,
        done_reward: float = 1.0,
        time_cost: float = 0.05,
        crossing_cost: float = 0.0,
        shaping: bool | Mapping[str, float] = False,
        partner: object = None,
        predictor: object = None,
        threshold: float = 0.8,
        render_mode: str | None = None,
    ) -> None:
        self._set_render_mode(render_mode)
        self.settings = TableSettings(
            task=task,
            layout=layout,
            virtual_obstacles=virtual_obstacles,
            contact=contact,
            max_obstacles=max_obstacles,
            max_speed=max_speed,
            slow_speed=slow_speed,
            grasp_distance=grasp_distance,
            release_distance=release_distance,
            done_reward=done_reward,
            time_cost=time_cost,
            crossing_cost=crossing_cost,
            shaping=shaping,
            threshold=threshold,
        )
        start, layout = self.settings.task.graph.start, self.settings.layout
        self._game = TableGame(self.settings.task, self.settings.rules)
        self._game.begin(layout, layout.place(start), start)
        self._shaping = None if self.settings.shaping is None else Shaping(self._game, self.settings.shaping)
        self._team = self._make_team(partner, predictor)
        self._observations = ObservationBuilder(self.settings.task, max_obstacles, partner is not None)
        self._masks: dict[tuple[str, ...], npt.NDArray[np.bool_]] = {}
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = self._observations.space
        self._chosen: TabletopLayout | None = None
        self._begun = False
        self._layout_number = 0
        names = dict.fromkeys([*layout.table.starts, *layout.goals, ELSEWHERE])
        self._starts = {name: i for i, name in enumerate(names)}

    def _make_team(self, partner: object, predictor: object) -> Team:
        if partner is None:
            if reserved := self.settings.task.graph.reserved_for(ROBOT):
                raise TaskError(
                    f"task {self.settings.task.name!r} has subtasks that only a robot can perform, and there is none: "
                    f"{[subtask.name for subtask in reserved]}; set `partner`, such as partner='robot'"
                )
            return Team(observer=None if predictor is None else IntentObserver(predictor))
        if not self.settings.task.configuration:
            raise ValueError(
                f"a robot puts objects in their places in the configuration; task {self.settings.task.name!r} has none"
            )
        return Team(make_partner(partner, predictor, self.settings.threshold))

    # -- the Gymnasium interface --------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the environment's generator; None goes on with the one there is. Without a partner that uses
                it, nothing here is random.
            options: ``"layout"``: play on another layout from now on; None returns to the environment's own. In a
                vector, a list or array of layouts holds one per environment.
                ``"start"``: where the hand starts this time, the name of a start or object of the table or ``(x, y)``.
                ``"goal"``: the goal of the first reach, an object that is valid at first; until it has been taken, the
                hand takes no other.

        Returns:
            ``(observation, info)``.

        Raises:
            LayoutError: A bad layout, start or goal; the episode goes on as if `reset` had not been called.
            ValueError: Options that are no mapping, or unknown keys, likewise; or a predictor given by name that cannot
                be fitted at this table.
            gymnasium.error.Error: A seed that is no whole number >= 0; likewise.
        """
        asked = check_options(options, ("layout", "start", "goal"))
        chosen = self._read(asked["layout"]) if "layout" in asked else self._chosen
        layout = chosen or self.settings.layout
        start = asked.get("start")
        begin = read_start(self.task.graph.start if start is None else start, layout)
        goal = asked.get("goal")
        if goal is not None:
            self._check_goal(goal, self._game.progress.first_goals)
        super().reset(seed=seed)
        self._chosen = chosen
        self._game.begin(layout, begin.at, begin.name, goal)
        if self._shaping is not None:
            self._shaping.begin()
        self._observations.enter(layout)
        self._layout_number = int(layout.layout_id, 16)
        self._team.begin(self._game, self.np_random)
        self._begun = True
        if self.render_mode == "human":
            self.render()
        return self._look()

    def step(self, action: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance by 1/30 s.

        Args:
            action: ``(2,)`` velocity of the hand in units of ``max_speed``.

        Returns:
            ``(observation, reward, terminated, truncated, info)``.

        Raises:
            ResetNeeded: Before the first reset.
            ValueError: Not two finite numbers.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call env.step() before calling env.reset()")
        x, y = read_action(action)
        game, settings = self._game, self.settings
        crossings, held = game.crossings, game.holding
        top = settings.rules.max_speed
        finished = game.move_hand(x * top, y * top)
        has_acted = bool(finished) or game.holding != held
        finished += self._team.act(game)
        self._team.log(game, has_acted)
        self._team.sense(game)
        crossed = game.crossings - crossings
        reward = settings.done_reward * finished - settings.time_cost * DT - settings.crossing_cost * crossed
        if self._shaping is not None:
            reward += self._shaping.reward()
        if self.render_mode == "human":
            self.render()
        observation, info = self._look()
        return observation, reward, game.progress.is_over, False, info

    # -- layouts -------------------------------------------------------------------------------------------------------

    @property
    def layout(self) -> TabletopLayout:
        """The layout: the one set for the next reset, else the one being played on."""
        return self._chosen or self._game.layout

    @layout.setter
    def layout(self, value: object) -> None:
        self._chosen = self._read(value)

    def _read(self, value: object) -> TabletopLayout | None:
        """The layout that is asked for; None for the environment's own."""
        entries = layout_entries(value)
        if entries is not None:
            value = own_entry("layout", entries, self, partial(LayoutError, rule="count"))
            if value is None:
                return self._chosen
        if value is None:
            return None
        for known in (self._chosen, self._game.layout, self.settings.layout):
            if known is not None and value is known:
                return known
        return self.settings.read(value)

    # -- the running game -------------------------------------------------------------------------------------------

    @property
    def game(self) -> TableGame:
        """The rules at work, and the table's whole state; to be read only."""
        return self._game

    @property
    def team(self) -> Team:
        """The robot and what it believes; to be read only."""
        return self._team

    @property
    def task(self) -> TabletopTask:
        """The task."""
        return self.settings.task

    @property
    def observation_names(self) -> tuple[str, ...]:
        """The name of each number of an observation."""
        return self._observations.names

    @property
    def hand(self) -> Floats:
        """``(2,)`` centre of the hand."""
        return np.array(self._game.hand)

    @property
    def holding(self) -> str | None:
        """Name of the object in the hand."""
        return self._name(self._game.holding)

    @property
    def goals(self) -> tuple[str, ...]:
        """Names of the objects that the person may validly reach for now, sorted: those in ``info["goal_mask"]``."""
        return self._game.goals

    @property
    def goal_names(self) -> npt.NDArray[np.str_]:
        """``(n,)`` names of the objects, so that ``goal_names[info["goal_mask"]]`` names the valid goals."""
        return np.array(self._game.names)

    @property
    def start_names(self) -> npt.NDArray[np.str_]:
        """Names of where a reach can begin: the starts of the table, the objects, and ``elsewhere``."""
        return np.array(list(self._starts))

    @property
    def start(self) -> str:
        """Name of where the present reach began in the task."""
        return self._game.progress.place

    @property
    def belief(self) -> dict[str, float] | None:
        """``{goal: probability}`` of the present reach, as the predictor or partner has it; None where it has none."""
        return None if self._team.belief is None else dict(self._team.belief)

    @property
    def robot_state(self) -> str | None:
        """What the partner is doing, in its own word, such as ``"wait"``; None without one."""
        return None if self._team.command is None else self._team.command.state

    @property
    def robot_target(self) -> str | None:
        """Name of the object that the partner goes for or carries."""
        return None if self._team.command is None else self._team.command.target

    @property
    def goal(self) -> str | None:
        """The person's goal, where it was set: the hand takes no other object until this reach ends.

        Setting it shows it in observations and pictures.

        Raises:
            LayoutError: Set to an object that is not valid now.
        """
        return self._game.goal

    @goal.setter
    def goal(self, name: str | None) -> None:
        if name is not None:
            self._check_goal(name, self._game.goals)
        self._game.goal = name

    @property
    def carry_to(self) -> Floats | None:
        """``(2,)`` where the held object belongs: the middle of the assembly zone if anywhere in it; or None."""
        delivery = self._game.delivery
        if delivery is None or delivery.kind == "goal":
            return None
        x0, y0, x1, y1 = self.task.layout.table.assembly
        return np.array(delivery.at or ((x0 + x1) / 2, (y0 + y1) / 2))

    @property
    def positions(self) -> Floats:
        """``(n, 2)`` where the objects are now, in the order of the layout."""
        return self._game.positions.copy()

    @property
    def time(self) -> float:
        """Seconds since the episode began."""
        return self._game.time

    @property
    def max_speed(self) -> float:
        """Of the hand, m/s: an action of length 1."""
        return self.settings.rules.max_speed

    def _picture(self) -> npt.NDArray[np.uint8]:
        from legible_envs.tabletop.rendering import draw_scene

        return draw_scene(self.view())

    def view(self) -> TableView:
        """A snapshot of the table, for drawing."""
        game, team = self._game, self._team
        command, has_robot = team.command, team.gripper is not None
        return TableView(
            layout=game.layout,
            task=self.task,
            positions=game.positions.copy(),
            angles=game.physics.angles.copy(),
            status=game.statuses(),
            hand=self.hand,
            holding=self.holding,
            robot=np.array(team.gripper) if has_robot else None,
            robot_holding=self._name(game.robot_holding),
            robot_target=command.target if command is not None else None,
            belief=None if team.belief is None else dict(team.belief),
            threshold=getattr(team.partner, "threshold", self.settings.threshold) if team.is_there else None,
            goals=game.goals,
            goal=game.goal,
            trail=game.reaches.points.copy(),
            time=game.time,
            crossings=game.crossings,
            virtual_obstacles=self.settings.rules.virtual_obstacles,
        )

    def trajectories(self, *, participant: str = "", condition: str = "") -> list[Trajectory]:
        """The reaches of this episode that ended at a goal, in order; carrying is no reach.

        Each begins where the hand was when it became empty (or, in the task ``bins``, had taken a piece) and ends where
        it took its goal, at 30 points per second. Its candidates are the goals of the running game when it ended, where
        they lay then.

        Args:
            participant: Of all trajectories.
            condition: Of all trajectories.
        """
        return self._game.reaches.trajectories(self._game.layout, participant=participant, condition=condition)

    def team_measures(self) -> Mapping[str, float]:
        """Measures of the team so far, by the names of :meth:`.TeamMetrics.summary`."""
        return self._team.summary()

    def get_keys_to_action(self) -> dict[tuple[int, ...], npt.NDArray[np.float32]]:
        """Keys for ``gymnasium.utils.play`` (``noop=np.zeros(2)``): arrows or W A S D; let go to take and place."""
        return keys_to_action(self.max_speed)

    def observe(self) -> npt.NDArray[np.float32]:
        """The observation of this moment, made anew."""
        return self._observations.observe(self._game, self._team, self._game.goals)

    def _look(self) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Observation and info of this moment."""
        goals = self._game.goals
        return self._observations.observe(self._game, self._team, goals), self._info(goals)

    def _info(self, goals: tuple[str, ...]) -> dict[str, Any]:
        game = self._game
        return {
            "goal_mask": self._mask(goals),
            "start": self._starts[game.progress.place],
            "stage": game.progress.stage(goals),
            "holding": game.holding,
            "num_done": game.progress.num_done,
            "crossings": game.crossings,
            "path_length": game.path_length,
            "time": game.time,
            "layout_id": self._layout_number,
            **self._team.info(game.index),
        }

    def _mask(self, goals: tuple[str, ...]) -> npt.NDArray[np.bool_]:
        """A new mask over the objects; a task has few sets of valid goals, so each is worked out once."""
        if goals not in self._masks:
            self._masks[goals] = np.array([name in goals for name in self._game.names])
        return self._masks[goals].copy()

    def _name(self, i: int) -> str | None:
        return self._game.names[i] if i >= 0 else None

    def _check_goal(self, goal: object, valid: tuple[str, ...]) -> None:
        if not isinstance(goal, str) or goal not in valid:
            raise LayoutError(
                f"the `goal` must be an object that is valid now, one of {list(valid)}; got {shown(goal)}", rule="goal"
            )
