"""Many playable kitchens in one: compiled, a layout per game, and the same trajectories as ``SyncVectorEnv``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from legible_envs.drawing.rendered import Windowed
from legible_envs.errors import LayoutError
from legible_envs.overcooked.batch_game import GameOfBatch
from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.game import batch
from legible_envs.overcooked.game.batch import Batch, Outcome
from legible_envs.overcooked.game.rules import count_pots, pack_rules
from legible_envs.overcooked.game.snapshot import make_view, name_goals, to_text
from legible_envs.overcooked.game.vectors import CROSSINGS, DELIVERIES, STATE_SIZE, Kitchen, Vector
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.layout_batches import layout_entries
from legible_envs.overcooked.layouts import read_layout
from legible_envs.overcooked.rendering.board import draw_small, tile_pictures
from legible_envs.overcooked.settings import NUM_ACTIONS, KitchenSettings, PackedKitchen
from legible_envs.support.per_env import check_count, read_autoreset_mode, read_reset_mask, read_seeds, read_step_limit
from legible_envs.support.specs import JsonSpec, check_options
from legible_envs.support.validation import as_array, integer, shown

__all__ = ["OvercookedVectorEnv"]

MOST_GAMES: Final = 65_536
"""Games of one vector environment."""
MOST_BYTES: Final = 2**32
"""Of the arrays of all games."""
_MARKS: Final = tuple(
    f"_{key}" for key in ("goal_mask", "action_mask", "layout_id", "num_done", "deliveries", "crossings")
)
"""For each key of infos, the one that says which games have it; as in ``SyncVectorEnv``."""

Infos = dict[str, Any]


def _check_memory(count: int, packed: PackedKitchen, observations: spaces.Space[Any]) -> None:
    """Refuse more games than there is room for, before any is made.

    Raises:
        ValueError: Their arrays would take more than ``MOST_BYTES``.
    """
    arrays = (packed.routes, *(array for array in packed.kitchen if isinstance(array, np.ndarray)))
    each = sum(array.nbytes for array in arrays) + 4 * int(packed.rules[STATE_SIZE])
    each += int(np.prod(observations.shape or (1,))) * np.dtype(observations.dtype).itemsize
    if count * each > MOST_BYTES:
        raise ValueError(
            f"`num_envs`: {count:,} games in kitchens of {packed.layout.shape} take {count * each / 2**30:.1f} GiB; "
            f"expected at most {MOST_BYTES / 2**30:g} GiB, which are {MOST_BYTES // each:,} games"
        )


class OvercookedVectorEnv(JsonSpec, Windowed, VectorEnv[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]):
    """``num_envs`` games of :class:`~legible_envs.overcooked.env.OvercookedEnv`, advanced by one compiled call.

    Made by ``gymnasium.make_vec("LegibleOvercooked-v0", num_envs=N, vectorization_mode="vector_entry_point")``.
    Observations, rewards, terminations, truncations and infos are those of ``SyncVectorEnv`` with the same seeds, in
    all three autoreset modes. ``envs.reset(options={"layout": ...})`` takes one kitchen for all games or one for each,
    see "Vectors" there; ``envs.set_attr("layout", [...])`` does so from each game's next reset on. Names of goals:
    ``envs.call("goals")``, or ``envs.goals(i)`` of one game.

    Args:
        num_envs: Number of games.
        max_episode_steps: Steps after which an episode is truncated; None or -1: never.
        autoreset_mode: ``gymnasium.vector.AutoresetMode`` or its value. Given directly: Gymnasium's ``vector_kwargs``
            are for ``vectorization_mode="sync"`` and ``"async"`` alone.
        render_mode: None, ``"human"`` (all games in one window), ``"rgb_array"`` or ``"ansi"`` (one picture or drawing
            per game).
        **kwargs: As for :class:`~legible_envs.overcooked.env.OvercookedEnv`.

    Raises:
        LayoutError: See :class:`~legible_envs.overcooked.env.OvercookedEnv`.
        ValueError: Likewise, and numbers out of range.
    """

    _window_title = "Legible kitchens"

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = 1200,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__()
        self.autoreset_mode = read_autoreset_mode(autoreset_mode)
        self.metadata = {**OvercookedEnv.metadata, "autoreset_mode": self.autoreset_mode}
        self._set_render_mode(render_mode)
        self.num_envs = integer("num_envs", num_envs, 1, MOST_GAMES, whole_floats=True)
        for name in ("partner", "predictor", "threshold"):
            if kwargs.pop(name, None) is not None:
                raise ValueError(
                    f"the batched kitchen knows no `{name}`: partners decide one by one; make the vector with "
                    'vectorization_mode="sync" (or "async")'
                )
        self.settings = KitchenSettings(**kwargs)
        self.max_episode_steps = read_step_limit(max_episode_steps)
        self.num_players = self.settings.num_players
        self.single_action_space = self.settings.action_space()
        self.single_observation_space = self.settings.observation_space()
        packed = self.settings.pack(self.settings.preview())
        _check_memory(self.num_envs, packed, self.single_observation_space)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * self.num_envs
        self._seeds = [-1] * self.num_envs
        self._ended = 0
        self._begun = False
        self._allocate(packed)

    def _allocate(self, packed: PackedKitchen) -> None:
        """Make the arrays, every game in the same kitchen."""
        count = self.num_envs
        cells = self.settings.shape[0] * self.settings.shape[1]
        self._num_pots = count_pots(packed.layout)
        self._packed = [packed] * count
        self._chosen: list[PackedKitchen | None] = [None] * count
        self._ids = np.full(count, int(packed.layout.layout_id, 16), dtype=np.int64)
        self._routes = np.repeat(packed.routes[None], count, axis=0)
        self._games = Batch(
            states=np.zeros((count, int(packed.rules[STATE_SIZE])), dtype=np.int32),
            kitchens=np.repeat(packed.kitchen[None], count, axis=0),
            rules=packed.rules,
            goals=np.zeros((count, self.num_players, cells), dtype=np.bool_),
            drawn=np.full((count, self.num_players), -1, dtype=np.int32),
            done=np.zeros(count, dtype=np.bool_),
        )
        own = self.settings.player_observation_space().shape
        self._kernel_shape = (count, self.num_players, *own)  # type: ignore[misc]
        self._observations_shape = (count, *self.single_observation_space.shape)  # type: ignore[misc]
        self._grids = np.zeros(self._kernel_shape if self.settings.obs_type == "grid" else 0, dtype=np.uint8)
        players = () if self.num_players == 1 else (self.num_players,)
        self._goals_shape = (count, *players, *self.settings.shape)
        self._masks_shape = (count, *players, NUM_ACTIONS)
        self._everyone = np.ones(count, dtype=np.bool_)

    # -- the Gymnasium interface --------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[Any], Infos]:
        """Start all episodes, or those of a mask.

        Args:
            seed: None, a number (game ``i`` gets ``seed + i``), or one per game.
            options: ``{"layout": …}``, one for all games (None: their own) or a list or array with one for each (None:
                the one it has); ``{"reset_mask": (N,) bool}`` to reset only some, and give only these their kitchens.

        Returns:
            ``(observations, infos)``.

        Raises:
            LayoutError: A bad kitchen, or another number of kitchens than of games; nothing is changed.
            ValueError: Options that are no mapping, unknown keys, or seeds or a mask that are not as above; likewise.
        """
        asked = check_options(options, known=("layout", "reset_mask"))
        seeds = read_seeds(seed, self.num_envs)
        which = read_reset_mask(asked, self.num_envs)
        if "layout" in asked:
            chosen = self._read_layouts(asked["layout"])
            self._chosen = [new if there else old for new, old, there in zip(chosen, self._chosen, which, strict=True)]
        for i in np.flatnonzero(which):
            if seeds[i] is not None:
                self._rngs[i], self._seeds[i] = seeding.np_random(seeds[i])
        self._begun = True
        masks = self._restart(which)
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._infos(masks, which)

    def step(
        self, actions: npt.NDArray[Any]
    ) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], Infos]:
        """Advance all games by one tick.

        Args:
            actions: ``(N,)`` integers 0..5; with several players ``(N, num_players)``.

        Returns:
            ``(observations, rewards, terminations, truncations, infos)``, the middle three of shape ``(N,)``.

        Raises:
            ResetNeeded: Before the first reset; or, without autoreset, while a finished game is not reset.
            ValueError: Actions of another shape, or out of range.
        """
        moves = self._read_actions(actions)
        self._check_begun()
        games = self._games
        if self._ended:
            for i in np.flatnonzero(games.done):
                self._enter_next(int(i))
            games = self._games
        count = self.num_envs
        ends = np.empty((2, count), dtype=np.bool_)
        masks = np.empty((count, self.num_players, NUM_ACTIONS), dtype=np.int8)
        outcome = Outcome(masks, np.empty(count), ends[0], ends[1])
        limit = self.max_episode_steps or 0
        self._ended = batch.play_all(*games, self.settings.weights, limit, moves, *outcome)
        final: Infos = {}
        if self._ended and self.autoreset_mode == AutoresetMode.SAME_STEP:
            final = self._finish(games.done, outcome.masks)
            self._restart(games.done, outcome.masks)
        infos = self._infos(outcome.masks)
        infos.update(final)
        if self.render_mode == "human":
            self.render()
        return self._observe(), outcome.rewards, outcome.terminated, outcome.truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """One picture ``(H', W', 3)`` or drawing per game; with ``"human"`` all games in one window, and None."""
        views = [self.view(i) for i in range(self.num_envs)]
        if self.render_mode == "ansi":
            return tuple(to_text(view) for view in views)
        from legible_envs.overcooked.rendering import draw_game

        if self.render_mode == "rgb_array":
            return tuple(draw_game(view) for view in views)
        if self.render_mode == "human":
            self._show(tile_pictures(views))
        return None

    def action_masks(self, index: int | None = None) -> npt.NDArray[np.bool_]:
        """Actions that do something now, staying always; see :meth:`.OvercookedEnv.action_masks`.

        Args:
            index: Number of a game.

        Returns:
            ``(6,)`` for one game, ``(N, 6)`` for all; with several players ``(num_players, 6)`` and
            ``(N, num_players, 6)``.

        Raises:
            ResetNeeded: Before the first reset.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call envs.action_masks() before calling envs.reset()")
        games, which = self._games, slice(None) if index is None else slice(index, index + 1)
        masks = np.empty((len(games.states[which]), self.num_players, NUM_ACTIONS), dtype=np.int8)
        batch.find_all_actions(games.states[which], games.kitchens[which], games.rules, masks)
        masks = masks.reshape(len(masks), *self._masks_shape[1:])
        return (masks if index is None else masks[0]).astype(np.bool_)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if there is one."""
        self._close_window()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of all kitchens of these games."""
        return self.settings.shape

    # -- each game ----------------------------------------------------------------------------------------------------

    def game(self, index: int) -> GameOfBatch:
        """One game, looked at as if it were an environment of its own."""
        return GameOfBatch(self, index)

    def view(self, index: int) -> GameView:
        """A snapshot of one game in words, for drawing."""
        games = self._games
        return make_view(self._packed[index].layout, games.states[index], games.rules, self.settings.rules)

    def layout(self, index: int) -> OvercookedLayout:
        """The kitchen of one game: the one set for the next reset, else the one being played in."""
        return (self._chosen[index] or self._packed[index]).layout

    def arrays(self, index: int) -> tuple[Vector, Kitchen, Vector]:
        """One game's ``(state, kitchen, rules)`` as described in ``vectors``; not copies, to be read only."""
        return self._games.states[index], self._games.kitchens[index], self._games.rules

    def goals(self, index: int) -> tuple[str, ...]:
        """Names of the first player's valid goals in one game, in reading order; ``call("goals")``: in all games."""
        return self.goals_of(index, 0)

    def goals_of(self, index: int, player: int) -> tuple[str, ...]:
        """Names of a player's valid goals in one game, in reading order."""
        return name_goals(self._packed[index].layout, self._games.goals[index, player])

    def generator(self, index: int) -> tuple[np.random.Generator, int]:
        """The random generator of one game, and its seed; made now if it has none yet."""
        rng = self._rngs[index]
        if rng is None:
            rng, self._seeds[index] = seeding.np_random()
            self._rngs[index] = rng
        return rng, self._seeds[index]

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every game, or get its attribute; as if each were an ``OvercookedEnv``.

        Args:
            name: ``layout``, ``view``, ``arrays``, ``goals``, ``goal_names``, ``action_masks``, ``render``,
                ``np_random``, ``np_random_seed``, or any attribute that all games share, such as ``settings`` or
                ``render_mode``.
            *args: Arguments of the method.
            **kwargs: Arguments of the method.

        Raises:
            AttributeError: The games have nothing of this name.
        """
        values = [getattr(self.game(i), name) for i in range(self.num_envs)]
        return tuple(value(*args, **kwargs) if callable(value) else value for value in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Get an attribute of every game; see :meth:`call`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set the kitchens of the games' next resets.

        Args:
            name: ``"layout"``; nothing else can be set.
            values: One kitchen for all, or a list, tuple or array of one per game; None returns a game to its own.

        Raises:
            AttributeError: Another name.
            ValueError: Another number of kitchens.
            LayoutError: A bad kitchen; nothing is changed.
        """
        if name != "layout":
            raise AttributeError(f"only the attribute 'layout' can be set in the games of {self}, not {name!r}")
        # As in Gymnasium's vectors, a list or tuple always holds one value per game.
        layouts = list(values) if isinstance(values, list | tuple) else layout_entries(values, self.settings.shape)
        if layouts is None:
            layouts = [values] * self.num_envs
        check_count("layout", layouts, self.num_envs)
        known: dict[int, PackedKitchen] = {}
        self._chosen = [None if layout is None else self._read(layout, known) for layout in layouts]

    def set_layout(self, index: int, layout: Any) -> None:
        """Set the kitchen of one game's next resets; None returns to its own.

        Raises:
            LayoutError: A bad kitchen; nothing is changed.
        """
        self._chosen[index] = None if layout is None else self._read(layout, {})

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of each game."""
        return tuple(self.generator(i)[0] for i in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of each game's random generator."""
        return tuple(self.generator(i)[1] for i in range(self.num_envs))

    # -- inside -------------------------------------------------------------------------------------------------------

    def _read_layouts(self, value: Any) -> list[PackedKitchen | None]:
        """The kitchen chosen for each game, None where it plays in its own, from what the options of a reset say."""
        layouts = layout_entries(value, self.settings.shape)
        if layouts is None:
            return [None if value is None else self._read(value, {})] * self.num_envs
        check_count("layout", layouts, self.num_envs, partial(LayoutError, rule="count"))
        known: dict[int, PackedKitchen] = {}
        return [
            before if layout is None else self._read(layout, known)
            for layout, before in zip(layouts, self._chosen, strict=True)
        ]

    def _read(self, value: Any, known: dict[int, PackedKitchen]) -> PackedKitchen:
        """Read and check a kitchen; one object given for many games is read once."""
        if id(value) not in known:
            known[id(value)] = self.settings.pack(read_layout(value, self.settings.shape))
        return known[id(value)]

    def _read_actions(self, actions: Any) -> npt.NDArray[np.int64]:
        moves = actions if type(actions) is np.ndarray else as_array(actions)
        if moves.shape != self.action_space.shape or moves.dtype.kind not in "iu":
            expected = self.num_envs if self.num_players == 1 else self.action_space.shape
            raise ValueError(
                f"expected {expected} integer actions, got shape {moves.shape} of {moves.dtype}: {shown(actions)}"
            )
        moves = moves.reshape(self.num_envs, self.num_players)
        if not batch.all_within(moves.ravel(), NUM_ACTIONS):
            raise ValueError(f"expected actions 0..{NUM_ACTIONS - 1}, got {shown(actions)}")
        return moves.astype(np.int64)

    def _check_begun(self) -> None:
        if not self._begun:
            raise ResetNeeded("Cannot call envs.step() before calling envs.reset()")
        if self._ended and self.autoreset_mode == AutoresetMode.DISABLED:
            over = np.flatnonzero(self._games.done).tolist()
            raise ResetNeeded(
                f"games {over} are over and autoreset is disabled: reset them with "
                "envs.reset(options={'reset_mask': mask})"
            )

    def _enter_next(self, index: int) -> None:
        """Put one game into the kitchen of its next episode."""
        packed = self._chosen[index]
        if packed is None:
            layout = self.settings.layout
            if layout is None:
                assert self.settings.distribution is not None
                layout = self.settings.distribution.sample(self.generator(index)[0])
            if layout is self._packed[index].layout:
                return
            packed = self.settings.pack(layout)
        if packed is self._packed[index]:
            return
        self._make_room(count_pots(packed.layout))
        self._packed[index] = packed
        self._ids[index] = int(packed.layout.layout_id, 16)
        self._games.kitchens[index] = packed.kitchen
        self._routes[index] = packed.routes

    def _make_room(self, num_pots: int) -> None:
        """Let every state have room for so many pots."""
        if num_pots <= self._num_pots:
            return
        self._num_pots = num_pots
        rules = pack_rules(self.settings.rules, self.settings.shape, self.num_players, num_pots)
        before = self._games.states
        states = np.full((self.num_envs, int(rules[STATE_SIZE])), -1, dtype=np.int32)
        states[:, : before.shape[1]] = before
        self._games = self._games._replace(states=states, rules=rules)

    def _restart(self, which: npt.NDArray[np.bool_], masks: npt.NDArray[np.int8] | None = None) -> npt.NDArray[np.int8]:
        """Start new episodes in some games; returns the action masks with theirs written."""
        if masks is None:
            masks = np.zeros((self.num_envs, self.num_players, NUM_ACTIONS), dtype=np.int8)
        for i in np.flatnonzero(which):
            self._enter_next(int(i))
            games = self._games
            batch.begin(games.states[i], games.kitchens[i], games.rules, games.goals[i], masks[i])
        self._games.drawn[which, 0] = -1
        self._games.done[which] = False
        self._ended = int(np.count_nonzero(self._games.done))
        return masks

    def _observe(self) -> npt.NDArray[Any]:
        games, obs_type = self._games, self.settings.obs_type
        if obs_type == "grid":
            batch.refresh_grids(games.states, games.kitchens, games.rules, games.drawn, self._grids)
            return self._grids.copy().reshape(self._observations_shape)
        if obs_type == "vector":
            features = np.zeros(self._kernel_shape, dtype=np.float32)
            batch.vector_observations(games.states, games.kitchens, games.rules, self._routes, features)
            return features.reshape(self._observations_shape)
        pictures = np.stack([draw_small(self.view(i)) for i in range(self.num_envs)])
        if self.num_players == 1:
            return pictures
        return np.repeat(pictures[:, None], self.num_players, axis=1)

    def _infos(self, masks: npt.NDArray[np.int8], which: npt.NDArray[np.bool_] | None = None) -> Infos:
        """The games' infos as ``SyncVectorEnv`` gathers them; zeros in games that have none."""
        states = self._games.states
        done = states[:, DELIVERIES].astype(np.int64)
        infos: Infos = {
            "goal_mask": self._games.goals.copy().reshape(self._goals_shape),
            "action_mask": masks.reshape(self._masks_shape),
            "layout_id": self._ids.copy(),
            "num_done": done,
            "deliveries": done.copy(),
            "crossings": states[:, CROSSINGS].astype(np.int64),
        }
        if which is not None and not which.all():
            for values in infos.values():
                values[~which] = 0
        told = self._everyone if which is None else which
        marks = np.empty((len(_MARKS), len(told)), dtype=np.bool_)
        marks[:] = told
        infos.update(zip(_MARKS, marks, strict=True))
        return infos

    def _finish(self, done: npt.NDArray[np.bool_], masks: npt.NDArray[np.int8]) -> Infos:
        """The last results of a game that ends and starts again in the same step."""
        observations = self._observe()
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(done):
            final[i] = observations[i].copy()
        return {
            "final_obs": final,
            "_final_obs": done.copy(),
            "final_info": self._infos(masks.copy(), done),
            "_final_info": done.copy(),
        }
