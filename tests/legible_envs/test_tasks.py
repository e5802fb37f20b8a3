"""Task graphs: exact counts and weights against brute force over all orderings."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import TaskError
from legible_envs.overcooked import soup_task
from legible_envs.tasks import Subtask, TaskGraph


def orderings(task: TaskGraph):
    """Every valid sequence, each as a list of subtask names with copies numbered; by trying all permutations."""
    copies = [(s, i) for s in task.subtasks for i in range(s.count)]
    group_of = {member: g for g, members in task.groups.items() for member in members}
    sizes = Counter(group_of[s.name] for s, _ in copies if s.name in group_of)
    for permutation in itertools.permutations(copies):
        done: Counter = Counter()
        begun: Counter = Counter()
        for subtask, _ in permutation:
            if any(done[before] < b.count for before in subtask.after for b in task.subtasks if b.name == before):
                break
            done[subtask.name] += 1
            if subtask.name in group_of:
                begun[group_of[subtask.name]] += 1
            still_open = sum(0 < begun[g] < sizes[g] for g in sizes)
            closing = subtask.name in group_of and begun[group_of[subtask.name]] == sizes[group_of[subtask.name]]
            if task.max_open is not None and still_open + closing > task.max_open:
                break
        else:
            yield [s for s, _ in permutation]


def brute_force(task: TaskGraph):
    """Number of sequences, and expected visits of each stage, when every subtask has one goal."""
    sequences = list(orderings(task))
    visits: dict = defaultdict(float)
    prefixes = defaultdict(set)
    for sequence in sequences:
        for i, subtask in enumerate(sequence):
            prefixes[tuple(s.name for s in sequence[:i])].add(subtask.goals[0])
    for sequence in sequences:
        place = task.start
        for i, subtask in enumerate(sequence):
            visits[place, tuple(sorted(prefixes[tuple(s.name for s in sequence[:i])]))] += 1 / len(sequences)
            place = subtask.then[-1] if subtask.then else subtask.goals[0]
    return len(sequences), dict(visits)


@st.composite
def tasks(draw) -> TaskGraph:
    n = draw(st.integers(1, 5))
    subtasks = []
    for i in range(n):
        after = tuple(f"s{j}" for j in range(i) if draw(st.booleans()) and draw(st.booleans()))
        then = draw(st.sampled_from([(), ("pot",), ("pot", "serving")]))
        goal = draw(st.sampled_from(["red", "green", "blue"]))
        count = draw(st.integers(1, 2)) if i < 2 else 1
        subtasks.append(Subtask(f"s{i}", (goal,), after, then, count))
    groups = {}
    if n >= 4 and draw(st.booleans()):
        groups = {"left": ["s0", "s2"], "right": ["s1", "s3"]}
    return TaskGraph(subtasks, "home", groups, draw(st.sampled_from([None, 2])) if groups else None)


@given(tasks())
@settings(max_examples=60, deadline=None)
def test_counts_and_weights_equal_brute_force(task):
    number, visits = brute_force(task)
    assert task.num_sequences == number
    stages = {(s.start, s.goals): s.weight for s in task.stages()}
    assert stages.keys() == visits.keys()
    for key, weight in visits.items():
        assert stages[key] == pytest.approx(weight, rel=1e-9)


def test_one_group_at_a_time_equals_brute_force():
    groups = {"a": ["a1", "a2"], "b": ["b1", "b2"]}
    subtasks = [
        Subtask(name, (name,), after=(name[0] + "1",) if name[1] == "2" else ()) for g in groups.values() for name in g
    ]
    task = TaskGraph(subtasks, "home", groups, max_open=1)
    number, visits = brute_force(task)
    assert task.num_sequences == number == 2
    assert {(s.start, s.goals): s.weight for s in task.stages()} == pytest.approx(visits)


@pytest.mark.parametrize(
    ("pots", "sequences", "states", "stages", "pairs"),
    [(None, 7_484_400, 339, 50, 33.526887926887916), (1, 1_296, 60, 14, 19.0)],
)
def test_the_papers_soups(pots, sequences, states, stages, pairs):
    task = soup_task(pots=pots)
    assert (task.num_sequences, task.num_states, len(task.stages())) == (sequences, states, stages)
    assert sum(s.weight * len(s.goals) for s in task.stages()) == pytest.approx(pairs, abs=1e-12)
    assert sum(s.weight for s in task.stages()) == pytest.approx(12)


def test_two_columns_of_cubes():
    first = [f"a{i}" for i in range(4)]
    cubes = [Subtask(name, (name,), then=("assembly",)) for name in first]
    cubes += [Subtask(f"b{i}", (f"b{i}",), after=tuple(first), then=("assembly",)) for i in range(4)]
    task = TaskGraph(cubes, "home")
    assert (task.num_sequences, task.num_states, len(task.stages())) == (576, 31, 30)
    assert sum(s.weight * len(s.goals) for s in task.stages()) == pytest.approx(20)


def test_legs_count_every_walk():
    legs = soup_task().legs()
    assert legs["dish", "pot"] == pytest.approx(3)
    assert legs["pot", "serving"] == pytest.approx(3)
    assert legs["onion", "pot"] == pytest.approx(3)
    assert sum(n for (a, _), n in legs.items() if a in ("pot", "serving")) == pytest.approx(12 + 3)
    transitions = soup_task().transitions()
    assert sum(t.weight for t in transitions if t.goal == "fish") == pytest.approx(3)


def test_several_goals_share_a_subtask():
    task = TaskGraph([Subtask("take", ("left", "right")), Subtask("leave", ("door",), after=("take",))], "home")
    assert task.num_sequences == 1
    weights = {(s.start, s.goals): s.weight for s in task.stages()}
    assert weights == {("home", ("left", "right")): 1.0, ("left", ("door",)): 0.5, ("right", ("door",)): 0.5}


@given(tasks())
@settings(max_examples=30, deadline=None)
def test_yaml_round_trip(task):
    again = TaskGraph.from_yaml(task.to_yaml())
    assert again == task
    assert hash(again) == hash(task)
    assert again.stages() == task.stages()


def test_yaml_file_and_hand_written_text(tmp_path):
    path = tmp_path / "tea.yaml"
    task = soup_task(pots=1)
    task.to_yaml(path)
    assert TaskGraph.from_yaml(path) == TaskGraph.from_yaml(str(path)) == task
    text = """
