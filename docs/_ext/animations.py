"""The moving pictures of README and site, made by the program itself.

    python docs/_ext/animations.py    # writes these four, about ten seconds

- ``docs/images/prediction.gif``: one person fetches the same ingredients in two kitchens, and an observer's belief;
- ``docs/images/kitchen.gif``: ``LegibleOvercooked-v0`` with the scripted player;
- ``docs/images/table.gif``: ``LegibleTabletop-v0`` with a simulated participant;
- ``docs/images/design.gif``: ``LegibleDesign-v0`` with a designer who always makes the best edit.

All are seeded: a second run writes the same bytes. The pages of the environments show the last three as well.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import numpy as np
from PIL import Image
from scipy.spatial import KDTree

import legible_envs  # noqa: F401 - registers the environments
from legible_envs.drawing.canvas import Canvas, paste, text_sprite
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.game.view import GameView, PlayerView
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.rendering import draw_game
from legible_envs.rollouts import Trajectory
from legible_envs.tabletop.humans import sample_person
from legible_envs.tabletop.policies import ReachingPlayer
from predictors import BayesianGoalPredictor

IMAGES = Path(__file__).parents[1] / "images"
TILE, GAP, BAR = 40, 40, 20
INK, PALE, RIGHT, WRONG = "#1f2328", "#d8dee4", "#1a7f37", "#9a6700"
FETCHES = ("tomato", "onion", "cabbage")
CANDIDATES = ("tomato", "onion", "cabbage", "fish", "dish")
STEP, REST = 380, 1500  # milliseconds
COLOURS, FREQUENT = 255, 160

Frame = np.ndarray
Cell = tuple[int, int]


class Episode(NamedTuple):
    """What an environment's moving picture shows: until which step, every how many of them, and for how long each."""

    picture: str
    steps: int
    every: int
    milliseconds: int


EPISODES = {
    "LegibleDesign-v0": Episode("design.gif", steps=24, every=1, milliseconds=700),
    "LegibleOvercooked-v0": Episode("kitchen.gif", steps=60, every=1, milliseconds=150),  # until the first soup is out
    "LegibleTabletop-v0": Episode("table.gif", steps=500, every=6, milliseconds=110),  # the whole task, a little faster
}


def two_kitchens(seed: int = 1) -> tuple[OvercookedLayout, OvercookedLayout]:
    """The median of 1,000 random kitchens by legibility, and the best of a search."""
    from optimizers import search  # here, so that the pages of the environments do without pyribs

    workspace = OvercookedWorkspace(shape=(7, 7))
    genomes = workspace.sample(1000, np.random.default_rng(seed))
    median = genomes[np.argsort(workspace.legibility(genomes))[500]]
    best = search(workspace, emitter="annealing", evaluations=60_000, seed=seed, progress=False).best_layout
    return workspace.decode(median), best


def shortest_path(layout: OvercookedLayout, start: str, goal: str, rng: np.random.Generator) -> list[Cell]:
    """Floor cells of a random shortest path from station to station."""
    distances = layout.distances_from(layout.access(goal))
    cell = min(layout.access(start), key=lambda cell: distances[cell])
    path = [cell]
    while distances[cell] > 0:
        row, col = cell
        ahead = [(row - 1, col), (row + 1, col), (row, col + 1), (row, col - 1)]
        nearer = [after for after in ahead if layout.is_floor(after) and distances[after] == distances[cell] - 1]
        cell = nearer[rng.integers(len(nearer))]
        path.append(cell)
    return path


