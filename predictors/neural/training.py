"""Training an ensemble of causal networks on every prefix of every trajectory. The only module that needs torch."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.optional import import_torch
from predictors.neural.networks import Network, Operations, Weights

__all__ = ["Examples", "Training", "require_torch", "train"]


def require_torch() -> Any:
    """The module torch.

    Raises:
        ImportError: It is not installed; the message says how to.
    """
    return import_torch(
        "training a neural predictor needs", "a fitted one that was saved is loaded and used without it"
    )


class Examples(NamedTuple):
    """What is learned from, padded to the longest trajectory.

    Attributes:
        inputs: ``(n, T, D)``.
        lengths: ``(n,)`` rows that are not padding, at least one.
        allowed: ``(n, K)`` which goals are candidates.
        goals: ``(n,)`` column of the goal.
    """

    inputs: npt.NDArray[np.float32]
    lengths: npt.NDArray[np.intp]
    allowed: npt.NDArray[np.bool_]
    goals: npt.NDArray[np.intp]


@dataclass(frozen=True)
class Training:
    """How to train; see :class:`predictors.neural.base.NeuralPredictor`."""

    members: int
    learning_rate: float
    weight_decay: float
    dropout: float
    batch_size: int
    max_epochs: int
    patience: int
    validation_fraction: float
    device: str


def train(
    network: Network, weights: Weights, examples: Examples, settings: Training, rng: np.random.Generator
) -> tuple[Weights, npt.NDArray[np.float64]]:
    """Train ``M`` networks at once, each until the loss on its own held-out part no longer falls.

    The loss of a trajectory is the mean, over its prefixes, of the negative log-probability of its goal among its
    candidates. Member ``m`` never trains on fold ``m`` of a split stratified by goal, and keeps the weights with which
    it did best there; so the ensemble has learned from every trajectory.

    Args:
        network: The kind of network.
        weights: Its weights to begin with.
        examples: What to learn from.
        settings: How.
        rng: Order of batches, split and dropout.

    Returns:
        Weights, and ``(epochs, M)`` held-out loss after every epoch.
    """
    torch = require_torch()
    device = _device(torch, settings.device)
    generator = torch.Generator(device=device).manual_seed(int(rng.integers(2**62)))
    operations = _operations(torch, device, generator, settings.dropout)
    evaluation = operations._replace(dropout=lambda values: values)
    held_out = _held_out(examples.goals, settings, rng)
    with _one_thread(torch):
        parameters = {
            name: torch.tensor(value, dtype=torch.float32, device=device, requires_grad=True)
            for name, value in weights.items()
        }
        data = _Data(torch, device, examples)
        optimizer = torch.optim.AdamW(
            parameters.values(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        keeper = _Keeper(torch, parameters, settings)
        validated, counted = _validation_rows(held_out)
        history: list[npt.NDArray[np.float64]] = []
        while len(history) < settings.max_epochs and not keeper.finished:
            for batch in _batches(examples.lengths, settings.batch_size, rng):
                optimizer.zero_grad()
                losses = data.losses(network, operations, parameters, batch[None], ~held_out[:, batch])
                losses.sum().backward()
                optimizer.step()
            with torch.no_grad():
                losses = data.losses(network, evaluation, parameters, validated, counted)
            history.append(losses.cpu().numpy().astype(np.float64))
            keeper.keep(history[-1])
        trained = {name: value.cpu().numpy().astype(np.float64) for name, value in keeper.best.items()}
    return trained, np.array(history)


class _Data:
    """Examples on the device."""

    def __init__(self, torch: Any, device: Any, examples: Examples) -> None:
        self._torch = torch
        self._device = device
        self._lengths = examples.lengths
        steps = np.arange(examples.inputs.shape[1])
        shares = (steps < examples.lengths[:, None]) / examples.lengths[:, None]
        self._inputs = torch.as_tensor(examples.inputs, dtype=torch.float32, device=device)
        self._shares = torch.as_tensor(shares, dtype=torch.float32, device=device)
        self._closed = torch.as_tensor(np.where(examples.allowed, 0.0, -1e9), dtype=torch.float32, device=device)
        self._goals = torch.as_tensor(examples.goals, dtype=torch.long, device=device)

    def losses(
        self,
        network: Network,
        operations: Operations,
        parameters: dict[str, Any],
        rows: npt.NDArray[np.intp],
        weights: npt.NDArray[np.bool_],
    ) -> Any:
        """``(M,)`` mean losses over rows ``(1 or M, b)``, the same or others for each member, that have a weight."""
        longest = int(self._lengths[rows].max())
        logits, _ = network(operations, parameters, self._inputs[rows, :longest])
        logs = self._torch.log_softmax(logits + self._closed[rows][:, :, None], dim=-1)
        goals = self._goals[rows][:, :, None, None].expand(*logs.shape[:3], 1)
        surprise = -(logs.gather(-1, goals)[..., 0] * self._shares[rows, :longest]).sum(-1)
        counted = self._torch.as_tensor(weights, dtype=self._torch.float32, device=self._device)
        return (surprise * counted).sum(1) / counted.sum(1).clip(min=1.0)


class _Keeper:
    """Remembers each member's best weights."""

    def __init__(self, torch: Any, parameters: dict[str, Any], settings: Training) -> None:
        self._torch = torch
        self._parameters = parameters
        self._patience = settings.patience
        self._lowest = np.full(settings.members, np.inf)
        self._waited = np.zeros(settings.members, dtype=np.intp)
        self.best = {name: value.detach().clone() for name, value in parameters.items()}

    def keep(self, losses: npt.NDArray[np.float64]) -> None:
        better = (losses < self._lowest) & (self._waited < self._patience)
        self._lowest[better] = losses[better]
        self._waited = np.where(better, 0, self._waited + 1)
        rows = self._torch.as_tensor(np.flatnonzero(better))
        for name, value in self._parameters.items():
            index = rows.to(value.device)
            self.best[name][index] = value.detach()[index]

    @property
    def finished(self) -> bool:
        return bool((self._waited >= self._patience).all())


