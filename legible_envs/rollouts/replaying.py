"""Playing recorded episodes again, to see the trajectories in them; nothing is believed that comes out otherwise."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.envs.registration import EnvSpec

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import shown

__all__ = ["RecordedEpisode", "Replayer", "environment_of"]

_TOLERANCE: Final = 1e-5
"""Metres and the like: rounding of other machines' numbers."""
_JPEG_LEVELS: Final = 16.0
"""Mean difference of two pictures' levels of 255 up to which they are the same but for their compression."""
_GOAL, _IN_HAND = ": goal", ": in hand"
_WORDS: Final = ("random:train", "random:test")
"""Values of arguments that look like names of code, and are none: distributions of kitchens."""
_CAUSES: Final = (
    "It was recorded with another version of the environment, through wrappers that change what the environment sees "
    "or shows and are not in the data set's description (pass `env=`), or something set in the environment between its "
    "steps"
)


@dataclass(frozen=True)
class RecordedEpisode:
    """``T`` steps between ``T + 1`` observations.

    Attributes:
        name: What messages call it.
        seed: What ``reset`` was given.
        options: What ``reset`` was given.
        observations: ``(T + 1, …)``.
        actions: ``(T, …)``.
        rewards: ``(T,)``.
        labels: Arguments of the environment's ``trajectories``, once for each player whose trajectories are wanted.
    """

    name: str
    seed: int | None
    options: Mapping[str, Any]
    observations: npt.NDArray[Any]
    actions: npt.NDArray[Any]
    rewards: npt.NDArray[np.float64]
    labels: Sequence[Mapping[str, Any]] = ({},)


def environment_of(spec: EnvSpec | None, dataset: str) -> gym.Env[Any, Any]:
    """Make the environment that a file describes, without importing what only the file names.

    Args:
        spec: The description.
        dataset: Whose it is, for messages.

    Raises:
        ValueError: No description, an environment of another package, or one that asks for code by its name.
    """
    if spec is None:
        raise ValueError(f"the data set {dataset!r} does not say which environment it is of; pass `env=`")
    known = {name for name, entry in gym.registry.items() if str(entry.entry_point).startswith("legible_envs.")}
    if spec.id not in known:
        raise ValueError(
            f"the data set {dataset!r} is of {spec.id}; trajectories are known in {sorted(known)}, and in others that "
            "are passed as `env=`"
        )
    code = [f"wrapper {wrapper.entry_point}" for wrapper in spec.additional_wrappers or () if _is_foreign(wrapper)]
    code += [f"{name}={value!r}" for name, value in spec.kwargs.items() if value not in _WORDS and _names_code(value)]
    if code:
        raise ValueError(
            f"the data set {dataset!r} asks for code by its name: {', '.join(code)}; pass `env=` to use it"
        )
    registered = gym.registry[spec.id]
    spec = EnvSpec(
        id=spec.id,
        entry_point=registered.entry_point,
        max_episode_steps=spec.max_episode_steps,
        disable_env_checker=True,
        kwargs=dict(spec.kwargs),
        additional_wrappers=spec.additional_wrappers,
    )
    try:
        return gym.make(spec)
    except Exception as error:  # whatever arguments of another version, or of a damaged file, may raise
        raise ValueError(f"the data set {dataset!r}: its {spec.id} cannot be made: {error}") from error


def _is_foreign(wrapper: Any) -> bool:
    return not str(wrapper.entry_point).startswith(("gymnasium.wrappers.", "legible_envs."))


def _names_code(value: object) -> bool:
    if isinstance(value, Mapping):
        return any(map(_names_code, value.values()))
    if not isinstance(value, str):
        return False
    module, colon, name = value.partition(":")
    return bool(colon) and all(part.isidentifier() for part in f"{module}.{name}".split("."))


