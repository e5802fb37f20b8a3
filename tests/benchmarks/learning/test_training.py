"""Checkpoints: read back whole, refused where they were changed or are of something else; and runs that go on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from benchmarks.experiments.learning.checkpoints import (  # noqa: E402
    FILE,
    CheckpointError,
    load_checkpoint,
    weight_shapes,
)
from benchmarks.experiments.learning.environments import PlayerSpace  # noqa: E402
from benchmarks.experiments.learning.evaluation import evaluate_policy, evaluate_scripted, summary  # noqa: E402
from benchmarks.experiments.learning.networks import ActorCritic  # noqa: E402
from benchmarks.experiments.learning.policy import TrainedPolicy, load_policy  # noqa: E402
from benchmarks.experiments.learning.settings import Environment, NetworkShape, TrainingSettings  # noqa: E402
from benchmarks.experiments.learning.train import train  # noqa: E402
from tests.benchmarks.learning.conftest import ONION, small  # noqa: E402


def same_bits(one: Path, other: Path) -> bool:
    """Whether two runs came to the same, in all but how long they took."""
    with np.load(one / FILE) as a, np.load(other / FILE) as b:
        assert set(a.files) == set(b.files)
        same = all(a[name].tobytes() == b[name].tobytes() for name in a.files)
    return same and (one / "curve.csv").read_bytes() == (other / "curve.csv").read_bytes()


def test_a_run_that_is_resumed_ends_with_the_same_bits(trained: Path, tmp_path: Path) -> None:
    threads = torch.get_num_threads()
    train(small(), tmp_path, most_updates=3)  # one beyond the checkpoint, which is played again
    assert load_checkpoint(tmp_path).steps == 512
    torch.rand(7)  # what torch's own generator does elsewhere does not matter
    train(small(), tmp_path, resume=True)
    assert same_bits(trained, tmp_path)
    assert torch.get_num_threads() == threads


def test_running_means_of_a_table_go_on_too(tmp_path: Path) -> None:
    settings = TrainingSettings(
        environment=Environment(id="LegibleTabletop-v0", arguments={"max_episode_steps": 20, "shaping": True}),
        network=NetworkShape(hidden=[8]),
        steps=64,
        checkpoint_every=32,
    ).replaced({"ppo.num_envs": 2, "ppo.rollout": 16, "ppo.batch": 16, "ppo.normalise_observations": True})
    train(settings, tmp_path / "whole")
    train(settings, tmp_path / "parts", most_updates=1)
    train(settings, tmp_path / "parts", resume=True)
    assert same_bits(tmp_path / "whole", tmp_path / "parts")
    action = load_policy(tmp_path / "whole")(np.zeros((3, 119), dtype=np.float32), {})
    assert action.shape == (3, 2)
    assert action.dtype == np.float32


def test_another_seed_is_another_run(trained: Path, tmp_path: Path) -> None:
    train(small().replaced({"seed": 4}), tmp_path)
    assert not same_bits(trained, tmp_path)


def test_a_checkpoint_is_read_back_whole(trained: Path, tmp_path: Path) -> None:
    checkpoint = load_checkpoint(trained)
    assert checkpoint.settings == small()
    assert (checkpoint.steps, checkpoint.updates, len(checkpoint.curve)) == (1024, 4, 4)
    checkpoint.save(tmp_path)
    assert (tmp_path / FILE).read_bytes() == (trained / FILE).read_bytes()
    again = load_checkpoint(tmp_path / FILE)
    assert again.generator().random() == checkpoint.generator().random()


def test_speed_and_settings_are_written(trained: Path) -> None:
    speed = json.loads((trained / "speed.json").read_text())
    assert speed["steps"] == 1024
    assert sum(speed["shares"].values()) == pytest.approx(1, abs=0.01)
    assert TrainingSettings.from_dict(json.loads((trained / "settings.json").read_text())) == small()


def test_logs_for_tensorboard_can_be_read(trained: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    events = EventAccumulator(str(trained / "tensorboard"))
    events.Reload()
    assert [event.step for event in events.Scalars("training/entropy")] == [256, 512, 768, 1024]


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ppo.learning_rate": 1e-3}, r"`ppo.learning_rate` was 0.0007 and is now 0.001"),
        ({"steps": 2048}, r"`steps` was 1024 and is now 2048"),
        ({"environment.arguments.cook_time": 5}, r"`environment.arguments.cook_time` was not set and is now 5"),
        ({"network.hidden": [8]}, r"`network.hidden` was \[16, 16\] and is now \[8\]"),
    ],
)
def test_other_settings_are_refused_by_name(trained: Path, change: dict[str, Any], said: str) -> None:
    with pytest.raises(CheckpointError, match=said):
        train(small().replaced(change), trained, resume=True)


def test_a_run_is_not_begun_over_another(trained: Path) -> None:
    with pytest.raises(CheckpointError, match="holds a training already"):
        train(small(), trained)


def test_a_changed_checkpoint_is_refused(trained: Path, tmp_path: Path) -> None:
    with np.load(trained / FILE) as stored:
        arrays = dict(stored)
    arrays["weights/actor.0.bias"] = arrays["weights/actor.0.bias"] + 1
    np.savez(tmp_path / FILE, **arrays)
    with pytest.raises(CheckpointError, match="was changed since, or damaged"):
        load_checkpoint(tmp_path)


def test_a_cut_file_no_file_and_another_file_are_refused(trained: Path, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes((trained / FILE).read_bytes()[:-300])
    with pytest.raises(CheckpointError, match="cannot be used as a checkpoint"):
        load_checkpoint(tmp_path)
    (tmp_path / "other.npz").write_text("XPX")
    with pytest.raises(CheckpointError, match=r"is no \.npz"):
        load_checkpoint(tmp_path / "other.npz")
    (tmp_path / "empty").mkdir()
    with pytest.raises(CheckpointError, match="not the folder of a training run"):
        load_checkpoint(tmp_path / "empty")


class Bomb:
    """Leaves a trace when it is unpickled."""

    def __reduce__(self) -> Any:
        return print, ("loaded",)


def test_pickles_are_never_loaded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savez(tmp_path / FILE, config=np.array([Bomb()], dtype=object), sha256=np.array("0" * 64))
    with pytest.raises(CheckpointError, match="pickled objects, which are never loaded"):
        load_checkpoint(tmp_path)
    assert "loaded" not in capsys.readouterr().out


def test_a_policy_of_another_space_says_so(trained: Path) -> None:
    policy = load_policy(trained)
    with pytest.raises(CheckpointError, match=r"trained for observations of shape \(52,\).*these games have .*\(54,\)"):
        evaluate_policy(policy, Environment(id="LegibleOvercooked-v0", arguments={"obs_type": "vector"}), 2, 0)
    with pytest.raises(ValueError, match=r"for observations of shape \(52,\).*got observations of shape \(54,\)"):
        policy(np.zeros(54, dtype=np.float32), {})
    with pytest.raises(ValueError, match=r"expected an `action_mask` of shape \(6,\), got \(5,\)"):
        policy(np.zeros(52, dtype=np.float32), {"action_mask": np.ones(5)})


# -- players -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("space", "network"),
    [
        (PlayerSpace(shape=[7], dtype="float32", actions="discrete", size=5), NetworkShape(hidden=[9, 4])),
        (
            PlayerSpace(shape=[4, 5, 3], dtype="uint8", actions="discrete", size=6),
            NetworkShape(channels=[5, 2], hidden=[7]),
        ),
        (PlayerSpace(shape=[6], dtype="float32", actions="continuous", size=2), NetworkShape(hidden=[])),
    ],
)  # fmt: skip
def test_a_policy_computes_what_the_network_computes(space: PlayerSpace, network: NetworkShape, trained: Path) -> None:
    rng = np.random.default_rng(0)
    scale = rng.random(tuple(space.shape)).astype(np.float32)
    net = ActorCritic(space, network, scale, rng)
    state = {name: values.detach().numpy() for name, values in net.state_dict().items()}
    assert {name: values.shape for name, values in state.items()} == weight_shapes(space, network)
    checkpoint = load_checkpoint(trained)
    checkpoint.space, checkpoint.weights = space, state
    checkpoint.settings = checkpoint.settings.replaced({"network": network.model_dump(mode="json")})
    obs = rng.integers(0, 9, size=(4, 3, *space.shape)).astype(space.dtype)
    policy = TrainedPolicy(checkpoint, greedy=True)
    with torch.no_grad():
        choices, _ = net(torch.from_numpy(obs.reshape(12, *space.shape)))
    if space.actions == "continuous":
        wanted = choices.outputs.clamp(-1, 1).numpy().reshape(4, 3, 2)
        np.testing.assert_allclose(policy(obs, {}), wanted, rtol=1e-5, atol=1e-6)
        return
    wanted = choices.outputs.exp().numpy().reshape(4, 3, space.size)
    np.testing.assert_allclose(policy.probabilities(obs, {}), wanted, rtol=1e-4, atol=1e-6)
    np.testing.assert_array_equal(policy(obs, {}), wanted.argmax(-1))
    assert policy(obs[0, 0], {}) == wanted[0, 0].argmax()


def test_the_scripted_cook_is_the_reference() -> None:
    cook = summary(evaluate_scripted(Environment(id="LegibleOvercooked-v0", arguments=ONION), 32, 0))
    assert cook["score"] == pytest.approx(31)
    assert cook["finished"] == 1
    assert 25 < cook["length"] < 45


@pytest.mark.slow
def test_a_cook_learns_a_soup_of_one_onion(tmp_path: Path) -> None:
    settings = TrainingSettings(
        environment=Environment(id="LegibleOvercooked-v0", arguments=ONION), steps=60_000, checkpoint_every=60_000
    ).replaced({"ppo.guide": 0.15, "ppo.num_envs": 32, "ppo.rollout": 64, "ppo.batch": 256, "ppo.entropy": 0.01})
    curve = train(settings, tmp_path).curve
    after = summary(evaluate_policy(load_policy(tmp_path), settings.environment, 32, 0))
    assert curve[0, 1] == 0  # nobody finishes within the first steps
    assert after["finished"] > 0.9  # of 32 games
    assert after["length"] < 130  # the scripted cook takes 33 steps, and games are cut off at 1,200
