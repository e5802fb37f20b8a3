"""A small transformer that looks back over a trajectory."""

from __future__ import annotations

from typing import Any

from predictors.neural.networks import Transformer
from predictors.neural.predictor import NeuralPredictor

__all__ = ["TransformerPredictor"]


class TransformerPredictor(NeuralPredictor):
    """Causal self-attention that learns from every prefix of every trajectory.

    Vaswani et al., *Attention is all you need*, 2017, with normalisation before each block. In everything but its
    network it is like :class:`~predictors.neural.recurrent.RecurrentPredictor`.

    Args:
        width: Numbers per state inside the network; a multiple of ``heads``.
        num_layers: Blocks of attention and perceptron.
        heads: Attention heads.
        learning_rate: Of AdamW.
        **training: The other parameters of :class:`~predictors.neural.predictor.NeuralPredictor`: ``members``,
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
