"""A session watched again: as it was drawn, at the times at which it was played, in a window or as a GIF."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.study.analysis.database import PersonRow, VisitRow, steps_of, visits_of
from benchmarks.study.analysis.played import key_times
from benchmarks.study.analysis.replaying import begin, game_visits, play
from benchmarks.study.design.study import Study

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["Frame", "chosen_visits", "frames_of", "save_frames", "show_frames"]

LONGEST_PAUSE: Final = 2.0
"""Seconds that a picture stands at most, at single speed: participants think, those who watch them need not."""
_FASTEST: Final = 0.04
"""Seconds of a picture of a GIF: players of GIFs draw no faster."""
_REST: Final = 1.5
_WIDTH: Final = 480

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture and how long it stands.

    Attributes:
        picture: ``(H, W, 3)``.
        seconds: At the speed asked for.
    """

    picture: Picture
    seconds: float


def chosen_visits(connection: sqlite3.Connection, person: PersonRow, number: int | None) -> list[VisitRow]:
    """The games of a participant to be watched.

    Args:
        connection: To the database.
        person: Who.
        number: Of the game, from 1, in the order they were played, the practice among them; None: all.

    Raises:
        ValueError: There is no such game.
    """
    games = game_visits(visits_of(connection, person.participant))
    if not games:
        raise ValueError(f"{person.participant} has played no game")
    if number is None:
        return games
    if not 1 <= number <= len(games):
        named = ", ".join(f"{i} {visit.name}" for i, visit in enumerate(games, 1))
        raise ValueError(f"{person.participant} has no game {number}; there are {named}")
    return [games[number - 1]]


def frames_of(
    study: Study, connection: sqlite3.Connection, person: PersonRow, visit: VisitRow, *, speed: float = 1.0
) -> Iterator[Frame]:
    """The pictures of a game, one after another.

    Raises:
        ReplayError: It cannot be played again.
    """
    steps = list(steps_of(connection, visit.visit))
    if study.content.domain == "overcooked":
        seconds = key_times(steps, visit.begun)
    else:
        seconds = np.arange(len(steps) + 1) / 30.0
    game = begin(study, person, visits_of(connection, person.participant), visit)
    try:
        due, shown = 0.0, 0.0
        for i, _ in enumerate(play(game, steps)):
            due += min(float(seconds[i + 1] - seconds[i]), LONGEST_PAUSE) / speed
            if due - shown >= _FASTEST:
                yield Frame(_picture(game.env), due - shown)
                shown = due
        yield Frame(_picture(game.env), max(due - shown, _FASTEST) + _REST)
    finally:
        game.close()


def _picture(env: Any) -> Picture:
    """What ``render_mode="rgb_array"`` would give."""
    picture: Picture = env.picture() if hasattr(env, "picture") else env._picture()
    return picture


def show_frames(frames: Iterator[Frame], title: str) -> None:
    """Show pictures in a window, at their times.

    Raises:
        RuntimeError: There is no screen.
    """
    from legible_envs.drawing.window import Window

    window = Window(title, fps=60)
    try:
        due = time.monotonic()
        for frame in frames:
            window.show(frame.picture)
            due += frame.seconds
            while (left := due - time.monotonic()) > 0:  # a window that is not asked answers nobody
                window.show(frame.picture)
                time.sleep(min(left, 0.02))
    finally:
        window.close()


def save_frames(frames: Iterator[Frame], out: Path) -> int:
    """Write pictures as a GIF, or as numbered PNG files into a folder; returns how many.

    Args:
        frames: The pictures.
        out: A ``.gif``, or a folder.

    Raises:
        OSError: They cannot be written.
    """
    from PIL import Image

    if out.suffix.lower() != ".gif":
        out.mkdir(parents=True, exist_ok=True)
        count = 0
        for count, frame in enumerate(frames, 1):
            Image.fromarray(frame.picture).save(out / f"{count:05d}.png")
        return count
    pictures, durations = [], []
    for frame in frames:
        pictures.append(_small(Image.fromarray(frame.picture)))
        durations.append(max(20, round(1000 * frame.seconds)))
    _write_gif(out, pictures, durations)
    return len(pictures)


def _small(picture: Image.Image) -> Image.Image:
    """Narrow, and with few colours: what is held in memory of a picture until the file is written."""
    from PIL import Image

    if picture.width > _WIDTH:
        height = round(picture.height * _WIDTH / picture.width)
        picture = picture.resize((_WIDTH, height), Image.Resampling.LANCZOS)
    return picture.quantize(128)


def _write_gif(path: Path, pictures: Sequence[Image.Image], durations: Sequence[int]) -> None:
    from legible_envs.support.files import write_atomically

    path.parent.mkdir(parents=True, exist_ok=True)

    def write(stream: Any) -> None:
        options = {"save_all": True, "append_images": pictures[1:], "duration": list(durations), "loop": 0}
        pictures[0].save(stream, format="GIF", **options)

    write_atomically(path, write)
