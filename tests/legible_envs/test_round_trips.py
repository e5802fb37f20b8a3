"""What a writer wrote its reader gives back, whatever things are called."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.layout_kinds import kind_of
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.human_play import Played, load_played
from legible_envs.overcooked.layout import SYMBOLS
from legible_envs.overcooked.recipes import PAPER_SOUPS
from legible_envs.rollouts import Trajectory, load_trajectories, save_trajectories, write_csv
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tasks import Subtask, TaskGraph
from tests.legible_envs.rollouts.hostile import HARD_NAMES, NAMES


def table(names: list[str]) -> TabletopLayout:
    objects = [TableObject(name, (0.15 + 0.12 * i, 0.3 + 0.1 * (i % 2))) for i, name in enumerate(names)]
    return TabletopLayout(objects, [VirtualObstacle((0.4, 0.2), 1 / 3)])


def survives_as_layout(layout: Any, folder: Path) -> None:
    kind = kind_of(layout)
    assert kind.from_text(kind.to_text(layout)) == layout
    assert kind.read_line(kind.line(layout)) == layout
    assert "\n" not in kind.line(layout)
    found = [Trajectory([(0.0, 1.0), (1.0, 1.0)], goal="a", candidates=("a",), layout=layout)]
    assert load_trajectories(write_csv(folder / "t.csv", found)) == found
    assert load_trajectories(save_trajectories(folder / "t.npz", found)) == found


@settings(max_examples=60, deadline=None)
@given(names=st.lists(NAMES, min_size=1, max_size=4, unique=True))
def test_tables_survive_with_any_names(names: list[str], tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("tables")
    layout = table(names)
    survives_as_layout(layout, folder)
    layout.to_json(folder / "table.json")
    assert TabletopLayout.from_json(folder / "table.json") == layout
    assert TabletopLayout.from_dict(json.loads(json.dumps(layout.to_dict()))) == layout


@pytest.mark.parametrize("name", HARD_NAMES)
def test_tasks_survive_with_any_names(tmp_path: Path, name: str) -> None:
    others = (name + "2", "x" + name)
    graph = TaskGraph(
        [
            Subtask(name, goals=(name,), then=(name + "2",)),
            Subtask(others[0], goals=others, after=(name,)),
            Subtask(others[1], goals=(others[1],), count=2),
        ],
        start=name + " start",
        groups={name + "g": (name, others[0])},
    )
    assert TaskGraph.from_yaml(graph.to_yaml(tmp_path / "task.yaml")) == graph
    assert TaskGraph.from_yaml(tmp_path / "task.yaml") == graph
    assert TaskGraph.from_dict(json.loads(json.dumps(graph.to_dict()))) == graph
    layout = table([name, others[0]])
    task = TabletopTask(name, layout, TaskGraph([Subtask(n, goals=(n,)) for n in (name, others[0])], start="home"))
    assert TabletopTask.from_yaml(task.to_yaml(tmp_path / "table.yaml")) == task
    assert TabletopTask.from_yaml(tmp_path / "table.yaml") == task


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), shape=st.tuples(st.integers(5, 9), st.integers(5, 9)))
def test_kitchens_survive(seed: int, shape: tuple[int, int], tmp_path_factory: pytest.TempPathFactory) -> None:
    workspace = OvercookedWorkspace(shape=shape)
    (genome,) = workspace.sample(1, np.random.default_rng(seed))
    survives_as_layout(workspace.decode(genome), tmp_path_factory.mktemp("kitchens"))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_kitchens_without_walls_survive(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Rows that begin and end with floor are blanks at the ends of lines."""
    height, width = data.draw(st.integers(3, 6)), data.draw(st.integers(3, 6))
    codes = st.sampled_from([0, 0, *range(len(SYMBOLS))])
    cells = np.array(data.draw(st.lists(codes, min_size=height * width, max_size=height * width)))
    cells[-1] = 0
    layout = OvercookedLayout(cells.reshape(height, width))
    assert OvercookedLayout.from_ascii(layout.to_ascii()) == layout
    survives_as_layout(layout, tmp_path_factory.mktemp("open"))


@settings(max_examples=30, deadline=None)
@given(actions=st.lists(st.integers(0, 5), max_size=30), seed=st.none() | st.integers(0, 2**63 - 1))
def test_recorded_play_survives(actions: list[int], seed: int | None, tmp_path_factory: pytest.TempPathFactory) -> None:
    layout = OvercookedLayout.from_ascii("XOTXX\nX   C\nX1  F\nP   D\nXXSXX")
    count = len(actions)
    played = Played(layout, PAPER_SOUPS, "soft", seed, np.array(actions, np.int8), np.arange(count, dtype=np.int32),
                    np.linspace(0, 1 / 3, count))  # fmt: skip
    path = tmp_path_factory.mktemp("play") / "me.npz"
    played.save(path)
    found = load_played(path)
    assert (found.layout, found.recipes, found.virtual_obstacles, found.seed) == (layout, PAPER_SOUPS, "soft", seed)
    for name in ("actions", "episodes", "rewards"):
        assert np.array_equal(getattr(found, name), getattr(played, name))
