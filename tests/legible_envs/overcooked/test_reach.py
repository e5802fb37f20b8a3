"""A score is of a person: stations out of their reach are no goals, for scores, participants and trajectories alike."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from legible_envs.errors import LayoutError
from legible_envs.legibility import From, goal_legibility
from legible_envs.observer import ObserverModel
from legible_envs.overcooked import OvercookedLayout, OvercookedScorer, OvercookedWorkspace, reach_of, soup_task
from legible_envs.overcooked.human_play import recipes_for
from legible_envs.overcooked.humans import BoltzmannWalker, fit_rationality, simulate_participants
from legible_envs.overcooked.humans.planner_fitting import fit_planner
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.reach import reach_from
from legible_envs.overcooked.scoring.boltzmann import HumanModel
from legible_envs.overcooked.scoring.explanation import ambiguity, explain_layout, grid_graph, layout_distance
from legible_envs.overcooked.scoring.explanation import score_layout as score_any
from legible_envs.overcooked.trajectories import trajectories
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tasks import Subtask, TaskGraph
from tests.support.repeats import Repeats

ONIONS = soup_task([("onion", "onion", "onion")])
HALVES = OvercookedLayout.from_rows(  # each player has onions, dishes and serving; the pots stand between them
    [
        "XXXXXXXXX",
        "O XSXOX S",
        "X   P 1 X",
        "X2  P   X",
        "XXXDXDXXX",
    ]
)
"""The plan of Overcooked-AI's ``asymmetric_advantages``."""

SHARED = OvercookedLayout.from_rows(["XOXXXXXOX", "S   P   X", "X 2 X 1 S", "X   D   X", "XOXXXXXXX"])
"""Pot and dishes between the halves; player 2 has two onion stations."""

SERVED = OvercookedLayout.from_rows(["XXOXX", "O1X2P", "D X S", "XXXXX"])
"""Player 1 fetches, player 2 cooks: nobody can do the task alone."""

WALLED_IN = OvercookedLayout.from_rows(["XOXXXOX", "X  XX X", "XXOXXXX", "P 1   D", "X V   X", "XXXSXXX"])


def walk_of(states: list[tuple[int, ...]], goal: str = next(iter(HALVES.stations))) -> Trajectory:
    """A walk in the asymmetric kitchen."""
    array = np.array(states, dtype=np.int64).reshape(len(states), -1 if states else 2)
    return Trajectory(array, goal=goal, candidates=(goal,), layout=HALVES)


# -- an oracle that knows nothing of reach -----------------------------------------------------------------------------


def flooded(layout: OvercookedLayout, start: tuple[int, int]) -> set[tuple[int, int]]:
    """Floor connected with a cell, from the drawing alone."""
    rows = ["".join(" " if symbol.isdigit() else symbol for symbol in line) for line in layout.to_ascii().split("\n")]
    found, queue = {start}, [start]
    while queue:
        row, col = queue.pop()
        for cell in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            inside = 0 <= cell[0] < len(rows) and 0 <= cell[1] < len(rows[0])
            if inside and rows[cell[0]][cell[1]] == " " and cell not in found:
                found.add(cell)
                queue.append(cell)
    return found


def without(layout: OvercookedLayout, player: int, floor_too: bool) -> OvercookedLayout:
    """The kitchen with a counter in place of each station, and each floor cell if asked, out of a player's reach."""
    start = layout.starts[player - 1]
    mine = flooded(layout, start)
    changes = {}
    for cell in np.ndindex(layout.shape):
        row, col = cell
        beside = {(row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)}
        if (layout.station_at(cell) is not None and not beside & mine) or (
            floor_too and layout.is_floor(cell) and cell not in mine
        ):
            changes[cell] = "X"
    return OvercookedLayout(layout.with_starts([start]).with_cells(changes).cells, [start])


