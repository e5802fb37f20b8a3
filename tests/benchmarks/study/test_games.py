"""Rounds as a study plays them: what the page draws is the environment's own view, and stored actions play the same."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.study.games.overcooked import KitchenGame
from benchmarks.study.games.pointer import PointerTrack
from benchmarks.study.games.tabletop import TableGame, velocity_to
from legible_envs.overcooked.game.view import GameView, Item
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.tabletop.objects import VirtualObstacle
from legible_envs.tabletop.task import TabletopTask

KITCHEN = "XPXTX\nO   X\nX V D\nX   C\nXXSFX"
SOUPS = [["onion", "tomato"], ["fish", "cabbage", "fish"]]


def kitchen(**settings: Any) -> KitchenGame:
    return KitchenGame(KITCHEN, soups=SOUPS, cook_time=4, virtual_obstacles="soft", **settings)


def table(**settings: Any) -> TableGame:
    layout = TabletopTask.named("columns").layout.with_obstacles(
        [VirtualObstacle(at=(0.45, 0.3), size=(0.3, 0.01), angle=0.0)]
    )
    return TableGame(json.dumps(layout.to_dict()), **settings)


def drawn_from(view: GameView) -> dict[str, Any]:
    """What a page draws of a kitchen, from the environment's own words."""

    def item(found: Item | None) -> list[Any] | None:
        return None if found is None else [found.kind, list(found.contents)]

    return {
        "n": view.steps,
        "players": [{"cell": list(p.cell), "facing": p.facing, "held": item(p.held)} for p in view.players],
        "counters": [[*cell, item(found)] for cell, found in sorted(view.counters.items())],
        "pots": [
            [*cell, list(pot.contents), pot.ticks, pot.cook_time, 2 if pot.is_ready else int(pot.is_cooking)]
            for cell, pot in view.pots.items()
        ],
        "delivered": [list(recipe) for recipe in view.delivered],
        "orders": [list(recipe) for recipe in view.orders],
        "crossings": view.crossings,
    }


@pytest.mark.parametrize("seed", range(6))
def test_the_page_draws_what_the_environment_says_in_every_state_of_a_kitchen(seed):
    game, rng = kitchen(), np.random.default_rng(seed)
    player, kinds = ScriptedPlayer(game.env, rng), set()
    while not game.is_over:
        state = game.state()
        assert {key: value for key, value in state.items() if key != "over"} == drawn_from(game.env.view())
        kinds |= {player["held"][0] for player in state["players"] if player["held"]}
        kinds |= {f"pot {pot[5]}" for pot in state["pots"]} | {"counter" for _ in state["counters"]}
        game.step(int(rng.integers(6)) if rng.random() < 0.2 else player(game.obs, game.info))
    assert game.outcome()["done"] == 2
    assert kinds >= {"onion", "dish", "soup", "pot 0", "pot 1", "pot 2"}


@pytest.mark.parametrize("make", [kitchen, table])
def test_stored_actions_play_the_same_states(make):
    rng, first, second = np.random.default_rng(0), make(seed=3), make(seed=3)
    digests = [first.digest()]
    for _ in range(200):
        action = int(rng.integers(6)) if make is kitchen else first.action_to(*rng.uniform((0, 0), (1.2, 0.8)))
        stored = json.loads(json.dumps(first.read_action(action)))
        first.step(action)
        second.step(second.read_action(stored))
        digests.append(first.digest())
        assert second.digest() == digests[-1]
        assert second.state(True) == first.state(True)
    assert len(set(digests)) > 100  # the digest tells states apart


def test_a_table_with_the_robot_plays_the_same_again():
    robot = {"partner": "robot", "predictor": "bayesian", "threshold": 0.8}
    first, second = table(partner=robot), table(partner=robot)
    goal = first.env.positions[0]
    for _ in range(120):
        action = first.action_to(*goal)
        first.step(action)
        second.step(action)
    assert second.digest() == first.digest()
    assert first.state()["holding"] >= 0
    assert first.state()["robot"][:2] != [0.6, 0.75]  # it has set out from home