def _held_out(goals: npt.NDArray[np.intp], settings: Training, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """``(M, n)`` what each member does not train on; nothing where there is too little to spare."""
    held_out = np.zeros((settings.members, len(goals)), dtype=bool)
    if settings.validation_fraction == 0 or len(goals) * settings.validation_fraction < 2:
        return held_out
    folds = max(round(1 / settings.validation_fraction), 2)
    order = rng.permutation(len(goals))
    order = order[np.argsort(goals[order], kind="stable")]
    fold = np.empty(len(goals), dtype=np.intp)
    fold[order] = np.arange(len(goals)) % folds
    for member in range(settings.members):
        held_out[member] = fold == member % folds
    return held_out


def _validation_rows(held_out: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Rows ``(1 or M, v)`` and whether they count ``(M, v)``: what each member holds out, or all if nothing is."""
    members, number = held_out.shape
    if not held_out.any():
        return np.arange(number)[None], np.ones((members, number), dtype=bool)
    longest = held_out.sum(axis=1).max()
    order = np.argsort(~held_out, axis=1, kind="stable")[:, :longest]
    return order, np.take_along_axis(held_out, order, axis=1)


def _batches(lengths: npt.NDArray[np.intp], size: int, rng: np.random.Generator) -> Iterator[npt.NDArray[np.intp]]:
    """Batches in random order of trajectories of similar length, so that little of them is padding."""
    order = np.argsort(lengths + rng.uniform(-0.25, 0.25, len(lengths)) * lengths)
    starts = rng.permutation(np.arange(0, len(order), size))
    for start in starts.tolist():
        yield order[start : start + size]


def _operations(torch: Any, device: Any, generator: Any, dropout: float) -> Operations:
    def drop(values: Any) -> Any:
        if not dropout:
            return values
        kept = torch.rand(values.shape, generator=generator, device=device) >= dropout
        return values * kept / (1.0 - dropout)

    return Operations(
        tanh=torch.tanh,
        logistic=torch.sigmoid,
        softmax=lambda values: torch.softmax(values, dim=-1),
        concatenate=torch.cat,
        stack=torch.stack,
        unstack=torch.unbind,
        cut=lambda values, size: torch.split(values, [size, values.shape[-1] - size], dim=-1),
        asarray=lambda values: torch.as_tensor(values, dtype=torch.float32, device=device),
        dropout=drop,
    )


def _device(torch: Any, name: str) -> Any:
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        raise ValueError(f"cannot train on `device` {name!r}: {error}") from error
    return device


@contextlib.contextmanager
def _one_thread(torch: Any) -> Iterator[None]:
    """Matrices this small are slower on several threads; the setting is the process's and is put back."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