def plain_score(layout: OvercookedLayout, task: TaskGraph, observer: ObserverModel, costs=None) -> tuple[float, float]:
    """Score and distance as they were before there was a person: every station of the kitchen is a goal."""
    graph, parts = grid_graph(layout, costs), []
    for stage in task.stages():
        starts = layout.named(stage.start)
        goals = [name for kind in stage.goals for name in layout.named(kind)]
        for start, goal in itertools.product(starts, goals):
            scores = goal_legibility(graph, From(start), goal, goals, observer)
            value = math.fsum(s.probability * s.weight * s.value for s in scores)
            parts.append(stage.weight / len(starts) * value)
    legs = []
    for (a, b), expected in task.legs().items():
        moves = []
        for start in layout.named(a):
            field = layout.distances_from(layout.access(start))
            reached = [min(field[cell] for cell in layout.access(name) if field[cell] >= 0) for name in layout.named(b)]
            moves.append(np.mean(reached) if b in task.goals else min(reached))
        legs.append(expected * np.mean(moves))
    return math.fsum(parts), math.fsum(legs)


def divided_kitchen(rng: np.random.Generator, kinds: str = "OTDPS") -> OvercookedLayout:
    """A free-form kitchen of rooms and pockets, stations anywhere, several of a type, and one to three players."""
    shape = tuple(int(side) for side in rng.integers(4, 9, size=2))
    rows = rng.choice(list(" " * int(rng.integers(6, 30)) + "XXV"), size=shape)
    rows[[0, -1]], rows[:, [0, -1]] = "X", "X"
    if rng.random() < 0.6:
        rows[:, rng.integers(2, max(3, shape[1] - 2))] = "X"
    near = np.pad(rows[1:] == " ", ((0, 1), (0, 0))) | np.pad(rows[:-1] == " ", ((1, 0), (0, 0)))
    near |= np.pad(rows[:, 1:] == " ", ((0, 0), (0, 1))) | np.pad(rows[:, :-1] == " ", ((0, 0), (1, 0)))
    walls = rng.permutation(np.flatnonzero((rows == "X") & (near | (rng.random() < 0.3))))
    count = int(rng.integers(3 * len(kinds)))
    for spot, kind in zip(walls, [*kinds, *rng.choice(list(kinds), size=count)], strict=False):
        rows.flat[spot] = kind
    floor = np.flatnonzero(rows == " ")
    if not len(floor):
        return divided_kitchen(rng, kinds)
    for number, cell in enumerate(rng.permutation(floor)[: rng.integers(1, 4)], 1):
        rows.flat[cell] = str(number)
    return OvercookedLayout.from_rows(rows.tolist())


def check_value(
    layout: OvercookedLayout, player: int, task: TaskGraph, observer: ObserverModel, explained: bool = True
) -> str:
    """Compare one score with the oracle's; what came of it: ``whole``, ``part`` or ``none``."""
    countered = without(layout, player, floor_too=False)
    lost = [name for name, cell in layout.stations.items() if countered.station_at(cell) is None]
    scorer = OvercookedScorer(task, observer=observer)
    impossible = [kind for kind in task.places if not countered.named(kind)]
    if impossible:
        check_refusal(layout, player, scorer, impossible)
        return "none"
    result = scorer.score_layout(layout, player=player)
    assert result["out_of_reach"] == lost
    assert (result["player"], result["layout_id"]) == (player, layout.layout_id)
    of_counters = scorer.score_layout(countered)
    same = [key for key in result if key not in ("player", "layout_id", "out_of_reach")]
    assert [result[key] for key in same] == [of_counters[key] for key in same]
    assert (of_counters["out_of_reach"], reach_of(layout, player).kitchen.cells.tolist()) == (
        [],
        countered.cells.tolist(),
    )
    alone = without(layout, player, floor_too=True)
    assert (result["score"], result["distance"]) == pytest.approx(plain_score(alone, task, observer), abs=1e-12)
    if explained:
        check_explanation(layout, player, scorer, countered)
    return "part" if lost else "whole"


