"""Advantages against a definition read aloud, masks, several players, and rewards that change no policy."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

torch = pytest.importorskip("torch")

from benchmarks.experiments.learning.environments import PlayerSpace, make_envs, observation_scale  # noqa: E402
from benchmarks.experiments.learning.guidance import moves_between  # noqa: E402
from benchmarks.experiments.learning.networks import Choices  # noqa: E402
from benchmarks.experiments.learning.ppo import PPO, Games, Seconds, advantages, collect  # noqa: E402
from benchmarks.experiments.learning.settings import Environment, PPOSettings, TrainingSettings  # noqa: E402
from legible_envs.overcooked import OvercookedLayout  # noqa: E402
from tests.benchmarks.learning.conftest import small  # noqa: E402

NUMBERS = st.floats(-5, 5)


def advantage_by_definition(
    rewards: Any, values: Any, last: float, ends: Any, gamma: float, lam: float, start: int
) -> float:
    """The sum of later surprises, each discounted by gamma * lambda a step, to the end of the episode."""
    total, weight = 0.0, 1.0
    for t in range(start, len(rewards)):
        following = values[t + 1] if t + 1 < len(values) else last
        total += weight * (rewards[t] + gamma * following * (not ends[t]) - values[t])
        if ends[t]:
            break
        weight *= gamma * lam
    return total


@given(
    rewards=hnp.arrays(np.float64, (7, 3), elements=NUMBERS),
    values=hnp.arrays(np.float64, (7, 3), elements=NUMBERS),
    last=hnp.arrays(np.float64, 3, elements=NUMBERS),
    ends=hnp.arrays(np.bool_, (7, 3)),
    gamma=st.floats(0, 1),
    lam=st.floats(0, 1),
)
@settings(max_examples=50, deadline=None)
def test_advantages_are_those_of_their_definition(
    rewards: Any, values: Any, last: Any, ends: Any, gamma: float, lam: float
) -> None:
    found = advantages(rewards, values, last, ends, gamma, lam)
    for row in range(3):
        for t in range(7):
            wanted = advantage_by_definition(rewards[:, row], values[:, row], last[row], ends[:, row], gamma, lam, t)
            assert found[t, row] == pytest.approx(wanted, abs=1e-9)


@given(
    outputs=hnp.arrays(np.float32, (6, 5), elements=st.floats(-50, 50, width=32)),
    masks=hnp.arrays(np.bool_, (6, 5)).map(lambda masks: masks | np.eye(6, 5, dtype=bool) | (np.arange(5) == 0)),
    seed=st.integers(0, 2**32),
)
@settings(max_examples=100, deadline=None)
def test_masked_actions_have_probability_0_and_are_never_drawn(outputs: Any, masks: Any, seed: int) -> None:
    choices = Choices(torch.from_numpy(outputs), masks=torch.from_numpy(masks))
    rng = np.random.default_rng(seed)
    for _ in range(5):
        actions = choices.sample(rng).numpy()
        assert masks[np.arange(6), actions].all()
    shares = choices.outputs.exp().numpy()
    assert (shares[~masks] == 0).all()
    assert np.isfinite(choices.entropy().numpy()).all()
    np.testing.assert_allclose(shares.sum(axis=1), 1, rtol=1e-5)


def test_draws_have_the_probabilities_of_the_network() -> None:
    logits = torch.log(torch.tensor([[0.1, 0.6, 0.3]])).repeat(20_000, 1)
    drawn = Choices(logits).sample(np.random.default_rng(0)).numpy()
    np.testing.assert_allclose(np.bincount(drawn) / 20_000, [0.1, 0.6, 0.3], atol=0.015)


def test_normal_choices_have_the_density_and_entropy_of_torch() -> None:
    means, spread = torch.tensor([[0.5, -1.0], [2.0, 0.0]]), torch.tensor([0.1, -0.4])
    own = Choices(means, spread)
    theirs = torch.distributions.Normal(means, spread.exp().expand_as(means))
    actions = torch.tensor([[0.0, 0.3], [1.0, -0.2]])
    torch.testing.assert_close(own.log_probs(actions), theirs.log_prob(actions).sum(1))
    torch.testing.assert_close(own.entropy(), theirs.entropy().sum(1))


class TwoSwitches(gym.Env[Any, Any]):
    """Two players; the team gains 1 for each who does the number that they see. Cut off after five steps."""

    observation_space = spaces.Box(0, 1, (2, 3), np.float32)
    action_space = spaces.MultiDiscrete([3, 3])

    def _look(self) -> tuple[Any, dict[str, Any]]:
        self.shown = self.np_random.integers(3, size=2)
        return np.eye(3, dtype=np.float32)[self.shown], {"action_mask": np.ones((2, 3), dtype=np.int8)}

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.time = 0
        return self._look()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        right = float((np.asarray(action) == self.shown).sum())
        self.time += 1
        obs, info = self._look()
        return obs, right, False, self.time == 5, info


def test_one_network_learns_to_play_both_players() -> None:
    envs = gym.vector.SyncVectorEnv([TwoSwitches] * 8, autoreset_mode=AutoresetMode.SAME_STEP)
    space = PlayerSpace.of(envs)
    assert (space.players, space.shape, space.size) == (2, [3], 3)
    learning = TrainingSettings(
        environment=Environment(id="none"),
        ppo=PPOSettings(num_envs=8, rollout=20, batch=80, entropy=0.0, final_entropy=0.0, learning_rate=3e-3),
    )
    learner = PPO(space, learning, observation_scale(envs, space), np.random.default_rng(0))
    games = Games.begin(envs, space, learning.ppo, seed=0)
    for _ in range(30):
        rollout = collect(games, learner, 20, Seconds())
        assert rollout.obs.shape == (20, 16, 3)
        learner.update(rollout, 0.0)
    scores = [episode.score for episode in games.ended]
    assert np.mean(scores[:16]) < 5  # of 10
    assert np.mean(scores[-16:]) > 9
    assert all(episode.length == 5 and not episode.finished for episode in games.ended)


def test_an_episode_that_was_cut_off_goes_on_in_the_value_of_its_last_observation() -> None:
    """With a critic that always says 10, no surprise is left where nothing is gained and gamma is 1."""
    envs = make_envs(
        Environment(id="LegibleOvercooked-v0", arguments={"obs_type": "vector", "max_episode_steps": 7}), 4
    )
    space = PlayerSpace.of(envs)
    learning = TrainingSettings(
        environment=Environment(id="none"), ppo=PPOSettings(gamma=1.0, normalise_rewards=False, guide=0.0)
    )
    learner = PPO(space, learning, observation_scale(envs, space), np.random.default_rng(0))
    with torch.no_grad():
        for parameter in learner.network.critic.parameters():
            parameter.zero_()
        learner.network.critic[-1].bias.fill_(10.0)
    rollout = collect(Games.begin(envs, space, learning.ppo, seed=0), learner, 30, Seconds())
    np.testing.assert_allclose(rollout.advantages, 0, atol=1e-5)


def test_learned_from_are_only_actions_that_do_something() -> None:
    settings_ = small()
    envs = make_envs(settings_.environment, 8)
    space = PlayerSpace.of(envs)
    learner = PPO(space, settings_, observation_scale(envs, space), np.random.default_rng(0))
    rollout = collect(Games.begin(envs, space, settings_.ppo, seed=0), learner, 50, Seconds())
    assert rollout.masks is not None
    taken = np.take_along_axis(rollout.masks, rollout.actions[:, :, None], axis=2)
    assert taken.all()
    assert not rollout.masks.all()


# -- guidance ----------------------------------------------------------------------------------------------------------


def test_moves_are_those_of_a_search_by_hand() -> None:
    layout = OvercookedLayout.from_ascii("XPXXX\nX   S\nXXV X\nO   D\nXXXXX")
    moves = moves_between(layout)
    cell = {"by the pot": 6, "pot": 1, "serving": 9, "onion": 15, "by the onion": 16}
    assert moves[cell["by the pot"], cell["pot"]] == 0
    assert moves[cell["by the pot"], cell["serving"]] == 2
    assert moves[cell["by the pot"], cell["onion"]] == 6
    assert moves_between(layout, soft=True)[cell["by the pot"], cell["onion"]] == 4
    assert moves[cell["by the onion"], cell["onion"]] == 0


KITCHEN = """\
XPXXX
O   S
X   X
X  1D
XXXXX
"""


@pytest.mark.parametrize("obs_type", ["vector", "grid"])
def test_a_guide_says_nearer_and_farther(obs_type: str) -> None:
    arguments = {"recipes": [["onion"]], "obs_type": obs_type, "layout": KITCHEN, "cook_time": 1, "shaping": True}
    envs = make_envs(Environment(id="LegibleOvercooked-v0", arguments=arguments), 2)
    games = Games.begin(envs, PlayerSpace.of(envs), PPOSettings(guide=0.5), seed=0)
    assert games.guide is not None
    north, south, east, west, stay, use = range(6)
    steps = [
        (north, 1), (south, -1), (east, 0), (stay, 0), (north, 1), (west, 1), (north, 1), (west, 1),  # to the onion
        (west, 0), (use, 1), (use, -1), (use, 1),  # take it, put it back, take it
        (north, 0), (use, 1),  # in the pot, which is rewarded
        (south, 1), (south, 1), (east, 1), (east, 1), (east, 0), (use, 1),  # the dish
        (north, 1), (stay, 0),  # to the pot with it; waiting is neither
    ]  # fmt: skip
    for number, (action, wanted) in enumerate(steps):
        obs, rewards, _, _, infos = envs.step(np.array([action, stay]))
        told = games.guide.nearer(obs, rewards, infos)[:, 0]
        assert told.tolist() == [wanted, 0], f"step {number}: {told}"


def test_guides_follow_games_into_other_kitchens() -> None:
    """Whoever walks to goals by shortest paths comes nearer to some goal, over many random kitchens."""
    arguments = {"shape": [6, 6], "recipes": [["onion"]], "obs_type": "vector", "layouts": "random"}
    envs = make_envs(Environment(id="LegibleOvercooked-v0", arguments=arguments), 6)
    games = Games.begin(envs, PlayerSpace.of(envs), PPOSettings(guide=0.5), seed=0)
    assert games.guide is not None
    from legible_envs.overcooked.policies import ScriptedPlayer

    cook, obs, infos, ended, told = ScriptedPlayer(envs, np.random.default_rng(0)), games.obs, games.infos, 0, []
    for _ in range(200):
        obs, rewards, terminated, _, infos = envs.step(cook(obs, infos))
        ended += int(terminated.sum())
        told.append(games.guide.nearer(obs, rewards, infos))
    assert ended > 20
    counts = np.array(told)
    assert (counts > 0).sum() > 5 * (counts < 0).sum()


def test_what_guides_falls_to_nothing() -> None:
    settings_ = small(guide=1.0, guide_until=0.5)
    envs = make_envs(settings_.environment, 8)
    space = PlayerSpace.of(envs)
    rollouts = []
    for progress in (0.0, 0.25, 0.5, 1.0):
        learner = PPO(space, settings_, observation_scale(envs, space), np.random.default_rng(0))
        rollouts.append(collect(Games.begin(envs, space, settings_.ppo, 0), learner, 40, Seconds(), progress))
    added = [rollout.advantages + rollout.values - rollout.returns for rollout in rollouts]
    for share, found in zip((1.0, 0.5, 0.0, 0.0), added, strict=True):
        np.testing.assert_allclose(found, share * added[0], atol=1e-5)
    assert set(np.unique(np.round(added[0], 3))) == {-1.0, 0.0, 1.0}


def test_only_kitchens_have_guides() -> None:
    envs = make_envs(Environment(id="CartPole-v1"), 2)
    with pytest.raises(ValueError, match=r"`ppo.guide` is for kitchens"):
        Games.begin(envs, PlayerSpace.of(envs), PPOSettings(guide=0.1), seed=0)


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        (spaces.Dict({}), r"expected observations in a Box"),
        (spaces.Box(0, 1, (2, 2)), r"expected observations of shape"),
        (spaces.Box(0, 1, (2,)), r"expected numbers from -1 to 1 as actions"),
    ],
)
def test_spaces_that_no_network_is_for_are_refused(environment: Any, said: str) -> None:
    class Odd(gym.Env[Any, Any]):
        observation_space = environment
        action_space = spaces.Box(-2, 2, (1,)) if "numbers" in said else spaces.Discrete(2)

    envs = gym.vector.SyncVectorEnv([Odd])
    with pytest.raises(ValueError, match=said):
        PlayerSpace.of(envs)
