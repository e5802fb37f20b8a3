"""Recorded episodes as a Minari data set, for offline reinforcement learning."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from legible_envs.rollouts.recording import RecordTrajectories

__all__ = ["to_minari"]


def to_minari(recorded: RecordTrajectories, dataset_id: str, **metadata: Any) -> Any:
    """Write recorded episodes into Minari's local folder (``MINARI_DATASETS_PATH``) as a new data set.

    An episode that was broken off is marked as truncated at its last step. Each episode's seed and
    options are kept, its layout among them (a table's as JSON text): the recovered environment can play it again.

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
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise ImportError("Minari is not installed; install the extra: pip install 'legible-envs[minari]'") from error

    episodes = recorded.episodes
    if not episodes:
        raise ValueError("nothing was recorded; play at least one step first")
    if dataset_id in minari.list_local_datasets():
        raise ValueError(f"there is a Minari data set {dataset_id!r} already; delete it or choose another name")
    buffers = []
    for number, episode in enumerate(episodes):
        over = episode.terminations[-1] or episode.truncations[-1]
        buffers.append(
            EpisodeBuffer(
                id=number,
                seed=episode.seed,
                options={
                    key: json.dumps(value) if isinstance(value, Mapping) else value
                    for key, value in episode.options.items()
                },
                observations=np.stack(episode.observations),
                actions=np.stack(episode.actions),
                rewards=list(episode.rewards),
                terminations=list(episode.terminations),
                truncations=[*episode.truncations[:-1], episode.truncations[-1] or not over],
            )
        )
    spec = recorded.env.spec
    name = type(recorded.env.unwrapped).__name__ if spec is None else spec.id
    about = {"algorithm_name": "recorded rollouts", "description": f"Episodes of {name}."} | metadata
    return minari.create_dataset_from_buffers(dataset_id, buffers, env=recorded.env, **about)
