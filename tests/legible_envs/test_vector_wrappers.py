"""Every vector wrapper of Gymnasium's works on every environment in every mode."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium as gym
import gymnasium.wrappers.vector as wrappers
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.wrappers import AddRenderObservation
from gymnasium.wrappers import transform_action as single_action
from gymnasium.wrappers import transform_observation as single_observation
from gymnasium.wrappers import transform_reward as single_reward

from tests.legible_envs.environment_cases import CASES, IDS, Case

MODES = ["vector_entry_point", "sync", "async"]


def pictures(env: Any) -> Any:
    return AddRenderObservation(env, render_only=True)


def pictures_beside(env: Any) -> Any:
    return AddRenderObservation(env, render_only=False)


def bounded(envs: Any) -> Any:
    """Observations between 0 and 1, where wrappers ask for bounds."""
    size = envs.observation_space.shape
    spaces = [Box(0.0, 1.0, shape, np.float32) for shape in (size, size[1:])]
    return wrappers.TransformObservation(envs, lambda obs: np.clip(obs, 0, 1).astype(np.float32), *spaces)


def rescaled_actions(envs: Any, _: Any) -> Any:
    continuous = isinstance(envs.single_action_space, Box)
    return wrappers.RescaleAction(envs, -2.0, 2.0) if continuous else None


def clipped_actions(envs: Any, _: Any) -> Any:
    return wrappers.ClipAction(envs) if isinstance(envs.single_action_space, Box) else None


def vectorized_action(envs: Any, _: Any) -> Any:
    if not isinstance(envs.single_action_space, Box):
        return None
    return wrappers.VectorizeTransformAction(envs, single_action.ClipAction)


def converted(envs: Any, _: Any) -> Any:
    import torch

    return wrappers.ArrayConversion(envs, env_xp=np, target_xp=torch)


def to_jax(envs: Any) -> Any:
    """An environment of JAX arrays, made of ours: what the wrappers that leave JAX start from."""
    import jax.numpy as jnp

    return wrappers.ArrayConversion(envs, env_xp=np, target_xp=jnp)


APPLY: dict[str, Any] = {
    "VectorizeTransformObservation": lambda envs, _: wrappers.VectorizeTransformObservation(
        envs, single_observation.FlattenObservation
    ),
    "VectorizeTransformAction": vectorized_action,
    "VectorizeTransformReward": lambda envs, _: wrappers.VectorizeTransformReward(
        envs, single_reward.ClipReward, min_reward=-1.0, max_reward=1.0
    ),
    "DictInfoToList": lambda envs, _: wrappers.DictInfoToList(envs),
    "TransformObservation": lambda envs, _: bounded(envs),
    "FilterObservation": lambda envs, _: wrappers.FilterObservation(envs, ["state"]),
    "FlattenObservation": lambda envs, _: wrappers.FlattenObservation(envs),
    "GrayscaleObservation": lambda envs, _: wrappers.GrayscaleObservation(envs),
    "ResizeObservation": lambda envs, _: wrappers.ResizeObservation(envs, (20, 20)),
    "ReshapeObservation": lambda envs, _: wrappers.ReshapeObservation(
        envs, (1, int(np.prod(envs.single_observation_space.shape)))
    ),
    "RescaleObservation": lambda envs, _: wrappers.RescaleObservation(bounded(envs), np.float32(-1), np.float32(1)),
    "DtypeObservation": lambda envs, _: wrappers.DtypeObservation(envs, np.float64),
    "NormalizeObservation": lambda envs, _: wrappers.NormalizeObservation(envs),
    "TransformAction": lambda envs, _: wrappers.TransformAction(envs, lambda actions: actions),
    "ClipAction": clipped_actions,
    "RescaleAction": rescaled_actions,
    "TransformReward": lambda envs, _: wrappers.TransformReward(envs, lambda rewards: rewards * 2),
    "ClipReward": lambda envs, _: wrappers.ClipReward(envs, -1.0, 1.0),
    "NormalizeReward": lambda envs, _: wrappers.NormalizeReward(envs),
    "RecordEpisodeStatistics": lambda envs, _: wrappers.RecordEpisodeStatistics(envs),
    "RecordVideo": lambda envs, folder: wrappers.RecordVideo(envs, str(folder), episode_trigger=lambda n: n == 0),
    "HumanRendering": lambda envs, _: wrappers.HumanRendering(envs),
    "ArrayConversion": converted,
    "JaxToNumpy": lambda envs, _: wrappers.JaxToNumpy(to_jax(envs)),
    "JaxToTorch": lambda envs, _: wrappers.JaxToTorch(to_jax(envs)),
    "NumpyToTorch": lambda envs, _: wrappers.NumpyToTorch(envs),
}
"""How each is made; None where an environment's actions are of another kind than the wrapper's."""

LIBRARIES = {
    "ResizeObservation": "cv2",
    "RecordVideo": "moviepy",
    "HumanRendering": "cv2",
    "ArrayConversion": "torch",
    "NumpyToTorch": "torch",
    "JaxToNumpy": "jax",
    "JaxToTorch": "jax",
}
OBSERVED = {"FilterObservation": pictures_beside, "GrayscaleObservation": pictures, "ResizeObservation": pictures}
FILMED = {"RecordVideo", "HumanRendering"}


def test_no_wrapper_is_forgotten() -> None:
    assert set(APPLY) == set(wrappers.__all__)


def make(name: str, env_id: str, mode: str) -> Any:
    """Two environments that end after four steps, with the observations that a wrapper asks for."""
    arguments: dict[str, Any] = {"max_episode_steps": 4}
    if name in OBSERVED:
        if mode == "vector_entry_point":
            return None  # takes no wrappers of single environments
        arguments |= {"wrappers": [OBSERVED[name]], "render_mode": "rgb_array"}
    if name in FILMED:
        arguments["render_mode"] = "rgb_array"
    return gym.make_vec(env_id, num_envs=2, vectorization_mode=mode, **arguments)


@pytest.mark.usefixtures("no_screen")
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("name", APPLY)
def test_wrappers_work(name: str, env_id: str, mode: str, tmp_path: Any) -> None:
    if name in LIBRARIES:
        pytest.importorskip(LIBRARIES[name])
    base = make(name, env_id, mode)
    if base is None:
        pytest.skip("image observations come from wrappers of single environments")
    envs = APPLY[name](base, tmp_path)
    if envs is None:
        base.close()
        pytest.skip("an action of another kind")
    told = set()
    try:
        _, infos = envs.reset(seed=0)
        actions = base.action_space
        actions.seed(0)
        for _ in range(9):
            sample = actions.sample()
            observations, rewards, terminations, truncations, infos = envs.step(moved(name, sample))
            told |= {bool(over) for over in truncations}
            assert len(rewards) == len(terminations) == 2
            assert_converted(name, observations, infos)
    finally:
        envs.close()
    assert told == {False, True}


def moved(name: str, actions: Any) -> Any:
    """Actions as the learner on the other side of a wrapper has them."""
    if name in ("ArrayConversion", "NumpyToTorch", "JaxToTorch"):
        import torch

        return torch.tensor(actions)
    return actions


def assert_converted(name: str, observations: Any, infos: Any) -> None:
    if name in ("ArrayConversion", "NumpyToTorch", "JaxToTorch"):
        import torch

        assert isinstance(observations, torch.Tensor)
        assert all(isinstance(value, torch.Tensor) for value in infos.values())
    elif name == "DictInfoToList":
        assert [type(info) for info in infos] == [dict, dict]
    elif name == "FilterObservation":
        assert list(observations) == ["state"]
    elif name == "JaxToNumpy":
        assert isinstance(observations, np.ndarray)


@pytest.mark.parametrize("mode", MODES[:2])
@pytest.mark.parametrize("case", CASES, ids=str)
def test_infos_of_every_variant_become_tensors(case: Case, mode: str) -> None:
    """With robots, beliefs, pictures and distributions, too; also where an episode ends."""
    torch = pytest.importorskip("torch")
    envs = gym.make_vec(case.env_id, num_envs=2, vectorization_mode=mode, max_episode_steps=3, **case.arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = wrappers.NumpyToTorch(envs)
        results = [envs.reset(seed=0)]
        results += [envs.step(torch.tensor(envs.action_space.sample())) for _ in range(7)]
    for result in results:
        assert all(isinstance(value, torch.Tensor) for value in result[-1].values())
    envs.close()


@pytest.mark.parametrize("env_id", IDS)
def test_the_wrapper_of_one_environment_converts_it_too(env_id: str) -> None:
    torch = pytest.importorskip("torch")
    env = gym.wrappers.NumpyToTorch(gym.make(env_id))
    for info in (env.reset(seed=0)[1], env.step(torch.tensor(env.action_space.sample()))[4]):
        assert all(isinstance(value, torch.Tensor) for value in info.values())


def test_kitchens_in_batches_take_no_vector_kwargs_and_say_what_to_write() -> None:
    """Gymnasium refuses them before any code of ours; the docstrings name the spelling that works."""
    for env_id in IDS:
        with pytest.raises(gym.error.Error, match="only through kwargs"):
            gym.make_vec(env_id, num_envs=2, vector_kwargs={"autoreset_mode": "SameStep"})
        for mode, arguments in (
            ("vector_entry_point", {"autoreset_mode": "SameStep"}),
            ("sync", {"vector_kwargs": {"autoreset_mode": "SameStep"}}),
            ("async", {"vector_kwargs": {"autoreset_mode": "SameStep"}}),
        ):
            envs = gym.make_vec(env_id, num_envs=2, vectorization_mode=mode, max_episode_steps=1, **arguments)
            assert envs.metadata["autoreset_mode"] is gym.vector.AutoresetMode.SAME_STEP
            envs.reset(seed=0)
            assert envs.step(envs.action_space.sample())[4]["_final_info"].all()
            envs.close()
        doc = gym.make(env_id).unwrapped.__doc__
        assert 'make_vec(id, num_envs, autoreset_mode="SameStep")' in doc
        assert 'vector_kwargs={"autoreset_mode": "SameStep"}' in doc
