"""The network of the learning designer, and its proximal policy updates. The only module here that needs PyTorch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from torch import nn
from torch.nn import functional

__all__ = ["Learner"]

Floats = npt.NDArray[np.float32]

FORBIDDEN: Final = -1e9
"""Logit of a masked edit: its probability is zero, and so is its gradient."""

MOST_GRADIENT: Final = 0.5
"""Norm that gradients are cut down to."""


class Learner:
    """A policy over edits with a value, and its updates (Schulman et al., 2017).

    The policy looks one edit ahead: a network gives a number to each layout that a valid edit leads to, and edits are
    drawn from the softmax of these. So what is learned of one layout counts for every edit that leads to one like it; a
    network with an output per edit would have to learn each edit by itself, from some thousands of samples. The value
    of a layout comes from the same hidden layers.

    All randomness comes from the generators given, and torch's own state is left alone. It pickles in full, optimiser
    included, so that a search goes on from a checkpoint as if it had not been interrupted.

    Args:
        inputs: Numbers of an observation.
        rng: Draws the first weights.
        hidden: Units of each of the two hidden layers.
        learning_rate: Of Adam.
        epochs: Passes over the batch of an update.
        minibatch: Edits of a gradient step.
        clip: Most that the probability of an edit gains by, as a share, before its gradient is cut off.
        entropy: Weight of the entropy in the loss.
    """

    def __init__(
        self,
        inputs: int,
        rng: np.random.Generator,
        *,
        hidden: int,
        learning_rate: float,
        epochs: int,
        minibatch: int,
        clip: float,
        entropy: float,
    ) -> None:
        self._body = nn.Sequential(_linear(inputs, hidden, rng), nn.Tanh(), _linear(hidden, hidden, rng), nn.Tanh())
        # Small first numbers: the policy begins close to uniform over the valid edits.
        self._policy = _linear(hidden, 1, rng, gain=0.01)
        self._value = _linear(hidden, 1, rng)
        self._parameters = [*self._body.parameters(), *self._policy.parameters(), *self._value.parameters()]
        self._adam = torch.optim.Adam(self._parameters, lr=learning_rate, eps=1e-5)
        self._epochs, self._minibatch, self._clip, self._entropy = epochs, minibatch, clip, entropy

    def evaluate(
        self, observed: Floats, masks: npt.NDArray[np.bool_], ahead: Floats
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Log-probabilities of edits and values of layouts.

        Args:
            observed: ``(n, inputs)`` the layouts.
            masks: ``(n, A)`` valid edits, at least one of each layout.
            ahead: ``(m, inputs)`` what the ``m`` valid edits lead to, in the order of ``masks``.

        Returns:
            ``(n, A)`` and ``(n,)``.
        """
        with _one_thread(), torch.no_grad():
            logs, values = self._forward(*map(torch.from_numpy, (observed, masks, ahead)))
        return logs.double().numpy(), values.double().numpy()

    def update(self, batch: Mapping[str, npt.NDArray[Any]], rng: np.random.Generator) -> None:
        """Take gradient steps on a batch of edits.

        Args:
            batch: ``observed``, ``masks`` and ``ahead`` as for :meth:`evaluate`; ``actions (n,)``, ``chosen (n,)`` the
                log-probability that each had when it was drawn, ``advantages (n,)`` and ``returns (n,)``.
            rng: Draws the order.
        """
        advantages = batch["advantages"]
        scaled = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        tensors = {name: torch.from_numpy(_single(values)) for name, values in {**batch, "advantages": scaled}.items()}
        owner = tensors["masks"].nonzero()[:, 0]  # whose edit each row of `ahead` is
        with _one_thread():
            for _ in range(self._epochs):
                order = torch.from_numpy(rng.permutation(len(advantages)))
                for drawn in order.split(self._minibatch):
                    rows = drawn.sort().values  # in the order of `ahead`
                    part = {name: values[rows] for name, values in tensors.items() if name != "ahead"}
                    loss = self._loss(part | {"ahead": tensors["ahead"][torch.isin(owner, rows)]})
                    self._adam.zero_grad()
                    loss.backward()
                    nn.utils.clip_grad_norm_(self._parameters, MOST_GRADIENT)
                    self._adam.step()

    def _forward(
        self, observed: torch.Tensor, masks: torch.Tensor, ahead: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        logits = torch.full(masks.shape, FORBIDDEN)
        logits = logits.masked_scatter(masks, self._policy(self._body(ahead))[:, 0])
        return functional.log_softmax(logits, dim=1), self._value(self._body(observed))[:, 0]

    def _loss(self, batch: Mapping[str, torch.Tensor]) -> torch.Tensor:
        """The clipped surrogate, the squared error of values, and the entropy of the policy."""
        logs, values = self._forward(batch["observed"], batch["masks"], batch["ahead"])
        ratio = (logs.gather(1, batch["actions"][:, None])[:, 0] - batch["chosen"]).exp()
        within = ratio.clamp(1 - self._clip, 1 + self._clip)
        surrogate = torch.minimum(ratio * batch["advantages"], within * batch["advantages"]).mean()
        error = functional.mse_loss(values, batch["returns"])
        entropy = -(logs.exp() * logs.masked_fill(~batch["masks"], 0.0)).sum(dim=1).mean()
        return 0.5 * error - surrogate - self._entropy * entropy


def _linear(inputs: int, outputs: int, rng: np.random.Generator, gain: float = 1.0) -> nn.Linear:
    """A layer with normal weights of variance ``gain**2 / inputs`` from a generator of numpy, and no bias at first."""
    layer = nn.utils.skip_init(nn.Linear, inputs, outputs)
    weights = rng.normal(0.0, gain / np.sqrt(inputs), (outputs, inputs))
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(weights))
        layer.bias.zero_()
    return layer


def _single(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Real numbers in single precision, anything else as it is."""
    return values.astype(np.float32) if np.issubdtype(values.dtype, np.floating) else values


@contextmanager
def _one_thread() -> Iterator[None]:
    """One thread: networks this small gain nothing by more, and sums come out the same whatever the machine has."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
