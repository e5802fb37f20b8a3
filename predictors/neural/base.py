"""What all neural predictors share: fitting, beliefs after every prefix, streams, and files."""

from __future__ import annotations

import inspect
import json
import os
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final, Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Cut, Trajectory
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.stored_arrays import says, stored_array, stored_json, stored_whole
from legible_envs.support.validation import integer, real
from predictors.base import (
    FRACTIONS,
    GoalPredictor,
    GoalStream,
    TrajectoryError,
    check_fractions,
    check_trajectories,
    prefix_lengths,
)
from predictors.grid.base import check_recorded, check_trajectory
from predictors.grid.candidates import within_reach
from predictors.neural.encoding import Encoding
from predictors.neural.networks import NUMPY, Network, Weights, softmax
from predictors.neural.training import Examples, Training, require_torch, train

__all__ = ["SCHEMA", "NeuralPredictor", "NeuralStream"]

SCHEMA: Final = 1
"""Version of the files that :meth:`NeuralPredictor.save` writes."""

_KIND: Final = "legible-envs neural predictor"
_WEIGHTS: Final = "weights/"
_AT_ONCE: Final = 512
_MOST: Final = {
    "num_layers": 64,
    "members": 100,
    "batch_size": 1_000_000,
    "max_epochs": 1_000_000,
    "patience": 1_000_000,
}
"""Greatest values of whole numbers."""
_WIDEST: Final = 8_192
"""Of a layer."""