@pytest.mark.parametrize("value", [6, -1, 1.0, True, "1", None, [1], float("nan"), 10**30])
def test_what_is_no_action_in_a_kitchen_is_refused(value):
    with pytest.raises(ValueError, match="integer from 0 to 5"):
        kitchen().read_action(value)


@pytest.mark.parametrize(
    "value", [0, [0.0], [0, 0, 0], ["0", 0], [math.nan, 0.0], [math.inf, 0.0], [1e300, 0.0], [True, 0.0], None]
)
def test_what_is_no_action_at_a_table_is_refused(value):
    with pytest.raises(ValueError, match=r"\[vx, vy\]|finite"):
        table().read_action(value)


def test_without_obstacles_nothing_else_changes():
    bare, full = kitchen(obstacles=False).scene(), kitchen().scene()
    assert "".join(full["cells"]).count("V") == 1
    assert [row.replace("V", " ") for row in full["cells"]] == bare["cells"]
    assert table(obstacles=False).scene()["layout"]["obstacles"] == []
    assert table(obstacles=False).scene()["layout"]["objects"] == table().scene()["layout"]["objects"]


def test_a_round_at_a_table_ends_with_the_last_reach_that_is_wanted():
    game = table(reaches=1)
    assert not game.is_over
    for target in (game.env.positions[0], np.array(game.scene()["slots"]["red-circle"])):
        for _ in range(90):
            if not game.is_over:
                game.step(game.action_to(*target))
    assert game.is_over
    assert game.outcome() | {"reaches": 1, "done": 1, "finished": False} == game.outcome()
    with pytest.raises(ValueError, match="over"):
        game.step([0.0, 0.0])


points = st.tuples(st.floats(-5, 5), st.floats(-5, 5))


@given(points, points)
def test_a_velocity_leads_to_its_target_or_towards_it_at_full_speed(hand, target):
    x, y = velocity_to(hand, target)
    reached = (hand[0] + x * 0.1, hand[1] + y * 0.1)  # 3 m/s for 1/30 s
    distance = math.dist(hand, target)
    assert math.dist(hand, reached) == pytest.approx(min(distance, 0.1), abs=1e-6)
    assert math.dist(reached, target) == pytest.approx(max(0.0, distance - 0.1), abs=1e-6)


@settings(max_examples=200)
@given(st.lists(st.tuples(st.floats(-100, 3000), points), max_size=60), st.integers(1, 7))
def test_however_samples_are_batched_the_hand_goes_the_same_way(samples, size):
    rows = [(t, x, y) for t, (x, y) in samples]

    def played(batches: list[list[tuple[float, float, float]]]) -> list[tuple[float, float]]:
        track, found = PointerTrack((0.5, 0.5)), []
        for batch in batches:
            track.add(batch)
            found += [track.take() for _ in range(track.ready())]
        return found

    once = played([rows])
    assert played([rows[i : i + size] for i in range(0, len(rows), size)]) == once
    later = [t for t, _, _ in rows]
    assert len(once) == max([0, *(int((t + 1e-6) * 30 / 1000) for t in later)])
    for x, y in once:  # between samples, never beyond them
        assert min([0.5, *(r[1] for r in rows)]) - 1e-9 <= x <= max([0.5, *(r[1] for r in rows)]) + 1e-9
        assert min([0.5, *(r[2] for r in rows)]) - 1e-9 <= y <= max([0.5, *(r[2] for r in rows)]) + 1e-9


def test_a_pointer_without_samples_rests_where_it_was():
    track = PointerTrack((0.0, 0.0))
    track.add([(100.0, 1.0, 1.0), (900.0, 0.2, 0.2)])
    path = [track.take() for _ in range(track.ready())]
    assert path[2:25] == [(1.0, 1.0)] * 23  # not a slow glide over 0.8 s
    assert path[26] == (0.2, 0.2)
