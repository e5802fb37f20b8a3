"""Every kind of file that strangers may hand over: small valid ones, how each is read, and what it must be good for."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from legible_envs.errors import LayoutError, TaskError
from tests.reliability.mutations import as_toml, damage_arrays, damage_bytes, damage_data, npz_bytes

__all__ = ["FORMATS", "Format"]

KITCHEN = "XXPXX\nO1 2O\nX   X\nXDXSX"


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Attributes:
        suffix: Of its name.
        examples: Valid contents: data for text formats, arrays by name for ``.npz``, or bytes.
        write: Turns data into the bytes of a file; None where examples are bytes or arrays.
        use: Reads a file, and uses what it holds: written again and read it is equal, and whatever it promises works.
        errors: What ``use`` may raise.
        inner: Names of arrays that hold JSON, whose data are damaged, too.
    """

    suffix: str
    examples: tuple[Any, ...]
    write: Callable[[Any], bytes] | None
    use: Callable[[Path], object]
    errors: tuple[type[Exception], ...] = (ValueError,)
    inner: tuple[str, ...] = ()

    def whole(self, example: Any) -> bytes:
        """The bytes of a valid file."""
        if self.write is not None:
            return self.write(example)
        return npz_bytes(example) if isinstance(example, dict) else example

    @cached_property
    def wholes(self) -> tuple[bytes, ...]:
        """The bytes of all valid files, archives compressed and not."""
        plain = (npz_bytes(e, compressed=False) for e in self.examples if self.write is None and isinstance(e, dict))
        return (*map(self.whole, self.examples), *plain)

    def damaged(self, rng: random.Random) -> bytes:
        """The bytes of a damaged file."""
        example = rng.choice(self.examples)
        if rng.random() < 0.4 or isinstance(example, bytes):
            return damage_bytes(rng.choice(self.wholes), rng, self.wholes)
        if self.write is not None:
            return self.write(damage_data(example, rng))
        if self.inner and rng.random() < 0.5:
            name = rng.choice(self.inner)
            text = _text_of(example[name])
            return npz_bytes({**example, name: _like(example[name], _json(damage_data(json.loads(text), rng)))})
        return damage_arrays(example, rng)


def _json(data: Any) -> bytes:
    return json.dumps(data).encode("ascii")


def _text_of(array: Any) -> str:
    array = np.asarray(array)
    return str(array) if array.dtype.kind == "U" else array.tobytes().decode("ascii")


def _like(array: Any, content: bytes) -> Any:
    return content.decode() if np.asarray(array).dtype.kind == "U" else np.frombuffer(content, dtype=np.uint8)


