"""A recurrent network that reads a trajectory state by state."""

from __future__ import annotations

from predictors.neural.networks import Gru
from predictors.neural.predictor import NeuralPredictor

__all__ = ["RecurrentPredictor"]


class RecurrentPredictor(NeuralPredictor):
    """Gated recurrent units (GRU) that learn from every prefix of every trajectory.

    Cho et al., *Learning phrase representations using RNN encoder-decoder*, 2014. Reads walks of cells and continuous
    reaches; see :class:`~predictors.neural.encoding.Encoding` for what it sees of them. Belief is the mean of an
    ensemble, each member of which stops early on a part of the trajectories that only the others train on.

    Fitting needs torch (``pip install legible-envs[torch]``) and takes seconds on a CPU; everything else, files and
    streams included, is plain numpy. Fits with equal parameters on equal data are equal on one machine's CPU.

    Args:
        hidden_size: Units per layer.
        num_layers: Layers.
        members: Networks in the ensemble.
        learning_rate: Of AdamW.
        weight_decay: Of AdamW.
        dropout: Share of each layer's outputs set to zero while training.
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

    _name = "recurrent"
    _sizes = ("hidden_size", "num_layers")

    def __init__(
        self,
        hidden_size: int = 32,
        num_layers: int = 1,
        *,
        members: int = 4,
        learning_rate: float = 0.02,
        weight_decay: float = 0.01,
        dropout: float = 0.2,
        batch_size: int = 64,
        max_epochs: int = 100,
        patience: int = 8,
        validation_fraction: float = 0.2,
        device: str = "auto",
        random_state: int = 0,
    ) -> None:
        self.hidden_size = hidden_size
        self.num_layers = num_layers
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

    def _network(self) -> Gru:
        return Gru(self.hidden_size, self.num_layers)
