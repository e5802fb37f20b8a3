"""A second player beside the agent: the robot, other partners, what they may do wrong, and the measures of the team."""

from __future__ import annotations

import json
import math
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence

import legible_envs  # noqa: F401  (registers the environment)
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.vectors import AT_PLAYERS, AT_POTS, DISH, INTERACT, STAY
from legible_envs.overcooked.humans import BoltzmannWalker
from legible_envs.overcooked.layout import FLOOR
from legible_envs.overcooked.layouts import RandomLayouts
from legible_envs.overcooked.partner.belief import BayesianIntent
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, TICK, Command
from legible_envs.overcooked.partner.needs import needed_beside
from legible_envs.overcooked.partner.ways import Floor
from legible_envs.overcooked.policies import ScriptedPlayer, WalkingPlayer
from legible_envs.partner.fluency import MEASURES, TeamMetrics
from legible_envs.rollouts import Trajectory
from predictors import BayesianGoalPredictor

NAMES = ("robot", "scripted", "boltzmann", "planner")
HERE = "tests.legible_envs.overcooked.test_partner"
POCKET = "XOXTXXX\nX   V X\nD   V P\nX 1   X\nF 2   C\nXXXSXXX"
SPLIT = "XXOXXXX\nX  X  D\nT2 X1 P\nX  X  S\nXCXXFXX"


def make(**kwargs):
    return gym.make("LegibleOvercooked-v0", **{"partner": "robot", **kwargs})


def play(env, person, seed=0, steps=100_000):
    """All results of an episode; the first is that of the reset."""
    obs, info = env.reset(seed=seed)
    results = [(obs, 0.0, False, False, info)]
    while not (results[-1][2] or results[-1][3]) and len(results) <= steps:
        results.append(env.step(person(results[-1][0], results[-1][4])))
    return results


def scripted(env, seed=0, **kwargs):
    return ScriptedPlayer(env, np.random.default_rng(seed), **kwargs)


def walking(env, seed=0):
    return WalkingPlayer(env, BoltzmannWalker(rationality=1.3, idle=0.2), np.random.default_rng(seed))


def has_a_round(layout):
    """Whether the floor has a cycle: on a tree, two people cannot pass each other everywhere."""
    floor = np.pad(layout.cells == FLOOR, 1)
    edges = (floor[1:] & floor[:-1]).sum() + (floor[:, 1:] & floor[:, :-1]).sum()
    return edges >= floor.sum()


# -- the robot --------------------------------------------------------------------------------------------------------


def test_with_the_robot_soups_are_served_sooner():
    alone = np.mean([len(play(env := make(partner=None), scripted(env, s), s)) for s in range(5)])
    together = np.mean([len(play(env := make(), scripted(env, s), s)) for s in range(5)])
    assert together < 0.9 * alone


@pytest.mark.parametrize(("shape", "rate", "count"), [((7, 7), 0.2, 6), ((5, 6), 0.25, 6)])
@pytest.mark.parametrize("person", [scripted, walking])
def test_every_episode_ends_in_random_kitchens(shape, rate, count, person):
    rng = np.random.default_rng(3)
    layouts = RandomLayouts(shape, obstacle_rate=rate)
    kitchens = [layout for layout in (layouts.sample(rng) for _ in range(4 * count)) if has_a_round(layout)][:count]
    assert len(kitchens) == count
    for seed, layout in enumerate(kitchens):
        env = make(layout=layout, max_episode_steps=3000)
        assert play(env, person(env, seed), seed)[-1][2], layout.to_ascii()


def test_it_makes_way_for_a_person_who_never_does():
    """Two shortest-path players in one door: the robot steps aside."""
    kitchen = "XOXXTXX\nX  1  X\nXXX XXX\nF  2  P\nD     X\nXXCXSXX"
    for seed in range(3):
        env = make(layout=kitchen, max_episode_steps=2000)
        assert play(env, scripted(env, seed, gives_way=False), seed)[-1][2]


class Fetches:
    """Goes to a station by the shortest path and takes what is there, then stays."""

    def __init__(self, env, station):
        self.env, self.station, self.player = env, station, scripted(env)

    def __call__(self, obs, info):
        layout = self.env.unwrapped.layout
        if self.env.unwrapped.view().players[0].held is not None:
            return STAY
        cell = layout.stations[self.station]
        goals = np.zeros_like(info["goal_mask"])
        goals[cell] = True
        return self.player(obs, {**info, "goal_mask": goals})