class Observed:
    """One kitchen with a person walking to a goal, and the observer's belief at every step."""

    def __init__(self, layout: OvercookedLayout, goal: str, rng: np.random.Generator) -> None:
        self.layout, self.goal = layout, goal
        self.path = shortest_path(layout, "pot", goal, rng)
        context = Trajectory([], start="pot", candidates=CANDIDATES, layout=layout, complete=False)
        stream = BayesianGoalPredictor().fit([context]).stream(context)
        self.beliefs = [dict(stream.update(cell)) for cell in self.path]

    @property
    def known_from(self) -> int | None:
        """The first step from which the goal is the single most probable one until the end; None if it never is."""
        known = [max(belief, key=belief.get) == self.goal and self._is_clear(belief) for belief in self.beliefs]
        unknown = [i for i, is_known in enumerate(known) if not is_known]
        first = unknown[-1] + 1 if unknown else 0
        return first if first < len(self.path) else None

    @staticmethod
    def _is_clear(belief: dict[str, float]) -> bool:
        first, second = sorted(belief.values())[-1:-3:-1]
        return first - second > 1e-6

    def frame(self, step: int) -> Frame:
        """The kitchen above, the belief below."""
        step = min(step, len(self.path) - 1)
        view = GameView(self.layout, players=(PlayerView(self.path[step], self._facing(step)),))
        kitchen = np.array(draw_game(view, tile=TILE, hud=False), dtype=np.uint8)
        return np.concatenate([kitchen, self._bars(step, kitchen.shape[1])])

    def _facing(self, step: int) -> int:
        here = self.path[step]
        ((row, col),) = [self.layout.stations[self.goal]]
        ahead = self.path[step + 1] if step + 1 < len(self.path) else (row, col)
        return {(-1, 0): 0, (1, 0): 1, (0, 1): 2, (0, -1): 3}[ahead[0] - here[0], ahead[1] - here[1]]

    def _bars(self, step: int, width: int) -> Frame:
        belief = self.beliefs[step]
        strip = np.full((BAR * len(CANDIDATES) + 50, width, 3), 255, dtype=np.uint8)
        is_known = self.known_from is not None and step >= self.known_from
        for number, goal in enumerate(CANDIDATES):
            top = 12 + number * BAR
            colour = (RIGHT if is_known else WRONG) if goal == self.goal else PALE
            bar = Canvas(BAR, wide=(width - 90) / BAR)
            bar.rectangle(0, 0.15, max(0.05, belief[goal] * (width - 90) / BAR), 0.7, colour)
            paste(strip, bar.sprite(), top, 84)
            paste(strip, text_sprite(goal, 15, INK), top + 2, 4)
        is_over = step == len(self.path) - 1
        text = "not known on arrival" if is_over else "which one?"
        if is_known:
            text = f"known after {self.known_from} of {len(self.path)} steps"
        paste(strip, text_sprite(text, 19, RIGHT if is_known else WRONG), 12 + BAR * len(CANDIDATES) + 14, 4)
        return strip


def prediction_frames(seed: int = 3) -> Iterator[tuple[Frame, int]]:
    """Frames of the person in both kitchens, and how long each is shown in milliseconds."""
    rng = np.random.default_rng(seed)
    random, legible = two_kitchens()
    for goal in FETCHES:
        pair = [Observed(layout, goal, rng) for layout in (random, legible)]
        last = max(len(one.path) for one in pair) - 1
        for step in range(last + 1):
            yield _side_by_side([one.frame(step) for one in pair], goal), REST if step == last else STEP


def _side_by_side(frames: Sequence[Frame], goal: str) -> Frame:
    height, width = frames[0].shape[0], frames[0].shape[1]
    sheet = np.full((height + 74, 2 * width + GAP + 24, 3), 255, dtype=np.uint8)
    paste(sheet, text_sprite(f"The person fetches: {goal}. When does an observer know?", 22, INK), 10, 12)
    for number, (frame, title) in enumerate(zip(frames, ("a random kitchen", "a legible kitchen"), strict=True)):
        left = 12 + number * (width + GAP)
        paste(sheet, text_sprite(title, 19, INK), 42, left)
        sheet[68 : 68 + height, left : left + width] = frame
    return sheet


