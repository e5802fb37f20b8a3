"""Real recorded play: Overcooked-AI's published 2019 human-human games, fetched, converted and cut into trajectories.

    >>> fetch_recordings()  # doctest: +SKIP
    >>> trajectories = recorded_trajectories(layouts=["cramped_room"])  # doctest: +SKIP

91,102 ticks of 76 games that 17 pairs of participants played in five kitchens (Carroll et al., *On the Utility of
Learning about Humans for Human-AI Coordination*, NeurIPS 2019).
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, Literal

from platformdirs import user_cache_path

from legible_envs.datasets.overcooked_2019.games import read_games, write_games
from legible_envs.datasets.overcooked_ai.games import Progress, RecordedGame, RecordingsError
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory

__all__ = [
    "RecordedGame",
    "RecordingsError",
    "fetch_recordings",
    "load_recorded_games",
    "recorded_layouts",
    "recorded_trajectories",
    "recording_stats",
    "recordings_folder",
]

GAMES_FILE: Final = "overcooked-ai-2019-games.npz"
TRAJECTORIES_FILE: Final = "overcooked-ai-2019-walks.npz"


def recordings_folder(folder: str | os.PathLike[str] | None = None) -> Path:
    """Where recordings are kept: the folder given, ``$LEGIBLE_DATA/recordings``, or the user's cache folder.

    On Linux the last is ``~/.cache/legible-envs/recordings``. Deleting it is always safe.
    """
    if folder is not None:
        return Path(folder)
    root = os.environ.get("LEGIBLE_DATA")
    return (Path(root) if root else user_cache_path("legible-envs")) / "recordings"


def fetch_recordings(
    folder: str | os.PathLike[str] | None = None,
    *,
    source: str | os.PathLike[str] | None = None,
    index_urls: Iterable[str] | None = None,
    progress: Progress | None = None,
    force: bool = False,
) -> Path:
    """Get the published games once, and write them as plain arrays.

    The games lie in the source distribution of ``overcooked-ai==1.1.0``. It is downloaded from the package index that
    pip is set up with, accepted by its sha256 alone, and neither built, imported nor executed; the tables in it are
    read without running what the pickles ask for.

    Args:
        folder: Where to write; see :func:`recordings_folder`.
        source: A local copy of the source distribution, instead of any index.
        index_urls: Package indexes to ask instead of pip's.
        progress: Called with (what is being done, done, of how much).
        force: Do it again even where the recordings are there already.

    Returns:
        The folder.

    Raises:
        RecordingsError: No index can be reached, or the file is any other file. Earlier files stay as they are.
        OSError: The folder cannot be written to.
    """
    from legible_envs.datasets.overcooked_2019.source import SHA256, download_archive, read_archive, read_members
    from legible_envs.datasets.overcooked_ai.tables_2019 import convert_tables
    from legible_envs.datasets.overcooked_ai.trajectories import all_trajectories
    from legible_envs.datasets.overcooked_ai.unpickle import read_table
    from legible_envs.rollouts.npz_files import save_trajectories

    place = recordings_folder(folder)
    if source is None and not force and _is_there(place):
        return place
    archive = read_archive(source) if source is not None else download_archive(index_urls, progress)
    tables = {split: read_table(data) for split, data in read_members(archive).items()}
    games = convert_tables(tables, progress)
    save_trajectories(place / TRAJECTORIES_FILE, all_trajectories(games))
    write_games(place / GAMES_FILE, games, {"source_sha256": SHA256})
    return place


def _is_there(place: Path) -> bool:
    try:
        load_recorded_games(place, layouts=())
        return (place / TRAJECTORIES_FILE).is_file()
    except RecordingsError:
        return False


def load_recorded_games(
    folder: str | os.PathLike[str] | None = None, layouts: Iterable[str] | None = None
) -> list[RecordedGame]:
    """The recorded games, all or those of some kitchens, in the published order.

    Args:
        folder: Where :func:`fetch_recordings` wrote them.
        layouts: Names of kitchens; see :func:`recorded_layouts`.

    Raises:
        RecordingsError: They are not there, or damaged; the message says how to get them.
    """
    path = recordings_folder(folder) / GAMES_FILE
    if not path.is_file():
        raise RecordingsError(
            f"no recorded games in {path.parent}; get them with `legible humans fetch` "
            "(`--from FILE` with a copy of the source distribution where there is no network)"
        )
    return read_games(path, layouts)


def recorded_layouts(folder: str | os.PathLike[str] | None = None) -> dict[str, OvercookedLayout]:
    """The five recorded kitchens by the names they have in the recordings.

    ``random0`` and ``random3`` are called forced coordination and counter circuit in the paper.

    Raises:
        RecordingsError: The games are not there, or damaged; the message says how to get them.
    """
    return {game.layout_name: game.layout for game in load_recorded_games(folder)}


def recorded_trajectories(
    folder: str | os.PathLike[str] | None = None,
    layouts: Iterable[str] | None = None,
    candidate_set: Literal["game", "all"] = "all",
    *,
    min_positions: int = 3,
    min_candidates: int = 2,
    round_trips: bool = False,
) -> list[Trajectory]:
    """Trajectories of recorded participants: empty-handed from a pot or serving station to an onion or dish station.

    With the defaults there are 502, 807, 424 and 673 of them in ``asymmetric_advantages``, ``coordination_ring``,
    ``cramped_room`` and ``random3``, and none in ``random0``, where pots and dispensers are in different rooms.

    Args:
        folder: Where :func:`fetch_recordings` wrote the games.
        layouts: Names of kitchens; all if None.
        candidate_set: ``"all"``: every dispenser in reach. ``"game"``: those among them that are of use when the
            trajectory begins (onions while a pot in reach is not full, dishes while fewer are held than soups are on
            the fire); trajectories to other goals are left out.
        min_positions: Fewest floor cells of a trajectory, repeats dropped.
        min_candidates: Fewest candidates of a trajectory.
        round_trips: Whether to keep trajectories that end on the cell they began on: start and goal share it, so that
            the player did not have to move.

    Raises:
        RecordingsError: The games are not there, or damaged; the message says how to get them.
    """
    from legible_envs.datasets.overcooked_ai.trajectories import trajectories_of_games

    return trajectories_of_games(
        load_recorded_games(folder, layouts),
        candidate_set,
        min_positions=min_positions,
        min_candidates=min_candidates,
        round_trips=round_trips,
    )


def recording_stats(folder: str | os.PathLike[str] | None = None) -> list[dict[str, Any]]:
    """Counts per kitchen and in all.

    Returns:
        Rows with ``layout``, ``games``, ``pairs``, ``ticks`` (recorded transitions), ``deliveries``, ``idle`` (share of
        player-ticks without a change of cell, facing or hands), ``trajectories`` (see :func:`recorded_trajectories`,
        every length) and ``scored_trajectories`` (with its defaults). The last row is ``"all"``.

    Raises:
        RecordingsError: The games are not there, or damaged; the message says how to get them.
    """
    from legible_envs.datasets.overcooked_ai.trajectories import statistics

    return statistics(load_recorded_games(folder))
