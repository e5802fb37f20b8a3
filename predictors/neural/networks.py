"""The networks, written once: numpy runs them to predict, torch to train them.

``M`` networks of one kind live side by side in arrays whose first axis is theirs (an ensemble costs little more than
one). A network takes inputs ``(1, n, T, D)`` and the state in which it left off, and returns the logits
``(M, n, T, K)`` after each of the ``T`` rows with its new state, so that feeding rows one at a time is the same
computation as feeding them all at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["NUMPY", "Gru", "Network", "Operations", "Transformer", "softmax"]

Weights = dict[str, npt.NDArray[np.float64]]
_LAYER_NORM_FLOOR: Final = 1e-5


class Operations(NamedTuple):
    """What numpy and torch call differently; everything else the networks need they call the same.

    Attributes:
        tanh: Elementwise.
        logistic: Elementwise.
        softmax: Over the last axis.
        concatenate: ``(arrays, axis)``.
        stack: ``(arrays, axis)``.
        unstack: ``(array, axis)``, the inverse.
        cut: ``(array, size)``, the first ``size`` along the last axis and the others.
        asarray: A numpy array as one of theirs, on the same device as the weights.
        dropout: Sets some values to zero while training; the identity otherwise.
    """

    tanh: Callable[[Any], Any]
    logistic: Callable[[Any], Any]
    softmax: Callable[[Any], Any]
    concatenate: Callable[[Any, int], Any]
    stack: Callable[[Any, int], Any]
    unstack: Callable[[Any, int], Sequence[Any]]
    cut: Callable[[Any, int], Sequence[Any]]
    asarray: Callable[[npt.NDArray[Any]], Any]
    dropout: Callable[[Any], Any]


def softmax(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """``exp(values)`` over the last axis, summing to one."""
    weights = np.exp(values - values.max(axis=-1, keepdims=True))
    return weights / weights.sum(axis=-1, keepdims=True)


NUMPY: Final = Operations(
    tanh=np.tanh,
    logistic=lambda values: 0.5 + 0.5 * np.tanh(0.5 * values),  # exp would overflow
    softmax=softmax,
    concatenate=np.concatenate,
    stack=np.stack,
    unstack=lambda values, axis: list(np.moveaxis(values, axis, 0)),
    cut=lambda values, size: (values[..., :size], values[..., size:]),
    asarray=np.asarray,
    dropout=lambda values: values,
)


class Network(Protocol):
    """A causal network."""

    def initial_weights(self, members: int, inputs: int, outputs: int, rng: np.random.Generator) -> Weights:
        """Random weights of ``members`` networks."""
        ...

    def shapes(self, members: int, inputs: int, outputs: int) -> Iterator[tuple[str, tuple[int, ...]]]:
        """Name and shape of each of these weights, without making them."""
        ...

    def __call__(self, ops: Operations, weights: Mapping[str, Any], x: Any, state: Any = None) -> tuple[Any, Any]:
        """Logits after each row of ``x``, and the state to go on from."""
        ...


def _uniform(rng: np.random.Generator, members: int, rows: int, columns: int, bound: float) -> npt.NDArray[np.float64]:
    return rng.uniform(-bound, bound, (members, rows, columns))


def _linear(x: Any, matrix: Any, bias: Any) -> Any:
    """``x (M or 1, n, T, D) -> (M, n, T, E)`` with one product per member."""
    flat = x.reshape(x.shape[0], -1, x.shape[-1]) @ matrix + bias[:, None]
    return flat.reshape(flat.shape[0], *x.shape[1:-1], flat.shape[-1])


class Gru:
    """Gated recurrent units (Cho et al., 2014; reset after the product, as in torch and cuDNN) and a linear readout.

    Args:
        hidden: Units per layer ``H``.
        layers: Layers.
    """

    def __init__(self, hidden: int, layers: int) -> None:
        self.hidden = hidden
        self.layers = layers

    def initial_weights(self, members: int, inputs: int, outputs: int, rng: np.random.Generator) -> Weights:
        """Uniform within ``1 / sqrt(H)``, biases zero, as is usual."""
        bound = 1.0 / math.sqrt(self.hidden)
        weights: Weights = {}
        for layer in range(self.layers):
            size = inputs if layer == 0 else self.hidden
            weights[f"input{layer}"] = _uniform(rng, members, size, 3 * self.hidden, bound)
            weights[f"input_bias{layer}"] = np.zeros((members, 3 * self.hidden))
            weights[f"hidden{layer}"] = _uniform(rng, members, self.hidden, 3 * self.hidden, bound)
            weights[f"hidden_bias{layer}"] = np.zeros((members, 3 * self.hidden))
        weights["out"] = _uniform(rng, members, self.hidden, outputs, bound)
        weights["out_bias"] = np.zeros((members, outputs))
        return weights

    def shapes(self, members: int, inputs: int, outputs: int) -> Iterator[tuple[str, tuple[int, ...]]]:
        """See :class:`Network`."""
        for layer in range(self.layers):
            yield f"input{layer}", (members, inputs if layer == 0 else self.hidden, 3 * self.hidden)
            yield f"input_bias{layer}", (members, 3 * self.hidden)
            yield f"hidden{layer}", (members, self.hidden, 3 * self.hidden)
            yield f"hidden_bias{layer}", (members, 3 * self.hidden)
        yield "out", (members, self.hidden, outputs)
        yield "out_bias", (members, outputs)

    def __call__(self, ops: Operations, weights: Mapping[str, Any], x: Any, state: Any = None) -> tuple[Any, Any]:
        """See :class:`Network`; the state is the hidden vectors ``(M, n, H)`` of each layer."""
        left_off = []
        for layer in range(self.layers):
            x, last = self._layer(ops, weights, layer, x, None if state is None else state[layer])
            left_off.append(last)
            x = ops.dropout(x)
        return _linear(x, weights["out"], weights["out_bias"]), left_off

    def _layer(self, ops: Operations, weights: Mapping[str, Any], layer: int, x: Any, h: Any) -> tuple[Any, Any]:
        incoming = _linear(x, weights[f"input{layer}"], weights[f"input_bias{layer}"])
        matrix, bias = weights[f"hidden{layer}"], weights[f"hidden_bias{layer}"][:, None]
        if h is None:
            h = ops.asarray(np.zeros((incoming.shape[0], incoming.shape[1], self.hidden)))
        outputs = []
        # Unstacked at once: torch fills a whole array with zeros for the gradient of every single slice.
        for given in ops.unstack(incoming, 2):
            given_gates, given_new = ops.cut(given, 2 * self.hidden)
            kept_gates, kept_new = ops.cut(h @ matrix + bias, 2 * self.hidden)
            reset, update = ops.cut(ops.logistic(given_gates + kept_gates), self.hidden)
            new = ops.tanh(given_new + reset * kept_new)
            h = new + update * (h - new)
            outputs.append(h)
        return ops.stack(outputs, 2), h


class Transformer:
    """Causal self-attention over the states so far (Vaswani et al., 2017; normalised before each block).

    Args:
        width: Numbers per token, a multiple of ``heads``.
        layers: Blocks of attention and a two-layer perceptron four times as wide.
        heads: Attention heads.
    """

    def __init__(self, width: int, layers: int, heads: int) -> None:
        self.width = width
        self.layers = layers
        self.heads = heads

    def initial_weights(self, members: int, inputs: int, outputs: int, rng: np.random.Generator) -> Weights:
        """Uniform with variance ``1 / inputs`` of each product, biases zero, gains one."""
        size = self.width
        weights: Weights = {}

        def linear(name: str, rows: int, columns: int) -> None:
            weights[name] = _uniform(rng, members, rows, columns, math.sqrt(1.0 / rows))
            weights[f"{name}_bias"] = np.zeros((members, columns))

        def norm(name: str) -> None:
            weights[name] = np.ones((members, size))
            weights[f"{name}_bias"] = np.zeros((members, size))

        linear("embed", inputs, size)
        for layer in range(self.layers):
            norm(f"norm_attention{layer}")
            linear(f"attend{layer}", size, 3 * size)
            linear(f"project{layer}", size, size)
            norm(f"norm_perceptron{layer}")
            linear(f"widen{layer}", size, 4 * size)
            linear(f"narrow{layer}", 4 * size, size)
        norm("norm_out")
        linear("out", size, outputs)
        return weights

    def shapes(self, members: int, inputs: int, outputs: int) -> Iterator[tuple[str, tuple[int, ...]]]:
        """See :class:`Network`."""
        size = self.width
        yield from _linear_shapes("embed", members, inputs, size)
        for layer in range(self.layers):
            yield from _norm_shapes(f"norm_attention{layer}", members, size)
            yield from _linear_shapes(f"attend{layer}", members, size, 3 * size)
            yield from _linear_shapes(f"project{layer}", members, size, size)
            yield from _norm_shapes(f"norm_perceptron{layer}", members, size)
            yield from _linear_shapes(f"widen{layer}", members, size, 4 * size)
            yield from _linear_shapes(f"narrow{layer}", members, 4 * size, size)
        yield from _norm_shapes("norm_out", members, size)
        yield from _linear_shapes("out", members, size, outputs)

    def __call__(self, ops: Operations, weights: Mapping[str, Any], x: Any, state: Any = None) -> tuple[Any, Any]:
        """See :class:`Network`; the state is the keys and values ``(M, n, heads, t, width / heads)`` of each block."""

        def linear(name: str, values: Any) -> Any:
            return _linear(values, weights[name], weights[f"{name}_bias"])

        def norm(name: str, values: Any) -> Any:
            centred = values - values.mean(-1)[..., None]
            deviation = ((centred**2).mean(-1)[..., None] + _LAYER_NORM_FLOOR) ** 0.5
            gain, bias = weights[name][:, None, None], weights[f"{name}_bias"][:, None, None]
            return centred / deviation * gain + bias

        seen = 0 if state is None else state[0][0].shape[3]
        tokens = linear("embed", x) + ops.asarray(_positions(seen, x.shape[2], self.width))
        remembered = []
        for layer in range(self.layers):
            triple = linear(f"attend{layer}", norm(f"norm_attention{layer}", tokens))
            mixed, memory = self._attend(ops, triple, None if state is None else state[layer])
            remembered.append(memory)
            tokens = tokens + ops.dropout(linear(f"project{layer}", mixed))
            wide = linear(f"widen{layer}", norm(f"norm_perceptron{layer}", tokens)).clip(0.0)
            tokens = tokens + ops.dropout(linear(f"narrow{layer}", wide))
        return linear("out", norm("norm_out", tokens)), remembered

    def _attend(self, ops: Operations, triple: Any, memory: Any) -> tuple[Any, Any]:
        """Every token looks at itself and those before it."""
        members, count, steps, _ = triple.shape
        split = triple.reshape(members, count, steps, 3, self.heads, self.width // self.heads)
        query, key, value = (part.swapaxes(2, 3) for part in ops.unstack(split, 3))
        if memory is not None:
            key, value = ops.concatenate([memory[0], key], 3), ops.concatenate([memory[1], value], 3)
        total = key.shape[3]
        future = np.triu(np.full((steps, total), -1e9), k=1 + total - steps)
        scores = query @ key.swapaxes(-1, -2) * (self.width // self.heads) ** -0.5 + ops.asarray(future)
        mixed = (ops.softmax(scores) @ value).swapaxes(2, 3)
        return mixed.reshape(members, count, steps, self.width), (key, value)


def _positions(first: int, count: int, width: int) -> npt.NDArray[np.float64]:
    """``(count, width)`` sines and cosines that tell tokens ``first, first + 1, …`` apart, for any length."""
    rates = np.exp(-math.log(1000.0) * np.arange(0, width, 2) / width)
    angles = np.arange(first, first + count)[:, None] * rates
    return np.stack([np.sin(angles), np.cos(angles)], axis=2).reshape(count, -1)[:, :width]


def _linear_shapes(name: str, members: int, rows: int, columns: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    yield name, (members, rows, columns)
    yield f"{name}_bias", (members, columns)


def _norm_shapes(name: str, members: int, size: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    yield name, (members, size)
    yield f"{name}_bias", (members, size)