class Replayer:
    """Plays episodes of one environment again, one after another.

    Args:
        env: The environment.
        layouts: Layouts that the recording names anywhere, for episodes that name none.
        is_lossy: Whether recorded observations are compressed pictures.
    """

    def __init__(self, env: gym.Env[Any, Any], layouts: Iterable[Any] = (), is_lossy: bool = False) -> None:
        self._env = env
        self._game: Any = env.unwrapped
        if not hasattr(self._game, "trajectories"):
            raise ValueError(f"{type(self._game).__name__} tells no trajectories; expected an environment that does")
        self._layouts = list({json.dumps(layout): layout for layout in layouts if layout is not None}.values())
        self._is_lossy = is_lossy

    def trajectories(self, episode: RecordedEpisode, **labels: Any) -> list[Trajectory]:
        """The trajectories in an episode.

        Args:
            episode: The episode.
            **labels: Arguments of the environment's ``trajectories``, instead of the episode's own.

        Raises:
            ValueError: It does not play again as it was recorded.
        """
        if len(episode.observations) != len(episode.actions) + 1 or len(episode.rewards) != len(episode.actions):
            raise ValueError(
                f"{episode.name} has {len(episode.actions)} actions, {len(episode.rewards)} rewards and "
                f"{len(episode.observations)} observations; expected one observation more than actions"
            )
        self._begin(episode)
        goals = _GoalsShown(self._game, episode.observations)
        for step, action in enumerate(episode.actions):
            goals.set_before(step)
            try:
                observation, reward, *_ = self._env.step(action if np.ndim(action) else action.item())
            except ValueError as error:
                raise ValueError(f"{episode.name}, step {step}: {error}") from error
            if not self._is_same(observation, episode.observations[step + 1]):
                raise ValueError(f"{episode.name} plays otherwise than it was recorded, from step {step} on. {_CAUSES}")
            if not np.isclose(float(reward), episode.rewards[step], atol=_TOLERANCE):
                raise ValueError(
                    f"{episode.name}, step {step} was recorded with reward {episode.rewards[step]:g} and gives "
                    f"{float(reward):g} now. {_CAUSES}"
                )
        try:
            found = [self._game.trajectories(**{**own, **labels}) for own in episode.labels]
        except (TypeError, IndexError) as error:  # labels of a file may be those of another environment
            raise ValueError(f"{episode.name} has labels that do not fit: {error}") from error
        return [trajectory for part in found for trajectory in part]

    def _begin(self, episode: RecordedEpisode) -> None:
        """Reset, on the layout whose first observation is the recorded one."""
        tried: list[dict[str, Any]] = [dict(episode.options)]
        if "layout" not in episode.options:
            tried += [{**episode.options, "layout": layout} for layout in (None, *self._layouts)]
        for options in tried:
            try:
                observation, _ = self._env.reset(seed=episode.seed, options=options or None)
            except ValueError as error:  # a LayoutError is one
                if len(tried) == 1:
                    raise ValueError(f"{episode.name} cannot begin with options {shown(options)}: {error}") from error
                continue
            if self._is_same(observation, episode.observations[0]):
                return
        raise ValueError(
            f"{episode.name} begins in none of the states that its seed and options, or the layouts of other episodes, "
            f"lead to. While recording, give layouts to `reset(options={{'layout': …}})` or to `gymnasium.make`. "
            f"{_CAUSES}"
        )

    def _is_same(self, observation: Any, recorded: npt.NDArray[Any]) -> bool:
        now = np.asarray(observation)
        if now.shape != recorded.shape:
            return False
        if self._is_lossy:
            return float(np.abs(now.astype(np.float64) - recorded).mean()) <= _JPEG_LEVELS
        if np.issubdtype(now.dtype, np.floating):
            return bool(np.allclose(now, recorded, rtol=0.0, atol=_TOLERANCE))
        return np.array_equal(now, recorded)


class _GoalsShown:
    """Goals that were set in a table while it was played: actions do not tell them, observations do.

    A player may set ``env.unwrapped.goal`` before a step. The observation after that step shows it, unless the goal was
    reached in the same step; then the object is in the hand.
    """

    def __init__(self, game: Any, observations: npt.NDArray[Any]) -> None:
        self._game = game
        names = tuple(getattr(game, "observation_names", ()))
        fits = observations.ndim == 2 and observations.shape[1] == len(names) and hasattr(game, "goal")
        self._rows = observations if fits else None
        self._shown = {name.removesuffix(_GOAL): i for i, name in enumerate(names) if name.endswith(_GOAL)}
        self._held = {name.removesuffix(_IN_HAND): i for i, name in enumerate(names) if name.endswith(_IN_HAND)}

    def set_before(self, step: int) -> None:
        """Set the goal that had been set before a step."""
        if self._rows is None:
            return
        before, after = self._rows[step], self._rows[step + 1]
        goal = next((name for name, i in self._shown.items() if after[i] > 0.5), None)
        if goal is None and self._game.goal is None:
            goal = next((name for name, i in self._held.items() if after[i] > 0.5 > before[i]), None)
        if goal is not None and goal != self._game.goal and goal in self._game.goals:
            self._game.goal = goal