def test_it_does_not_fetch_what_the_person_fetches_and_is_needed_once():
    """One pot, one soup of one tomato and one onion: whatever the person goes for, the robot brings the other."""
    for station, other in (("tomato", "onion"), ("onion", "tomato")):
        env = make(layout=POCKET, recipes=[("tomato", "onion")], threshold=0.6)
        play(env, Fetches(env, station), steps=90)
        pot = env.unwrapped.view().pots[(2, 6)]
        assert pot.contents == (other,)
        assert env.unwrapped.team.summary()["conflicts"] == 0
        assert env.unwrapped.view().players[1].held is None


def test_it_waits_until_it_is_sure_and_at_threshold_one_it_never_predicts():
    first = {}
    for threshold in (0.0, 0.6, 1.0):
        env = make(recipes=[("tomato", "onion")], threshold=threshold)
        env.reset(seed=0)
        person, sure = Fetches(env, "tomato"), []
        obs, info = env.reset(seed=0)
        for _ in range(20):
            sure.append(env.unwrapped.team.command.predicted)
            obs, _, _, _, info = env.step(person(obs, info))
        first[threshold] = next((t for t, goal in enumerate(sure) if goal is not None), math.inf)
    assert first[0.0] == 0 < first[0.6] < first[1.0] == math.inf


def test_it_keeps_out_of_a_pocket_when_the_person_may_come():
    layout = OvercookedLayout.from_ascii(POCKET)
    env = make(layout=layout)
    env.reset(seed=0)
    _, kitchen, rules = env.unwrapped.arrays()
    floor = Floor(kitchen, rules)
    inside = {divmod(cell, 7): int(floor.depth[cell]) for cell in np.flatnonzero(floor.depth)}
    assert inside == {(1, 5): 2, (2, 5): 1}
    assert divmod(int(floor.mouth[1 * 7 + 5]), 7) == (3, 5)
    for seed in range(3):
        assert play(env, scripted(env, seed), seed)[-1][2]


@pytest.mark.parametrize("starts", [((2, 5), (2, 1)), ((2, 1), (2, 5))])
def test_it_hands_over_in_a_divided_kitchen(starts):
    layout = OvercookedLayout.from_ascii(SPLIT).with_starts(starts)
    env = make(layout=layout, max_episode_steps=2000)
    results = play(env, scripted(env))
    assert results[-1][2]
    with pytest.raises(ValueError, match="reach"):
        make(layout=layout, partner=None).reset()


def test_it_is_deterministic():
    runs = [play(env := make(), scripted(env, 2), 5) for _ in range(2)]
    assert data_equivalence(runs[0], runs[1], exact=True)
    env = make()
    again = play(env, scripted(env, 2), 5)
    env.reset(seed=9)
    assert data_equivalence(again, play(env, scripted(env, 2), 5), exact=True)


# -- what is needed ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contents", "item", "others", "needed"),
    [
        ((), 1, (), True),
        ((1,), 1, (), True),  # tomato, tomato, onion
        ((1, 2), 1, (), True),
        ((1, 2), 1, (1,), False),  # one more tomato, and somebody brings it
        ((1, 2), 1, (4,), True),  # fish is of no use, so it does not count
        ((1,), 2, (1,), True),
        ((1,), 2, (2,), False),
        ((2,), 2, (2,), False),  # onion, onion, cabbage
        ((2,), 3, (2,), True),
        ((4,), 4, (4,), True),
        ((4, 4), 4, (4,), False),
        ((1, 2), DISH, (), False),
        ((4, 4, 4), DISH, (), True),
        ((4, 4, 4), DISH, (DISH,), False),
        ((4, 4, 4), 1, (), False),
        ((), 6, (DISH,), True),
    ],
)
def test_what_is_needed_beside_something_else(contents, item, others, needed):
    env = make()
    env.reset(seed=0)
    state, _, rules = (array.copy() for array in env.unwrapped.arrays())
    pot = int(rules[AT_POTS])
    for kind in contents:
        state[pot + kind] += 1
    if len(contents) == 3:
        state[pot + 6] = 2
        state[int(rules[10]) + 2] = 1
    assert needed_beside(state, rules, item, np.array(others, dtype=np.int64)) == needed


# -- beliefs ----------------------------------------------------------------------------------------------------------


