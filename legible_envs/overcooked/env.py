"""The playable kitchen as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded

from legible_envs.drawing.rendered import Rendered
from legible_envs.errors import LayoutError
from legible_envs.overcooked.game import batch
from legible_envs.overcooked.game.observations import grid_observations, vector_observations
from legible_envs.overcooked.game.snapshot import make_view, name_goals, to_text
from legible_envs.overcooked.game.vectors import CROSSINGS, DELIVERIES, STATE_SIZE, Kitchen, Vector
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.layout_batches import layout_entries
from legible_envs.overcooked.layouts import read_layout
from legible_envs.overcooked.partner.interface import PARTNER
from legible_envs.overcooked.partner.team import Game, Team, make_partner
from legible_envs.overcooked.rendering.board import draw_small
from legible_envs.overcooked.settings import NUM_ACTIONS, KitchenSettings, PackedKitchen, read_action, read_actions
from legible_envs.overcooked.trajectories import trajectories_from_states
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.per_env import own_entry
from legible_envs.support.specs import JsonSpec, check_options
from legible_envs.support.validation import real

__all__ = ["OvercookedEnv"]


class OvercookedEnv(JsonSpec, Rendered, gym.Env[npt.NDArray[Any], Any]):
    """A person cooks soups in a kitchen whose layout can be changed from episode to episode.

    ## Description

    One cook fetches ingredients, puts them in a pot, waits, puts the soup on a dish and serves it, until every ordered
    soup is delivered: by default the three soups of Tung, Luebbers, Roncone and Hayes, *Workspace Optimization
    Techniques to Improve Prediction of Human Motion During Human-Robot Collaboration* (HRI 2024), each once and in any
    order. Virtual obstacles are projected on the floor so that the cook's goals are easier to predict. The game follows
    Overcooked-AI (actions and their order, turning in place, counters that hold one item, a cook time of 20), with
    three differences: recipes are data; a pot accepts only what can still become an ordered soup, and starts by itself
    when one is complete; and an ingredient or empty dish can be put back where it came from, so that no state is a dead
    end.

    ## Action Space

    `Discrete(6)`, in the order of Overcooked-AI:

    | Num | Action   | Effect |
    | --- | -------- | ------ |
    | 0   | North    | turn north (row - 1), and move if the cell is free |
    | 1   | South    | turn south (row + 1), and move if the cell is free |
    | 2   | East     | turn east (column + 1), and move if the cell is free |
    | 3   | West     | turn west (column - 1), and move if the cell is free |
    | 4   | Stay     | nothing |
    | 5   | Interact | take from or put back at a station, put on or pick up from a counter, add to a pot, take a soup with a dish, deliver |

    With `num_players=P` for `P` > 1 it is `MultiDiscrete([6] * P)`: everybody acts at once. Who interacts comes first, in
    the order of players; then all move, except those who would share or swap cells.

    ## Observation Space

    With `obs_type="grid"` (default) a `Box` of `uint8` and shape `(H, W, 22 + R)` for `R` recipes; each cell has

    | Channel | Content | Range |
    | ------- | ------- | ----- |
    | 0       | counter | 0, 1 |
    | 1       | virtual obstacle | 0, 1 |
    | 2 - 8   | station: tomato, onion, cabbage, fish, dish, pot, serving | 0, 1 |
    | 9       | the player | 0, 1 |
    | 10 - 13 | the player, facing north, south, east, west | 0, 1 |
    | 14 - 17 | tomatoes, onions, cabbages, fish on the counter, in the player's hands, in the pot, or in the soup there | 0 - most in a recipe |
    | 18      | a dish, empty or with soup | 0, 1 |
    | 19      | a dish with soup | 0, 1 |
    | 20      | ticks the pot has cooked | 0 - cook time (at most 255) |
    | 21      | the pot's soup is ready | 0, 1 |
    | 22 + r  | recipe r is not yet delivered (the same on all cells) | 0, 1 |

    With `obs_type="vector"` a `Box` of `float32` in [-1, 1] and shape `(51 + R,)`, a summary for small networks; grids
    tell everything, this leaves out which counter an item lies on, where obstacles are unless next to the player, and
    which of several pots holds what:

    | Index   | Content |
    | ------- | ------- |
    | 0, 1    | row / (H - 1), column / (W - 1) |
    | 2 - 5   | facing north, south, east, west |
    | 6 - 12  | hands: empty, tomato, onion, cabbage, fish, dish, soup |
    | 13 - 16 | whether the cell to the north, south, east, west can be walked on |
    | 17 - 37 | for tomato, onion, cabbage, fish, dish, pot, serving: rows / (H - 1) and columns / (W - 1) to the nearest such station by walking, and the walk's steps / (H W); 0, 0, 1 if there is none |
    | 38 - 41 | tomatoes, onions, cabbages, fish in pots that do not cook yet / size of the largest recipe |
    | 42      | soups on the fire or ready / R |
    | 43, 44  | progress of the soup cooked longest; whether a soup is ready |
    | 45 - 50 | tomatoes, onions, cabbages, fish, dishes, soups on counters / 4 |
    | 51 + r  | recipe r is not yet delivered |

    With several players, observations have the shape `(P, ...)`, one for each player as they see the kitchen: "the player"
    is the one who observes. Grids have five more channels, for the other players: presence, and facing north, south,
    east, west. Vectors have 13 more entries for each other player, beginning with the next one: rows / (H - 1) and
    columns / (W - 1) to them, facing (4), and hands (7).

    With `obs_type="rgb"` a `Box` of `uint8` and shape `(12 H, 12 W, 3)`: the picture of `render`, smaller.

    ## Partner

    With `partner=` the kitchen has a second player, who decides for themselves. The environment has one agent as ever,
    `Discrete(6)`, the person; its observations, goals and masks are those of player 0 of two. Person and partner act at
    once, the partner on what it saw before. The robot waits until its predictor is sure of what the person fetches and
    does something else that is needed; see `legible_envs.overcooked.partner.robot`. In measures a step counts as 0.15 s.

    ## Rewards

    +20 for every delivery. A crossing of a soft virtual obstacle costs `crossing_cost`. With `shaping=True`
    (Overcooked-AI's values) also +3 for an ingredient put in a pot, +3 for a dish fetched while a soup waits for one
    (taken back if it is put back: going to and fro gains nothing), +5 for a soup taken from the pot. A mapping with
    some of the keys `ingredient`, `dish`, `soup` sets other values. Several players get one reward, that of the team.

    ## Starting State

    The player stands at the layout's first start (`1` in the drawing; by default beside the serving station), facing
    north with empty hands; pots and counters are empty. Further players stand at its further starts (`2`, `3`, `4`), or
    else as far as possible from the others, by steps; see `player_starts`.

    The kitchen of an episode is, first match first: the one in `reset(options={"layout": ...})` or set by
    `env.unwrapped.layout = ...` (from the next reset on), which stays until replaced (by None: until then as if never
    set); one drawn from `layouts`; the one given as `layout`; a default kitchen, the same for every environment of
    this shape.

    ## Episode End

    The episode terminates when every ordered soup is delivered (with `rules="overcooked-ai-2019"`: never). It is truncated after 1,200 steps (Gymnasium's
    `max_episode_steps`).

    ## Information

    Every `reset` and `step` returns fresh numbers and arrays of fixed shape, so that wrappers can stack, convert and
    record them (with several players `goal_mask` has the shape `(P, H, W)` and `action_mask` `(P, 6)`):

    | Key           | Content |
    | ------------- | ------- |
    | `goal_mask`   | `(H, W)` bool: the cells of the valid goals, what the player may reach for next in the running game (candidate set `game`): stations and counters where an interaction would bring the game forward |
    | `action_mask` | `(6,)` int8: actions that do something (staying always), as `action_space.sample(mask)` takes it |
    | `layout_id`   | int: identifies the kitchen; the number that the twelve hexadecimal digits of `layout.layout_id` write, `int(layout.layout_id, 16)` |
    | `num_done`    | int: subtasks done in this episode, here the deliveries |
    | `deliveries`  | int: soups delivered in this episode |
    | `crossings`   | int: steps onto soft virtual obstacles in this episode |
    | `belief`      | with a partner: `(H, W)` float, the probability of each cell to be what the person fetches; zeros where there is no belief |
    | `robot_target` | with a partner: int, `row * W + column` of the cell it goes for, -1 for none |
    | `completion_time`, `human_idle`, `robot_idle`, `concurrent_activity`, `functional_delay`, `conflicts`, `goals_lost`, `decision_time`, `decision_fraction`, `decided`, `decided_rightly` | with a partner: floats, measures of the team so far, see `legible_envs.partner.fluency` and `legible_envs.overcooked.partner.team`; `inf` where not known yet |

    Names are told when asked for: `env.unwrapped.goals` names the valid goals in reading order (counters are
    `counter@(row,col)`), `env.unwrapped.goal_names[info["goal_mask"]]` does the same from the mask, and
    `env.unwrapped.layout` is the kitchen. `env.unwrapped.action_masks()` gives the action mask as bool, as
    `MaskablePPO` of sb3-contrib asks for it.

    ## Vectors

    `gymnasium.make_vec` makes the batched kitchen `OvercookedVectorEnv` (some millions of steps per second), or a
    vector of single ones with `vectorization_mode="sync"` or `"async"`. In all three, `reset(options={"layout": ...})`
    takes one kitchen for all environments, or a list, tuple or array with one for each: a layout, a drawing, a genome
    of any numeric type with whole values, or None, which keeps the one there is. So `ws.sample(num_envs, rng)` gives
    each environment its own. An array of shape `(H, W)` is one kitchen's cells, `(n, d)` holds genomes, `(n, H, W)`
    cells; `d` is larger than `W` in every shape. The autoreset mode is given as
    `make_vec(id, num_envs, autoreset_mode="SameStep")` to the batched kitchen, and as
    `vector_kwargs={"autoreset_mode": "SameStep"}` with `"sync"` and `"async"`.

    ## Arguments

    Args:
        shape: Rows and columns of all kitchens of this environment, 3 to 64 each. None: those of `layout` or
            `layouts`, else 7 and 7.
        layout: The kitchen: an ASCII drawing, or the text of a layout file in any form that `KitchenFile` reads (never
            a file's name: `KitchenFile.read(path)` reads one); a `KitchenFile`, or the entries of one; a list of row
            strings or nested lists of symbols; an `OvercookedLayout`; a 2-D array of cell codes; or a genome of
            `OvercookedWorkspace(shape)`. The environment's spec stays JSON.
        layouts: A distribution to draw a kitchen from at every reset: `"random"`, `"random:train"`, `"random:test"`, a
            mapping such as `{"kind": "random", "split": "train", "num_layouts": 200}` with arguments of
            `RandomLayouts`, a list of kitchens, or any object with `sample(rng)`.
        recipes: The ordered soups, each a sequence of ingredients (`tomato`, `onion`, `cabbage`, `fish`), each cooked
            and delivered once. `"own"`: those of the file that `layout` is, where it orders any, else the paper's.
        cook_time: Ticks a soup cooks.
        obs_type: `"grid"`, `"vector"` or `"rgb"`.
        virtual_obstacles: `"hard"`: they block the player; `"soft"`: they can be crossed, and crossings are counted.
        crossing_cost: What a crossing of a soft virtual obstacle costs.
        shaping: False, True, or a mapping of rewards; see Rewards.
        num_players: Cooks, 1 to 4, all of whom this environment controls. `parallel_env` deals them out to agents.
        partner: A second player beside the agent: `"robot"`, `"scripted"`, `"boltzmann"`, `"planner"`, a mapping of
            arguments of one of them (`"kind"` says of which), `{"kind": "recorded", "actions": [...]}`,
            `"module:Class"`, an object with the methods `reset` and `step`, or a policy to call with
            `(observation, info)`; see Partner.
        predictor: Of `partner="robot"`: predicts what the person fetches. None or `"bayesian"`, the built-in Bayesian
            goal inference (Eq. 1); a name that `predictors.list_predictors()` lists; `"module:Class"`; or a predictor.
            One that must be fitted and is not learns from simulated participants in this very kitchen.
        threshold: Of `partner="robot"`: probability that a goal must exceed for it to be sure; at 1 it never predicts.
        rules: `"legible"`, or `"overcooked-ai-2019"`: the game of the recordings of 2019, in which one recipe is cooked
            again and again.
        render_mode: None, `"human"` (a window), `"rgb_array"` or `"ansi"`.

    Raises:
        LayoutError: A kitchen that cannot be read, has another shape, or in which the recipes cannot be cooked; the
            message names row, column and rule.
        ValueError: Any other bad argument, options of `reset` or actions; at `reset`, a predictor given by name that
            cannot be fitted in this kitchen.
        TypeError: A partner or predictor that lacks the methods.
        ResetNeeded: `step` before the first `reset`.

    ## Version History

    * v0: first version.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array", "ansi"], "render_fps": 8}  # noqa: RUF012
    _window_title = "Legible kitchen"

    def __init__(
        self,
        *,
        shape: Sequence[int] | None = None,
        layout: Any = None,
        layouts: Any = None,
        recipes: Sequence[Sequence[str]] | Literal["own"] = "own",
        cook_time: int = 20,
        obs_type: str = "grid",
        virtual_obstacles: str = "hard",
        crossing_cost: float = 0.0,
        shaping: bool | Mapping[str, float] = False,
        num_players: int = 1,
        partner: Any = None,
        predictor: Any = None,
        threshold: float = 0.8,
        rules: str = "legible",
        render_mode: str | None = None,
    ) -> None:
        self._set_render_mode(render_mode)
        self.settings = KitchenSettings(
            shape=shape,
            layout=layout,
            layouts=layouts,
            recipes=recipes,
            cook_time=cook_time,
            obs_type=obs_type,
            virtual_obstacles=virtual_obstacles,
            crossing_cost=crossing_cost,
            shaping=shaping,
            num_players=num_players,
            has_partner=partner is not None,
            rules=rules,
        )
        threshold = real("threshold", threshold, 0, 1)
        if partner is None and predictor is not None:
            raise ValueError("`predictor` is for partner='robot'; there is no partner")
        self._team = None if partner is None else Team(make_partner(partner, predictor, threshold))
        self.action_space = self.settings.action_space()
        self.observation_space = self.settings.observation_space()
        self._chosen: OvercookedLayout | None = None
        self._pending: PackedKitchen | None = None
        self._players = players = self.settings.num_players
        self._agents = self.settings.num_agents
        self._actions = np.zeros(players, dtype=np.int64)
        self._goals = np.zeros((players, self.settings.shape[0] * self.settings.shape[1]), dtype=np.bool_)
        self._log = bytearray()
        self._begun = False
        self._all_shape = (players, *(self.settings.player_observation_space().shape or ()))
        self._install(self.settings.pack(self.settings.preview()))

    # -- the Gymnasium interface --------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[Any], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the environment's generator; None goes on with the one there is.
            options: ``{"layout": …}`` plays in another kitchen from now on; None as its value returns to the
                environment's own. In a vector, a list or array of kitchens holds one per environment.

        Returns:
            ``(observation, info)``.

        Raises:
            LayoutError: A bad kitchen; the environment goes on as if it had not been asked.
            ValueError: Options that are no mapping, or unknown keys; likewise.
            gymnasium.error.Error: A seed that is no whole number >= 0; likewise.
        """
        asked = check_options(options)
        chosen = self._read(asked["layout"]) if "layout" in asked else (self._chosen, self._pending)
        super().reset(seed=seed)
        self._chosen, self._pending = chosen
        layout = self._chosen or self.settings.layout
        if layout is None:
            assert self.settings.distribution is not None
            layout = self.settings.distribution.sample(self.np_random)
        self._enter(layout)
        masks = np.empty((self._players, NUM_ACTIONS), dtype=np.int8)
        batch.begin(self._state, self._kitchen, self._rules, self._goals, masks)
        self._log.clear()
        self._masks = masks
        if self._team is not None:
            self._team.begin(self._game(), self.settings.rules, self.np_random)
        self._begun = True
        if self.render_mode == "human":
            self.render()
        return self.observe(), self._info(masks)

    def step(self, action: Any) -> tuple[npt.NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Advance the game by one tick.

        Args:
            action: An integer 0..5; with several players ``(num_players,)`` of them.

        Returns:
            ``(observation, reward, terminated, truncated, info)``.

        Raises:
            ResetNeeded: Before the first reset.
            ValueError: The action is not an integer 0..5, or not one for each player.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call env.step() before calling env.reset()")
        moves = [read_action(action)] if self._agents == 1 else read_actions(action, self._players)
        if self._team is not None:
            moves.append(self._team.action)
        return self.play(moves)

    def play(self, moves: list[int]) -> tuple[npt.NDArray[Any], float, bool, bool, dict[str, Any]]:
        """As :meth:`step` after the first reset, without looking at the actions again.

        Args:
            moves: An integer 0..5 for each player.
        """
        self._actions[:] = moves
        self._log.extend(moves)
        masks = np.empty((self._players, NUM_ACTIONS), dtype=np.int8)
        reward, over, _ = batch.play(
            self._state, self._kitchen, self._rules, self.settings.weights, self._actions, self._goals, masks
        )
        self._masks = masks
        if self._team is not None:
            self._team.follow(self._game(), int(self._actions[0]), is_over=over)
        if self.render_mode == "human":
            self.render()
        return self.observe(), reward, over, False, self._info(masks)

    def _picture(self) -> npt.NDArray[np.uint8]:
        from legible_envs.overcooked.rendering import draw_game

        return draw_game(self.view())

    def render(self) -> Any:
        """See :meth:`.Rendered.render`; with ``"ansi"``, the game drawn in text."""
        return to_text(self.view()) if self.render_mode == "ansi" else super().render()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of all kitchens of this environment."""
        return self.settings.shape

    # -- kitchens -----------------------------------------------------------------------------------------------------

    @property
    def layout(self) -> OvercookedLayout:
        """The kitchen: the one set for the next reset, else the one being played in."""
        return self._chosen or self._packed.layout

    @layout.setter
    def layout(self, value: Any) -> None:
        self._chosen, self._pending = self._read(value)

    def _read(self, value: Any) -> tuple[OvercookedLayout | None, PackedKitchen | None]:
        """The kitchen that is asked for, and what the kernels read of it where that has to be made anew."""
        entries = layout_entries(value, self.settings.shape)
        if entries is not None:
            value = own_entry("layout", entries, self, partial(LayoutError, rule="count"))
            if value is None:
                return self._chosen, self._pending
        if value is None:
            return None, None
        layout = read_layout(value, self.settings.shape)
        return layout, None if layout is self._packed.layout else self.settings.pack(layout)

    def _enter(self, layout: OvercookedLayout) -> None:
        """Make a kitchen the one that is played in; staying in the same one costs nothing."""
        if layout is self._packed.layout:
            return
        pending, self._pending = self._pending, None
        self._install(pending if pending is not None and pending.layout is layout else self.settings.pack(layout))

    def _install(self, packed: PackedKitchen) -> None:
        self._packed = packed
        self._rules, self._kitchen = packed.rules, packed.kitchen
        self._layout_number = int(packed.layout.layout_id, 16)
        self._state = np.zeros(int(packed.rules[STATE_SIZE]), dtype=np.int32)

    def observe(self) -> npt.NDArray[Any]:
        """The observation of this moment, made anew."""
        observations = self._observe_all()
        return observations[0] if self._agents == 1 else observations

    def _observe_all(self) -> npt.NDArray[Any]:
        """What each player sees, one behind the other."""
        obs_type = self.settings.obs_type
        if obs_type == "grid":
            grids = np.zeros(self._all_shape, dtype=np.uint8)
            grid_observations(self._state, self._kitchen, self._rules, grids)
            return grids
        if obs_type == "vector":
            features = np.zeros(self._all_shape, dtype=np.float32)
            vector_observations(self._state, self._kitchen, self._rules, self._packed.routes, features)
            return features
        return np.repeat(draw_small(self.view())[None], self._players, axis=0)

    def _info(self, masks: npt.NDArray[np.int8]) -> dict[str, Any]:
        goals = self._goals.reshape(self._players, *self.settings.shape).copy()
        if self._agents > 1:
            return {"goal_mask": goals, "action_mask": masks, **self._counts()}
        team = {} if self._team is None else self._team.info(self._packed.layout)
        return {"goal_mask": goals[0], "action_mask": masks[0].copy(), **self._counts(), **team}

    def _counts(self) -> dict[str, Any]:
        """The part of ``info`` that is the same for all players."""
        deliveries = self._state.item(DELIVERIES)
        return {
            "layout_id": self._layout_number,
            "num_done": deliveries,
            "deliveries": deliveries,
            "crossings": self._state.item(CROSSINGS),
        }

    # -- the partner --------------------------------------------------------------------------------------------------

    def _game(self) -> Game:
        return Game(self._packed.layout, self._state, self._kitchen, self._rules, self._goals, self._look_as_partner)

    def _look_as_partner(self) -> tuple[npt.NDArray[Any], dict[str, Any]]:
        """The partner's own observation and info."""
        goals = self._goals[PARTNER].reshape(self.settings.shape).copy()
        return self._observe_all()[PARTNER].copy(), {
            "goal_mask": goals,
            "action_mask": self._masks[PARTNER].copy(),
            **self._counts(),
        }

    @property
    def team(self) -> Team | None:
        """The partner, what it believes, and the measures of the team; to be read only. None without a partner."""
        return self._team

    @property
    def belief(self) -> dict[str, float] | None:
        """``{station: probability}`` of the person's present reach, as the partner has it; None where it has none."""
        return None if self._team is None or self._team.belief is None else dict(self._team.belief)

    @property
    def robot_state(self) -> str | None:
        """What the partner is doing, in its own word, such as ``"wait"``; None without one."""
        return None if self._team is None else self._team.command.state

    @property
    def robot_target(self) -> str | None:
        """Name of the station or counter that the partner goes for."""
        return None if self._team is None else self._team.command.target

    def team_measures(self) -> Mapping[str, float]:
        """Measures of the team so far, by the names of :meth:`.TeamMetrics.summary`; none without a partner."""
        return {} if self._team is None else self._team.summary()

    # -- questions to the game ---------------------------------------------------------------------------------------

    def view(self) -> GameView:
        """A snapshot of the game in words, for drawing."""
        view = make_view(self._packed.layout, self._state, self._rules, self.settings.rules)
        if self._team is None or not self._team.has_robot:
            return view
        person, robot = view.players
        return replace(view, players=(person, replace(robot, is_robot=True)))

    def arrays(self) -> tuple[Vector, Kitchen, Vector]:
        """The game's ``(state, kitchen, rules)`` as described in ``vectors``; not copies, to be read only."""
        return self._state, self._kitchen, self._rules

    @property
    def num_players(self) -> int:
        """Number of players."""
        return self._players

    @property
    def goals(self) -> tuple[str, ...]:
        """Names of the first player's valid goals, in reading order: those that ``info["goal_mask"]`` marks."""
        return self.goals_of(0)

    def goals_of(self, player: int) -> tuple[str, ...]:
        """Names of a player's valid goals, in reading order."""
        return name_goals(self._packed.layout, self._goals[player])

    @property
    def goal_names(self) -> npt.NDArray[np.str_]:
        """``(H, W)`` name of each cell as a goal, so that ``goal_names[info["goal_mask"]]`` names the valid ones."""
        return np.array(self._packed.layout.goal_names).reshape(self.settings.shape)

    def action_masks(self) -> npt.NDArray[np.bool_]:
        """``(6,)`` actions that do something now, staying always; the others would leave the game as it is.

        With several players ``(num_players, 6)``. The name is the one that ``MaskablePPO`` of sb3-contrib calls;
        ``info["action_mask"]`` says the same as int8.

        Raises:
            ResetNeeded: Before the first reset.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call env.action_masks() before calling env.reset()")
        masks = np.empty((1, self._players, NUM_ACTIONS), dtype=np.int8)
        batch.find_all_actions(self._state[None], self._kitchen[None], self._rules, masks)
        return (masks[0, 0] if self._agents == 1 else masks[0]).astype(np.bool_)

    def trajectories(
        self,
        *,
        participant: str = "",
        condition: str = "",
        candidate_set: Literal["game", "all"] = "game",
        player: int = 0,
        **options: Any,
    ) -> list[Trajectory]:
        """The trajectories of this episode so far, in order: empty-handed from a pot or serving station to a dispenser.

        Nothing is kept for them but the actions, which are played again when this is called.

        Args:
            participant: Who plays.
            condition: Under which condition.
            candidate_set: Whether the candidates are the goals valid in the running game when the trajectory begins, or
                all in reach.
            player: Whose trajectories.
            **options: Of :func:`~legible_envs.overcooked.trajectories.trajectories_from_states`: ``layout_name``,
                ``seconds_per_tick``, ``min_positions``, ``min_candidates``.
        """
        actions = np.frombuffer(bytes(self._log), dtype=np.uint8).astype(np.int64).reshape(-1, self._players)
        states = np.empty((len(actions) + 1, len(self._state)), dtype=np.int32)
        goals = np.empty((len(states), *self._goals.shape), dtype=np.bool_)
        batch.play_back(self._kitchen, self._rules, actions, states, goals)
        return trajectories_from_states(
            self._packed.layout,
            states,
            goals[:, player] if candidate_set == "game" else None,
            player=player,
            participant=participant,
            condition=condition,
            **options,
        )

    @staticmethod
    def get_keys_to_action() -> dict[tuple[int, ...], int]:
        """Keys for ``gymnasium.utils.play`` (give it ``noop=4``): arrows or W A S D, and space or E to interact."""
        up, down, right, left = 1073741906, 1073741905, 1073741903, 1073741904
        keys = {up: 0, down: 1, right: 2, left: 3, ord("w"): 0, ord("s"): 1, ord("d"): 2, ord("a"): 3}
        return {(key,): action for key, action in {**keys, ord(" "): 5, ord("e"): 5}.items()}
