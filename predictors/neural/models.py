"""Two causal networks as predictors: gated recurrent units and a small transformer."""

from __future__ import annotations

from typing import Any

from predictors.neural.base import NeuralPredictor
from predictors.neural.networks import Gru, Transformer

__all__ = ["RecurrentPredictor", "TransformerPredictor"]


class RecurrentPredictor(NeuralPredictor):
    """Gated recurrent units (GRU) that learn from every prefix of every trajectory.

    Cho et al., *Learning phrase representations using RNN encoder-decoder*, 2014. Takes trajectories over
    cells and continuous reaches; :class:`~predictors.neural.encoding.Encoding` defines the inputs. The belief is the
    mean of an ensemble, each member of which stops early on a part of the trajectories that only the others train on.

    Fitting needs torch (``pip install legible-envs[torch]``) and takes seconds on a CPU; everything else, files and
    streams included, is plain numpy. Fits with equal parameters on equal data are equal on one machine's CPU.

    Args:
        hidden_size: Units per layer.
        num_layers: Layers.
        learning_rate: Of AdamW.
        **training: The other parameters of :class:`~predictors.neural.base.NeuralPredictor`: ``members``,
            ``weight_decay``, ``dropout``, ``batch_size``, ``max_epochs``, ``patience``, ``validation_fraction``,
            ``device``, ``random_state``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        prior_: ``(K,)`` how often each goal was chosen when it was a candidate; the belief before the first state.
        validation_loss_: ``(epochs, members)`` held-out negative log-likelihood.
    """

    _name = "recurrent"
    _sizes = ("hidden_size", "num_layers")

    def __init__(
        self,
        hidden_size: int = 32,
        num_layers: int = 1,
        *,
        learning_rate: float = 0.02,
        **training: Any,
    ) -> None:
        super().__init__(learning_rate=learning_rate, **training)
        self.hidden_size = hidden_size
        self.num_layers = num_layers

    def _network(self) -> Gru:
        return Gru(self.hidden_size, self.num_layers)


class TransformerPredictor(NeuralPredictor):
    """Causal self-attention that learns from every prefix of every trajectory.

    Vaswani et al., *Attention is all you need*, 2017, with normalisation before each block. In everything but its
    network it is like :class:`~predictors.neural.models.RecurrentPredictor`.

    Args:
        width: Numbers per state inside the network; a multiple of ``heads``.
        num_layers: Blocks of attention and perceptron.
        heads: Attention heads.
        learning_rate: Of AdamW.
        **training: The other parameters of :class:`~predictors.neural.base.NeuralPredictor`: ``members``,
            ``weight_decay``, ``dropout``, ``batch_size``, ``max_epochs``, ``patience``, ``validation_fraction``,
            ``device``, ``random_state``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        prior_: ``(K,)`` how often each goal was chosen when it was a candidate; the belief before the first state.
        validation_loss_: ``(epochs, members)`` held-out negative log-likelihood.
    """

    _name = "transformer"
    _sizes = ("width", "num_layers", "heads")

    def __init__(
        self,
        width: int = 32,
        num_layers: int = 2,
        heads: int = 4,
        *,
        learning_rate: float = 0.003,
        **training: Any,
    ) -> None:
        super().__init__(learning_rate=learning_rate, **training)
        self.width = width
        self.num_layers = num_layers
        self.heads = heads

    def _network(self) -> Transformer:
        if self.width % self.heads:
            raise ValueError(f"`width` must be a multiple of `heads`, got {self.width} and {self.heads}")
        return Transformer(self.width, self.num_layers, self.heads)