def test_the_built_in_belief_is_that_of_the_predictor():
    rng = np.random.default_rng(0)
    for layout in (RandomLayouts((6, 7)).sample(rng) for _ in range(5)):
        goals = tuple(name for name in layout.stations if name.partition("@")[0] not in ("pot", "serving"))
        cells = [layout.starts[0]]
        while len(cells) < 8:
            row, col = cells[-1]
            beside = [(row - 1, col), (row + 1, col), (row, col + 1), (row, col - 1)]
            cells.append([cell for cell in beside if layout.is_floor(cell)][int(rng.integers(9)) % 2 - 1])
        context = Trajectory(np.zeros((0, 2)), start="serving", candidates=goals, layout=layout, complete=False)
        whole = Trajectory(cells, start="serving", candidates=goals, layout=layout, complete=False)
        oracle = BayesianGoalPredictor(beta=1.0).fit([whole])
        stream = BayesianIntent().stream(context)
        for n, cell in enumerate(cells, 1):
            told = stream.update(cell, 0.0)
            expected = dict(zip(oracle.classes_, oracle.predict_proba([whole.first(n)])[0], strict=True))
            assert told == pytest.approx(expected)


def test_predictors_by_name_and_by_instance():
    env = make(predictor="maxent-irl")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        results = play(env, scripted(env))
    assert results[-1][2]
    assert results[-1][4]["decided"] > 0
    bayesian = make(predictor="bayesian")
    assert data_equivalence(play(bayesian, scripted(bayesian))[-1], play(e := make(), scripted(e))[-1], exact=True)


class Doubtful:
    """A predictor whose probabilities are no numbers."""

    def stream(self, context):
        self.goals = context.candidates
        return self

    def update(self, point, time=None):
        return dict.fromkeys(self.goals, math.nan)


def test_a_predictor_that_fails_is_reported_once_and_the_episode_goes_on():
    env = make(predictor=Doubtful())
    with pytest.warns(RuntimeWarning, match="Doubtful failed") as caught:
        results = play(env, scripted(env))
    assert len(caught) == 1
    assert results[-1][2]
    assert not any(result[4]["belief"].any() for result in results)


# -- the environment --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("obs_type", ["grid", "vector"])
def test_it_is_a_single_agent_environment_of_the_joint_game(obs_type):
    """The same actions in the joint game give the same observations, masks, rewards and trajectories."""
    env = make(obs_type=obs_type)
    joint = gym.make("LegibleOvercooked-v0", num_players=2, obs_type=obs_type)
    person = scripted(env, 4)
    obs, info = env.reset(seed=1)
    theirs, told = joint.reset(seed=1)
    assert env.action_space == gym.spaces.Discrete(6)
    over = False
    while not over:
        assert np.array_equal(obs, theirs[0])
        assert np.array_equal(info["goal_mask"], told["goal_mask"][0])
        assert np.array_equal(info["action_mask"], told["action_mask"][0])
        assert np.array_equal(env.unwrapped.action_masks(), info["action_mask"])
        action, partner = person(obs, info), env.unwrapped.team.action
        obs, reward, over, _, info = env.step(action)
        theirs, team_reward, theirs_over, _, told = joint.step([action, partner])
        assert (reward, over) == (team_reward, theirs_over)
    assert env.observation_space.contains(obs)
    for player in range(2):
        mine, others = (e.unwrapped.trajectories(player=player) for e in (env, joint))
        assert mine == others
    assert len(env.unwrapped.trajectories()) > 3


@pytest.mark.parametrize("partner", NAMES)
def test_checks_of_gymnasium(partner):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(make(partner=partner).unwrapped, skip_render_check=True)


def test_spec_is_json_and_makes_the_environment_again():
    given = {"kind": "boltzmann", "rationality": 2.0}
    env = make(partner=given, max_episode_steps=50)
    text = env.spec.to_json()
    assert json.loads(text)["kwargs"]["partner"] == given
    again = gym.make(EnvSpec.from_json(text))
    assert data_equivalence(play(env, scripted(env)), play(again, scripted(again)), exact=True)
    recorded = make(partner={"kind": "recorded", "actions": np.array([1, 5])})
    assert json.loads(recorded.spec.to_json())["kwargs"]["partner"]["actions"] == [1, 5]
    robot = make()
    copied = pickle.loads(pickle.dumps(robot.unwrapped))
    assert data_equivalence(copied.reset(seed=3), robot.reset(seed=3), exact=True)


def test_in_vectors_of_single_environments_but_not_in_the_batched_one():
    vector = gym.make_vec("LegibleOvercooked-v0", 2, vectorization_mode="sync", partner="robot")
    _, infos = vector.reset(seed=0)
    player = scripted(vector)
    for _ in range(5):
        _, _, _, _, infos = vector.step(player(None, infos))
    assert infos["belief"].shape == (2, 7, 7)
    with pytest.raises(ValueError, match=r'no `partner`.*vectorization_mode="sync"'):
        gym.make_vec("LegibleOvercooked-v0", 2, vectorization_mode="vector_entry_point", partner="robot")


