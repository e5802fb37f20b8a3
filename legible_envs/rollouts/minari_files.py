"""Episodes as Minari data sets: recorded ones are written for offline reinforcement learning, and read back.

A data set holds what was done, not what it meant: actions, observations, rewards, and each episode's seed and options.
Trajectories are made from it by playing the actions again in the environment that it names; every observation has to
come out as it was recorded (:mod:`legible_envs.rollouts.replaying`). So it does not matter who recorded it:
:class:`~legible_envs.rollouts.RecordTrajectories` and :func:`to_minari`, or ``minari.DataCollector`` with or without
``record_infos``. Participant, condition and the set of candidates are kept by :func:`to_minari` alone.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from legible_envs.rollouts.minari_writing import LABELS, episode_buffer, import_minari
from legible_envs.rollouts.replaying import RecordedEpisode, Replayer, environment_of
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.plain_data import parse_json
from legible_envs.support.text import read_text
from legible_envs.support.validation import shown

if TYPE_CHECKING:
    from legible_envs.rollouts.recording import RecordTrajectories

__all__ = ["find_dataset", "from_minari", "is_minari_folder", "to_minari"]


def to_minari(recorded: RecordTrajectories, dataset_id: str, **metadata: Any) -> Any:
    """Write recorded episodes into Minari's local folder (``MINARI_DATASETS_PATH``) as a new data set.

    An episode that was broken off is marked as truncated at its last step. Each episode's seed and
    options are kept, its layout among them (a table's as JSON text): the recovered environment can play it again, and
    :func:`from_minari` gives the trajectories back, with participant and condition.

    Args:
        recorded: The environment that recorded them.
        dataset_id: As Minari names data sets: ``namespace/name-v0``.
        metadata: Further arguments of ``minari.create_dataset_from_buffers``: ``author``, ``description``, ….

    Returns:
        The ``minari.MinariDataset``.

    Raises:
        ImportError: Minari is not installed.
        ValueError: Nothing was recorded, or there is a data set of that name.
    """
    minari = import_minari()
    episodes = recorded.episodes
    if not episodes:
        raise ValueError("nothing was recorded; play at least one step first")
    if dataset_id in minari.list_local_datasets():
        raise ValueError(f"there is a Minari data set {dataset_id!r} already; delete it or choose another name")
    buffers = [episode_buffer(number, episode) for number, episode in enumerate(episodes)]
    spec = recorded.env.spec
    name = type(recorded.env.unwrapped).__name__ if spec is None else spec.id
    about = {"algorithm_name": "recorded rollouts", "description": f"Episodes of {name}."} | metadata
    dataset = minari.create_dataset_from_buffers(dataset_id, buffers, env=recorded.env, **about)
    dataset.storage.update_episode_metadata([{LABELS: json.dumps(recorded.labels(episode))} for episode in episodes])
    return dataset


def from_minari(
    dataset: Any,
    *,
    env: gym.Env[Any, Any] | None = None,
    participant: str | None = None,
    condition: str | None = None,
    **options: Any,
) -> list[Trajectory]:
    """The trajectories in a Minari data set of an environment of this package, in the order of its episodes.

    Its episodes are played again. The layout is the one in an episode's options, or else the one that is played on
    already; where that is another, those that the data set names anywhere. On a table, goals that a simulated
    participant had set are taken from the observations.

    Args:
        dataset: A ``minari.MinariDataset``, the id of a local one, or the folder of one.
        env: The environment to play in, wrapped as it was; None makes it from the data set's own description.
        participant: Of all trajectories; None takes what :func:`to_minari` kept, or nothing.
        condition: Likewise.
        **options: Further arguments of the environment's ``trajectories``, such as ``candidate_set="all"`` in
            kitchens; by default those that :func:`to_minari` kept.

    Raises:
        ImportError: Minari is not installed.
        FileNotFoundError: No such data set.
        ValueError: It is of another environment, or an episode does not play again as it was recorded: which step of
            which episode, and what may be the cause.

    Example:
        >>> trajectories = from_minari("kitchen/scripted-v0")                              # doctest: +SKIP
    """
    found = _opened(dataset)
    given = {"participant": participant, "condition": condition, **options}
    given = {name: value for name, value in given.items() if value is not None}
    game = environment_of(found.env_spec, found.id) if env is None else env
    try:
        episodes = list(_episodes(found))
        replayer = Replayer(game, [episode.options.get("layout") for episode in episodes], _is_lossy(found))
        trajectories = []
        for episode in episodes:
            trajectories += replayer.trajectories(episode, **given)
        return trajectories
    finally:
        if env is None:
            game.close()


def is_minari_folder(path: Path) -> bool:
    """Whether a folder is a Minari data set: the one with its name, or ``data`` in it."""
    return _data_folder(path) is not None


def find_dataset(name: str) -> Any | None:
    """The local data set of that id; None where there is none, or no Minari."""
    try:
        minari = import_minari()
        path = Path(minari.storage.get_dataset_path(name))
    except (ImportError, ValueError):
        return None
    return path if is_minari_folder(path) else None


def _data_folder(path: Path) -> Path | None:
    return next((folder for folder in (path, path / "data") if (folder / "metadata.json").is_file()), None)


def _opened(dataset: Any) -> Any:
    minari = import_minari()
    if isinstance(dataset, minari.MinariDataset):
        return dataset
    path = Path(dataset)
    if not path.exists() and isinstance(dataset, str):
        path = find_dataset(dataset) or path
    folder = _data_folder(path)
    if folder is None:
        raise FileNotFoundError(f"there is no Minari data set {os.fspath(dataset)!r} here, by id or as a folder")
    try:
        about = parse_json(read_text(folder / "metadata.json"), finite=False)
        if not isinstance(about, dict):
            raise ValueError(f"its metadata must be a mapping, got {shown(about)}")
        if missing := [name for name in ("observation_space", "action_space") if name not in about]:
            # Minari would make the environment that the file names, whatever it is
            raise ValueError(f"its metadata lack {missing}")
        return minari.MinariDataset(folder)
    except (ValueError, KeyError, TypeError, AssertionError, AttributeError) as error:
        raise ValueError(f"{folder} is no Minari data set that can be read: {error}") from error


def _is_lossy(dataset: Any) -> bool:
    """Whether observations are pictures that were kept as JPEG."""
    from minari.dataset.minari_storage import is_image_space

    return bool(dataset.storage.jpeg_encoding and is_image_space(dataset.observation_space))


def _episodes(dataset: Any) -> Iterator[RecordedEpisode]:
    indices = [int(index) for index in dataset.episode_indices]
    about = list(dataset.storage.get_episode_metadata(indices))
    for metadata, episode in zip(about, dataset.iterate_episodes(indices), strict=True):
        labels = metadata.get(LABELS)
        yield RecordedEpisode(
            name=f"episode {episode.id} of the data set {dataset.id!r}",
            seed=metadata.get("seed"),
            options=_plain(metadata.get("options") or {}),
            observations=np.asarray(episode.observations),
            actions=np.asarray(episode.actions),
            rewards=np.asarray(episode.rewards, dtype=np.float64),
            labels=[{}] if labels is None else _labels(labels, episode.id),
        )


def _labels(text: object, episode: object) -> list[dict[str, Any]]:
    """The arguments of ``trajectories`` that were kept: those of one player, or a list with those of each."""
    try:
        labels = parse_json(text) if isinstance(text, str) else text
    except ValueError as error:
        raise ValueError(f"episode {episode}: its labels cannot be read: {error}") from error
    listed: list[Any] = labels if isinstance(labels, list) else [labels]
    if not listed or not all(isinstance(entry, dict) for entry in listed):
        raise ValueError(f"episode {episode}: its labels must be a mapping or a list of such, got {shown(labels)}")
    return listed


def _plain(options: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value.tolist() if hasattr(value, "tolist") else value for key, value in options.items()}
