"""A small transformer that looks back over a trajectory."""

from __future__ import annotations

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
        members: Networks in the ensemble.
        learning_rate: Of AdamW.
        weight_decay: Of AdamW.
        dropout: Share of each block's outputs set to zero while training.
        batch_size: Trajectories per step.
        max_epochs: Most passes over the data.
        patience: Passes without a better held-out loss after which a member is done.
        validation_fraction: Share each member holds out; 0 holds out nothing (as where that would be less than two).
        device: ``"auto"`` (a GPU if there is one), ``"cpu"``, ``"cuda"``, ….
        random_state: Seed.

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
        members: int = 4,
        learning_rate: float = 0.003,
        weight_decay: float = 0.01,
        dropout: float = 0.2,
        batch_size: int = 64,
        max_epochs: int = 100,
        patience: int = 8,
        validation_fraction: float = 0.2,
        device: str = "auto",
        random_state: int = 0,
    ) -> None:
        self.width = width
        self.num_layers = num_layers
        self.heads = heads
        self.members = members
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.dropout = dropout
        self.batch_size = batch_size
        self.max_epochs = max_epochs
        self.patience = patience
        self.validation_fraction = validation_fraction
        self.device = device
        self.random_state = random_state

    def _network(self) -> Transformer:
        if self.width % self.heads:
            raise ValueError(f"`width` must be a multiple of `heads`, got {self.width} and {self.heads}")
        return Transformer(self.width, self.num_layers, self.heads)
