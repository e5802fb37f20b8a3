"""Cook in a kitchen yourself: a window, a keyboard, and a record of the game."""

from __future__ import annotations

import json
import os
import warnings
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from legible_envs.drawing.window import open_screen, room_for_a_window
from legible_envs.overcooked.game.vectors import INTERACT, STAY
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout
from legible_envs.overcooked.layouts import read_kitchen
from legible_envs.overcooked.reach import reach_of
from legible_envs.overcooked.recipes import PAPER_SOUPS, Recipe, check_recipes
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.plain_data import parse_json
from legible_envs.support.stored_arrays import stored_array, stored_text
from legible_envs.support.validation import real, shown

if TYPE_CHECKING:
    from legible_envs.overcooked.kitchen_file import KitchenFile
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Played", "load_played", "play", "read_played", "recipes_for", "tile_for", "trajectories_from_played"]

ENV_ID: Final = "LegibleOvercooked-v0"
_POLLS_PER_SECOND: Final = 60
_QUEUE: Final = 2  # more taps than this ahead of the game would make it feel slow to answer
_SCHEMA: Final = 1
_LEAST_TILE, _LARGEST_TILE = 8, 160  # pixels of a cell's side


@dataclass(frozen=True, eq=False)
class Played:
    """Games that a person played.

    Attributes:
        layout: The kitchen.
        recipes: The ordered soups.
        virtual_obstacles: ``"hard"`` or ``"soft"``.
        seed: Seed of the first game, or None.
        actions: ``(T,)`` int8, the action of every step.
        episodes: ``(T,)`` int32, which game the step belongs to, from 0.
        rewards: ``(T,)`` float64.
        interrupted: Whether Ctrl-C ended them; not written to the file.
    """

    layout: OvercookedLayout
    recipes: tuple[Recipe, ...]
    virtual_obstacles: str = "hard"
    seed: int | None = None
    actions: npt.NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, np.int8))
    episodes: npt.NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))
    rewards: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    interrupted: bool = False

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an ``.npz`` that :func:`load_played` reads; the name is used as given.

        Raises:
            OSError: The place cannot be written to; a file that was there stays.
        """
        about = {
            "schema": _SCHEMA,
            "env": ENV_ID,
            "layout": self.layout.to_ascii(),
            "recipes": self.recipes,
            "virtual_obstacles": self.virtual_obstacles,
            "seed": self.seed,
        }
        arrays = {"actions": self.actions, "episodes": self.episodes, "rewards": self.rewards}
        write_npz(path, {"about": np.array(json.dumps(about)), **arrays})

    def make_env(self, render_mode: str | None = None) -> gym.Env[Any, Any]:
        """The environment it was played in; the recorded actions give the recorded rewards again."""
        return gym.make(
            f"legible_envs:{ENV_ID}",
            shape=self.layout.shape,
            layout=self.layout.to_ascii(),
            recipes=self.recipes,
            virtual_obstacles=self.virtual_obstacles,
            render_mode=render_mode,
        )


def load_played(path: str | os.PathLike[str]) -> Played:
    """Read what :func:`play` recorded.

    Raises:
        OSError: No such file.
        ValueError: The file is something else.
    """
    from legible_envs.overcooked.played_file import PlayedContent
    from legible_envs.support.models import validated

    try:
        with open_npz(path) as file:
            about = validated(PlayedContent, parse_json(stored_text(file, "about")), "`about`")
            if about.env != ENV_ID:
                raise ValueError(f"it was played in {shown(about.env)}, expected {ENV_ID}")
            actions = stored_array(file, "actions", "iu", (None,))
            episodes = stored_array(file, "episodes", "iu", actions.shape)
            rewards = stored_array(file, "rewards", "f", actions.shape, finite=True)
        if len(actions) and not 0 <= actions.min() <= actions.max() <= INTERACT:
            raise ValueError(f"`actions` must be numbers from 0 to {INTERACT}")
        if len(actions) and (episodes[0] != 0 or (episodes[1:] < episodes[:-1]).any() or episodes[-1] >= len(actions)):
            raise ValueError("`episodes` must count the games from 0")
        return Played(
            OvercookedLayout.from_ascii(about.layout),
            check_recipes(about.recipes),
            about.virtual_obstacles,
            about.seed,
            actions.astype(np.int8),
            episodes.astype(np.int32),
            rewards.astype(np.float64),
        )
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)} is no recorded play: {error}") from error


def read_played(path: Path) -> list[Trajectory] | None:
    """The trajectories in recorded play, its participant named like the file; None where the file is something else.

    Raises:
        OSError: No such file.
        ValueError: The recording belongs to another version of the game.
    """
    try:
        played = load_played(path)
    except ValueError:
        return None
    return trajectories_from_played(played, participant=path.stem)


def trajectories_from_played(
    played: Played, *, candidate_set: Literal["game", "all"] = "game", **labels: Any
) -> list[Trajectory]:
    """The trajectories in what ``legible play --record`` wrote, by playing its actions again.

    Args:
        played: As of :func:`load_played`.
        candidate_set: Whether the candidates are the goals valid in the running game or all in reach.
        labels: Further arguments of ``OvercookedEnv.trajectories``: ``participant``, ``condition``, ….

    Raises:
        ValueError: The actions do not give the recorded rewards: the recording is of another version of the game.
    """
    env = played.make_env()
    game: Any = env.unwrapped
    found: list[Trajectory] = []
    try:
        current = None
        for number, (action, episode) in enumerate(zip(played.actions, played.episodes, strict=True)):
            if episode != current:
                found += game.trajectories(candidate_set=candidate_set, **labels)
                env.reset(seed=played.seed if current is None else None)
                current = episode
            _, reward, *_ = env.step(int(action))
            if not np.isclose(float(reward), played.rewards[number]):
                raise ValueError(
                    f"step {number} was recorded with reward {played.rewards[number]:g} and gives {float(reward):g} "
                    "now; the recording belongs to another version of the game"
                )
        return found + game.trajectories(candidate_set=candidate_set, **labels)
    finally:
        env.close()


def recipes_for(layout: OvercookedLayout, player: int = 1) -> tuple[Recipe, ...]:
    """Soups that a player can cook: the paper's whose ingredients are in reach, else three of each such ingredient.

    Where no ingredient is in reach, soups are of all in the kitchen, so that errors name what the player lacks.

    Args:
        layout: The kitchen.
        player: Number of the player, from 1.

    Raises:
        LayoutError: The kitchen has no start of this player.
    """
    in_reach, drawn = (set(map(_kind, names)) for names in (reach_of(layout, player).stations, layout.stations))
    there = in_reach.intersection(INGREDIENTS) or drawn
    known = tuple(soup for soup in PAPER_SOUPS if there >= set(soup))
    return known or tuple((kind,) * 3 for kind in INGREDIENTS if kind in there) or PAPER_SOUPS


def _kind(name: str) -> str:
    return name.partition("@")[0]


def play(
    layout: OvercookedLayout | KitchenFile | str | Sequence[str],
    *,
    recipes: Sequence[Sequence[str]] | None = None,
    fps: int = 8,
    record: str | os.PathLike[str] | None = None,
    virtual_obstacles: str = "hard",
    seed: int | None = None,
    zoom: float | None = None,
) -> Played:
    """Open a window and cook: arrow keys or W A S D to walk, space or E to interact, Esc to end.

    The game runs in real time, as the recorded games of Overcooked-AI did; it starts with the first key, and another
    one starts after it. A walking key repeats while it is held, a tap shorter than a step still counts, and
    interacting happens once per tap.

    Args:
        layout: The kitchen; also a drawing, a list of rows, or a :class:`.KitchenFile`.
        recipes: The ordered soups; None takes those that the kitchen's file orders, else those of :func:`recipes_for`.
        fps: Steps per second.
        record: Where to write the actions (``.npz``), also when the window is closed or the game is
            interrupted; not written if no step was played.
        virtual_obstacles: ``"hard"`` or ``"soft"`` (can be crossed, crossings are counted).
        seed: Seed of the first game.
        zoom: Enlargement of the environment's picture; None draws cells as large as the screen has room for.

    Returns:
        What was played.

    Raises:
        LayoutError: A kitchen in which the soups cannot be cooked.
        OSError: The recording cannot be written; checked before the game begins.
        RuntimeError: There is no screen to open a window on.
        ValueError: A bad number of steps per second.
    """
    real("fps", fps, 1, _POLLS_PER_SECOND, unit="steps per second")
    kitchen = read_kitchen(layout, orders=recipes is None)
    layout = kitchen.layout
    soups = check_recipes(recipes if recipes is not None else kitchen.recipes or recipes_for(layout))
    setting = Played(layout, soups, virtual_obstacles, seed)
    if record is not None:
        _check_writable(Path(record))
    env = setting.make_env("rgb_array")
    steps: list[tuple[int, int, float]] = []
    interrupted = False
    try:
        _PlayWindow(env, fps, zoom, seed, steps).run()
    except KeyboardInterrupt:
        interrupted = True  # a way to end like any other
    finally:
        env.close()
        actions, episodes, rewards = zip(*steps, strict=True) if steps else ((), (), ())
        played = Played(
            layout,
            soups,
            virtual_obstacles,
            seed,
            np.array(actions, np.int8),
            np.array(episodes, np.int32),
            np.array(rewards, np.float64),
            interrupted,
        )
        if record is not None and steps:  # an earlier recording is not replaced by nothing
            played.save(record)
    return played


def _check_writable(path: Path) -> None:
    """Fail now rather than after an hour of play."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; name a file to record to")
    if not os.access(path.parent, os.W_OK):
        raise PermissionError(f"cannot write to the folder {path.parent}")


