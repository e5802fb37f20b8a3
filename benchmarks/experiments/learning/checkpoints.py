"""Checkpoints of training: one ``.npz`` of arrays and a JSON of settings in it, read without running any code."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.experiments.learning.environments import PlayerSpace
from benchmarks.experiments.learning.settings import NetworkShape, TrainingSettings, changed
from legible_envs.support.digests import digest_of_arrays
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.models import FileModel, Length, Text, Whole, validated
from legible_envs.support.stored_arrays import stored_array, stored_json, stored_text

__all__ = ["FILE", "Checkpoint", "CheckpointError", "check_same", "load_checkpoint", "weight_shapes"]

FILE: Final = "checkpoint.npz"
"""Name of the checkpoint in the folder of a run."""

_SCHEMA: Final = 1
_KIND: Final = "legible-envs training checkpoint"
_MOST_ARRAYS: Final = 512

Arrays = dict[str, npt.NDArray[Any]]


class CheckpointError(ValueError):
    """A checkpoint that cannot be read, or is of another run or space."""


class _Config(FileModel):
    """What the JSON in a checkpoint holds."""

    kind: Annotated[str, Text()]
    schema_version: Annotated[int, Whole(1, 1_000)]
    settings: TrainingSettings
    space: PlayerSpace
    updates: Annotated[int, Whole(0)]
    steps: Annotated[int, Whole(0)]
    columns: Annotated[list[Annotated[str, Text(100)]], Length(0, 100)]
    rng: dict[str, Any]


@dataclass
class Checkpoint:
    """A training run at one moment.

    Attributes:
        settings: All that decides what the run comes to.
        space: What a player sees and does.
        updates: How often the network was updated.
        steps: Steps of all games.
        weights: Of the network, by name.
        optimizer: State of the optimiser, by name.
        moments: Running means and deviations, by name.
        rng: State of the random generator, as ``numpy.random.Generator.bit_generator.state`` has it.
        columns: Names of the columns of the curve.
        curve: ``(updates, columns)`` the learning curve so far.
    """

    settings: TrainingSettings
    space: PlayerSpace
    updates: int
    steps: int
    weights: Arrays
    optimizer: Arrays
    moments: Arrays
    rng: dict[str, Any]
    columns: tuple[str, ...]
    curve: npt.NDArray[np.float64]

    def generator(self) -> np.random.Generator:
        """A random generator that goes on where the run's was.

        Raises:
            CheckpointError: The stored state is none.
        """
        rng = np.random.default_rng()
        try:
            rng.bit_generator.state = self.rng
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise CheckpointError(f"the state of its random generator is none of numpy's PCG64: {error}") from error
        return rng

    def save(self, folder: Path) -> Path:
        """Write ``checkpoint.npz``, all or nothing.

        Raises:
            OSError: It cannot be written; what was there before is untouched.
        """
        config = _Config(
            kind=_KIND,
            schema_version=_SCHEMA,
            settings=self.settings,
            space=self.space,
            updates=self.updates,
            steps=self.steps,
            columns=list(self.columns),
            rng=self.rng,
        )
        text = json.dumps(config.model_dump(mode="json"), ensure_ascii=True)
        arrays: Arrays = {"config": np.frombuffer(text.encode("ascii"), dtype=np.uint8), "curve": self.curve}
        for group in ("weights", "optimizer", "moments"):
            arrays |= {f"{group}/{name}": values for name, values in getattr(self, group).items()}
        write_npz(folder / FILE, {**arrays, "sha256": np.array(digest_of_arrays(arrays))})
        return folder / FILE


def load_checkpoint(path: str | Path) -> Checkpoint:
    """Read a checkpoint; no code in it is run, and no pickle loaded.

    Args:
        path: The file, or the folder of the run.

    Raises:
        CheckpointError: It is no checkpoint, damaged, changed, or of a later version; names the file.
        OSError: It cannot be read.
    """
    file = Path(path)
    if file.is_dir():
        file = file / FILE
        if not file.exists():
            raise CheckpointError(f"{path} has no {FILE}: it is not the folder of a training run")
    try:
        with open_npz(file, most_arrays=_MOST_ARRAYS) as stored:
            return _read(dict(stored))
    except ValueError as error:
        raise CheckpointError(f"{file} cannot be used as a checkpoint: {error}") from error


def _read(stored: Mapping[str, npt.NDArray[Any]]) -> Checkpoint:
    digest = stored_text(stored, "sha256")
    if digest != digest_of_arrays({name: values for name, values in stored.items() if name != "sha256"}):
        raise ValueError("its content is not the one it was written with: it was changed since, or damaged")
    data = stored_json(stored, "config")
    if not isinstance(data, dict) or data.get("kind") != _KIND:
        raise ValueError(f"its `config` is not that of a {_KIND}")
    version = data.get("schema_version")
    if version != _SCHEMA:
        raise ValueError(f"it is of version {version!r}, and this program reads version {_SCHEMA}")
    config = validated(_Config, data, "its `config`")
    shapes = weight_shapes(config.space, config.settings.network)
    weights = {name: stored_array(stored, f"weights/{name}", "f", shape, finite=True) for name, shape in shapes.items()}
    shape = tuple(config.space.shape)
    moments: Arrays = {}
    for name, of in (("obs", shape), ("return", ())):
        for part, size in (("mean", of), ("variance", of), ("count", ())):
            moments[f"{name}.{part}"] = stored_array(stored, f"moments/{name}.{part}", "f", size, finite=True)
    optimizer = {
        name.removeprefix("optimizer/"): stored_array(stored, name, "f", values.shape, finite=True)
        for name, values in stored.items()
        if name.startswith("optimizer/")
    }
    return Checkpoint(
        config.settings,
        config.space,
        config.updates,
        config.steps,
        weights,
        optimizer,
        moments,
        config.rng,
        tuple(config.columns),
        stored_array(stored, "curve", "f", (None, len(config.columns))),
    )


def weight_shapes(space: PlayerSpace, network: NetworkShape) -> dict[str, tuple[int, ...]]:
    """The shape of every array of a network, by the names that torch gives them.

    Example:
        >>> space = PlayerSpace(shape=[54], dtype="float32", actions="discrete", size=6)
        >>> weight_shapes(space, NetworkShape(hidden=[128]))["actor.0.weight"]
        (128, 54)
    """
    shapes: dict[str, tuple[int, ...]] = {"scale": tuple(space.shape)}
    before = space.shape[-1]
    for number, channels in enumerate(network.channels):
        shapes[f"cells.{2 * number}.weight"] = (channels, before, 3, 3)
        shapes[f"cells.{2 * number}.bias"] = (channels,)
        before = channels
    for part, outputs in (("actor", space.size), ("critic", 1)):
        size = math.prod([*space.shape[:-1], before])
        for number, width in enumerate([*network.hidden, outputs]):
            shapes[f"{part}.{2 * number}.weight"] = (width, size)
            shapes[f"{part}.{2 * number}.bias"] = (width,)
            size = width
    if space.actions == "continuous":
        shapes["spread"] = (space.size,)
    return shapes


def check_same(checkpoint: Checkpoint, settings: TrainingSettings, where: Path) -> None:
    """Refuse to go on with other settings than those a run began with.

    Raises:
        CheckpointError: Something differs; names it, with the old and the new value.
    """
    if differences := changed(checkpoint.settings, settings):
        raise CheckpointError(
            f"the training in {where} was begun with other settings, and cannot go on: {'; '.join(differences)}"
        )