class NeuralPredictor(GoalPredictor):
    """Base class of predictors that learn with an ensemble of causal networks.

    Subclasses take the parameters below and their network's own, and define ``_network``. Theirs may come first and
    the rest as ``**training``: the signature that users and scikit-learn see names them all.

    Args:
        members: Networks in the ensemble.
        learning_rate: Of AdamW.
        weight_decay: Of AdamW.
        dropout: Share of each layer's outputs set to zero while training.
        batch_size: Trajectories per step.
        max_epochs: Most passes over the data.
        patience: Passes without a lower held-out loss after which a member stops.
        validation_fraction: Share each member holds out; 0 holds out nothing (as where that would be less than two).
        device: ``"auto"`` (a GPU where there is one), ``"cpu"``, ``"cuda"``, ….
        random_state: Seed.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        prior_: ``(K,)`` how often each goal was chosen when it was a candidate, one choice of each added.
        validation_loss_: ``(epochs, members)`` negative log-likelihood per prefix of what each member did not train on.
        weights_: The networks' weights by name, first axis the member.
        encoding_: How trajectories become inputs.
    """

    _name: ClassVar[str]
    _sizes: ClassVar[tuple[str, ...]]

    prior_: npt.NDArray[np.float64]
    validation_loss_: npt.NDArray[np.float64]
    weights_: Weights
    encoding_: Encoding

    def __init__(
        self,
        *,
        members: int = 4,
        learning_rate: float = 0.01,
        weight_decay: float = 0.01,
        dropout: float = 0.2,
        batch_size: int = 64,
        max_epochs: int = 100,
        patience: int = 8,
        validation_fraction: float = 0.2,
        device: str = "auto",
        random_state: int = 0,
    ) -> None:
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

    def __init_subclass__(cls, **options: Any) -> None:
        """Name the shared parameters in the subclass's signature, from which scikit-learn takes what to clone."""
        super().__init_subclass__(**options)
        own = inspect.signature(cls.__init__)
        named = [each for each in own.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        if len(named) < len(own.parameters):
            shared = inspect.signature(NeuralPredictor.__init__).parameters.values()
            named += [each for each in shared if each.name not in own.parameters]
            cls.__init__.__signature__ = own.replace(parameters=named)  # type: ignore[attr-defined]

    @abstractmethod
    def _network(self) -> Network:
        """The kind of network, from the parameters."""

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn from trajectories with known goals, every prefix of each.

        Args:
            X: Trajectories of one kind: all cells, or all positions of one dimension.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ImportError: torch is not installed.
            ValueError: A parameter out of range, no trajectories, a goal that is not known, or mixed kinds.
        """
        settings = self._settings()
        network = self._network()
        trajectories = check_trajectories(X)
        super().fit(trajectories)
        self.goal_columns(trajectories)
        check_recorded(trajectories)
        encoding = Encoding.learn(trajectories)
        self._check_layouts(trajectories)
        require_torch()
        self.prior_ = self._learn_prior(trajectories)
        rng = np.random.default_rng(self.random_state)
        weights = network.initial_weights(self.members, encoding.width, len(self.classes_), rng)
        weights["out_bias"] = weights["out_bias"] + np.log(self.prior_)
        examples = self._examples([trajectory for trajectory in trajectories if trajectory.num_states], encoding)
        self.weights_, self.validation_loss_ = train(network, weights, examples, settings, rng)
        self.encoding_ = encoding
        return self

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`; nothing observed is ``prior_`` among the candidates."""
        trajectories = check_trajectories(X)
        rows = [beliefs[-1] for beliefs in self._beliefs(trajectories)]
        return np.array(rows, dtype=np.float64).reshape(len(trajectories), len(self.classes_))

    def predict_proba_at(
        self, X: Sequence[Trajectory], fractions: Sequence[float] = FRACTIONS, cut: Cut = "steps"
    ) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba_at`; one pass over each trajectory, as the networks are causal."""
        trajectories, fractions = check_trajectories(X), check_fractions(fractions, cut)
        check_recorded(trajectories)
        lengths = prefix_lengths(trajectories, fractions, cut)
        after = self._beliefs(
            [trajectory.first(max(row, default=0)) for trajectory, row in zip(trajectories, lengths, strict=True)]
        )
        rows = [beliefs[row] for beliefs, row in zip(after, lengths, strict=True)]
        return np.array(rows, dtype=np.float64).reshape(len(trajectories), len(fractions), len(self.classes_))

    def stream(self, context: Trajectory) -> NeuralStream:
        """Predict one person's goal while they move, keeping the networks' state; see :meth:`GoalPredictor.stream`."""
        return NeuralStream(self, context)

    # -- files --------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the fitted predictor to one ``.npz`` of plain arrays and JSON, all or nothing; no pickles.

        Returns:
            The path written.

        Raises:
            NotFittedError: Before ``fit``.
            OSError: The file cannot be written; what was there before is untouched.
        """
        self._check_fitted()
        config = {
            "predictor": self._name,
            "parameters": self.get_params(),
            "classes": self.classes_.tolist(),
            "encoding": self.encoding_.to_config(),
        }
        arrays: dict[str, Any] = {f"{_WEIGHTS}{name}": value for name, value in self.weights_.items()}
        arrays |= {"prior": self.prior_, "validation_loss": self.validation_loss_}
        text = np.frombuffer(json.dumps(config).encode("ascii"), dtype=np.uint8)
        write_npz(path, {"kind": _KIND, "schema": SCHEMA, "config": text, **arrays})
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a predictor back; needs no torch and runs no code from the file.

        Raises:
            FileNotFoundError: No such file.
            OSError: It cannot be read.
            ValueError: Not a file of a predictor of this class, damaged, or of a newer schema.
        """
        try:
            with open_npz(path) as file:
                if not says(file, "kind", _KIND):
                    raise ValueError("it is not a file of a neural predictor")
                schema = stored_whole(file, "schema", 1)
                if schema > SCHEMA:
                    raise ValueError(f"it has schema {schema}; this version reads up to {SCHEMA}")
                return cls._rebuild(file)
        except ValueError as error:
            raise ValueError(f"cannot read a {cls.__name__} from {os.fspath(path)}: {error}") from error

    @classmethod
    def _rebuild(cls, file: Mapping[str, Any]) -> Self:
        from legible_envs.support.models import validated
        from predictors.neural.checkpoints import CheckpointConfig

        config = validated(CheckpointConfig, stored_json(file, "config"), "`config`")
        if config.predictor != cls._name:
            raise ValueError(f"it holds a {config.predictor!r} predictor, not {cls._name!r}")
        if unknown := sorted(config.parameters.keys() - inspect.signature(cls).parameters.keys()):
            raise ValueError(f"`config`: unknown parameters {unknown}")
        if len(set(config.classes)) < len(config.classes):
            raise ValueError("`config`: `classes` has one more than once")
        predictor = cls(**config.parameters)
        predictor._settings()
        predictor.classes_ = np.array(config.classes)
        predictor.encoding_ = Encoding.from_config(config.encoding)
        predictor.prior_ = stored_array(file, "prior", "f", (len(config.classes),), finite=True)
        if not (predictor.prior_ > 0).all():
            raise ValueError("`prior` must be positive")
        predictor.validation_loss_ = stored_array(file, "validation_loss", "f", (None, predictor.members))
        predictor.weights_ = predictor._stored_weights(file)
        return predictor

    def _stored_weights(self, file: Mapping[str, Any]) -> Weights:
        """The weights of a file, one after the other: the parameters may promise more than any memory holds."""
        expected = self._network().shapes(self.members, self.encoding_.width, len(self.classes_))
        weights: Weights = {}
        for name, shape in expected:
            array = file.get(f"{_WEIGHTS}{name}")
            if array is None or array.shape != shape or array.dtype.kind != "f":
                raise ValueError(f"its weights do not fit its parameters: `{name}` must be floats of shape {shape}")
            if not np.isfinite(array).all():
                raise ValueError(f"its weights are not finite: `{name}`")
            weights[name] = array
        if more := sorted(name for name in file if name.removeprefix(_WEIGHTS) not in weights and _WEIGHTS in name):
            raise ValueError(f"its weights do not fit its parameters: it also has {more[:5]}")
        return weights

    # -- inside -------------------------------------------------------------------------------------------------------

    def _check_parameters(self) -> None:
        self._settings()

    def _settings(self) -> Training:
        for name in (*self._sizes, "members", "batch_size", "max_epochs", "patience"):
            integer(name, getattr(self, name), 1, _MOST.get(name, _WIDEST))
        limits = {"learning_rate": 10.0, "weight_decay": 10.0, "dropout": 0.99, "validation_fraction": 0.5}
        for name, most in limits.items():
            real(name, getattr(self, name), 0, most)
        integer("random_state", self.random_state, 0, np.inf)
        return Training(
            members=self.members,
            learning_rate=self.learning_rate,
            weight_decay=self.weight_decay,
            dropout=self.dropout,
            batch_size=self.batch_size,
            max_epochs=self.max_epochs,
            patience=self.patience,
            validation_fraction=self.validation_fraction,
            device=self.device,
        )

    def _check_fitted(self) -> None:
        if not hasattr(self, "weights_"):
            from sklearn.exceptions import NotFittedError

            raise NotFittedError(f"this {type(self).__name__} is not fitted yet; call `fit` with trajectories first")

    @staticmethod
    def _check_layouts(trajectories: Sequence[Trajectory]) -> None:
        for number, trajectory in enumerate(trajectories):
            if trajectory.layout is not None and trajectory.is_grid:
                try:
                    check_trajectory(trajectory)
                except ValueError as error:
                    raise TrajectoryError.of(number, trajectory, error) from error

    def _learn_prior(self, trajectories: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        chosen = np.bincount(self.goal_columns(trajectories), minlength=len(self.classes_)) + 1.0
        return chosen / (self._allowed(trajectories).sum(axis=0) + len(self.classes_))

    def _allowed(self, trajectories: Sequence[Trajectory]) -> npt.NDArray[np.bool_]:
        allowed = np.zeros((len(trajectories), len(self.classes_)), dtype=bool)
        for row, trajectory in enumerate(trajectories):
            allowed[row, self.candidate_columns(within_reach(trajectory))] = True
        return allowed

    def _examples(self, trajectories: Sequence[Trajectory], encoding: Encoding) -> Examples:
        return Examples(
            inputs=_padded([encoding.encode(trajectory) for trajectory in trajectories]).astype(np.float32),
            lengths=np.array([trajectory.num_states for trajectory in trajectories], dtype=np.intp),
            allowed=self._allowed(trajectories),
            goals=self.goal_columns(trajectories),
        )

    def _beliefs(self, trajectories: Sequence[Trajectory]) -> list[npt.NDArray[np.float64]]:
        """For each trajectory ``(T+1, K)``: the belief after 0, 1, …, T states."""
        self._check_fitted()
        allowed = self._allowed(trajectories)
        for number, trajectory in enumerate(trajectories):
            try:
                self.encoding_.check(trajectory)
            except ValueError as error:
                raise TrajectoryError.of(number, trajectory, error) from error
        self._check_layouts(trajectories)
        found: list[npt.NDArray[np.float64]] = [np.zeros(0)] * len(trajectories)
        by_length = sorted(range(len(trajectories)), key=lambda i: trajectories[i].num_states)
        network = self._network()
        for begin in range(0, len(by_length), _AT_ONCE):
            rows = by_length[begin : begin + _AT_ONCE]
            inputs = _padded([self.encoding_.encode(trajectories[i]) for i in rows])
            after = self._probabilities(network(NUMPY, self.weights_, inputs[None])[0], allowed[rows])
            before = self._prior(allowed[rows])
            for row, i in enumerate(rows):
                found[i] = np.concatenate([before[row, None], after[row, : trajectories[i].num_states]])
        return found

    def _prior(self, allowed: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
        weights = np.where(allowed, self.prior_, 0.0)
        return weights / weights.sum(axis=1, keepdims=True)

    def _probabilities(
        self, logits: npt.NDArray[np.float64], allowed: npt.NDArray[np.bool_]
    ) -> npt.NDArray[np.float64]:
        """``(n, T, K)`` mean over the members' probabilities, given logits ``(M, n, T, K)``."""
        probabilities = softmax(np.where(allowed[:, None], logits, -np.inf)).mean(axis=0)
        return probabilities / probabilities.sum(axis=-1, keepdims=True)


class NeuralStream(GoalStream):
    """A neural predictor's belief about one person, which goes on from the networks' state.

    Each update runs the networks on one state: recurrent ones carry their hidden vectors, transformers their keys and
    values.
    """

    def __init__(self, predictor: NeuralPredictor, context: Trajectory) -> None:
        predictor._check_fitted()
        super().__init__(predictor, context, cells=predictor.encoding_.grid)
        self._neural = predictor
        self._network = predictor._network()
        self._known = predictor.encoding_.context(context)
        self._allowed = predictor._allowed([context])
        self._state: Any = None
        self._row = predictor._prior(self._allowed)[0]

    @property
    def belief(self) -> dict[str, float]:
        """``{goal: probability}`` now; the prior before the first point."""
        return dict(zip(self._context.candidates, self._row[self._columns].tolist(), strict=True))

    def add(self, point: npt.ArrayLike, time: float | None = None) -> None:
        """Add a state without asking for the belief; see :meth:`update`."""
        count = len(self._points)
        super().add(point, time)
        if len(self._points) == count:
            return
        try:
            self._advance()
        except ValueError:  # a refused point is not part of the trajectory
            del self._points[count:], self._times[count:]
            raise

    def _advance(self) -> None:
        predictor = self._neural
        recent = np.array([self._points[0], *self._points[-2:]])
        if len(self._points) == 1:  # where the person stands tells which goals are in reach
            self._allowed = predictor._allowed([self._observed()])
        if len(self._points) < 3:  # the kind of points cannot change later
            predictor.encoding_.check(self._observed())
        if self._context.layout is not None and predictor.encoding_.grid:
            check_trajectory(self._observed())
        rows = predictor.encoding_.rows(self._known, recent[0], recent[-2:-1], recent[-1:])
        logits, self._state = self._network(NUMPY, predictor.weights_, rows[None, None], self._state)
        self._row = predictor._probabilities(logits, self._allowed)[0, 0]


def _padded(arrays: Sequence[npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
    """``(n, T, D)`` with zeros after the end of shorter ones; ``T`` is at least 1."""
    longest = max(max(len(array) for array in arrays), 1)
    padded = np.zeros((len(arrays), longest, arrays[0].shape[1]))
    for row, array in enumerate(arrays):
        padded[row, : len(array)] = array
    return padded
