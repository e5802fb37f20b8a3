"""The settings of a training run: plain data that a checkpoint keeps, and what can be said about two of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final

from legible_envs.support.models import FileModel, Flag, Length, Real, Text, Whole, validated
from legible_envs.support.optional import import_torch
from legible_envs.support.validation import shown

__all__ = ["Environment", "NetworkShape", "PPOSettings", "TrainingSettings", "changed", "require_torch"]

_MOST_STEPS: Final = 10**12

Width = Annotated[int, Whole(1, 8_192)]
Widths = Annotated[list[Width], Length(0, 16)]
Share = Annotated[float, Real(0, 1)]
Positive = Annotated[float, Real(0, closed="neither")]
NotNegative = Annotated[float, Real(0)]


class Environment(FileModel):
    """What is played.

    Attributes:
        id: Of Gymnasium's registry.
        arguments: Of the environment, plain data.
    """

    id: Annotated[str, Text()]
    arguments: dict[str, Any] = {}  # noqa: RUF012


class NetworkShape(FileModel):
    """The network.

    Attributes:
        channels: Of the 3x3 convolutions, of which grids of cells have some; vectors have none.
        hidden: Widths of the layers of the actor, and of the critic.
    """

    channels: Widths = []  # noqa: RUF012
    hidden: Widths = [128, 128]  # noqa: RUF012


class PPOSettings(FileModel):
    """Proximal policy optimisation (Schulman et al. 2017); the names of Stable-Baselines3 in brackets.

    Attributes:
        num_envs: Games at a time.
        rollout: Steps of each game between updates (``n_steps``).
        batch: Rows of a minibatch (``batch_size``); a row is one decision of one player.
        epochs: Passes over the rows of a rollout (``n_epochs``).
        learning_rate: Of Adam, at the beginning; it falls linearly to ``final_rate`` times that.
        final_rate: Share of the learning rate that is left at the end.
        gamma: Discount.
        gae_lambda: Of generalised advantage estimation (Schulman et al. 2016).
        clip: How far the ratio of probabilities counts.
        clip_value: How far a value counts that moves away from the one before; 0: as far as it moves.
        entropy: Weight of the entropy at the beginning (``ent_coef``); it falls linearly to ``final_entropy``.
        final_entropy: Weight of the entropy at the end.
        value_weight: Of the critic's loss (``vf_coef``).
        least_deviation: Advantages of a minibatch are divided by their deviation, or by this where it is less: where
            nothing is gained, their differences are noise, which must not be made large.
        max_gradient: Norm to which gradients are cut (``max_grad_norm``).
        guide: Kitchens: added to advantages, at the beginning, for every step nearer to a valid goal; see
            :class:`.Guide`.
        guide_until: Share of the training over which that falls linearly to 0.
        masked: Whether actions that do nothing are left out, where the environment says which those are.
        normalise_observations: Whether observations are shifted and scaled by running means and deviations.
        normalise_rewards: Whether rewards are scaled by the running deviation of discounted returns.
    """

    num_envs: Annotated[int, Whole(1, 65_536)] = 16
    rollout: Annotated[int, Whole(1, 1_000_000)] = 256
    batch: Annotated[int, Whole(2, 10_000_000)] = 1024
    epochs: Annotated[int, Whole(1, 1_000)] = 6
    learning_rate: Positive = 7e-4
    final_rate: Share = 0.0
    gamma: Share = 0.99
    gae_lambda: Share = 0.95
    clip: Positive = 0.2
    clip_value: NotNegative = 0.0
    entropy: NotNegative = 0.05
    final_entropy: NotNegative = 0.05
    value_weight: NotNegative = 0.5
    least_deviation: Positive = 0.1
    max_gradient: Positive = 0.5
    guide: NotNegative = 0.0
    guide_until: Annotated[float, Real(0, 1, closed="right")] = 0.5
    masked: Annotated[bool, Flag()] = True
    normalise_observations: Annotated[bool, Flag()] = False
    normalise_rewards: Annotated[bool, Flag()] = True


class TrainingSettings(FileModel):
    """All that decides what a training run comes to.

    Attributes:
        environment: What is played.
        network: The network.
        ppo: How it learns.
        steps: Steps of all games together; those of several players in one kitchen count once.
        seed: Of all randomness.
        checkpoint_every: Steps between checkpoints. All games start anew after each, so that a run that is resumed
            goes on as one that was never interrupted.
    """

    environment: Environment
    network: NetworkShape = NetworkShape()
    ppo: PPOSettings = PPOSettings()
    steps: Annotated[int, Whole(1, _MOST_STEPS)] = 1_000_000
    seed: Annotated[int, Whole(0)] = 0
    checkpoint_every: Annotated[int, Whole(1, _MOST_STEPS)] = 100_000

    def to_dict(self) -> dict[str, Any]:
        """Plain data that :meth:`from_dict` reads back."""
        return self.model_dump(mode="json")

    @classmethod
    def from_dict(cls, data: object, what: str = "the settings") -> TrainingSettings:
        """Read settings back.

        Raises:
            ValueError: They are no such settings; names the first that is wrong.
        """
        return validated(cls, data, what)

    def replaced(self, changes: Mapping[str, Any]) -> TrainingSettings:
        """The same settings but for some.

        Args:
            changes: New values by path, such as ``{"ppo.learning_rate": 1e-3}``.

        Raises:
            ValueError: A value that is out of range, or a path that leads nowhere.
        """
        data = self.to_dict()
        for path, value in changes.items():
            *parents, name = path.split(".")
            place: Any = data
            for parent in parents:
                place = place.get(parent) if isinstance(place, dict) else None
            if not isinstance(place, dict):
                raise ValueError(f"there is no setting {shown(path)}; there are {', '.join(data)}, and those in them")
            if value is None:
                place.pop(name, None)
            else:
                place[name] = value
        return self.from_dict(data)


def changed(before: TrainingSettings, after: TrainingSettings) -> list[str]:
    """What differs between two settings, a phrase for each: its name, the old and the new value.

    Example:
        >>> old = TrainingSettings(environment=Environment(id="CartPole-v1"))
        >>> changed(old, old.replaced({"seed": 1}))
        ['`seed` was 0 and is now 1']
    """
    old, new = dict(_flat(before.to_dict())), dict(_flat(after.to_dict()))
    return [
        f"`{path}` was {_said(old, path)} and is now {_said(new, path)}"
        for path in dict.fromkeys((*old, *new))
        if old.get(path) != new.get(path) or (path in old) != (path in new)
    ]


def _flat(data: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _said(values: Mapping[str, Any], path: str) -> str:
    return shown(values[path]) if path in values else "not set"


def require_torch() -> None:
    """Make sure that PyTorch is there.

    Raises:
        ImportError: It is not installed; the message says how to.
    """
    import_torch("training needs", "a trained policy plays without it")
