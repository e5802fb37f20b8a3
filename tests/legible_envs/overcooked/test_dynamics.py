"""The compiled game against the plain one, its corner cases, and recorded-game arrays."""

from __future__ import annotations

import copy
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.dynamics import interaction, is_over, start, step
from legible_envs.overcooked.game.goals import find_actions, find_goals
from legible_envs.overcooked.game.replay import GameArrays, _unpack, predict_transitions
from legible_envs.overcooked.game.rules import LEGIBLE, OVERCOOKED_AI_2019, GameRules, pack_kitchen, pack_rules
from legible_envs.overcooked.game.vectors import AT_PLAYERS, DISHES_OUT, NOTHING_HAPPENS, SOUPS_IN_POTS
from tests.oracles.kitchen_oracle import KernelGame, OracleGame, any_kitchen

N, S, E, W, STAY, INTERACT = range(6)
PLAIN = np.array([20.0, 0.0, 0.0, 0.0, 0.0])

ROOM = """\
XXTXOXX
C     D
F  1  P
X     P
XXXSXXX"""


def play(game: KernelGame, actions, weights=PLAIN) -> float:
    """Total reward of a one-player game's actions."""
    return sum(step(game.state, game.kitchen, game.rules, weights, np.array([a]))[0] for a in actions)


RECIPE_BOOKS = {
    "paper": (("tomato", "tomato", "onion"), ("onion", "onion", "cabbage"), ("fish", "fish", "fish")),
    "one": (("onion", "fish"),),
    "twins": (("onion", "tomato"), ("onion", "tomato"), ("onion", "onion")),
    "overlapping": (("tomato", "onion"), ("onion", "cabbage"), ("cabbage", "fish"), ("fish", "tomato")),
}


