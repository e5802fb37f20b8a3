"""Small trainings for the tests of learning; skipped where torch is not installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.experiments.learning.settings import Environment, NetworkShape, PPOSettings, TrainingSettings

ONION = {"shape": [5, 5], "recipes": [["onion"]], "obs_type": "vector", "shaping": True}


def small(**ppo: object) -> TrainingSettings:
    """Four updates of 256 steps, a checkpoint after each second one."""
    settings = {"num_envs": 8, "rollout": 32, "batch": 64, "epochs": 2, **ppo}
    return TrainingSettings(
        environment=Environment(id="LegibleOvercooked-v0", arguments=ONION),
        network=NetworkShape(hidden=[16, 16]),
        ppo=PPOSettings(**settings),
        steps=1024,
        checkpoint_every=512,
        seed=3,
    )


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small training that ran to its end."""
    pytest.importorskip("torch")
    from benchmarks.experiments.learning.train import train

    folder = tmp_path_factory.mktemp("training") / "run"
    train(small(), folder)
    return folder