def test_the_robot_is_drawn_as_one():
    pictures = {}
    for partner in ("robot", "scripted"):
        env = make(partner=partner, render_mode="rgb_array")
        env.reset(seed=0)
        assert [p.is_robot for p in env.unwrapped.view().players] == [False, partner == "robot"]
        pictures[partner] = env.render()
    col = env.unwrapped.view().players[1].cell[1]
    differs = np.argwhere((pictures["robot"] != pictures["scripted"]).any(axis=-1))
    tile = pictures["robot"].shape[1] // 7
    assert len(differs) > 0.1 * tile**2
    assert set(differs[:, 1] // tile) == {col}


# -- other partners ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("partner", ["scripted", "boltzmann", "planner"])
def test_other_players_finish_with_a_scripted_person(partner):
    for seed in range(2):
        env = make(partner=partner, max_episode_steps=3000)
        results = play(env, scripted(env, seed), seed)
        assert results[-1][2]
        assert env.unwrapped.team.summary()["robot_idle"] < 0.9


def test_a_recorded_partner_does_what_was_recorded_then_stays():
    rng = np.random.default_rng(0)
    actions = rng.integers(6, size=30)
    env = make(partner={"kind": "recorded", "actions": actions.tolist()})
    for _ in range(2):
        env.reset(seed=0)
        done = []
        for _ in range(40):
            done.append(env.unwrapped.team.action)
            env.step(STAY)
        assert done == [*actions.tolist(), *[STAY] * 10]


def test_a_policy_sees_the_kitchen_as_its_player_does():
    seen = []

    def policy(obs, info):
        seen.append((obs, info))
        return 2 if len(seen) % 2 else np.int64(INTERACT)

    env = make(partner=policy)
    joint = gym.make("LegibleOvercooked-v0", num_players=2)
    env.reset(seed=0)
    expected = [joint.reset(seed=0)]
    for t in range(10):
        env.step(STAY)
        expected.append(joint.step([STAY, 5 if t % 2 else 2])[::4])
    for (obs, info), (theirs, told) in zip(seen, expected, strict=True):
        assert np.array_equal(obs, theirs[1])
        assert np.array_equal(info["goal_mask"], told["goal_mask"][1])
        assert np.array_equal(info["action_mask"], told["action_mask"][1])


class Stays:
    """A partner of one's own, made without arguments."""

    def reset(self, layout, rules, rng):
        self.layout, self.draw = layout, rng.random()

    def step(self, senses):
        senses.state[:] = 0  # a copy
        return Command(STAY, target="pot", state="rest")


def test_partners_of_ones_own():
    env = make(partner=f"{HERE}:Stays")
    _, info = env.reset(seed=0)
    assert env.unwrapped.robot_state == "rest"
    assert env.unwrapped.goal_names.ravel()[info["robot_target"]] == "pot" == env.unwrapped.robot_target
    results = play(env, scripted(env))
    assert results[-1][2]
    assert results[-1][4]["robot_idle"] == 1
    own = Stays()
    make(partner=own).reset(seed=0)
    assert not hasattr(own, "layout")


# -- bad input --------------------------------------------------------------------------------------------------------


class Raises(Stays):
    def step(self, senses):
        raise KeyError("lost")


class RaisesAtReset(Stays):
    def reset(self, layout, rules, rng):
        raise RuntimeError("not today")


@pytest.mark.parametrize(
    "partner",
    [
        Raises(),
        RaisesAtReset(),
        lambda obs, info: math.nan,
        lambda obs, info: 6,
        lambda obs, info: np.array([1, 2]),
        lambda obs, info: "north",
        lambda obs, info: None,
        lambda obs, info: Command(1, belief={"pot": math.nan}),
        lambda obs, info: Command(1, target=3),
    ],
)
def test_partners_that_fail_are_reported_once_and_the_episode_goes_on(partner):
    env = make(partner=partner)
    with pytest.warns(RuntimeWarning, match="failed, so it stays") as caught:
        results = play(env, scripted(env))
    assert len(caught) == 1
    assert results[-1][2]
    assert env.unwrapped.team.failure is not None
    assert env.unwrapped.view().players[1].held is None


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"partner": "robt"}, ValueError, r"no partner named 'robt'; there are robot, scripted, .*'module:Class'"),
        ({"partner": {"kind": 3}}, ValueError, "no partner named 3"),
        ({"partner": {"kind": "recorded", "actions": [1, 7]}}, ValueError, "list of actions 0..5"),
        ({"partner": {"kind": "recorded", "actions": [math.nan]}}, ValueError, "list of actions 0..5"),
        ({"partner": {"kind": "recorded"}}, ValueError, "a recorded partner does not take"),
        ({"partner": {"speed": 3}}, ValueError, "a robot partner does not take: .*speed"),
        ({"partner": {"kind": "planner", "rationality": 3}}, ValueError, "planner partner"),
        ({"partner": "nowhere:Robot"}, ValueError, "cannot be made: ModuleNotFoundError"),
        ({"partner": 3}, TypeError, r"`reset` and `step`, or a policy"),
        ({"partner": Stays}, TypeError, r"`reset` and `step`, or a policy"),
        ({"predictor": "eq1"}, ValueError, "no predictor named 'eq1'"),
        ({"predictor": 3}, TypeError, "`predictor`"),
        ({"partner": None, "predictor": "bayesian"}, ValueError, "there is no partner"),
        ({"partner": "scripted", "predictor": "bayesian"}, ValueError, "for partner='robot'"),
        ({"threshold": 1.5}, ValueError, "threshold"),
        ({"num_players": 2}, ValueError, "`num_players` must be 1"),
    ],
)
def test_arguments_that_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        make(**arguments)