def check_explanation(layout: OvercookedLayout, player: int, scorer: OvercookedScorer, countered) -> None:
    """Rows and ambiguity are those of the kitchen with counters, but for the names."""
    rows = scorer.explain_layout(layout, player=player)
    renamed = {name: countered.station_at(cell) for name, cell in layout.stations.items()}
    for row, other in zip(rows, scorer.explain_layout(countered), strict=True):
        assert (renamed[row["start"]], renamed[row["goal"]]) == (other["start"], other["goal"])
        assert [renamed[name] for name in row["goals"]] == other["goals"]
        assert (row["contribution"], len(row["prefixes"])) == (other["contribution"], len(other["prefixes"]))
    heat = scorer.ambiguity(layout, player=player)
    np.testing.assert_array_equal(heat, scorer.ambiguity(countered))
    assert {(int(r), int(c)) for r, c in np.argwhere(~np.isnan(heat))} <= flooded(layout, layout.starts[player - 1])


def check_refusal(layout: OvercookedLayout, player: int, scorer: OvercookedScorer, impossible: list[str]) -> None:
    """The message names the types that are missing, or else the types and places that are out of reach."""
    with pytest.raises(LayoutError) as caught:
        scorer.score_layout(layout, player=player)
    message, absent = str(caught.value), [kind for kind in impossible if not layout.named(kind)]
    assert not re.search(r"From|place=|\(\d", message)
    assert all(f"{kind} station" in message for kind in absent or impossible)
    if not absent:
        assert caught.value.rule == "reachable"
        assert "player {}, who starts at row {}, column {}:".format(player, *layout.starts[player - 1]) in message
        for name in (name for kind in impossible for name in layout.named(kind)):
            assert "row {}, column {}".format(*layout.stations[name]) in message
    calls = (scorer.explain_layout, scorer.ambiguity, lambda *a, **k: layout_distance(*a, scorer.task, **k))
    for call in calls:
        with pytest.raises(LayoutError, match=re.escape(message)):
            call(layout, player=player)
    with pytest.raises(LayoutError, match=re.escape(message)):
        simulate_participants(layout, 1, np.random.default_rng(0), task=scorer.task, player=player)


def check_many(count: int, seed: int) -> None:
    rng, found = np.random.default_rng(seed), []
    tasks = [soup_task([("onion", "tomato")]), soup_task([("onion",), ("tomato",)]), soup_task([("onion", "onion")])]
    for number in range(count):
        layout = divided_kitchen(rng)
        player = int(rng.integers(1, len(layout.starts) + 1))
        observer = ObserverModel(prefix=("mean", "sum")[number % 2], beta=float(rng.uniform(0.5, 2)))
        found.append(check_value(layout, player, tasks[number % 3], observer, explained=number % 5 == 0))
    assert min(found.count(kind) for kind in ("whole", "part", "none")) > count / 50, found


def test_the_score_is_that_of_the_kitchen_with_counters_in_place_of_stations_out_of_reach() -> None:
    check_many(100, seed=0)


@pytest.mark.slow
def test_the_score_is_that_of_the_kitchen_with_counters_in_many_kitchens(repeats: Repeats) -> None:
    check_many(repeats(400, 1500), seed=1)


@pytest.mark.parametrize("seed", range(6))
def test_noisily_rational_people_and_costs_of_cells_follow_the_same_rule(seed: int) -> None:
    rng, task, compared = np.random.default_rng(seed), soup_task([("onion", "tomato")]), 0
    while compared < 4:
        layout = divided_kitchen(rng)
        alone = without(layout, 1, floor_too=True)
        if not all(alone.named(kind) for kind in task.places) or alone.cells.tolist() == layout.cells.tolist():
            continue
        compared += 1
        costs = rng.uniform(0.5, 2, size=layout.shape)
        weighted = score_any(layout, task, cell_costs=costs)["score"]
        assert weighted == pytest.approx(plain_score(alone, task, ObserverModel(), costs)[0], abs=1e-12)
        human = HumanModel("boltzmann", 0.9, 70)
        noisy, of_alone = (score_any(one, task, human=human, cell_costs=costs) for one in (layout, alone))
        for key in ("score", "truncated_probability", "normalised"):
            assert noisy[key] == pytest.approx(of_alone[key], abs=1e-12)


# -- kitchens that people use ------------------------------------------------------------------------------------------


