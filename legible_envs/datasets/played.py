"""Data sets of played episodes in Minari's format: scripted players, simulated participants, or any policy.

    >>> make_played_dataset("data", "overcooked", player="boltzmann", episodes=20, seed=0)       # doctest: +SKIP

The same arguments make the same arrays, byte for byte. The environment can be made again from what the data set says
(``dataset.recover_environment()``), and :func:`legible_envs.rollouts.from_minari` gives its trajectories.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import gymnasium as gym
import numpy as np

import legible_envs
from legible_envs.datasets.players import ENVIRONMENTS, Player, Policy, find_player, make_policy
from legible_envs.rollouts.counts import check_participants
from legible_envs.rollouts.minari_writing import DatasetInfo, MinariWriter
from legible_envs.rollouts.recording import Episode, RecordTrajectories
from legible_envs.support.specs import plain
from legible_envs.support.validation import choice, integer

__all__ = ["Progress", "make_environment", "make_played_dataset", "requirements"]

Progress = Callable[[int, int], None]
"""Told (episodes done, of how many)."""

_GREATEST_SEED: Final = 2**31 - 1


def make_played_dataset(
    folder: str | os.PathLike[str],
    domain: str = "overcooked",
    *,
    player: str | Policy | type = "scripted",
    episodes: int = 100,
    participants: int | None = None,
    seed: int = 0,
    dataset_id: str | None = None,
    author: Sequence[str] = (),
    description: str | None = None,
    condition: str = "simulated",
    progress: Progress | None = None,
    **arguments: Any,
) -> Any:
    """Play episodes and write them as a Minari data set.

    Args:
        folder: The folder of data sets, as ``MINARI_DATASETS_PATH`` would name it; made where it is missing.
        domain: ``"overcooked"`` or ``"tabletop"``.
        player: See :func:`~legible_envs.datasets.players.find_player`.
        episodes: How many episodes.
        participants: How many participants, who take turns; None: one where they do not differ, else one per episode.
        seed: Of everything: participants, their decisions, and the environment.
        dataset_id: As Minari names data sets; by default such as ``"overcooked/boltzmann-v0"``.
        author: Names of those who make it.
        description: In sentences; by default what is known.
        condition: Of all trajectories.
        progress: Told (episodes done, of how many) after each.
        **arguments: Of ``gymnasium.make``, such as ``layout``, ``obs_type`` or ``max_episode_steps``. With
            ``num_players=2`` a policy gives joint actions, and observations are of both.

    Returns:
        The ``minari.MinariDataset``.

    Raises:
        ImportError: Minari is not installed.
        ValueError: No such domain or player, a number out of range, a bad id or bad arguments of the environment.
        TypeError: Something that is no player.
        FileExistsError: There is a data set of that name.
        RuntimeError: A policy that fails or gives an action that is none; nothing is written then.
    """
    choice("domain", domain, tuple(ENVIRONMENTS))
    who = find_player(domain, player)
    episodes = integer("episodes", episodes, 1, 1_000_000)
    seed = integer("seed", seed, 0)
    people = (episodes if who.differs else 1) if participants is None else participants
    people, _ = check_participants(integer("participants", people, 1), 1)
    env = make_environment(ENVIRONMENTS[domain], **arguments)
    try:
        assert env.spec is not None
        info = DatasetInfo(
            dataset_id=dataset_id or f"{domain}/{_short(who.name)}-v0",
            env_spec=env.spec,
            observation_space=env.observation_space,
            action_space=env.action_space,
            algorithm_name=who.name,
            description=description or f"Episodes of {env.spec.id} by {who.about}.",
            author=author,
            details={"code": requirements()[0], "player": who.name, "participants": people, "seed": seed},
            requirements=requirements(),
        )
        with MinariWriter(Path(folder), info) as writer:
            for number, (episode, labels) in enumerate(_play(env, who, episodes, people, seed, condition), 1):
                writer.add(episode, labels)
                if progress is not None:
                    progress(number, episodes)
        return writer.dataset
    finally:
        env.close()


def make_environment(name: str, **arguments: Any) -> gym.Env[Any, Any]:
    """An environment of this package, whose spec is JSON.

    Raises:
        ValueError: Bad arguments, one that the environment does not have, or one that JSON cannot hold, so that the
            environment could not be made again from the data set.
    """
    try:
        env = gym.make(name, **plain(arguments))
    except TypeError as error:
        raise ValueError(f"{name} cannot be made with {sorted(arguments)}: {error}") from error
    assert env.spec is not None
    try:
        json.dumps(env.spec.kwargs)
    except (TypeError, ValueError) as error:
        env.close()
        raise ValueError(f"the arguments of {name} must be data that JSON can hold: {error}") from error
    return env


def requirements() -> list[str]:
    """What must be installed to make the environment again, as pip writes it."""
    return [f"legible-envs=={legible_envs.__version__}"]


def _short(name: str) -> str:
    """A name as part of an id: of ``module:Name`` what follows the colon."""
    return "".join(c if c.isascii() and c.isalnum() else "-" for c in name.rpartition(":")[2]).strip("-") or "policy"


def _play(
    env: Any, player: Player, episodes: int, participants: int, seed: int, condition: str
) -> Iterator[tuple[Episode, dict[str, Any] | list[dict[str, Any]]]]:
    """Episodes and the labels of their trajectories, one after the other."""
    of_env, of_people = np.random.SeedSequence(seed).spawn(2)
    seeds = np.random.default_rng(of_env).integers(0, _GREATEST_SEED, size=episodes, endpoint=True).tolist()
    # Each from a stream of their own, so that one participant's play does not change with the others' number.
    streams = [np.random.default_rng(child) for child in of_people.spawn(participants)]
    policies: dict[int, Policy] = {}
    for number, own in enumerate(seeds):
        who = number % participants
        recorder = RecordTrajectories(env, participant=f"{player.name}/{who}", condition=condition)
        first = recorder.reset(seed=own)
        if who not in policies:
            policies[who] = make_policy(player, env, streams[who])
        _run(recorder, policies[who], player.name, number, first)
        (episode,) = recorder.episodes
        yield episode, _labels(env, recorder.labels(episode))


def _labels(env: Any, labels: dict[str, Any]) -> dict[str, Any] | list[dict[str, Any]]:
    """Of the one player, or of each of several, who are numbered after the participant's name."""
    cooks = getattr(env.unwrapped, "num_players", 1)
    if cooks == 1:
        return labels
    return [{**labels, "player": cook, "participant": f"{labels['participant']}/{cook}"} for cook in range(cooks)]


def _run(env: RecordTrajectories, policy: Policy, name: str, number: int, first: tuple[Any, dict[str, Any]]) -> None:
    """Play an episode that has been begun to its end."""
    (observation, info), over, step = first, False, 0
    while not over:
        try:
            action = policy(observation, info)
        except Exception as error:  # users' code may raise anything
            raise RuntimeError(
                f"player {name!r} failed in episode {number}, step {step}: {type(error).__name__}: {error}"
            ) from error
        try:
            observation, _, terminated, truncated, info = env.step(action)
        except (ValueError, TypeError) as error:
            raise RuntimeError(
                f"player {name!r} gave an action that is none in episode {number}, step {step}: {error}"
            ) from error
        over, step = bool(terminated or truncated), step + 1