start: home
subtasks:
  - {name: cup, goals: cup, then: table}
  - {name: milk, goals: [milk], after:, count: 2}
"""
    read = TaskGraph.from_yaml(text)
    assert read.num_sequences == 6
    assert read.subtasks[0].then == ("table",)


def test_networkx_export():
    import networkx as nx

    graph = soup_task().to_networkx()
    assert nx.is_directed_acyclic_graph(graph)
    assert graph.nodes["soup 1: tomato"] == {
        "goals": ("tomato",),
        "then": ("pot",),
        "count": 2,
        "agents": ("human", "robot"),
        "group": "soup 1",
    }
    assert set(graph.predecessors("soup 2: serve")) == {"soup 2: onion", "soup 2: cabbage"}


TASK = {"start": "s", "subtasks": [{"name": "a", "goals": "x"}]}

ALIASES = "\n".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 8)}]" for a, b in zip("abcdefgh", "bcdefghi", strict=True))


def test_a_single_name_stands_for_a_list_and_null_for_nothing():
    data = {"start": "s", "subtasks": [{"name": "a", "goals": ["x"]}], "groups": {"g": ["a"]}}
    text = "start: s\nsubtasks:\n- name: a\n  goals: x\n  after:\n  then:\n  count:\ngroups: {g: a}\nmax_open:"
    assert TaskGraph.from_yaml(text) == TaskGraph.from_dict(data) == TaskGraph.from_dict({**data, "groups": {"g": "a"}})
    assert TaskGraph.from_dict({**data, "subtasks": ({"name": "a", "goals": ("x",)},)}) == TaskGraph.from_dict(data)


def test_messages_about_files_begin_with_their_path(tmp_path):
    path = tmp_path / "task.yaml"
    path.write_text("start: s\nsubtasks: [{name: a, goals: 0}]")
    with pytest.raises(TaskError, match=r"task\.yaml: the task: `subtasks\[0\].goals` must be"):
        TaskGraph.from_yaml(path)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            lambda: TaskGraph([Subtask("a", ("x",), ("b",)), Subtask("b", ("y",), ("a",))], "s"),
            "(a waits for b waits for a|b waits for a waits for b)",
        ),
        (lambda: TaskGraph([Subtask("a", ("x",), ("ghost",))], "s"), r"'a' waits for unknown subtasks \['ghost'\]"),
        (lambda: TaskGraph([Subtask("a", ("x",)), Subtask("a", ("y",))], "s"), r"repeated: \['a'\]"),
        (lambda: TaskGraph([], "s"), "at least one"),
        (lambda: TaskGraph([Subtask("a", ("x",))], ""), "start"),
        (lambda: TaskGraph([Subtask("a", ("x",))], "s", {"g": ["b"]}), "unknown subtask 'b'"),
        (lambda: TaskGraph([Subtask("a", ("x",))], "s", {"g": ["a"], "h": ["a"]}), "in group 'g' and in group 'h'"),
        (lambda: TaskGraph([Subtask("a", ("x",))], "s", max_open=0), "max_open"),
        (lambda: TaskGraph([Subtask("a", ("x",))], "s", max_open=True), "max_open"),
        (lambda: Subtask("a", ()), "no goals"),
        (lambda: Subtask("a", ("x", "x")), "twice"),
        (lambda: Subtask("a", ("x",), count=0), "count"),
        (lambda: Subtask("a", 5), "subtask 'a': `goals` must hold non-empty names, got 5"),
        (lambda: Subtask("a", ("b",), after=None), "`after` must hold non-empty names, got None"),
        (lambda: TaskGraph(None, "s"), "`subtasks` must be a list of Subtask"),
        (lambda: TaskGraph(["a"], "s"), "entry 1 of `subtasks` must be a Subtask, got 'a'"),
        (lambda: TaskGraph([Subtask("a", ("b",))], "s", groups=[1]), "`groups` must map group names"),
        (lambda: TaskGraph([Subtask("a", ("b",))], "s", groups={"g": 3}), "group 'g' of `groups` must hold non-empty"),
        (lambda: TaskGraph.from_yaml("start: [unclosed"), "not valid YAML"),
        (lambda: TaskGraph.from_yaml("just text"), "must be a mapping"),
        (lambda: TaskGraph.from_dict({"start": "s"}), "the task lacks the key `subtasks`"),
        (
            lambda: TaskGraph.from_dict({"start": "s", "subtasks": [{"name": "a", "goals": "x", "befor": []}]}),
            "'befor'; known: name",
        ),
        (lambda: TaskGraph.from_dict({"start": "s", "subtasks": "a"}), "`subtasks` must be a list, got 'a'"),
        (
            lambda: TaskGraph.from_dict(TASK | {"groups": {"g": -1}}),
            "`groups.g` must be a text or a list of texts, got -1",
        ),
        (
            lambda: TaskGraph.from_dict({"start": "s", "subtasks": [{"name": None, "goals": "x"}]}),
            "lacks the key `name`",
        ),
        (
            lambda: TaskGraph.from_dict({"start": "s", "subtasks": [{"name": "a", "goals": 0}]}),
            r"`subtasks\[0\].goals`",
        ),
        (
            lambda: TaskGraph.from_dict({"start": "s", "subtasks": [{"name": "a", "goals": "x", "count": 10**200}]}),
            r"`subtasks\[0\].count` must be an integer from 1 to 1000, got 1000",
        ),
        (
            lambda: TaskGraph.from_dict({"start": "s", "subtasks": TASK["subtasks"] * 129}),
            "`subtasks` must have at most 128 entries, got 129",
        ),
        (
            lambda: TaskGraph.from_yaml("a: &a [x, x, x, x, x, x, x, x]\n" + ALIASES),
            "more than 100,000 values, aliases unfolded",
        ),
    ],
)
def test_bad_tasks_are_named(build, message):
    with pytest.raises(TaskError, match=message):
        build()


def test_groups_and_precedence_that_contradict_are_rejected():
    # b1 waits for a1, a2 waits for b1: group a cannot be finished before b begins.
    subtasks = [
        Subtask("a1", ("x",)),
        Subtask("b1", ("y",), ("a1",)),
        Subtask("b2", ("y",)),
        Subtask("a2", ("x",), ("b1",)),
    ]
    with pytest.raises(TaskError, match="no valid sequence"):
        TaskGraph(subtasks, "s", {"a": ["a1", "a2"], "b": ["b1", "b2"]}, max_open=1)


def test_dead_ends_are_no_valid_goals():
    # Starting with b1 leads nowhere under max_open=1, so b1's goal is never valid at the beginning.
    subtasks = [Subtask("a1", ("x",)), Subtask("b1", ("y",)), Subtask("b2", ("z",), ("a1",))]
    task = TaskGraph(subtasks, "s", {"a": ["a1"], "b": ["b1", "b2"]}, max_open=1)
    first = next(s for s in task.stages() if s.start == "s")
    assert first.goals == ("x",)
    assert task.num_sequences == 2  # a1 b1 b2 and a1 b2 b1


def test_recipes_are_checked():
    with pytest.raises(TaskError, match="contained in"):
        soup_task([("onion",), ("onion", "onion")])
    with pytest.raises(TaskError, match="recipe 1"):
        soup_task([("beans",)])
    with pytest.raises(TaskError, match="at least one recipe"):
        soup_task([])
    assert soup_task([("onion",)] * 2).num_sequences == 6