# -- measures ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("partner", ["robot", "scripted"])
def test_measures_are_those_of_the_states(partner):
    """Idle times, concurrent activity, reaches, decision times and duplicated fetches, counted from recorded states."""
    env = make(partner=partner)
    for seed in range(3):
        person, states, targets, sure = scripted(env, seed), [], [], []
        obs, info = env.reset(seed=seed)
        over = False
        while not over:
            states.append(env.unwrapped.arrays()[0].copy())
            targets.append(env.unwrapped.robot_target)
            sure.append(env.unwrapped.team.command.predicted)
            obs, _, over, _, info = env.step(person(obs, info))
        states.append(env.unwrapped.arrays()[0].copy())
        rules = env.unwrapped.arrays()[2]
        players = np.array([state[AT_PLAYERS : AT_PLAYERS + 6].reshape(2, 3) for state in states])
        acted = (np.diff(players, axis=0) != 0).any(axis=2)
        acted[:, PARTNER] &= [target is not None for target in targets]
        summary = env.unwrapped.team.summary()
        assert summary["completion_time"] == pytest.approx(TICK * len(targets))
        assert summary["human_idle"] == pytest.approx(1 - acted[:, PERSON].mean())
        assert summary["robot_idle"] == pytest.approx(1 - acted[:, PARTNER].mean())
        assert summary["concurrent_activity"] == pytest.approx(acted.all(axis=1).mean())
        reaches = env.unwrapped.trajectories()
        assert summary["reaches"] >= len(reaches)
        for reach in reaches:
            begin, end = round(reach.times[0] / TICK), round(reach.times[-1] / TICK)
            log = [p for p in env.unwrapped.team.predictions if p.taken == reach.goal]
            mine = [p for p in log if p.duration == pytest.approx((end - begin) * TICK)]
            first = next((t for t in range(begin, end) if sure[t] is not None), end)
            assert any(p.decision_time == pytest.approx((first - begin) * TICK) for p in mine)
        held = players[:, :, 2]
        doubled = 0
        for before, after, state in zip(held, held[1:], states[1:], strict=False):
            filled = (before == 0) & (after > 0) & (after <= DISH)
            if filled.any() and (after > 0).all() and (after <= DISH).all():
                one, other = (int(item) for item in after)
                useful = all(needed_beside(state, rules, item, np.zeros(0, np.int64)) for item in (one, other))
                doubled += useful and not needed_beside(state, rules, one, np.array([other]))
        assert summary["goals_lost"] == doubled
        assert summary["conflicts"] >= doubled
        again = TeamMetrics()
        for tick in env.unwrapped.team.ticks:
            again.add(tick)
        again.complete(TICK * len(targets))
        assert again.summary() == summary
        assert {name: info[name] for name in MEASURES} == {name: summary[name] for name in MEASURES}


def test_a_conflict_is_counted_where_the_person_takes_what_the_partner_goes_for():
    class Heads(Stays):
        def step(self, senses):
            return Command(STAY, target="onion")

    for recipe, conflicts in ((("tomato", "onion"), 1), (("onion", "onion"), 0)):
        env = make(partner=Heads(), recipes=[recipe])
        play(env, Fetches(env, "onion"), steps=30)
        assert env.unwrapped.view().players[0].held is not None
        assert env.unwrapped.team.summary()["conflicts"] == conflicts
        assert env.unwrapped.team.summary()["goals_lost"] == 0
