"""A recurrent network that reads a trajectory state by state."""

from __future__ import annotations

from typing import Any

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
        learning_rate: Of AdamW.
        **training: The other parameters of :class:`~predictors.neural.predictor.NeuralPredictor`: ``members``,
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
