"""Tasks of heterogeneous teams: stages of the person's steps alone, against brute force over all orderings."""

from __future__ import annotations

import math
import pickle
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import TaskError
from legible_envs.legibility import task_legibility
from legible_envs.overcooked import OvercookedLayout, OvercookedScorer, OvercookedWorkspace, reach_of, soup_task
from legible_envs.overcooked.humans import simulate_participants
from legible_envs.overcooked.scoring.explanation import grid_graph, layout_distance
from legible_envs.tasks import AGENTS, Subtask, TaskGraph
from tests.oracles.task_oracle import TaskOracle


@st.composite
def team_tasks(draw) -> TaskGraph:
    """Up to five subtasks, up to seven steps; the first can be the person's."""
    n = draw(st.integers(1, 5))
    subtasks = []
    for i in range(n):
        after = tuple(f"s{j}" for j in range(i) if draw(st.integers(0, 3)) == 0)
        then = draw(st.sampled_from([(), (), ("pot",), ("pot", "serving")]))
        goals = tuple(draw(st.lists(st.sampled_from(["red", "green", "blue"]), min_size=1, max_size=2, unique=True)))
        agents = draw(st.sampled_from([AGENTS, ("human",), ("robot",)] if i else [AGENTS, ("human",)]))
        subtasks.append(Subtask(f"s{i}", goals, after, then, draw(st.integers(1, 2)) if i < 2 else 1, agents))
    groups, max_open = {}, None
    if n >= 4 and draw(st.booleans()):
        groups, max_open = {"left": ["s0", "s2"], "right": ["s1", "s3"]}, draw(st.sampled_from([None, 1, 2]))
    try:
        return TaskGraph(subtasks, "home", groups, max_open)
    except TaskError:  # groups and precedence contradict each other
        return TaskGraph(subtasks, "home")


@given(team_tasks())
@settings(max_examples=120, deadline=None)
def test_counts_stages_and_transitions_equal_brute_force(task):
    oracle = TaskOracle(task)
    stages, transitions = oracle.visits()
    assert task.num_sequences == len(oracle.sequences)
    found = {(s.start, s.goals): s.weight for s in task.stages()}
    assert found == pytest.approx({key: float(weight) for key, weight in stages.items()}, rel=1e-12)
    found = {(t.start, t.goals, t.goal, t.then): t.weight for t in task.transitions()}
    assert found == pytest.approx({key: float(weight) for key, weight in transitions.items()}, rel=1e-12)
    assert math.fsum(s.weight for s in task.stages()) == pytest.approx(task.num_choices)
    assert sum(stages.values()) == task.num_choices