class _Enlarged(gym.Wrapper[Any, Any, Any, Any]):
    """A kitchen drawn with cells of another size, sharp at any."""

    def __init__(self, env: gym.Env[Any, Any], tile: int) -> None:
        super().__init__(env)
        self._tile = tile

    def render(self) -> Any:
        from legible_envs.overcooked.rendering import draw_game

        return draw_game(self.env.get_wrapper_attr("view")(), tile=self._tile)


def tile_for(shape: tuple[int, int], room: tuple[int, int]) -> int:
    """Pixels of a cell's side, so that a game fills the screen: a multiple of 8 up to 160; sprites are sharp at any.

    Args:
        shape: Rows and columns of the kitchen.
        room: Width and height for the picture with the strip of orders.
    """
    from legible_envs.overcooked.rendering import hud_height

    def fits(tile: int) -> bool:
        return shape[1] * tile <= room[0] and shape[0] * tile + hud_height(tile) <= room[1]

    return max(filter(fits, range(_LEAST_TILE, _LARGEST_TILE + 1, _LEAST_TILE)), default=_LEAST_TILE)


class _PlayWindow:
    """A window on an environment: Gymnasium's playable game, with taps that count and keys that repeat."""

    def __init__(
        self,
        env: gym.Env[Any, Any],
        fps: int,
        zoom: float | None,
        seed: int | None,
        steps: list[tuple[int, int, float]],
    ) -> None:
        from legible_envs.overcooked.rendering import load_pygame

        self._pygame = load_pygame()
        with warnings.catch_warnings():  # Gymnasium says on import that it would like matplotlib for plots
            warnings.simplefilter("ignore")
            from gymnasium.utils import play as gym_play
        self._env, self._fps, self._steps, self._show = env, fps, steps, gym_play.display_arr
        self._keys: dict[int, int] = {
            key: action for (key,), action in env.get_wrapper_attr("get_keys_to_action")().items()
        }
        self._taps: deque[int] = deque(maxlen=_QUEUE)
        self._held: list[int] = []
        env.reset(seed=seed)
        open_screen()
        if zoom is None:
            self._env = env = _Enlarged(env, tile_for(env.get_wrapper_attr("layout").shape, room_for_a_window()))
        try:
            self._game = gym_play.PlayableGame(env, {(key,): action for key, action in self._keys.items()}, zoom)
        except self._pygame.error as error:
            raise RuntimeError(f"cannot open a window: {error}") from error
        self._pygame.display.set_caption("Legible kitchen")

    def run(self) -> None:
        """Play games until the window is closed."""
        episode = 0
        try:
            self._wait("Cook the orders!", "Arrow keys or WASD: walk", "Space: take, put, serve", "Esc: end")
            while self._game.running:
                delivered, steps = self._play_one(episode)
                if self._game.running:
                    soups = "1 soup" if delivered == 1 else f"{delivered} soups"
                    self._wait(f"{soups} in {steps} steps", "Any key: play again", "Esc: end")
                    self._env.reset()
                    episode += 1
        finally:
            self._pygame.quit()

    def _play_one(self, episode: int) -> tuple[int, int]:
        clock, polls = self._pygame.time.Clock(), max(1, round(_POLLS_PER_SECOND / self._fps))
        info: dict[str, Any] = {}
        steps, over = 0, False
        self._draw()
        while self._game.running and not over:
            for _ in range(polls):
                self._poll()
                clock.tick(self._fps * polls)
            if self._game.running:
                action = self._next_action()
                _, reward, terminated, truncated, info = self._env.step(action)
                self._steps.append((action, episode, float(reward)))
                steps, over = steps + 1, terminated or truncated
                self._draw()
        return int(info.get("deliveries", 0)), steps

    def _wait(self, *lines: str) -> None:
        """Show a message until a key is pressed or the window closed."""
        clock = self._pygame.time.Clock()
        self._taps.clear()
        pressed = False
        while self._game.running and not pressed:
            self._draw(lines)
            pressed = self._poll()
            clock.tick(_POLLS_PER_SECOND // 2)
        self._taps.clear()
        self._held.clear()

    def _poll(self) -> bool:
        """Take in what happened at the keyboard and the window; whether a key went down."""
        pressed = False
        for event in self._pygame.event.get():
            self._game.process_event(event)
            if event.type == self._pygame.KEYDOWN:
                pressed = True
                if event.key in self._keys:
                    self._taps.append(self._keys[event.key])
                    self._held.append(event.key)
            elif event.type == self._pygame.KEYUP and event.key in self._held:
                self._held.remove(event.key)
            elif event.type == self._pygame.WINDOWFOCUSLOST:
                self._held.clear()
        return pressed

    def _next_action(self) -> int:
        if self._taps:
            return self._taps.popleft()
        walking = [self._keys[key] for key in self._held if self._keys[key] != INTERACT]
        return walking[-1] if walking else STAY

    def _draw(self, lines: Sequence[str] = ()) -> None:
        from legible_envs.drawing.sheets import overlay

        picture: Any = self._env.render()
        if lines:
            picture = overlay(picture, lines, max(48, picture.shape[1] // 8))
        self._show(self._game.screen, picture, transpose=True, video_size=self._game.video_size)
        self._pygame.display.flip()