def _arrays_of(write: Callable[[Path], object]) -> dict[str, Any]:
    """The arrays of an ``.npz`` that is written by ours."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.npz"
        write(path)
        with np.load(path) as file:
            return dict(file)


# -- tasks and layouts -------------------------------------------------------------------------------------------------

TASK = {
    "start": "home",
    "subtasks": [
        {"name": "a", "goals": ["x", "y"], "then": ["z"], "count": 2},
        {"name": "b", "goals": "y", "after": ["a"]},
    ],
    "groups": {"g": ["a"], "h": ["b"]},
    "max_open": 1,
}
TABLE = {
    "schema": 1,
    "table": {"size": [1.2, 0.8], "starts": {"home": [0.6, 0.05]}, "hand": 0.02},
    "objects": [
        {"name": "cup", "at": [0.3, 0.3], "size": [0.05, 0.04], "angle": 0.2, "colour": "red"},
        {"name": "pot", "at": [0.6, 0.5], "movable": False},
    ],
    "obstacles": [{"at": [0.45, 0.3], "angle": 1.5, "size": [0.1, 0.01]}],
}
TABLE_TASK = TABLE | {
    "name": "t",
    "configuration": {"cup": [1.0, 0.4]},
    "task": {"start": "home", "subtasks": [{"name": "a", "goals": ["cup"]}, {"name": "b", "goals": "pot"}]},
}


def use_task(path: Path) -> None:
    from legible_envs.tasks import TaskGraph

    graph = TaskGraph.from_yaml(path)
    assert abs(sum(stage.weight for stage in graph.stages()) - graph.length) < 1e-6 * graph.length
    assert TaskGraph.from_yaml(graph.to_yaml()) == graph


def use_table_task(path: Path) -> None:
    from legible_envs.tabletop import TabletopTask

    task = TabletopTask.from_yaml(path)
    task.layout.validate()
    assert task.graph.stages()
    assert TabletopTask.from_yaml(task.to_yaml()) == task


def use_table(path: Path) -> None:
    from legible_envs.tabletop import TabletopLayout

    layout = TabletopLayout.from_json(path)
    layout.is_valid()
    assert TabletopLayout.from_json(layout.to_json() + "\n") == layout


def use_kitchen(path: Path) -> None:
    from legible_envs.overcooked.kitchen_file import KitchenFile

    file = KitchenFile.read(path)
    again = KitchenFile.from_data(json.loads(json.dumps(file.to_dict())))
    assert (again.layout, again.recipes) == (file.layout, file.recipes)


# -- trajectories ------------------------------------------------------------------------------------------------------


def trajectories() -> list[Any]:
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.rollouts import Trajectory

    kitchen = OvercookedLayout.from_ascii(KITCHEN)
    about = {"participant": "p", "condition": "c"}
    return [
        Trajectory([(1, 1), (2, 1), (2, 2)], None, "serving", "pot", ("pot", "dish"), layout=kitchen, **about),
        Trajectory([(1, 1), (1, 2)], [0.0, 0.5], "pot", None, ("pot", "dish"), complete=False, **about),
    ]


def reaches() -> list[Any]:
    from legible_envs.rollouts import Trajectory
    from legible_envs.tabletop import TabletopLayout

    table = TabletopLayout.from_dict(TABLE)
    first = Trajectory([(0.6, 0.05), (0.5, 0.2), (0.3, 0.3)], None, "home", "cup", ("cup", "pot"), layout=table)
    second = Trajectory([(0.0, 0.0), (1.0, 1.0)], None, "home", "a", ("a", "b"), goal_positions=[(1, 1), (0, 1)])
    return [first, second]


def use_trajectories(path: Path) -> None:
    from legible_envs.rollouts import load_trajectories, save_trajectories

    found = load_trajectories(path)
    for each in found:
        if each.complete and each.num_states >= 2:
            each.prefix(0.5, "arc")
    again = load_trajectories(save_trajectories(path.with_name("again.npz"), found))
    assert [e for e in again if e.num_states] == [e for e in found if e.num_states]


def _csv(found: list[Any]) -> bytes:
    import tempfile

    from legible_envs.rollouts import write_csv

    with tempfile.TemporaryDirectory() as folder:
        return write_csv(Path(folder) / "t.csv", found).read_bytes()


def played() -> dict[str, Any]:
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.human_play import Played

    game = Played(
        OvercookedLayout.from_ascii(KITCHEN),
        (("onion", "onion", "onion"),),
        seed=3,
        actions=np.array([0, 4, 5, 1], np.int8),
        episodes=np.array([0, 0, 1, 1], np.int32),
        rewards=np.zeros(4),
    )
    return _arrays_of(game.save)


def use_played(path: Path) -> None:
    from legible_envs.overcooked.human_play import load_played

    game = load_played(path)
    again_path = path.with_name("again.npz")
    game.save(again_path)
    again = load_played(again_path)
    assert (again.layout, again.recipes, again.seed) == (game.layout, game.recipes, game.seed)
    assert all(np.array_equal(getattr(again, name), getattr(game, name)) for name in ("actions", "episodes", "rewards"))


def episodes() -> dict[str, Any]:
    def state(x: int, y: int, held: Any, objects: Any) -> dict[str, Any]:
        players = [
            {"position": [x, y], "orientation": [0, -1], "held_object": held},
            {"position": [3, 1], "orientation": [1, 0], "held_object": None},
        ]
        return {"players": players, "objects": objects, "all_orders": []}

    soup = {
        "name": "soup",
        "position": [2, 0],
        "_ingredients": [{"name": "onion"}],
        "cooking_tick": -1,
        "cook_time": 20,
    }
    onion = {"name": "onion", "position": [1, 1]}
    return {
        "ep_states": [[state(1, 1, None, []), state(1, 1, onion, [soup]), state(1, 2, None, [])]],
        "ep_actions": [[[[0, -1], [0, 0]], [[0, 1], "interact"], [[0, 0], [0, 0]]]],
        "ep_rewards": [[0, 20, 0]],
        "mdp_params": [{"layout_name": "room", "terrain": [list(row) for row in ["XXPXX", "O   O", "X   X", "XDXSX"]]}],
    }


def episode_rows() -> bytes:
    found = episodes()
    grid = json.dumps(found["mdp_params"][0]["terrain"])
    columns = "state,joint_action,reward,time_elapsed,cur_gameloop,layout,layout_name,trial_id,player_0_id,player_1_id"
    lines = [columns]
    for tick in range(3):
        state, action = (json.dumps(found[key][0][tick]) for key in ("ep_states", "ep_actions"))
        cells = [
            state,
            action,
            str(found["ep_rewards"][0][tick]),
            str(tick / 4),
            str(tick + 1),
            grid,
            "room",
            "7",
            "a",
            "b",
        ]
        lines.append(",".join('"' + cell.replace('"', '""') + '"' for cell in cells))
    return "\n".join(lines).encode()


def use_recording(path: Path) -> None:
    from legible_envs.datasets.overcooked_ai import check_replay, read_recording
    from legible_envs.datasets.overcooked_ai.games import RecordedGame

    for game in read_recording(path):
        assert isinstance(game, RecordedGame)
        check_replay(game)


def recorded_games() -> dict[str, Any]:
    import tempfile

    from legible_envs.datasets.overcooked_2019.games import write_games
    from legible_envs.datasets.overcooked_ai import read_recording

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "game.json"
        path.write_bytes(_json(episodes()))
        found = read_recording(path)
    return _arrays_of(lambda path: write_games(path, found))


def use_games(path: Path) -> None:
    from legible_envs.datasets.overcooked_2019.games import read_games
    from legible_envs.datasets.overcooked_ai import check_replay

    for game in read_games(path):
        check_replay(game)


# -- searches ----------------------------------------------------------------------------------------------------------


def use_archive(path: Path) -> None:
    from optimizers.archives import FIELDS, read_archive

    arrays = read_archive(path)
    assert len({len(arrays[name]) for name in FIELDS}) == 1
    assert np.isfinite(arrays["objective"]).all()


def network() -> dict[str, Any]:
    from predictors.neural.encoding import Encoding
    from predictors.neural.models import RecurrentPredictor

    found = trajectories()
    predictor = RecurrentPredictor(hidden_size=2, members=1)
    predictor.classes_ = np.array(["dish", "pot"])
    predictor.encoding_ = Encoding.learn(found)
    predictor.prior_ = np.array([0.5, 0.5])
    predictor.validation_loss_ = np.ones((3, 1))
    shape = (1, predictor.encoding_.width, 2)
    predictor.weights_ = predictor._network().initial_weights(*shape, np.random.default_rng(0))
    return _arrays_of(predictor.save)


def use_network(path: Path) -> None:
    from predictors.neural.models import RecurrentPredictor

    predictor = RecurrentPredictor.load(path)
    known = set(predictor.classes_.tolist())
    found = [each for each in trajectories() if set(each.candidates) <= known]
    if predictor.encoding_.grid and found:
        with np.errstate(all="ignore"):
            probabilities = predictor.predict_proba(found)
        assert probabilities.shape == (len(found), len(known))
    again = RecurrentPredictor.load(predictor.save(path.with_name("again.npz")))
    assert again.get_params() == predictor.get_params()


SWEEP = {
    "name": "s",
    "seeds": 2,
    "evaluations": [100],
    "objectives": ["legibility"],
    "workspaces": [{"workspace": "overcooked", "label": "w", "shape": [5, 5], "people": {"participants": 3}}],
    "emitters": ["improve", {"emitter": "random", "batch_size": 8}],
    "predictors": [],
}


def use_sweep(path: Path) -> None:
    """All but building what the entries name, which belongs to them and takes seconds."""
    from unittest import mock

    from benchmarks.sweeps.sweep import Sweep

    with mock.patch.object(Sweep, "_check"):
        plan = Sweep.from_toml(path)
    for variant, _ in zip(plan.variants(), range(20), strict=False):
        json.dumps(variant.trial, allow_nan=False)


EVALUATION = {
    "schema": 1,
    "definition": "accuracy",
    "walks": 3,
    "participants": 2,
    "summary": [{"predictor": "a", "accuracy": 0.5}, {"predictor": "b", "accuracy": None}],
    "comparisons": [{"what": "predictor", "verdict": "none", "pairs": [{"a": "a", "b": "b", "difference": 0.1}]}],
    "notes": ["x"],
}


def use_evaluation(path: Path) -> None:
    from benchmarks.reports.prediction_report import evaluation_section

    path.rename(path.with_name("reading.json"))
    if evaluation_section(path.parent) is None:
        raise ValueError("a report leaves it out")


def _formats() -> dict[str, Callable[[], Format]]:
    from benchmarks.sweeps.sweep import SweepError
    from legible_envs.datasets.overcooked_ai.games import RecordingsError
    from optimizers.errors import SearchError

    kitchens = (
        KITCHEN.encode(),
        b"WWPWW\nOA AO\nW   W\nWBWXW",
        b'{"grid": """XXPXX\n  O1 2O\n  X   X\n  XDXSX""", "start_order_list": ["onion", "any"], "cook_time": 20}  # x',
    )
    kitchen_data = (
        {"rows": KITCHEN.split("\n"), "recipes": [["onion", "onion"], ["tomato"]]},
        KITCHEN.split("\n"),
        {"grid": KITCHEN, "start_all_orders": [{"ingredients": ["onion"]}], "order_bonus": 2.0},
        {"height": 4, "width": 5, "wall_idx": [0, 1, 3, 4, 9], "agent_idx": [6], "goal_idx": [18], "pot_idx": [2]},
    )
    archive = {
        "solution": np.arange(6, dtype=np.int64).reshape(2, 3),
        "objective": np.array([0.5, 1.5]),
        "measures": np.zeros((2, 2)),
        "index": np.array([3, 9], dtype=np.int32),
    }
    csv = (RecordingsError,)
    return {
        "task YAML": lambda: Format(".yaml", (TASK,), _json, use_task, (TaskError,)),
        "table task YAML": lambda: Format(".yaml", (TABLE_TASK,), _json, use_table_task, (TaskError, LayoutError)),
        "table JSON": lambda: Format(".json", (TABLE,), _json, use_table, (LayoutError,)),
        "kitchen text": lambda: Format(".layout", kitchens, None, use_kitchen, (LayoutError,)),
        "kitchen JSON": lambda: Format(".json", kitchen_data, _json, use_kitchen, (LayoutError,)),
        "trajectory npz": lambda: Format(
            ".npz",
            tuple(_saved(found) for found in (trajectories(), reaches())),
            None,
            use_trajectories,
            inner=("records",),
        ),
        "trajectory CSV": lambda: Format(".csv", (_csv(trajectories()), _csv(reaches())), None, use_trajectories),
        "recorded play npz": lambda: Format(".npz", (played(),), None, use_played, inner=("about",)),
        "recorded games npz": lambda: Format(".npz", (recorded_games(),), None, use_games, csv),
        "Overcooked-AI JSON": lambda: Format(".json", (episodes(),), _json, use_recording, csv),
        "Overcooked-AI CSV": lambda: Format(".csv", (episode_rows(),), None, use_recording, csv),
        "archive npz": lambda: Format(".npz", (archive,), None, use_archive, (SearchError,)),
        "network npz": lambda: Format(".npz", (network(),), None, use_network, inner=("config",)),
        "sweep TOML": lambda: Format(".toml", (SWEEP,), as_toml, use_sweep, (SweepError,)),
        "evaluation JSON": lambda: Format(".json", (EVALUATION,), _json, use_evaluation),
    }


def _saved(found: list[Any]) -> dict[str, Any]:
    from legible_envs.rollouts import save_trajectories

    return _arrays_of(lambda path: save_trajectories(path, found))


FORMATS = _formats()