@given(team_tasks(), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_a_sampled_person_makes_transitions_of_the_task_and_no_other(task, seed):
    steps = task.sample(np.random.default_rng(seed))
    known = {(t.start, t.goals, t.goal, t.then) for t in task.transitions()}
    assert {(t.start, t.goals, t.goal, t.then) for t in steps} <= known
    assert len(steps) == task.num_choices
    place = task.start
    for step in steps:
        assert step.start == place
        assert set(step.goals) <= set(task.goals_of("human"))
        place = step.then[-1] if step.then else step.goal


def test_samples_are_as_frequent_as_weights_say():
    task = soup_task([("onion", "fish"), ("tomato",)], agents={"fish": "robot"})
    rng, n = np.random.default_rng(4), 1500
    counts = Counter((t.start, t.goals, t.goal, t.then) for _ in range(n) for t in task.sample(rng))
    for t in task.transitions():
        sd = math.sqrt(n * t.weight) + 1
        assert abs(counts[t.start, t.goals, t.goal, t.then] - n * t.weight) < 5 * sd


@given(team_tasks())
@settings(max_examples=60, deadline=None)
def test_round_trips(task):
    for again in (TaskGraph.from_yaml(task.to_yaml()), TaskGraph.from_dict(task.to_dict())):
        assert again == task
        assert hash(again) == hash(task)
    again = pickle.loads(pickle.dumps(task))
    assert (again, again.stages()) == (task, task.stages())
    assert eval(repr(task.subtasks)) == task.subtasks


def test_agents_make_tasks_differ_but_not_their_order():
    one = Subtask("a", ("x",), agents=["robot", "human"])
    assert one == Subtask("a", ("x",))
    assert one.agents == AGENTS
    assert Subtask("a", ("x",), agents="human") != one
    task = TaskGraph([one], "s")
    assert task != TaskGraph([replace(one, agents=("human",))], "s")
    assert "agents" not in task.to_yaml()


def test_yaml_by_hand():
    text = """
start: serving
subtasks:
  - {name: fish, goals: fish, then: pot, count: 3, agents: robot}
  - {name: onion, goals: onion, then: pot, agents: [robot, human]}
  - {name: serve, goals: dish, then: [pot, serving], after: [fish, onion], agents:}
"""
    task = TaskGraph.from_yaml(text)
    assert [s.agents for s in task.subtasks] == [("robot",), AGENTS, AGENTS]
    assert [(s.start, s.goals, s.weight) for s in task.stages()] == [
        ("pot", ("dish",), 1.0),
        ("serving", ("onion",), 1.0),
    ]
    assert (task.num_sequences, task.length, task.num_choices) == (24, 5, 2)
    assert task.to_networkx().nodes["fish"]["agents"] == ("robot",)


def test_what_the_robot_does_unlocks_what_waits_for_it():
    # The person chooses between b and what the robot's step frees, in half of the orders in which that comes first.
    task = TaskGraph([Subtask("r", ("fish",), agents="robot"), Subtask("a", ("a",), ("r",)), Subtask("b", ("b",))], "s")
    assert {(s.start, s.goals): s.weight for s in task.stages()} == pytest.approx(
        {("s", ("b",)): 1 / 3, ("s", ("a", "b")): 2 / 3, ("a", ("b",)): 1 / 3, ("b", ("a",)): 2 / 3}
    )


def test_who_can_do_what():
    task = soup_task([("fish", "onion")], agents={"fish": "robot", "dish": ["human"]})
    assert task.goals == ("dish", "fish", "onion")
    assert task.goals_of("human") == ("dish", "onion")
    assert task.places_of("human") == ("dish", "onion", "pot", "serving")
    assert task.goals_of("robot") == ("fish", "onion")
    assert task.places_of("robot") == ("fish", "onion", "pot")
    assert [s.name for s in task.reserved_for("robot")] == ["soup 1: fish"]
    assert [s.name for s in task.reserved_for("human")] == ["soup 1: serve"]
    assert not any("fish" in pair for pair in task.legs())
    with pytest.raises(TaskError, match="`agent` must be 'human' or 'robot', got 'dog'"):
        task.goals_of("dog")


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Subtask("a", ("x",), agents=()), "'a': `agents` names nobody"),
        (
            lambda: Subtask("a", ("x",), agents=("human", "dog")),
            r"'a': `agents` must be some of \['human', 'robot'\], g",
        ),
        (lambda: Subtask("a", ("x",), agents=("human", "human")), "names an agent twice"),
        (lambda: Subtask("a", ("x",), agents=None), "`agents` must hold non-empty names, got None"),
        (lambda: Subtask("a", ("x",), agents={"human": 1}), "`agents` must hold non-empty names"),
        (
            lambda: TaskGraph([Subtask("a", ("x",), agents="robot"), Subtask("b", ("y",), agents="robot")], "s"),
            r"the person can perform no subtask of the task.*\['robot'\]; expected 'human'",
        ),
        (
            lambda: TaskGraph([Subtask("a", ("x",), ("b",), agents="robot"), Subtask("b", ("y",), ("a",))], "s"),
            "cycle",
        ),
        (
            lambda: TaskGraph.from_yaml("start: s\nsubtasks: [{name: a, goals: x, agents: []}]"),
            r"`subtasks\[0\].agents` must have at least 1 entr",
        ),
        (
            lambda: TaskGraph.from_yaml("start: s\nsubtasks: [{name: a, goals: x, agents: dog}]"),
            "subtask 'a': `agents` must be some of",
        ),
        (
            lambda: soup_task(agents={"beans": "robot"}),
            "`agents` names 'beans', which is not fetched; expected some of",
        ),
        (lambda: soup_task([("onion",)], agents={"fish": "robot"}), r"expected some of \['onion', 'dish'\]"),
        (lambda: soup_task(agents=["fish"]), "`agents` must map what is fetched"),
        (lambda: soup_task([("fish",)], agents={"fish": "robot", "dish": "robot"}), "can perform no subtask"),
    ],
)
def test_bad_agents_are_named(build, message):
    with pytest.raises(TaskError, match=message):
        build()


KITCHEN = """
XTXXCXX
X     X
O     D
X     X
X     F
X     X
XXPXSXX
""".strip()

TEAM = soup_task(agents={"fish": "robot"})


def test_a_kitchen_is_scored_for_what_the_person_may_do():
    kitchen = OvercookedLayout.from_ascii(KITCHEN)
    workspace = OvercookedWorkspace(task=TEAM)
    genome = workspace.encode(kitchen)[None]
    by_definition = task_legibility(grid_graph(kitchen), TEAM, workspace.observer)
    assert workspace.legibility(genome)[0] == pytest.approx(by_definition, abs=1e-9)
    assert workspace.distance(genome)[0] == pytest.approx(layout_distance(kitchen, TEAM))
    result = OvercookedScorer(TEAM).score_layout(kitchen)
    assert result["score"] == pytest.approx(by_definition, abs=1e-9)
    assert result["normalised"] <= 1
    assert not any("fish" in row["goals"] for row in workspace.explain(genome[0]))
    again = OvercookedWorkspace(task=TEAM.to_dict())
    assert again.task == TEAM


def test_only_what_the_person_does_must_be_in_their_reach():
    task = soup_task([("fish", "onion")], agents={"fish": "robot"})
    person = reach_of(OvercookedLayout.from_rows(["XOXXXFX", "X1 P 2X", "XSDXXXX"]))
    assert person.out_of_reach == ("fish",)
    person.check_task(task)
    assert OvercookedScorer(task).score_layout(person.layout)["out_of_reach"] == ["fish"]
    with pytest.raises(ValueError, match="out of reach is the fish station"):
        person.check_task(soup_task([("fish", "onion")]))
    with pytest.raises(ValueError, match="needs a fish station"):
        reach_of(OvercookedLayout.from_rows(["XOXXXXX", "X1    X", "XSDPXXX"])).check_task(task)


def test_simulated_people_go_nowhere_that_only_the_robot_may():
    kitchen = OvercookedLayout.from_ascii(KITCHEN)
    walks = simulate_participants(kitchen, 3, np.random.default_rng(0), task=TEAM)
    assert len(walks) == 3 * TEAM.num_choices
    assert Counter(w.goal for w in walks) == {"onion": 9, "tomato": 6, "cabbage": 3, "dish": 9}
    assert not any("fish" in w.candidates for w in walks)
