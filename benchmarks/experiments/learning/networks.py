"""The network of actor and critic: layers for vectors, 3x3 convolutions before them for grids of cells."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from benchmarks.experiments.learning.environments import PlayerSpace
from benchmarks.experiments.learning.settings import NetworkShape

__all__ = ["ActorCritic", "Choices", "one_thread"]

_NEVER = -1e8
"""Logit of an action that is masked out: its probability is exactly 0, and gradients stay finite."""


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread, and put its setting back.

    Matrices as small as these are slower on several threads, and sums differ in their last bits with the number of
    threads: one makes runs repeatable on every machine.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class Choices:
    """The distributions that actions of some rows are drawn from.

    Args:
        outputs: ``(B, n)`` of the actor: logits, or means of normal distributions.
        spread: ``(n,)`` logarithms of their deviations; None: outputs are logits.
        masks: ``(B, n)`` bool, which actions may be taken; None: all.
    """

    def __init__(self, outputs: Tensor, spread: Tensor | None = None, masks: Tensor | None = None) -> None:
        self.spread = spread
        if spread is None:
            if masks is not None:
                outputs = outputs.masked_fill(~masks, _NEVER)
            outputs = outputs.log_softmax(dim=1)
        self.outputs = outputs

    def sample(self, rng: np.random.Generator) -> Tensor:
        """``(B,)`` actions, or ``(B, n)`` numbers; an action of probability 0 is never drawn."""
        outputs = self.outputs.numpy()
        if self.spread is None:
            below = np.exp(outputs.astype(np.float64)).cumsum(axis=1)
            return torch.from_numpy((below > rng.random((len(below), 1)) * below[:, -1:]).argmax(axis=1))
        return self.outputs + self.spread.exp() * torch.from_numpy(rng.standard_normal(outputs.shape, np.float32))

    def log_probs(self, actions: Tensor) -> Tensor:
        """``(B,)`` logarithms of the probabilities, or densities, of actions."""
        if self.spread is None:
            return self.outputs.gather(1, actions[:, None]).squeeze(1)
        away = (actions - self.outputs) / self.spread.exp()
        return (-0.5 * away.square() - self.spread - 0.5 * math.log(2 * math.pi)).sum(dim=1)

    def entropy(self) -> Tensor:
        """``(B,)`` entropies."""
        if self.spread is None:
            return -(self.outputs.exp() * self.outputs).sum(dim=1)
        return (self.spread + 0.5 + 0.5 * math.log(2 * math.pi)).sum().expand(len(self.outputs))


class ActorCritic(nn.Module):
    """Actor and critic.

    A vector goes through the layers ``hidden`` of each (tanh). A grid goes through convolutions first (3x3, padded, so
    that no cell is lost; ReLU), which both share.

    Args:
        space: What a player sees and does.
        shape: Of the network.
        scale: Observations are multiplied with it; of their shape.
        rng: Source of the first weights.

    Raises:
        ValueError: Convolutions for observations that are no grids.
    """

    def __init__(
        self, space: PlayerSpace, shape: NetworkShape, scale: npt.NDArray[np.float32], rng: np.random.Generator
    ) -> None:
        super().__init__()
        if shape.channels and not space.is_grid:
            raise ValueError(f"`network.channels` are for grids; there are {space}")
        self.register_buffer("scale", torch.from_numpy(np.array(scale, dtype=np.float32)))
        convolutions: list[nn.Module] = []
        before = space.shape[-1]
        for channels in shape.channels:
            layer = nn.utils.skip_init(nn.Conv2d, before, channels, 3, padding=1)
            convolutions += [_begun(layer, math.sqrt(2), rng), nn.ReLU()]
            before = channels
        size = math.prod([*space.shape[:-1], before])
        self.cells = nn.Sequential(*convolutions)
        self.actor = _layers(size, shape.hidden, space.size, 0.01, rng)
        self.critic = _layers(size, shape.hidden, 1, 1.0, rng)
        self.spread = nn.Parameter(torch.zeros(space.size)) if space.actions == "continuous" else None

    def features(self, obs: Tensor) -> Tensor:
        """``(B, size)`` what actor and critic see of ``(B, ...)`` observations."""
        found = obs.float() * self.scale
        if len(self.cells):
            # Channels last, as observations have them, is also how convolutions are fastest on processors.
            found = self.cells(found.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)
        return found.flatten(1)

    def forward(self, obs: Tensor, masks: Tensor | None = None) -> tuple[Choices, Tensor]:
        """Choices of actions, and ``(B,)`` values, of ``(B, ...)`` observations and ``(B, n)`` masks."""
        found = self.features(obs)
        return Choices(self.actor(found), self.spread, masks), self.critic(found).squeeze(1)

    def values(self, obs: Tensor) -> Tensor:
        """``(B,)`` values of ``(B, ...)`` observations."""
        return self.critic(self.features(obs)).squeeze(1)


def _layers(size: int, hidden: list[int], outputs: int, gain: float, rng: np.random.Generator) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in hidden:
        layers += [_begun(nn.utils.skip_init(nn.Linear, size, width), math.sqrt(2), rng), nn.Tanh()]
        size = width
    return nn.Sequential(*layers, _begun(nn.utils.skip_init(nn.Linear, size, outputs), gain, rng))


def _begun(layer: Any, gain: float, rng: np.random.Generator) -> nn.Module:
    """A layer with orthogonal weights (Saxe et al. 2014), drawn from ``rng`` and not from torch's global generator."""
    shape = tuple(layer.weight.shape)
    rows, columns = shape[0], math.prod(shape[1:])
    q, r = np.linalg.qr(rng.standard_normal((max(rows, columns), min(rows, columns))))
    q = q * np.sign(np.diag(r))
    weights = (q if rows >= columns else q.T) * gain
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(weights.reshape(shape).astype(np.float32)))
        layer.bias.zero_()
    return layer  # type: ignore[no-any-return]
