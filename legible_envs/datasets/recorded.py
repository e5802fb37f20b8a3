"""Recorded games of two people as Minari data sets: what each saw, what both did, and what the team earned.

    >>> make_recorded_dataset("data", "cramped_room")                                            # doctest: +SKIP

Each game is played again in ``LegibleOvercooked-v0`` with two players and the rules of 2019, from the recorded joint
actions. Every state is compared with the recorded one, so the observations are those of the very states that the
participants were in. An episode's observations are ``(T + 1, 2, ...)`` and its actions ``(T, 2)``: the transitions of
one person are ``episode.observations[:, player]`` and ``episode.actions[:, player]``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import gymnasium as gym
import numpy as np

from legible_envs.datasets.overcooked_2019 import load_recorded_games, recorded_layouts
from legible_envs.datasets.overcooked_ai.games import RecordedGame, RecordingsError
from legible_envs.datasets.played import Progress, make_environment, requirements
from legible_envs.overcooked.game.vectors import AT_PLAYERS
from legible_envs.rollouts.minari_writing import DatasetInfo, MinariWriter
from legible_envs.rollouts.recording import Episode, RecordTrajectories
from legible_envs.support.validation import integer

__all__ = ["AUTHORS", "make_recorded_dataset"]

AUTHORS: Final = ("Micah Carroll", "Rohin Shah", "Mark K. Ho", "Thomas L. Griffiths", "Sanjit A. Seshia",
                  "Pieter Abbeel", "Anca Dragan")  # fmt: skip
"""Of the recordings: *On the Utility of Learning about Humans for Human-AI Coordination*, NeurIPS 2019."""

_FIXED: Final = ("layout", "layouts", "shape", "num_players", "rules", "recipes", "cook_time", "partner")
"""Arguments of the environment that the recordings settle."""


def make_recorded_dataset(
    folder: str | os.PathLike[str],
    layout_name: str,
    *,
    recordings: str | os.PathLike[str] | None = None,
    games: int | None = None,
    dataset_id: str | None = None,
    author: Sequence[str] = AUTHORS,
    description: str | None = None,
    progress: Progress | None = None,
    **arguments: Any,
) -> Any:
    """Convert the recorded games of a kitchen to a Minari data set.

    Args:
        folder: The folder of data sets, as ``MINARI_DATASETS_PATH`` would name it; made where it is missing.
        layout_name: Name of the kitchen in the recordings; see
            :func:`legible_envs.datasets.overcooked_2019.recorded_layouts`.
        recordings: Where ``legible humans fetch`` wrote the games.
        games: Only the first so many; all by default.
        dataset_id: As Minari names data sets; by default such as ``"overcooked/recorded-cramped_room-v0"``.
        author: Of the recordings by default.
        description: In sentences; by default what is known.
        progress: Told (games done, of how many) after each.
        **arguments: Of ``gymnasium.make``, such as ``obs_type``; not those that the recordings settle.

    Returns:
        The ``minari.MinariDataset``. Its episodes keep, as metadata, ``pair``, ``split`` (as published) and
        ``participants``; :func:`legible_envs.rollouts.from_minari` gives the trajectories of both.

    Raises:
        ImportError: Minari is not installed.
        RecordingsError: The recordings are not there, or of no such kitchen; or a game that the environment plays
            otherwise than it was recorded.
        ValueError: Arguments of the environment that are bad or settled, a bad id, or no game.
        FileExistsError: There is a data set of that name.
    """
    if settled := sorted(set(arguments) & set(_FIXED)):
        raise ValueError(f"the recordings settle {settled}: the kitchen, two players and the rules of 2019")
    if layout_name not in (known := recorded_layouts(recordings)):
        raise RecordingsError(f"no games are recorded in {layout_name!r}; there are {list(known)}")
    found = load_recorded_games(recordings, [layout_name])
    if games is not None:
        found = found[: integer("games", games, 1)]
    longest = max(game.num_ticks for game in found)
    settings = {"max_episode_steps": longest, **arguments}
    env = make_environment(
        "LegibleOvercooked-v0",
        layout=known[layout_name].to_ascii(),
        num_players=2,
        rules="overcooked-ai-2019",
        **settings,
    )
    try:
        assert env.spec is not None
        info = DatasetInfo(
            dataset_id=dataset_id or f"overcooked/recorded-{layout_name}-v0",
            env_spec=env.spec,
            observation_space=env.observation_space,
            action_space=env.action_space,
            algorithm_name="recorded people",
            description=description
            or f"Games of two people in {layout_name}, recorded by Carroll et al. (NeurIPS 2019) and played again in "
            f"{env.spec.id}: observations of each, joint actions, team reward.",
            author=author,
            details={"code": requirements()[0], "player": "recorded", "layout_name": layout_name},
            requirements=requirements(),
        )
        with MinariWriter(Path(folder), info) as writer:
            for number, (game, episode) in enumerate(_replayed(env, found), 1):
                people = [game.participant(player) for player in range(2)]
                writer.add(
                    episode, _labels(game, people), pair=game.pair, split=game.split, participants=" ".join(people)
                )
                if progress is not None:
                    progress(number, len(found))
        return writer.dataset
    finally:
        env.close()


def _labels(game: RecordedGame, people: Sequence[str]) -> list[dict[str, Any]]:
    """The arguments of the environment's ``trajectories`` for each person."""
    shared = {"condition": "recorded", "layout_name": game.layout_name, "candidate_set": "all"}
    return [{**shared, "participant": name, "player": player} for player, name in enumerate(people)]


def _replayed(env: gym.Env[Any, Any], games: Sequence[RecordedGame]) -> Iterator[tuple[RecordedGame, Episode]]:
    for game in games:
        recorder = RecordTrajectories(env, participant=game.pair, condition="recorded")
        recorder.reset()
        _compare(env, game, 0)
        for tick, actions in enumerate(game.actions):
            _, reward, terminated, truncated, _ = recorder.step(actions.astype(np.int64))
            _compare(env, game, tick + 1)
            if reward != game.rewards[tick]:
                raise _differs(game, tick + 1, f"a reward of {reward:g}", f"{game.rewards[tick]:g}")
            if (terminated or truncated) and tick + 1 < game.num_ticks:
                raise ValueError(
                    f"`max_episode_steps` ends episodes after {tick + 1} steps; a game lasts {game.num_ticks} ticks"
                )
        (episode,) = recorder.episodes
        yield game, episode


def _compare(env: gym.Env[Any, Any], game: RecordedGame, tick: int) -> None:
    """Raise an error if players do not stand, face and hold as they were recorded."""
    state = env.unwrapped.arrays()[0]  # type: ignore[attr-defined]
    width = game.layout.shape[1]
    now = state[AT_PLAYERS : AT_PLAYERS + 6].reshape(2, 3)
    cells = game.cells[tick].astype(np.int32)
    recorded = np.column_stack([cells[:, 0] * width + cells[:, 1], game.facing[tick], game.held[tick]])
    if not np.array_equal(now, recorded):
        raise _differs(game, tick, f"(cell, facing, held) {now.tolist()}", str(recorded.tolist()))


def _differs(game: RecordedGame, tick: int, now: str, recorded: str) -> RecordingsError:
    return RecordingsError(
        f"the game of {game.pair} in {game.layout_name} plays otherwise than it was recorded: after tick {tick} {now}, "
        f"recorded {recorded}"
    )