@pytest.mark.parametrize("book", RECIPE_BOOKS)
@pytest.mark.parametrize(("players", "soft"), [(1, False), (1, True), (2, False), (2, True), (3, False)])
def test_kernels_play_like_the_plain_game(book, players, soft):
    rng = np.random.default_rng([players, soft, sorted(RECIPE_BOOKS).index(book)])
    interactions = deliveries = 0
    for _ in range(3):
        layout = any_kitchen(rng, players, soft=soft)
        arguments = {"recipes": RECIPE_BOOKS[book], "cook_time": 3, "soft": soft, "players": players}
        oracle, game = OracleGame(layout, **arguments), KernelGame(layout, **arguments)
        goals, mask = np.zeros(layout.cells.size, dtype=bool), np.zeros(6, dtype=np.int8)
        for _ in range(200):
            actions = [purposeful(oracle, p, rng) for p in range(players)]
            interactions += actions.count(INTERACT)
            reward, _ = step(game.state, game.kitchen, game.rules, PLAIN, np.array(actions))
            assert reward == oracle.step(actions)
            deliveries += int(reward // 20)
            assert game.facts() == oracle.facts()
            assert is_over(game.state, game.rules) == oracle.over
            for player in range(players):
                find_goals(game.state, game.kitchen, game.rules, player, goals)
                assert {divmod(int(cell), layout.shape[1]) for cell in np.flatnonzero(goals)} == oracle.goals(player)
                find_actions(game.state, game.kitchen, game.rules, player, mask)
                if rng.random() < 0.1:
                    assert mask.tolist() == expected_mask(oracle, player)
            held = [item == "dish" for item in [*oracle.held, *oracle.counters.values()]]
            assert game.state[DISHES_OUT] == sum(held)
            assert game.state[SOUPS_IN_POTS] == sum(pot.order is not None for pot in oracle.pots.values())
    # The test means nothing unless the games went somewhere.
    assert interactions > 50
    assert deliveries > 0


def purposeful(game: OracleGame, player: int, rng) -> int:
    """Mostly walk towards a goal and use it, so that games get on; often do anything at all."""
    if rng.random() < 0.3:
        return int(rng.integers(6))
    goals = game.goals(player)
    here = game.cells[player]
    for action, (dr, dc) in enumerate(((-1, 0), (1, 0), (0, 1), (0, -1))):
        if (here[0] + dr, here[1] + dc) in goals:
            return INTERACT if game.facing[player] == action else action
    queue, seen = [(here, None)], {here}
    for cell, first in queue:
        for action, (dr, dc) in enumerate(((-1, 0), (1, 0), (0, 1), (0, -1))):
            after = (cell[0] + dr, cell[1] + dc)
            if after in goals and first is not None:
                return first
            if game.free(after) and after not in seen:
                seen.add(after)
                queue.append((after, action if first is None else first))
    return int(rng.integers(6))


def expected_mask(game: OracleGame, player: int) -> list[int]:
    """What would change if this player alone acted, by trying."""
    mask = []
    for action in range(6):
        trial = copy.deepcopy(game)
        trial.cells = [trial.cells[player]]
        trial.facing, trial.held = [trial.facing[player]], [trial.held[player]]
        before = (list(trial.cells), list(trial.facing), list(trial.held))
        trial.step([action])
        mask.append(int(action == STAY or before != (trial.cells, trial.facing, trial.held)))
    return mask


def test_two_pots_never_commit_to_one_order():
    game = KernelGame(OvercookedLayout.from_ascii(ROOM), recipes=(("onion", "onion"), ("tomato", "fish")))
    game.state[AT_PLAYERS : AT_PLAYERS + 3] = [2 * 7 + 5, E, 2]
    play(game, [INTERACT])
    assert game.facts()["pots"][2, 6] == (("onion",), 0, False)
    game.state[AT_PLAYERS : AT_PLAYERS + 3] = [3 * 7 + 5, E, 2]
    assert interaction(game.state, game.kitchen, game.rules, 0) == NOTHING_HAPPENS
    game.state[AT_PLAYERS + 2] = 1
    play(game, [INTERACT])
    assert game.facts()["pots"][3, 6] == (("tomato",), 0, False)


def test_soup_on_a_counter_keeps_its_order():
    game = KernelGame(OvercookedLayout.from_ascii(ROOM), recipes=(("onion",),), cook_time=2)
    at_pot = [2 * 7 + 5, E]
    for held in (2, 5):
        game.state[AT_PLAYERS : AT_PLAYERS + 3] = [*at_pot, held]
        play(game, [INTERACT, STAY])
    assert game.facts()["players"][0][2] == ("soup", ("onion",))
    play(game, [S, S, W, W, S, W, S, INTERACT])
    assert ("soup", ("onion",)) in game.facts()["counters"].values()
    game.state[AT_PLAYERS : AT_PLAYERS + 3] = [*at_pot, 2]
    assert interaction(game.state, game.kitchen, game.rules, 0) == NOTHING_HAPPENS


def test_cook_time_counts_from_the_tick_of_the_last_ingredient():
    game = KernelGame(OvercookedLayout.from_ascii(ROOM), recipes=(("onion",),), cook_time=20)
    game.state[AT_PLAYERS : AT_PLAYERS + 3] = [2 * 7 + 5, E, 2]
    play(game, [INTERACT])
    assert game.facts()["pots"][2, 6] == (("onion",), 1, True)
    game.state[AT_PLAYERS + 2] = 5
    play(game, [STAY] * 18)
    assert interaction(game.state, game.kitchen, game.rules, 0) == NOTHING_HAPPENS
    play(game, [STAY])
    assert interaction(game.state, game.kitchen, game.rules, 0) != NOTHING_HAPPENS
    play(game, [STAY] * 5)
    assert game.facts()["pots"][2, 6][1] == 20


def test_shaping_cannot_be_farmed():
    """Whatever is done and undone, the extra reward is at most that of the shortest way to the same end."""
    rng = np.random.default_rng(5)
    weights = np.array([0.0, 3.0, 3.0, 5.0, 0.0])
    for _ in range(5):
        game = KernelGame(any_kitchen(rng), cook_time=2)
        total = play(game, rng.choice([N, S, E, W, INTERACT, INTERACT], size=4000), weights)
        assert 0 <= total <= 9 * 3 + 3 * (3 + 5)


@pytest.mark.parametrize("swap", [True, False])
def test_players_cannot_swap_or_share_cells(swap):
    layout = OvercookedLayout.from_ascii("XXXXXX\nX1 2 X\nXXXXXX" if not swap else "XXXXX\nX12 X\nXXXXX")
    game = KernelGame(layout, players=2)
    step(game.state, game.kitchen, game.rules, PLAIN, np.array([E, W]))
    assert [p[0] for p in game.facts()["players"]] == list(layout.starts)
    assert [p[1] for p in game.facts()["players"]] == [E, W]


def test_following_another_player_is_allowed():
    game = KernelGame(OvercookedLayout.from_ascii("XXXXXX\nX12  X\nXXXXXX"), players=2)
    step(game.state, game.kitchen, game.rules, PLAIN, np.array([E, E]))
    assert [p[0] for p in game.facts()["players"]] == [(1, 2), (1, 3)]


def test_rules_and_kitchens_reject_what_they_cannot_hold():
    with pytest.raises(TaskError, match="ingredients"):
        GameRules(recipes=(("beetroot",),))
    with pytest.raises(ValueError, match="at most 32"):
        GameRules(recipes=(("onion", "fish"),) * 33)
    with pytest.raises(ValueError, match="at most 15"):
        GameRules(recipes=(("onion",) * 16,))
    with pytest.raises(ValueError, match="cook_time"):
        GameRules(cook_time=-1)
    layout = OvercookedLayout.from_ascii(ROOM)
    with pytest.raises(LayoutError, match="shape"):
        pack_kitchen(layout, pack_rules(LEGIBLE, (7, 7)))
    with pytest.raises(LayoutError, match="2 pots"):
        pack_kitchen(layout, pack_rules(LEGIBLE, layout.shape, 1, 1))
    with pytest.raises(LayoutError, match="3 players"):
        pack_kitchen(layout, pack_rules(LEGIBLE, layout.shape, 3, 2))


# -- recorded games ---------------------------------------------------------------------------------------------------


def recorded(layout, game, moves):
    """States before each of the joint actions, and the last, as recordings hold them."""
    states = [game.state.copy()]
    for actions in moves:
        step(game.state, game.kitchen, game.rules, PLAIN, np.array(actions))
        states.append(game.state.copy())
    return np.array(states)


@pytest.mark.parametrize("name", ["legible", "overcooked-ai-2019"])
def test_replay_predicts_played_games(name):
    rules = LEGIBLE if name == "legible" else OVERCOOKED_AI_2019
    rng = np.random.default_rng(11)
    scored = 0.0
    for _ in range(4):
        layout = any_kitchen(rng, players=2)
        packed = pack_rules(rules, layout.shape, 2, len(layout.named("pot")))
        kitchen = pack_kitchen(layout, packed)
        state = np.zeros(int(packed[13]), dtype=np.int32)
        start(state, kitchen, packed)
        goals = np.zeros(layout.cells.size, dtype=bool)
        rows, moves, rewards = [state.copy()], [], []
        oracle = OracleGame(layout, players=2)
        for _ in range(500):
            for player in range(2):
                find_goals(state, kitchen, packed, player, goals)
                at = AT_PLAYERS + 3 * player
                oracle.cells[player] = divmod(int(state[at]), layout.shape[1])
                oracle.facing[player] = int(state[at + 1])
            wanted = {divmod(int(cell), layout.shape[1]) for cell in np.flatnonzero(goals)}
            oracle.goals = lambda player, wanted=wanted: wanted
            actions = [purposeful(oracle, player, rng) for player in range(2)]
            rewards.append(step(state, kitchen, packed, PLAIN, np.array(actions))[0])
            moves.append(actions)
            rows.append(state.copy())
        played = _unpack(np.array(rows), packed)
        before = GameArrays(*(array[:-1] for array in played))
        following, predicted = predict_transitions(layout, before, moves, rules=name)
        for field in GameArrays._fields:
            np.testing.assert_array_equal(getattr(following, field), getattr(played, field)[1:], err_msg=field)
        np.testing.assert_array_equal(predicted, rewards)
        scored += predicted.sum()
    assert scored > 0


def test_the_2019_rules():
    """Three onions cook and go on ticking past 20, a dish takes the soup, serving takes it, for ever."""
    layout = OvercookedLayout.from_ascii("XXPXX\nO1 2O\nX   X\nXDXSX")
    one = GameArrays(
        cells=np.array([[[1, 2], [2, 3]]]),
        facing=np.array([[N, S]]),
        held=np.array([[2, 6]]),
        counters=np.zeros((1, 4, 5), dtype=np.int8),
        pots=np.array([[[0, 2, 0, 0, 0]]]),
    )
    after, reward = predict_transitions(layout, one, [[INTERACT, INTERACT]])
    assert after.pots[0, 0].tolist() == [0, 3, 0, 0, 1]
    assert after.held.tolist() == [[0, 0]]
    assert reward.tolist() == [20.0]
    for ticks, held in ((19, 5), (20, 6), (35, 6)):
        cooking = one._replace(held=np.array([[5, 0]]), pots=np.array([[[0, 3, 0, 0, ticks]]]))
        after, _ = predict_transitions(layout, cooking, [[INTERACT, STAY]])
        assert after.held[0, 0] == held
        assert after.pots[0, 0].tolist() == ([0, 3, 0, 0, 20] if held == 5 else [0, 0, 0, 0, 0])
    nothing_back = one._replace(cells=np.array([[[1, 1], [2, 3]]]), facing=np.array([[W, S]]))
    after, _ = predict_transitions(layout, nothing_back, [[INTERACT, STAY]])
    assert after.held[0, 0] == 2


def test_replay_names_the_array_that_does_not_fit():
    layout = OvercookedLayout.from_ascii(ROOM)
    states = GameArrays(
        np.ones((2, 1, 2), int), np.zeros((2, 1), int), np.zeros((2, 1), int), np.zeros((2, 5, 7)), np.zeros((2, 1, 5))
    )
    with pytest.raises(ValueError, match="`pots` must have shape \\(2, 2, 5\\)"):
        predict_transitions(layout, states, [[0], [0]])
    with pytest.raises(ValueError, match=r"0\.\.5"):
        predict_transitions(layout, states, [[0], [6]])


@pytest.mark.parametrize(
    ("name", "at", "value", "message"),
    [
        ("cells", (1, 0, 0), 5, "rows of `cells` must be integers 0..4, got 5 in state 1"),
        ("cells", (1, 0, 1), -1, "columns of `cells` must be integers 0..6, got -1 in state 1"),
        ("facing", (0, 0), 4, "`facing` must be integers 0..3, got 4 in state 0"),
        ("held", (0, 0), 7, "`held` must be integers 0..6, got 7 in state 0"),
        ("held", (0, 0), 120, "`held` must be integers 0..6, got 120 in state 0"),
        ("counters", (1, 2, 3), -2, "`counters` must be integers 0..6, got -2 in state 1"),
    ],
)
def test_replay_names_the_number_that_is_out_of_range(name, at, value, message):
    """Kernels look up cells and orders by these numbers: without a check they read and wrote outside their arrays."""
    layout = OvercookedLayout.from_ascii(ROOM)
    states = GameArrays(
        np.ones((2, 1, 2), int),
        np.zeros((2, 1), int),
        np.zeros((2, 1), int),
        np.zeros((2, 5, 7), int),
        np.zeros((2, 2, 5), int),
    )
    predict_transitions(layout, states, [[0], [0]])
    getattr(states, name)[at] = value
    with pytest.raises(ValueError, match=re.escape(message)):
        predict_transitions(layout, states, [[0], [0]])


PLAIN_PYTHON = """
import numpy as np
from tests.oracles.kitchen_oracle import KernelGame, OracleGame, any_kitchen
from legible_envs.overcooked.game.dynamics import (step)
rng = np.random.default_rng(0)
for players in (1, 2):
    layout = any_kitchen(rng, players)
    game, oracle = KernelGame(layout, players=players), OracleGame(layout, players=players)
    for actions in rng.integers(6, size=(300, players)):
        reward, _ = step(game.state, game.kitchen, game.rules, np.array([20.0, 0, 0, 0, 0]), actions)
        assert reward == oracle.step(actions.tolist())
        assert game.facts() == oracle.facts()
assert isinstance(step, type(lambda: 0))
print("same")
"""


def test_kernels_are_also_plain_python():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(Path(__file__).parents[3])}
    result = subprocess.run(
        [sys.executable, "-c", PLAIN_PYTHON], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert result.stdout.strip() == "same", result.stderr
