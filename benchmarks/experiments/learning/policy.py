"""A trained policy as a player: called with ``(obs, info)``, alone or for many games, and without torch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.experiments.learning.checkpoints import Checkpoint, CheckpointError, load_checkpoint
from benchmarks.experiments.learning.environments import PlayerSpace
from benchmarks.experiments.learning.normalising import normalised

__all__ = ["TrainedPolicy", "load_policy"]

Floats = npt.NDArray[np.floating[Any]]


def load_policy(path: str | Path, *, greedy: bool = False, rng: np.random.Generator | None = None) -> TrainedPolicy:
    """Read a trained policy; no code in the file is run.

    Args:
        path: A checkpoint, or the folder of a training run.
        greedy: Whether it takes the most probable action, and not one drawn by probability.
        rng: Source of its draws; None: one of seed 0.

    Raises:
        CheckpointError: It is no checkpoint, or a damaged one.
        OSError: It cannot be read.
    """
    return TrainedPolicy(load_checkpoint(path), greedy=greedy, rng=rng)


class TrainedPolicy:
    """Plays as the network of a checkpoint does.

    Args:
        checkpoint: Of a training run.
        greedy: Whether it takes the most probable action, and not one drawn by probability.
        rng: Source of its draws; None: one of seed 0.

    Attributes:
        space: What a player of it sees and does.
        settings: Of the training.
    """

    def __init__(self, checkpoint: Checkpoint, *, greedy: bool = False, rng: np.random.Generator | None = None) -> None:
        self.space: PlayerSpace = checkpoint.space
        self.settings = checkpoint.settings
        self.greedy = greedy
        self.rng = np.random.default_rng(0) if rng is None else rng
        self._weights = checkpoint.weights
        self._moments = checkpoint.moments

    def __call__(self, obs: Any, info: Mapping[str, Any]) -> Any:
        """The next actions.

        Args:
            obs: Observation of one player, or those of several, with axes such as ``(N, players)`` in front.
            info: What came with it; its ``action_mask``, if there is one, has the same axes in front.

        Returns:
            An integer for one player, else integers of the shape of the axes in front; of continuous actions, floats
            with the axis of their numbers behind.

        Raises:
            ValueError: Observations or masks of another space.
        """
        rows, ahead = self._rows(obs)
        outputs = self._outputs(rows)
        if self.space.actions == "continuous":
            if not self.greedy:
                outputs = outputs + np.exp(self._weights["spread"]) * self.rng.standard_normal(outputs.shape)
            return np.clip(outputs, -1.0, 1.0).astype(np.float32).reshape(*ahead, self.space.size)
        shares = self._shares(outputs, self._masks(info, ahead))
        if self.greedy:
            actions = shares.argmax(axis=1)
        else:
            below = shares.cumsum(axis=1)
            actions = (below > self.rng.random((len(below), 1)) * below[:, -1:]).argmax(axis=1)
        return int(actions[0]) if not ahead else actions.reshape(ahead)

    def probabilities(self, obs: Any, info: Mapping[str, Any]) -> npt.NDArray[np.float64]:
        """``(..., n)`` the probability of each action.

        Args:
            obs: As for a call.
            info: As for a call.

        Raises:
            ValueError: Observations or masks of another space, or actions that are numbers.
        """
        if self.space.actions == "continuous":
            raise ValueError(f"this policy takes actions of {self.space.size} numbers, which have no probabilities")
        rows, ahead = self._rows(obs)
        return self._shares(self._outputs(rows), self._masks(info, ahead)).reshape(*ahead, self.space.size)

    def check_space(self, space: PlayerSpace) -> None:
        """Refuse games in which players see or do something else; the number of players does not matter.

        Raises:
            CheckpointError: They do; says what was learned and what is there.
        """
        own = self.space.model_copy(update={"players": 1})
        if own != space.model_copy(update={"players": 1}):
            raise CheckpointError(f"the policy was trained for {self.space}, and these games have {space}")

    def _rows(self, obs: Any) -> tuple[npt.NDArray[Any], tuple[int, ...]]:
        """``(B, ...)`` observations of players, and the axes in front of them."""
        array, shape = np.asarray(obs), tuple(self.space.shape)
        if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape) or array.dtype.kind not in "biuf":
            raise ValueError(
                f"the policy was trained for {self.space}, got observations of shape {array.shape} ({array.dtype})"
            )
        ahead = array.shape[: array.ndim - len(shape)]
        return array.reshape(-1, *shape), ahead

    def _masks(self, info: Mapping[str, Any], ahead: tuple[int, ...]) -> npt.NDArray[np.bool_] | None:
        if not self.settings.ppo.masked or "action_mask" not in info:
            return None
        masks = np.asarray(info["action_mask"])
        if masks.shape != (*ahead, self.space.size):
            raise ValueError(f"expected an `action_mask` of shape {(*ahead, self.space.size)}, got {masks.shape}")
        return masks.reshape(-1, self.space.size).astype(np.bool_)

    def _outputs(self, rows: npt.NDArray[Any]) -> Floats:
        """``(B, n)`` of the actor, as :class:`.ActorCritic` works them out."""
        if self.settings.ppo.normalise_observations:
            rows = normalised(rows, self._moments["obs.mean"], self._moments["obs.variance"])
        found: Floats = rows.astype(np.float32) * self._weights["scale"]
        for number in range(len(self.settings.network.channels)):
            weight, bias = (self._weights[f"cells.{2 * number}.{part}"] for part in ("weight", "bias"))
            found = np.maximum(_convolved(found, weight) + bias, 0)
        found = found.reshape(len(found), -1)
        last = len(self.settings.network.hidden)
        for number in range(last + 1):
            weight, bias = (self._weights[f"actor.{2 * number}.{part}"] for part in ("weight", "bias"))
            found = found @ weight.T + bias
            if number < last:
                found = np.tanh(found)
        return found

    @staticmethod
    def _shares(outputs: Floats, masks: npt.NDArray[np.bool_] | None) -> npt.NDArray[np.float64]:
        """``(B, n)`` probabilities of actions; exactly 0 of those that are masked out."""
        logits = outputs.astype(np.float64)
        if masks is not None:
            logits = np.where(masks, logits, -np.inf)
        shares = np.exp(logits - logits.max(axis=1, keepdims=True))
        return shares / shares.sum(axis=1, keepdims=True)


def _convolved(cells: Floats, weight: Floats) -> Floats:
    """A padded 3x3 convolution of ``(B, rows, columns, channels)`` with ``(out, channels, 3, 3)``."""
    _, height, width, _ = cells.shape
    padded = np.pad(cells, ((0, 0), (1, 1), (1, 1), (0, 0)))
    return np.asarray(
        sum(
            padded[:, i : i + height, j : j + width] @ weight[:, :, i, j].T  # each neighbour's share
            for i in range(3)
            for j in range(3)
        )
    )
