"""Writing Minari data sets into any folder, an episode at a time and all or nothing.

Minari's own functions write into the one folder that ``MINARI_DATASETS_PATH`` names and take all episodes at once. Here
the folder is an argument, the environment variable is neither read nor set, and no more than one episode
is kept in memory. What comes out is laid out as Minari expects it: with ``MINARI_DATASETS_PATH`` set to the folder,
``minari.load_dataset`` and ``minari list local`` find the data set by its id.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
import secrets
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from legible_envs.support.files import write_text
from legible_envs.support.validation import shown

if TYPE_CHECKING:
    import gymnasium as gym
    from gymnasium.envs.registration import EnvSpec

    from legible_envs.rollouts.recording import Episode

__all__ = ["LABELS", "DatasetInfo", "MinariWriter", "check_dataset_id", "episode_buffer", "import_minari"]

LABELS: Final = "legible_envs"
"""Key of what an episode's metadata keep beside Minari's own: JSON with the arguments of ``trajectories``."""
DETAILS: Final = "legible_envs"
"""Key of what a data set's metadata keep beside Minari's own."""

_ID: Final = re.compile(r"(?:[A-Za-z0-9][\w-]*/)*[A-Za-z0-9][\w-]*-v\d+", re.ASCII)
_NAMESPACE_FILE: Final = "namespace_metadata.json"


@dataclass(frozen=True, kw_only=True)
class DatasetInfo:
    """What a data set says of itself.

    Attributes:
        dataset_id: As Minari names data sets: ``namespace/name-v0``.
        env_spec: How the environment is made again; it must be JSON.
        observation_space: Of the observations.
        action_space: Of the actions.
        algorithm_name: Who played, in a word.
        description: In sentences.
        author: Names of those who made it; none leaves them out.
        details: JSON data of the project's own, such as the seed.
        requirements: What must be installed to make the environment, as pip writes it.
    """

    dataset_id: str
    env_spec: EnvSpec
    observation_space: gym.Space[Any]
    action_space: gym.Space[Any]
    algorithm_name: str
    description: str
    author: Sequence[str] = ()
    details: Mapping[str, Any] | None = None
    requirements: Sequence[str] = ()


class MinariWriter:
    """A data set that is being written; a context manager.

    The data set appears under its name when the block ends; after an exception nothing of it is left.

    Args:
        folder: The folder of data sets, made where it is missing.
        info: What the data set says of itself.

    Raises:
        ImportError: Minari is not installed.
        ValueError: A bad id.
        FileExistsError: There is a data set of that name in the folder.

    Attributes:
        path: The data set's own folder.
        dataset: The ``minari.MinariDataset``, once the block has ended.
    """

    dataset: Any

    def __init__(self, folder: Path, info: DatasetInfo) -> None:
        import_minari()
        self._root, self._info = Path(folder), info
        self.path = self._root / check_dataset_id(info.dataset_id)
        self._refuse_existing()
        self._count = 0

    def _refuse_existing(self) -> None:
        if self.path.exists():
            raise FileExistsError(
                f"there is a data set {self._info.dataset_id!r} in {self._root} already; delete it or choose another "
                "name"
            )

    def __enter__(self) -> Self:
        from minari.dataset.minari_storage import MinariStorage

        self._root.mkdir(parents=True, exist_ok=True)
        # Hidden, so that Minari does not take it for a data set, and on the same disk, so that it can be renamed.
        self._place = self._root / f".unfinished-{secrets.token_hex(8)}"
        self._place.mkdir()
        info = self._info
        self._storage = MinariStorage.new(
            self._place / "data",
            observation_space=info.observation_space,
            action_space=info.action_space,
            env_spec=info.env_spec,
        )
        about: dict[str, Any] = {
            "dataset_id": info.dataset_id,
            "minari_version": importlib.metadata.version("minari"),
            "algorithm_name": info.algorithm_name,
            "description": info.description,
            DETAILS: dict(info.details or {}),
        }
        if info.author:
            about["author"] = set(info.author)
        if info.requirements:
            about["requirements"] = list(info.requirements)
        self._storage.update_metadata(about)
        return self

    def add(self, episode: Episode, labels: Mapping[str, Any] | Sequence[Mapping[str, Any]], **details: str) -> None:
        """Write an episode.

        Args:
            episode: Of one step at least.
            labels: The arguments of the environment's ``trajectories`` with which :func:`.from_minari` gives its
                trajectories, such as ``participant``; a list has those of each player.
            **details: Further metadata of the episode.
        """
        number, self._count = self._count, self._count + 1
        self._storage.update_episodes([episode_buffer(number, episode)])
        about = {"participant": episode.participant, "condition": episode.condition, LABELS: json.dumps(labels)}
        self._storage.update_episode_metadata([{**details, **about}], [number])

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._finish()
        finally:
            shutil.rmtree(self._place, ignore_errors=True)

    def _finish(self) -> None:
        if not self._count:
            raise ValueError(f"the data set {self._info.dataset_id!r} has no episode")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        for namespace in self.path.relative_to(self._root).parents:
            place = self._root / namespace / _NAMESPACE_FILE
            if namespace.parts and not place.exists():
                write_text(place, "{}")
        self._refuse_existing()
        self._place.rename(self.path)
        self.dataset = import_minari().MinariDataset(self.path / "data")


def episode_buffer(number: int, episode: Episode) -> Any:
    """An episode as Minari takes it; one that was broken off is marked as truncated at its last step."""
    from minari.data_collector import EpisodeBuffer

    over = episode.terminations[-1] or episode.truncations[-1]
    return EpisodeBuffer(
        id=number,
        seed=episode.seed,
        options={
            key: json.dumps(value) if isinstance(value, Mapping) else value for key, value in episode.options.items()
        },
        observations=np.stack(episode.observations),
        actions=np.stack(episode.actions),
        rewards=list(episode.rewards),
        terminations=list(episode.terminations),
        truncations=[*episode.truncations[:-1], episode.truncations[-1] or not over],
    )


def check_dataset_id(dataset_id: object) -> str:
    """The id of a data set, which is also the path of its folder.

    Raises:
        ValueError: It is none, or would lead out of the folder of data sets.
    """
    if not isinstance(dataset_id, str) or not _ID.fullmatch(dataset_id):
        raise ValueError(
            "a data set is called like 'kitchen/scripted-v0': letters, digits, '-' and '_', and a version at the end; "
            f"got {shown(dataset_id)}"
        )
    return dataset_id


def import_minari() -> Any:
    """Minari, with its storage.

    Raises:
        ImportError: It is not installed.
    """
    try:
        import minari
        import minari.storage
    except ImportError as error:
        raise ImportError("Minari is not installed; install the extra: pip install 'legible-envs[minari]'") from error
    return minari
