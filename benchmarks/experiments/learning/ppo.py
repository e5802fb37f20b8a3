"""Proximal policy optimisation (Schulman et al. 2017), masked and for several players, in one file.

``collect`` plays games and gathers what each player saw, did and gained; ``PPO.update`` learns from it. Players of one
game share the network: ``(N, players, ...)`` observations are ``N * players`` rows, and each row gains the team's
reward. All randomness comes from one ``numpy.random.Generator``.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from gymnasium.vector import VectorEnv
from torch import Tensor, nn

from benchmarks.experiments.learning.environments import PlayerSpace, final_observations
from benchmarks.experiments.learning.guidance import Guide
from benchmarks.experiments.learning.networks import ActorCritic
from benchmarks.experiments.learning.normalising import RunningMoments, normalised
from benchmarks.experiments.learning.settings import PPOSettings, TrainingSettings

__all__ = ["PPO", "Episode", "Games", "Rollout", "Seconds", "advantages", "collect"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


class Rollout(NamedTuple):
    """What ``B`` players saw, did and gained in ``T`` steps; all of shape ``(T, B, ...)``.

    Attributes:
        obs: Observations, as the network takes them.
        masks: bool, which actions could be taken; None: all.
        actions: Actions.
        log_probs: Logarithms of the probabilities with which they were taken.
        values: What the critic expected.
        advantages: How much better it went than expected; see :func:`advantages`; with what guides cooks.
        returns: What the critic should have expected.
    """

    obs: npt.NDArray[Any]
    masks: Flags | None
    actions: npt.NDArray[Any]
    log_probs: npt.NDArray[np.float32]
    values: npt.NDArray[np.float32]
    advantages: npt.NDArray[np.float32]
    returns: npt.NDArray[np.float32]


class Episode(NamedTuple):
    """An episode that has ended.

    Attributes:
        score: Sum of its rewards, the team's.
        length: Its steps.
        finished: Whether it terminated, and was not cut off.
    """

    score: float
    length: int
    finished: bool


@dataclass
class Seconds:
    """Where the time goes."""

    environment: float = 0.0
    acting: float = 0.0
    learning: float = 0.0


@dataclass
class Games:
    """Games under way.

    Attributes:
        envs: Them.
        space: What a player sees and does.
        obs: ``(N, ...)`` observations of this moment.
        infos: Infos of this moment.
        scores: ``(N,)`` sums of rewards so far.
        lengths: ``(N,)`` steps so far.
        discounted: ``(N * players,)`` discounted sums of rewards so far, for the running deviation.
        guide: Tells whether steps led nearer to valid goals; None: nothing does.
        ended: Episodes that have ended since the list was emptied.
    """

    envs: VectorEnv[Any, Any, Any]
    space: PlayerSpace
    obs: npt.NDArray[Any]
    infos: dict[str, Any]
    scores: Floats
    lengths: npt.NDArray[np.int64]
    discounted: Floats
    guide: Guide | None = None
    ended: list[Episode] = field(default_factory=list)

    @classmethod
    def begin(cls, envs: VectorEnv[Any, Any, Any], space: PlayerSpace, settings: PPOSettings, seed: int) -> Games:
        """Start all games."""
        count = envs.num_envs
        guide = Guide(envs, space) if settings.guide else None
        obs, infos = envs.reset(seed=seed)
        if guide is not None:
            guide.begin(obs, infos)
        scores, lengths = np.zeros(count), np.zeros(count, dtype=np.int64)
        return cls(envs, space, obs, infos, scores, lengths, np.zeros(count * space.players), guide)

    def rows(self, obs: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """``(k * players, ...)`` observations of players, of ``(k, ...)`` games."""
        return obs.reshape(-1, *self.space.shape)

    def masks(self) -> Flags | None:
        """``(N * players, n)`` actions that may be taken; None where the environment does not say."""
        if self.space.actions != "discrete" or "action_mask" not in self.infos:
            return None
        return np.asarray(self.infos["action_mask"]).reshape(-1, self.space.size).astype(np.bool_)


class PPO:
    """A learner: network, optimiser, and running means.

    Args:
        space: What a player sees and does.
        settings: How it learns.
        scale: Observations are multiplied with it; see :func:`.observation_scale`.
        rng: Source of all randomness.
    """

    def __init__(
        self,
        space: PlayerSpace,
        settings: TrainingSettings,
        scale: npt.NDArray[np.float32],
        rng: np.random.Generator,
    ) -> None:
        self.space = space
        self.settings = settings.ppo
        self.rng = rng
        self.network = ActorCritic(space, settings.network, scale, rng)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=self.settings.learning_rate, eps=1e-5)
        self.obs_moments = RunningMoments(tuple(space.shape))
        self.return_moments = RunningMoments(())

    def seen(self, obs: npt.NDArray[Any], *, learn: bool = False) -> npt.NDArray[Any]:
        """Rows of observations as the network takes them; ``learn`` lets running means take them in."""
        if not self.settings.normalise_observations:
            return obs
        if learn:
            self.obs_moments.update(obs)
        return normalised(obs, self.obs_moments.mean, self.obs_moments.variance)

    def gained(self, games: Games, rewards: Floats, done: Flags) -> Floats:
        """``(B,)`` rewards of a step as they are learned from; ``done`` is of the same shape."""
        if not self.settings.normalise_rewards:
            return rewards
        games.discounted = games.discounted * self.settings.gamma + rewards
        self.return_moments.update(games.discounted)
        games.discounted[done] = 0.0
        return np.clip(rewards / np.sqrt(self.return_moments.variance + 1e-8), -10, 10)

    @torch.no_grad()
    def act(self, obs: npt.NDArray[Any], masks: Flags | None) -> tuple[Tensor, Tensor, Tensor]:
        """Actions of rows, the logarithms of their probabilities, and values."""
        choices, values = self.network(torch.from_numpy(obs), None if masks is None else torch.from_numpy(masks))
        actions = choices.sample(self.rng)
        return actions, choices.log_probs(actions), values

    @torch.no_grad()
    def values(self, obs: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """``(B,)`` values of rows of observations."""
        return np.asarray(self.network.values(torch.from_numpy(obs)).numpy())

    def update(self, rollout: Rollout, progress: float) -> dict[str, float]:
        """Learn from a rollout.

        Args:
            rollout: What was gathered with the network as it is.
            progress: Share of the training that is over, from 0 to 1.

        Returns:
            Means over minibatches: ``policy_loss``, ``value_loss``, ``entropy``, ``kl`` (how far the policy moved, in
            nats) and ``clipped`` (share of rows whose ratio was cut).
        """
        settings = self.settings
        entropy_weight = _between(settings.entropy, settings.final_entropy, progress)
        rate = settings.learning_rate * _between(1.0, settings.final_rate, progress)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        rows = _flatten(rollout)
        told = []
        for _ in range(settings.epochs):
            for chosen in _minibatches(len(rows.actions), settings.batch, self.rng):
                part = _Rows(*(None if values is None else values[chosen] for values in rows))
                loss, said = self._loss(part, entropy_weight)
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.network.parameters(), settings.max_gradient)
                self.optimizer.step()
                told.append(said)
        means = torch.stack(told).mean(dim=0).tolist()
        return dict(zip(("policy_loss", "value_loss", "entropy", "kl", "clipped"), means, strict=True))

    def _loss(self, rows: _Rows, entropy_weight: float) -> tuple[Tensor, Tensor]:
        """The loss of a minibatch, and what is told about it."""
        settings = self.settings
        choices, values = self.network(rows.obs, rows.masks)
        change = choices.log_probs(rows.actions) - rows.log_probs
        ratio = change.exp()
        better = (rows.advantages - rows.advantages.mean()) / rows.advantages.std().clamp(min=settings.least_deviation)
        policy_loss = -torch.min(ratio * better, ratio.clamp(1 - settings.clip, 1 + settings.clip) * better).mean()
        error = (values - rows.returns).square()
        if settings.clip_value:
            near = rows.values + (values - rows.values).clamp(-settings.clip_value, settings.clip_value)
            error = torch.max(error, (near - rows.returns).square())
        value_loss = 0.5 * error.mean()
        entropy = choices.entropy().mean()
        loss = policy_loss + 2 * settings.value_weight * value_loss - entropy_weight * entropy
        with torch.no_grad():
            kl = (ratio - 1 - change).mean()
            clipped = ((ratio - 1).abs() > settings.clip).float().mean()
        return loss, torch.stack([policy_loss, value_loss, entropy, kl, clipped]).detach()


class _Rows(NamedTuple):
    obs: Tensor
    masks: Tensor | None
    actions: Tensor
    log_probs: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor


def advantages(
    rewards: npt.NDArray[Any],
    values: npt.NDArray[Any],
    last_values: npt.NDArray[Any],
    ends: Flags,
    gamma: float,
    gae_lambda: float,
) -> Floats:
    """Generalised advantage estimation (Schulman et al. 2016).

    Args:
        rewards: ``(T, B)``; the reward with which an episode is cut off holds the discounted value of its last
            observation too, as it would have gone on.
        values: ``(T, B)`` of the observation before each step.
        last_values: ``(B,)`` of the observation after the last step.
        ends: ``(T, B)`` whether an episode ended, or was cut off, in a step.
        gamma: Discount.
        gae_lambda: 0: how much better one step was than expected; 1: how much better all that followed.

    Returns:
        ``(T, B)``.
    """
    found = np.zeros(rewards.shape)
    ahead, following = np.zeros(rewards.shape[1]), np.asarray(last_values, dtype=np.float64)
    for t in reversed(range(len(rewards))):
        goes_on = ~ends[t]
        surprise = rewards[t] + gamma * following * goes_on - values[t]
        found[t] = ahead = surprise + gamma * gae_lambda * ahead * goes_on
        following = values[t].astype(np.float64)
    return found


def collect(games: Games, learner: PPO, length: int, seconds: Seconds, progress: float = 0.0) -> Rollout:
    """Play ``length`` steps of all games.

    Where games have a guide, ``settings.guide`` for every step nearer to a valid goal is added to advantages, and
    subtracted for one farther away: less with progress, and nothing from ``settings.guide_until`` on.

    Args:
        games: Under way; they are further when this returns.
        learner: Plays all players.
        length: Steps of each game.
        seconds: Counts the time it took.
        progress: Share of the training that is over, from 0 to 1.
    """
    settings, players, steps = learner.settings, games.space.players, []
    rewards = np.zeros((length, games.envs.num_envs * players))
    nearer, ends = np.zeros(rewards.shape), np.zeros(rewards.shape, dtype=np.bool_)
    for t in range(length):
        before = time.perf_counter()
        obs = learner.seen(games.rows(games.obs), learn=True)
        masks = games.masks() if settings.masked else None
        actions, log_probs, values = learner.act(obs, masks)
        steps.append((obs, masks, actions.numpy(), log_probs.numpy(), values.numpy()))
        begun = time.perf_counter()
        gains, terminated, truncated, infos = _step(games, steps[-1][2])
        after = time.perf_counter()
        ends[t] = np.repeat(terminated | truncated, players)
        rewards[t] = learner.gained(games, np.repeat(gains, players), ends[t])
        if games.guide is not None:
            nearer[t] = games.guide.nearer(games.obs, gains, infos).reshape(-1)
        cut_off = np.flatnonzero(truncated & ~terminated)
        if len(cut_off):  # not over: the rest would have been worth this
            last = learner.values(learner.seen(games.rows(final_observations(infos, cut_off))))
            rewards[t].reshape(-1, players)[cut_off] += settings.gamma * last.reshape(-1, players)
        seconds.environment += after - begun
        seconds.acting += time.perf_counter() - before - (after - begun)
    seen, masks_, actions_, log_probs_, values_ = zip(*steps, strict=True)
    last_values = learner.values(learner.seen(games.rows(games.obs)))
    found = advantages(rewards, np.array(values_), last_values, ends, settings.gamma, settings.gae_lambda)
    return Rollout(
        np.array(seen),
        None if masks_[0] is None else np.array(masks_),
        np.array(actions_),
        np.array(log_probs_),
        np.array(values_),
        (found + settings.guide * max(0.0, 1 - progress / settings.guide_until) * nearer).astype(np.float32),
        (found + np.array(values_)).astype(np.float32),
    )


def _step(games: Games, actions: npt.NDArray[Any]) -> tuple[Floats, Flags, Flags, dict[str, Any]]:
    """Advance all games, and keep count of their episodes."""
    space, count = games.space, games.envs.num_envs
    if space.actions == "continuous":
        low, high = games.envs.single_action_space.low, games.envs.single_action_space.high  # type: ignore[attr-defined]
        moves = np.clip(actions, low, high).reshape(count, space.size)
    else:
        moves = actions if space.players == 1 else actions.reshape(count, space.players)
    games.obs, gains, terminated, truncated, games.infos = games.envs.step(moves)
    games.scores += gains
    games.lengths += 1
    for i in np.flatnonzero(terminated | truncated):
        games.ended.append(Episode(float(games.scores[i]), int(games.lengths[i]), bool(terminated[i])))
        games.scores[i], games.lengths[i] = 0.0, 0
    return np.asarray(gains, dtype=np.float64), terminated, truncated, games.infos


def _between(first: float, last: float, progress: float) -> float:
    return first + (last - first) * progress


def _flatten(rollout: Rollout) -> _Rows:
    """All rows of a rollout, one below the other."""
    return _Rows(*(None if part is None else torch.from_numpy(part.reshape(-1, *part.shape[2:])) for part in rollout))


def _minibatches(count: int, size: int, rng: np.random.Generator) -> Iterator[Tensor]:
    """Rows of minibatches of about equal size, each row in one of them."""
    yield from torch.from_numpy(rng.permutation(count)).chunk(max(1, round(count / size)))
