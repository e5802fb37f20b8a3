"""Pickles as the pandas of 2019 wrote them, made without it, and published-looking tables of simulated games."""

from __future__ import annotations

import io
import pickle
import tarfile
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.replay import GameArrays, predict_transitions

DIRECTIONS = ([0, -1], [0, 1], [1, 0], [-1, 0], [0, 0], "INTERACT")
ITEM_NAMES = {2: "onion", 5: "dish", 6: "soup"}
ROOM = OvercookedLayout.from_ascii("XXPXX\nO  2O\nX1  X\nXDXSX")
HALL = OvercookedLayout.from_ascii("XXPPX\nX   S\nD12 X\nXOOXX")


def named(module: str, name: str) -> Any:
    """Something that pickles as the global ``module.name``."""
    return type(name, (), {"__module__": module, "__qualname__": name})


class Call:
    """Something that pickles as a call of a global, followed by setting the result's state."""

    def __init__(self, function: Any, *args: Any, state: Any = None) -> None:
        self.parts = (function, args) if state is None else (function, args, state)

    def __reduce__(self) -> Any:
        return self.parts


class _Pickler(pickle._Pickler):  # type: ignore[name-defined,misc]
    """Writes globals by name without looking whether they exist."""

    dispatch: ClassVar[dict[Any, Any]] = dict(pickle._Pickler.dispatch)  # type: ignore[attr-defined]

    def save_global(self, obj: Any, name: str | None = None) -> None:
        self.write(pickle.GLOBAL + f"{obj.__module__}\n{obj.__qualname__}\n".encode())
        self.memoize(obj)

    dispatch[type] = save_global

    def save_reduce(self, func: Any, args: Any, state: Any = None, *rest: Any, **more: Any) -> None:
        super().save_reduce(func, args, state, *rest, **{**more, "obj": more.get("obj")})


def dumps(value: Any) -> bytes:
    """Pickle with the globals that ``named`` and ``Call`` stand for."""
    file = io.BytesIO()
    _Pickler(file, protocol=4).dump(value)
    return file.getvalue()


def array(values: Any, dtype: str) -> Call:
    """A numpy array as its ``__reduce__`` describes it."""
    reconstruct = named("numpy.core.multiarray", "_reconstruct")
    order = ("|" if dtype in ("O8", "b1") else "<", None, None, None, -1, -1, 0)
    kind = Call(named("numpy", "dtype"), dtype, 0, 1, state=(3, *order))
    if dtype == "O8":
        shape, data = np.shape(values), [item for row in values for item in (row if np.ndim(values) > 1 else [row])]
    else:
        flat = np.asarray(values, dtype={"b1": np.bool_, "i8": np.int64, "f8": np.float64}[dtype])
        shape, data = flat.shape, flat.tobytes()
    return Call(reconstruct, named("numpy", "ndarray"), (0,), b"b", state=(1, shape, kind, False, data))


def table_pickle(columns: Mapping[str, Sequence[Any]], index: Any = None) -> bytes:
    """A pickled table: a block of floats, one of integers, one of texts."""
    new_index = named("pandas.core.indexes.base", "_new_Index")
    groups = {
        dtype: [name for name, values in columns.items() if type(values[0]) is kind]
        for dtype, kind in (("f8", float), ("i8", int), ("O8", str))
    }
    names = list(columns)
    count = len(next(iter(columns.values())))
    axes = [
        Call(new_index, named("pandas.core.indexes.base", "Index"), {"data": array(names, "O8"), "name": None}),
        index
        or Call(
            new_index,
            named("pandas.core.indexes.numeric", "Int64Index"),
            {"data": array(np.arange(count), "i8"), "name": None},
        ),
    ]
    blocks = [
        {
            "values": array([list(columns[name]) for name in group], dtype),
            "mgr_locs": array([names.index(name) for name in group], "i8"),
        }
        for dtype, group in groups.items()
        if group
    ]
    manager = Call(
        named("pandas.core.internals.managers", "BlockManager"),
        state=(axes, [], [], {"0.14.1": {"axes": axes, "blocks": blocks}}),
    )
    frame = Call(
        named("pandas.core.frame", "DataFrame"), state={"_data": manager, "_typ": "dataframe", "_metadata": []}
    )
    return dumps(frame)


def simulated_table(layout: OvercookedLayout, name: str, pairs: Sequence[int], ticks: int, seed: int) -> dict[str, Any]:
    """Random play by the 2019 rules, written down as the published tables are."""
    rng = np.random.default_rng(seed)
    rows: dict[str, list[Any]] = {}
    for pair in pairs:
        state = _first(layout)
        for tick in range(ticks):
            # Mostly interacting and moving, so that pots fill and soups are cooked.
            action = rng.choice(6, size=2, p=[0.15, 0.15, 0.15, 0.15, 0.05, 0.35])
            after, rewards = predict_transitions(layout, state, action[None])
            after = after._replace(delivered=None)
            row = {
                "state": str(_published(layout, state)),
                "next_state": str(_published(layout, after)),
                "joint_action": str([DIRECTIONS[a] for a in action]),
                "layout": str(layout.to_ascii().split("\n")),
                "layout_name": name,
                "run": "run-1",
                "workerid_num": pair,
                "time_elapsed": 0.15 * tick,
                "reward_norm": float(rewards[0]),
                "cur_gameloop": float(tick),
            }
            for key, value in row.items():
                rows.setdefault(key, []).append(value)
            state = after
    return rows


def _first(layout: OvercookedLayout) -> GameArrays:
    # With a nearly cooked soup in a pot and one in a hand, so that every kind of thing occurs early.
    pots = np.zeros((1, len(layout.named("pot")), 5), dtype=np.int16)
    pots[0, 0] = 0, 3, 0, 0, 19
    return GameArrays(
        np.array([layout.starts[:2]], dtype=np.int16),
        np.zeros((1, 2), dtype=np.int8),
        np.array([[6, 2]], dtype=np.int8),
        np.zeros((1, *layout.shape), dtype=np.int8),
        pots,
    )


def _published(layout: OvercookedLayout, state: GameArrays) -> dict[str, Any]:
    players, objects = [], {}
    for (row, col), facing, held in zip(
        state.cells[0].tolist(), state.facing[0].tolist(), state.held[0].tolist(), strict=True
    ):
        player: dict[str, Any] = {"position": [col, row], "orientation": DIRECTIONS[facing]}
        if held:
            player["held_object"] = _item(held, row, col, 20)
        players.append(player)
    for row, col in np.argwhere(state.counters[0]).tolist():
        objects[f"{col},{row}"] = _item(int(state.counters[0, row, col]), row, col, 20)
    for pot, name in enumerate(layout.named("pot")):
        row, col = layout.stations[name]
        _, onions, _, _, ticks = state.pots[0, pot].tolist()
        if onions:
            objects[f"{col},{row}"] = {"name": "soup", "position": [col, row], "state": ["onion", onions, ticks]}
    return {"players": players, "objects": objects, "order_list": ["onion"], "pot_explosion": False}


def _item(held: int, row: int, col: int, ticks: int) -> dict[str, Any]:
    item: dict[str, Any] = {"name": ITEM_NAMES[held], "position": [col, row]}
    return {**item, "state": ["onion", 3, ticks]} if held == 6 else item


def archive(members: Mapping[str, bytes]) -> bytes:
    """A ``.tar.gz`` in memory."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w:gz") as tar:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
    return file.getvalue()