class GreedyDesigner:
    """Makes the edit that gains most; keeps the layout where none gains."""

    def __init__(self, env: gym.Env) -> None:
        self.game = env.unwrapped

    def __call__(self, obs: Frame, info: dict) -> int:
        valid = np.flatnonzero(info["action_mask"])
        genomes = self.game.edits.apply(np.repeat(info["genome"][None], len(valid), axis=0), valid)
        return int(valid[np.argmax(self.game.problem.scores(genomes))])


PLAYERS = {
    "LegibleDesign-v0": lambda env, rng: GreedyDesigner(env),
    "LegibleOvercooked-v0": ScriptedPlayer,
    "LegibleTabletop-v0": lambda env, rng: ReachingPlayer(env, sample_person(rng), rng),
}


def episode_frames(env_id: str) -> Iterator[tuple[Frame, int]]:
    """An environment at work, with a simulated person or a designer; the last frame rests."""
    rng = np.random.default_rng(0)
    env = gym.make(env_id, render_mode="rgb_array")
    obs, info = env.reset(seed=4)
    player = PLAYERS[env_id](env, rng)
    episode = EPISODES[env_id]
    for step in range(episode.steps):
        if step % episode.every == 0:
            yield np.asarray(env.render()), episode.milliseconds
        obs, _, terminated, truncated, info = env.step(player(obs, info))
        if terminated or truncated:
            break
    yield np.asarray(env.render()), REST
    env.close()


def write_gif(path: Path, frames: Iterator[tuple[Frame, int]], width: int | None = None) -> Path:
    """Write frames as a GIF that repeats, with one palette for all."""
    pictures, durations = [], []
    for frame, duration in frames:
        picture = Image.fromarray(frame)
        if width is not None and picture.width > width:
            picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
        pictures.append(picture)
        durations.append(duration)
    palette = _common_palette(pictures)
    pictures = [_in_palette(picture, palette) for picture in pictures]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)
    return path


def _common_palette(pictures: Sequence[Image.Image]) -> np.ndarray:
    """Colours for all frames, found on some of them: the most frequent ones as they are, and a choice of the rest."""
    some = pictures[:: max(1, len(pictures) // 8)]
    sheet = np.concatenate([np.asarray(picture) for picture in some])
    colours, index = _colours(sheet)
    frequent = colours[np.argsort(-np.bincount(index), kind="stable")[:FREQUENT]]
    chosen = Image.fromarray(sheet).quantize(COLOURS - len(frequent)).getpalette()
    return np.concatenate([frequent, np.array(chosen, dtype=np.uint8).reshape(-1, 3)])


def _colours(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different colours of a picture, and for every pixel the index of its own."""
    packed, index = np.unique(picture.reshape(-1, 3) @ np.array([1 << 16, 1 << 8, 1]), return_inverse=True)
    return np.stack([packed >> 16, packed >> 8 & 255, packed & 255], axis=1).astype(np.uint8), index


def _in_palette(picture: Image.Image, palette: np.ndarray) -> Image.Image:
    """The picture in the nearest colours of the palette; Pillow itself rounds the colours before it compares."""
    colours, index = _colours(np.asarray(picture))
    nearest = KDTree(palette.astype(float)).query(colours.astype(float))[1].astype(np.uint8)
    indexed = Image.fromarray(nearest[index].reshape(picture.height, picture.width))
    indexed.putpalette(palette.ravel().tolist())
    return indexed


def write_episode(env_id: str, path: Path) -> Path:
    """Write the moving picture of an environment."""
    return write_gif(path, episode_frames(env_id))


def main() -> None:
    """Write the moving pictures of README and gallery."""
    IMAGES.mkdir(exist_ok=True)
    paths = [write_episode(env_id, IMAGES / episode.picture) for env_id, episode in EPISODES.items()]
    paths.append(write_gif(IMAGES / "prediction.gif", prediction_frames()))
    sys.stdout.writelines(f"{path}\n" for path in paths)


if __name__ == "__main__":
    main()
