"""The kitchen as a value: reading, writing, naming, and refusing."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from legible_envs import LayoutError
from legible_envs.overcooked import OvercookedLayout

KITCHEN = """
XPXXX
O   T
X V X
D  1X
XXSXX"""

grids = hnp.arrays(np.int8, st.tuples(st.integers(3, 9), st.integers(3, 9)), elements=st.integers(0, 9))


@given(grids, st.data())
@settings(max_examples=150, deadline=None)
def test_every_grid_is_a_layout_that_round_trips_or_is_refused(cells, data):
    floor = np.argwhere(cells == 0).tolist()
    starts = data.draw(st.lists(st.sampled_from(floor), max_size=3, unique_by=tuple)) if floor else []
    try:
        layout = OvercookedLayout(cells, starts)
    except LayoutError:
        assert not floor
        return
    again = OvercookedLayout.from_ascii(layout.to_ascii())
    assert again == layout
    assert hash(again) == hash(layout)
    assert again.layout_id == layout.layout_id
    assert pickle.loads(pickle.dumps(layout)) == copy.deepcopy(layout) == layout
    assert eval(repr(layout)) == layout
    assert OvercookedLayout.from_rows([list(row) for row in layout.to_ascii().split("\n")]) == layout
    assert len(layout.stations) == (cells > 2).sum()
    for name, cell in layout.stations.items():
        assert layout.station_at(cell) == name
        for access in layout.access(name):
            assert layout.is_floor(access)
            assert abs(access[0] - cell[0]) + abs(access[1] - cell[1]) == 1


@given(st.text(alphabet="X VTOCFDPS12\n.", max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_text_is_read_or_refused_with_a_layout_error(text):
    try:
        layout = OvercookedLayout.from_ascii(text)
    except LayoutError:
        return
    assert OvercookedLayout.from_ascii(layout.to_ascii()) == layout


def test_names_access_and_distances():
    layout = OvercookedLayout.from_ascii(KITCHEN)
    assert layout.shape == (5, 5)
    assert layout.stations == {"pot": (0, 1), "onion": (1, 0), "tomato": (1, 4), "dish": (3, 0), "serving": (4, 2)}
    assert layout.access("pot") == ((1, 1),)
    assert layout.starts == ((3, 3),)
    assert layout.num_obstacles == 1
    field = layout.distances_from([(1, 1)])
    assert field[3, 3] == 4
    assert field[2, 2] == field[0, 0] == -1


def test_repeated_and_inner_stations_are_named_by_cell():
    layout = OvercookedLayout.from_ascii("XPXXX\nO  OX\nX P X\nX   X\nXXSXX")
    assert layout.named("onion") == ("onion@(1,0)", "onion@(1,3)")
    assert layout.access("pot@(2,2)") == ((1, 2), (3, 2), (2, 3), (2, 1))
    assert layout.access("onion@(1,3)") == ((2, 3), (1, 2))


def test_start_defaults_to_the_access_cell_of_serving():
    assert OvercookedLayout.from_ascii(KITCHEN.replace("1", " ")).starts == ((3, 2),)


def test_overcooked_ai_layout_files():
    text = '{"grid": """XXPXX\n   O  2O\n   X1  X\n   XDXSX""", "start_order_list": None, "cook_time": 20}'
    layout = OvercookedLayout.from_overcooked_ai(text)
    assert layout.starts == ((2, 1), (1, 3))
    assert set(layout.stations) == {"pot", "onion@(1,0)", "onion@(1,4)", "dish", "serving"}
    assert OvercookedLayout.from_overcooked_ai({"grid": ["XXPXX", "O  2O", "X1  X", "XDXSX"]}) == layout
    for bad in ("{broken", "{}", "{'grid': 3}", "{'grid': __import__('os')}"):
        with pytest.raises(LayoutError):
            OvercookedLayout.from_overcooked_ai(bad)


@pytest.mark.parametrize(
    ("text", "message", "cell"),
    [
        ("XXXX\nX  X\nXXX", "row 2 has 3 cells, row 0 has 4", (2, 0)),
        ("XXX\nX?X\nXXX", r"row 1, column 1: unknown symbol '\?'", (1, 1)),
        ("XXX\nX.X\nXXX", "did you mean ' '", (1, 1)),
        ("XXX\nX1X\nX1X\nXXX", "row 2, column 1: player 1 already starts at row 1", (2, 1)),
        ("XXX\nX2X\nXXX", "numbered 1, 2", None),
        ("XX\nXX", "3 to 64", None),
        ("XXX\nXXX\nXXX", "no floor", None),
        ("", "empty", None),
    ],
)
def test_bad_drawings_name_row_column_and_rule(text, message, cell):
    with pytest.raises(LayoutError, match=message) as caught:
        OvercookedLayout.from_ascii(text)
    assert caught.value.cell == cell
    assert caught.value.rule
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.rule, again.cell) == (str(caught.value), caught.value.rule, cell)


@pytest.mark.parametrize("rows", [[["X", ["a"], "X"]] * 3, [["X", 3, "X"]] * 3, [["X", "XX", "X"]] * 3, [[]], []])
def test_bad_rows(rows):
    with pytest.raises(LayoutError):
        OvercookedLayout.from_rows(rows)


def test_layouts_are_immutable():
    layout = OvercookedLayout.from_ascii(KITCHEN)
    with pytest.raises(AttributeError, match="immutable"):
        layout.cells = None
    with pytest.raises(AttributeError, match="immutable"):
        layout.extra = 1
    with pytest.raises(ValueError, match="read-only"):
        layout.cells[0, 0] = 3
    source = np.ones((3, 3), dtype=int)
    source[1, 1] = 0
    built = OvercookedLayout(source)
    source[1, 1] = 1
    assert built.cells[1, 1] == 0
    changed = layout.with_cells({(0, 0): "fish", (2, 2): " "})
    assert changed.stations["fish"] == (0, 0)
    assert layout.num_obstacles == 1
    assert changed.num_obstacles == 0


@pytest.mark.parametrize(
    "cells", [[1, 2], [[0, 0, 0], [0, 99, 0], [0, 0, 0]], [[0.5, 0, 0]] * 3, [["a", "b", "c"]] * 3]
)
def test_bad_arrays(cells):
    with pytest.raises(LayoutError):
        OvercookedLayout(cells)


def test_bad_starts_and_stations():
    layout = OvercookedLayout.from_ascii(KITCHEN)
    with pytest.raises(LayoutError, match="not a free floor cell"):
        layout.with_starts([(0, 0)])
    with pytest.raises(LayoutError, match="not a free floor cell"):
        layout.with_starts([(-1, 2)])
    with pytest.raises(LayoutError, match="two players"):
        layout.with_starts([(1, 1), (1, 1)])
    with pytest.raises(LayoutError, match="no station 'fish'"):
        layout.access("fish")