def test_each_player_of_a_divided_kitchen_has_a_score_of_their_own() -> None:
    scorer = OvercookedScorer(ONIONS)
    right, left = (scorer.score_layout(HALVES, player=player) for player in (1, 2))
    assert right["out_of_reach"] == ["onion@(1,0)", "serving@(1,3)", "dish@(4,3)"]
    assert left["out_of_reach"] == ["onion@(1,5)", "serving@(1,8)", "dish@(4,5)"]
    assert scorer.score_layout(HALVES) == right
    assert (right["distance"], left["distance"]) == (8.0, 20.0)  # counted by hand
    assert (right["score"], left["score"]) == (4.0, 4.0)  # one goal at a time is always legible
    assert {row["goal"] for row in scorer.explain_layout(HALVES)} == {"onion@(1,5)", "dish@(4,5)"}
    assert {row["goal"] for row in scorer.explain_layout(HALVES, player=2)} == {"onion@(1,0)", "dish@(4,3)"}
    assert np.isnan(scorer.ambiguity(HALVES)[:, :5]).all()
    assert np.isnan(scorer.ambiguity(HALVES, player=2)[:, 4:]).all()


def test_stations_between_the_halves_belong_to_both_players() -> None:
    right, left = (score_any(SHARED, ONIONS, player=player) for player in (1, 2))
    assert right["out_of_reach"] == ["onion@(0,1)", "serving@(1,0)", "onion@(4,1)"]
    assert left["out_of_reach"] == ["onion@(0,7)", "serving@(2,8)"]
    assert right["normalised"] == 1.0 > left["normalised"]  # two onion stations may be confused
    graph = grid_graph(SHARED, reach=reach_of(SHARED))
    assert graph[From("pot")] == {(1, 5): 1.0}
    assert {cell for cell in graph if isinstance(cell, tuple) and not isinstance(cell, From)} == flooded(
        SHARED, SHARED.starts[0]
    )


def test_one_of_several_stations_may_be_walled_in() -> None:
    result = score_any(WALLED_IN, ONIONS)
    assert result["out_of_reach"] == ["onion@(0,1)", "onion@(0,5)"]
    assert result["score"] == score_any(WALLED_IN.with_cells({(0, 1): "X", (0, 5): "X"}), ONIONS)["score"]
    assert {row["goal"] for row in explain_layout(WALLED_IN, ONIONS)} == {"onion@(2,2)", "dish"}
    two_rooms = OvercookedLayout.from_rows(["XOXOX", "S1XXX", "X P X", "XDXXX"])
    assert score_any(two_rooms, ONIONS)["out_of_reach"] == ["onion@(0,3)"]


def test_a_task_that_nobody_can_do_alone_is_refused_in_words() -> None:
    with pytest.raises(LayoutError) as first:
        score_any(SERVED, ONIONS)
    assert str(first.value) == (
        "the task cannot be done in this kitchen by player 1, who starts at row 1, column 1: out of reach are the pot "
        "station (row 1, column 4) and the serving station (row 2, column 4)"
    )
    assert (first.value.rule, first.value.cell) == ("reachable", (1, 4))
    with pytest.raises(LayoutError, match=r"by player 2, .* out of reach is the dish station \(row 2, column 0\)$"):
        score_any(SERVED, TaskGraph([Subtask("a", ("dish",))], "serving"), player=2)
    with pytest.raises(LayoutError, match=r"are the onion stations \(row 0, column 2; row 1, column 0\)"):
        score_any(SERVED, TaskGraph([Subtask("a", ("onion",))], "serving"), player=2)
    with pytest.raises(LayoutError, match=r"the dish station \(row 3, column 1\)[^;]*; player 1 can do it$"):
        score_any(OvercookedLayout.from_rows(["XOXOX", "S1X2X", "X P X", "XDXSX"]), ONIONS, player=2)
    with pytest.raises(LayoutError, match=r"needs a fish station: there is no fish station in this kitchen, which has"):
        score_any(HALVES, soup_task([("fish",)]))


def test_a_task_may_name_one_station() -> None:
    task = TaskGraph([Subtask("a", ("onion@(1,0)",), then=("pot",))], "serving")
    assert {row["goal"] for row in explain_layout(HALVES, task, player=2)} == {"onion@(1,0)"}
    assert {t.goal for t in simulate_participants(HALVES, 2, np.random.default_rng(0), task=task, player=2)} == {
        "onion@(1,0)"
    }
    with pytest.raises(LayoutError, match=r"out of reach is the onion station \(row 1, column 0\); player 2 can do it"):
        explain_layout(HALVES, task)


@pytest.mark.parametrize("player", [0, 3, -1, 1.5, "1", None, True])
def test_a_player_without_a_start_is_refused_in_words(player) -> None:
    wanted = re.escape("`player` must be an integer from 1 to 2 (the kitchen has 2 starts), got ")
    rng = np.random.default_rng(0)
    for call in (
        lambda: score_any(HALVES, ONIONS, player=player),
        lambda: explain_layout(HALVES, ONIONS, player=player),
        lambda: ambiguity(HALVES, ONIONS, player=player),
        lambda: layout_distance(HALVES, ONIONS, player=player),
        lambda: OvercookedScorer(ONIONS).score_layout(HALVES, player=player),
        lambda: simulate_participants(HALVES, 1, rng, task=ONIONS, player=player),
        lambda: recipes_for(HALVES, player),
        lambda: reach_of(HALVES, player),
    ):
        with pytest.raises(LayoutError, match=wanted) as caught:
            call()
        assert caught.value.rule == "start"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: score_any(HALVES.to_ascii(), ONIONS), "`layout` must be an OvercookedLayout, got 'XXX"),
        (lambda: OvercookedScorer("soup"), "`task` must be None or a TaskGraph, got 'soup'"),
        (lambda: explain_layout(HALVES, "soup"), "`task` must be a TaskGraph, got 'soup'"),
        (lambda: OvercookedScorer(ONIONS, observer=2), "`observer` must be an ObserverModel, got 2"),
        (lambda: ambiguity(HALVES, ONIONS, observer=None), "`observer` must be an ObserverModel, got None"),
        (lambda: score_any(HALVES, ONIONS, cell_costs="a"), "`cell_costs` must be an array of numbers of shape (5, 9)"),
        (lambda: score_any(HALVES, ONIONS, cell_costs=np.ones((9, 5))), "the kitchen's shape (5, 9), got (9, 5)"),
        (lambda: score_any(HALVES, ONIONS, cell_costs=-np.ones((5, 9))), "at least 1e-06; row 1, column 7 is -1.0"),
        (lambda: score_any(HALVES, ONIONS, cell_costs=np.full((5, 9), math.nan)), "row 1, column 7 is nan"),
        (lambda: fit_rationality([3]), "expected trajectories, got 3 at index 0"),
        (lambda: fit_planner([]), "at least one trajectory, got none"),
        (lambda: fit_planner([walk_of([])]), "1 trajectories have none"),
        (lambda: fit_planner([walk_of([(1, 1), (10**6, 1)])]), "state 1, row 1000000, column 1, lies outside its 5x9"),
        (lambda: fit_planner([walk_of([(1, 1), (1, -3)])]), "state 1, row 1, column -3, lies outside"),
        (lambda: fit_rationality([walk_of([(1, 1), (1, 9)])]), "state 1, row 1, column 9, lies outside"),
        (lambda: fit_rationality([walk_of([(1, 1, 1), (1, 2, 1)])]), "expected (row, col) cells, got states of shape"),
        (lambda: fit_rationality([walk_of([(1, 1)], "moon")]), "trajectory 0: no station 'moon'; this kitchen has ["),
    ],
)
def test_other_arguments_are_refused_in_words(call, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        call()


def test_workspaces_score_the_player_of_a_kitchen() -> None:
    ws = OvercookedWorkspace((6, 6), stations=("onion", "dish", "pot", "serving"), recipes=[("onion", "onion")])
    genome = ws.sample(1, np.random.default_rng(0))[0]
    bare = ws.decode(genome)
    floor = [tuple(cell) for cell in np.argwhere(bare.distances_from(bare.starts) >= 0).tolist()]
    kitchen = bare.with_starts(floor[:2])
    alone, second = ws.summary(genome), ws.summary(kitchen, player=2)
    assert (alone["player"], alone["out_of_reach"], second["player"], second["out_of_reach"]) == (1, [], 2, [])
    assert alone["score"] == second["score"] == pytest.approx(ws.legibility(genome), abs=1e-9)
    assert second["layout_id"] == kitchen.layout_id
    assert ws.explain(kitchen, player=2) == ws.explain(genome)
    np.testing.assert_array_equal(ws.ambiguity(kitchen, player=2), ws.ambiguity(genome))
    assert {t.layout for t in ws.simulate(kitchen, 1, np.random.default_rng(0), player=2)} == {kitchen}
    for call in (ws.summary, ws.explain, ws.ambiguity):
        with pytest.raises(LayoutError, match="`player` must be an integer from 1 to 1"):
            call(genome, player=2)


def test_recipes_are_of_ingredients_in_reach() -> None:
    kitchen = OvercookedLayout.from_rows(["XTXOX", "S1X2S", "XDPDX"])
    assert recipes_for(kitchen) == (("tomato",) * 3,)
    assert recipes_for(kitchen, 2) == (("onion",) * 3,)
    assert recipes_for(SERVED, 2) == (("onion",) * 3,)  # out of reach, which the score then says


# -- participants, recordings and games --------------------------------------------------------------------------------


def goals_of(layout: OvercookedLayout, task: TaskGraph, player: int) -> set[tuple[str, frozenset[str]]]:
    """Starts and candidate sets of all stages that are scored."""
    rows = explain_layout(layout, task, player=player)
    return {(row["start"], frozenset(row["goals"])) for row in rows}


@pytest.mark.parametrize("population", ["boltzmann", "planner"])
def test_participants_have_the_goals_that_are_scored(population: str) -> None:
    rng, task, simulated = np.random.default_rng(0), soup_task([("onion", "tomato")]), 0
    kitchens = [HALVES.with_cells({(0, 6): "T", (0, 2): "T"})] + [divided_kitchen(rng) for _ in range(150)]
    for layout, player in [(one, number) for one in kitchens for number in range(1, len(one.starts) + 1)]:
        reach = reach_of(layout, player)
        if not all(reach.named(place) for place in task.places):
            continue
        settings = {"slip": 0.3} if population == "planner" else {}
        walks = simulate_participants(
            layout, 2, rng, task=task, player=player, population=population, layout_name="k", **settings
        )
        simulated += 1
        mine = flooded(layout, layout.starts[player - 1])
        assert {(walk.start, frozenset(walk.candidates)) for walk in walks} <= goals_of(layout, task, player)
        assert {tuple(cell) for walk in walks for cell in walk.states[:-1].tolist()} <= mine
        assert all(walk.layout == layout for walk in walks)
    assert simulated > 20


def test_walkers_leave_a_shared_station_on_the_side_of_their_goal() -> None:
    rng = np.random.default_rng(0)
    walks = BoltzmannWalker().sample(HALVES, "pot@(2,4)", HALVES.named("onion"), 20, rng)
    assert {(walk.goal, walk.candidates, int(walk.states[0][1])) for walk in walks} == {
        ("onion@(1,0)", ("onion@(1,0)",), 3),
        ("onion@(1,5)", ("onion@(1,5)",), 5),
    }
    with pytest.raises(LayoutError, match=r"no path to 'onion@\(1,0\)' from row 2, column 6"):
        BoltzmannWalker().walk(HALVES, (2, 6), "onion@(1,0)", rng)


def two_players() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells, facing and hands of both players of ``HALVES``: each puts an onion into the pot and fetches something."""
    north_to_west = {"N": 0, "S": 1, "E": 2, "W": 3}
    right = [((2, 5), "W", 2), ((2, 5), "W", 0), ((3, 5), "S", 0), ((3, 5), "S", 5), ((3, 5), "S", 5)]
    left = [((2, 3), "E", 2), ((2, 3), "E", 0), ((2, 2), "W", 0), ((2, 1), "W", 0), ((1, 1), "N", 0)]
    right += [((3, 5), "S", 5)] * 2
    left += [((1, 1), "W", 0), ((1, 1), "W", 2)]
    cells = np.array([[a[0], b[0]] for a, b in zip(right, left, strict=True)])
    facing = np.array([[north_to_west[a[1]], north_to_west[b[1]]] for a, b in zip(right, left, strict=True)])
    held = np.array([[a[2], b[2]] for a, b in zip(right, left, strict=True)])
    return cells, facing, held


def test_each_player_of_a_recorded_game_has_their_own_candidates() -> None:
    cells, facing, held = two_players()
    seconds = np.arange(len(cells)) * 0.15
    first, second = trajectories(HALVES, cells, facing, held, seconds, participants=["a", "b"])
    assert (first.participant, first.start, first.goal) == ("a", "pot@(2,4)", "dish@(4,5)")
    assert (second.participant, second.start, second.goal) == ("b", "pot@(2,4)", "onion@(1,0)")
    for player, walk in ((1, first), (2, second)):
        scored = {row["goal"] for row in explain_layout(HALVES, ONIONS, player=player)}
        assert set(walk.candidates) == scored
        assert walk.layout == HALVES
    everything = trajectories(
        HALVES, cells, facing, held, seconds, participants=["a", "b"], valid_goals=lambda *_: list(HALVES.stations)
    )
    assert [set(walk.candidates) for walk in everything] == [set(first.candidates), set(second.candidates)]


def test_walkers_are_fitted_to_the_floor_of_their_own_half() -> None:
    rng, own = np.random.default_rng(3), []
    task = soup_task([("onion", "onion")])
    walks = {p: simulate_participants(SHARED, 6, rng, task=task, player=p, participant=str(p)) for p in (1, 2)}
    for player, mine in walks.items():
        alone = without(SHARED, player, floor_too=True)
        for walk in mine:
            renamed = {name: alone.station_at(SHARED.stations[name]) for name in walk.candidates}
            goal, names = renamed[walk.goal], tuple(renamed.values())
            own.append(replace(walk, layout=alone, goal=goal, candidates=names, start=""))
    both = [*walks[1], *walks[2]]
    assert fit_rationality(both) == fit_rationality(own)
    grid = {"depth": (2, 3), "turn_cost": (0.0, 0.5), "recency": (1.0,), "fade": (0.8,)}
    assert fit_planner(both, grid) == fit_planner(own, grid)


def test_the_running_game_has_the_goals_of_its_player() -> None:
    env = gym.make(
        "legible_envs:LegibleOvercooked-v0", shape=HALVES.shape, layout=HALVES.to_ascii(), recipes=[("onion",) * 3]
    )
    player, game = ScriptedPlayer(env, np.random.default_rng(0)), env.unwrapped
    obs, info = env.reset(seed=0)
    mine, seen, over = flooded(HALVES, HALVES.starts[0]), set(), False
    while not over:
        for row, col in np.argwhere(info["goal_mask"]).tolist():
            assert {(row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)} & mine
        seen |= set(game.goals)
        obs, _, terminated, truncated, info = env.step(player(obs, info))
        over = terminated or truncated
    assert info["deliveries"] == 1
    assert {name for name in seen if "counter" not in name} == set(reach_of(HALVES).stations)
    for candidate_set in ("game", "all"):
        walks = game.trajectories(candidate_set=candidate_set)
        assert len(walks) == 3  # the first has no start: the player begins beside no station
        assert {name for walk in walks for name in walk.candidates} == {"onion@(1,5)", "dish@(4,5)"}


def test_reach_from_a_cell() -> None:
    assert reach_from(HALVES, (3, 1)).stations == reach_of(HALVES, 2).stations
    assert reach_from(HALVES, (3, 1)).player is None
    assert reach_from(HALVES, (0, 0)).stations == ()
    assert reach_of(HALVES).access("pot@(2,4)") == ((2, 5),)
    assert reach_of(HALVES).access("onion@(1,0)") == ()
    assert reach_of(HALVES).kitchen.stations.keys() == {"onion", "serving", "pot@(2,4)", "pot@(3,4)", "dish"}
    whole = OvercookedWorkspace((5, 5), stations=("onion", "dish", "pot", "serving"), recipes=[("onion",)])
    layout = whole.decode(whole.sample(1, np.random.default_rng(0))[0])
    assert reach_of(layout).kitchen is layout
    with pytest.raises(LayoutError, match="a person at row 0, column 0: out of reach are"):
        reach_from(HALVES, (0, 0)).check_task(ONIONS)
