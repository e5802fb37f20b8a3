"""Kitchens in files: every form that is in use, orders, and texts that people and their editors changed."""

from __future__ import annotations

import json
import re

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import legible_envs  # noqa: F401
from legible_envs import LayoutError, TaskError
from legible_envs.layout_kinds import kind_named, kind_of_line
from legible_envs.overcooked import PAPER_SOUPS, KitchenFile, OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.layouts import read_kitchen

NAME = "LegibleOvercooked-v0"
DRAWING = "XXPXX\nO1 2O\nX   X\nXDXSX"
ROWS = DRAWING.split("\n")
ROOM = OvercookedLayout.from_ascii(DRAWING)
ONIONS = ("onion", "onion", "onion")

LAYOUT_FILE = '''{
    "grid":  """XXPXX
                O1 2O
                X   X
                XDXSX""",
    "start_bonus_orders": [],
    "start_all_orders" : [
        { "ingredients" : ["onion", "onion", "onion"]},  # the only one
    ],
    "order_bonus": float("inf"),
    "start_state": {"players": [{"position": (2, 1), "held_object": None}], "objects": [lambda: 0]},
    "rew_shaping_params": None
}
'''
JAXMARL = "\nWWPWW\nOA AO\nW   W\nWBWXW\n"
NUMBERED = {
    "height": 4,
    "width": 5,
    "wall_idx": [0, 1, 2, 3, 4, 5, 9, 10, 14, 15, 16, 17, 18, 19],
    "agent_idx": [6, 8],
    "goal_idx": [18],
    "plate_pile_idx": [16],
    "onion_pile_idx": [5, 9],
    "pot_idx": [2],
}

FORMS = {
    "drawing": (DRAWING, "drawing", None),
    "Overcooked-AI": (LAYOUT_FILE, "Overcooked-AI layout", (ONIONS,)),
    "JaxMARL": (JAXMARL, "drawing of JaxMARL", None),
    "JaxMARL, numbered": (json.dumps(NUMBERED), "numbered cells of JaxMARL", None),
    "JSON rows": (json.dumps(ROWS), "drawing", None),
    "JSON cells": (json.dumps(ROOM.cells.tolist()), "cell codes", None),
    "JSON symbols": (json.dumps([list(row) for row in ROWS]), "drawing", None),
    "rows with recipes": (json.dumps({"rows": ROWS, "recipes": [["onion"]]}), "rows", (("onion",),)),
    "quoted": (f'"""{DRAWING}"""', "drawing", None),
    "commented": (f"# a kitchen\n\n{LAYOUT_FILE}", "Overcooked-AI layout", (ONIONS,)),
}
CHANGES = {
    "as it is": lambda text: text,
    "byte-order mark": lambda text: "\ufeff" + text,
    "Windows": lambda text: text.replace("\n", "\r\n"),
    "old Macintosh": lambda text: text.replace("\n", "\r"),
    "no final newline": str.rstrip,
    "more newlines": lambda text: f"\n\n{text}\n   \n\n",
    "blanks at the ends": lambda text: "\n".join(line + "  " for line in text.split("\n")),
    "blanks at some ends": lambda text: "\n".join(line + " " * (n % 3) for n, line in enumerate(text.split("\n"))),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_every_form_reads_the_same_whatever_an_editor_did_to_it(form, change, tmp_path):
    text, words, recipes = form
    expected = ROOM.with_starts(ROOM.starts[:1]) if words == "cell codes" else ROOM
    path = tmp_path / "kitchen"
    path.write_bytes(change(text).encode())
    for file in (KitchenFile.read(path), KitchenFile.from_text(change(text)), KitchenFile.from_text(path.read_bytes())):
        assert file.layout.cells.tolist() == ROOM.cells.tolist()
        assert file.recipes == recipes
        assert file.form == words
        if words != "cell codes":
            assert file.layout == expected
            assert file.layout.layout_id == ROOM.layout_id
    kind = kind_named("overcooked")
    assert kind.from_text(change(text)).cells.tolist() == ROOM.cells.tolist()
    again = KitchenFile.from_data(json.loads(json.dumps(file.to_dict())))
    assert (again.layout, again.recipes) == (file.layout, file.recipes)


def test_a_text_in_utf_16_is_read_and_other_bytes_are_named(tmp_path):
    path = tmp_path / "kitchen.layout"
    path.write_text(LAYOUT_FILE, encoding="utf-16")
    assert KitchenFile.read(path).layout == ROOM
    path.write_bytes(DRAWING.encode() + b"\nX\xe4X")
    with pytest.raises(LayoutError, match=r"kitchen\.layout, line 5: byte 0xe4 is not UTF-8"):
        KitchenFile.read(path)
    path.write_text("XXX\nX?X\nXXX")
    with pytest.raises(LayoutError, match=r"kitchen\.layout: row 1, column 1: unknown symbol") as caught:
        KitchenFile.read(path)
    assert caught.value.cell == (1, 1)


@pytest.mark.parametrize(
    ("entries", "recipes", "left_out"),
    [
        ({}, None, ()),
        ({"start_all_orders": None, "start_order_list": None}, None, ()),
        ({"start_all_orders": [], "start_bonus_orders": []}, None, ()),
        ({"start_all_orders": [{"ingredients": list(ONIONS)}] * 2}, (ONIONS,), ()),
        ({"start_all_orders": [["onion", "tomato"]]}, (("tomato", "onion"),), ()),
        (
            {"start_all_orders": [{"ingredients": ["onion"] * n} for n in (3, 2, 1)]},
            (ONIONS,),
            (("onion", "onion"), ("onion",)),
        ),
        ({"start_all_orders": [], "start_bonus_orders": [{"ingredients": ["tomato"]}]}, (("tomato",),), ()),
        (
            {"start_all_orders": [{"ingredients": ["onion"]}], "start_bonus_orders": [{"ingredients": ["tomato"]}]},
            (("onion",),),
            (),
        ),
        ({"start_order_list": ["onion", "any", "onion", None]}, (ONIONS, ONIONS), ()),
        ({"start_order_list": ["tomato"], "num_items_for_soup": 2}, (("tomato", "tomato"),), ()),
        ({"start_order_list": ["any"], "cook_time": 20}, None, ()),
        ({"recipes": [["fish"], ["fish"]], "start_order_list": ["onion"]}, (("fish",), ("fish",)), ()),
    ],
)
def test_orders_of_both_styles(entries, recipes, left_out):
    for text in (str({"grid": DRAWING, **entries}), json.dumps({"grid": DRAWING, **entries})):
        file = KitchenFile.from_text(text)
        assert (file.layout, file.recipes, file.left_out) == (ROOM, recipes, left_out)
        assert KitchenFile.from_text(text, orders=False).recipes is None


@pytest.mark.parametrize(
    ("orders", "message"),
    [
        ("'start_all_orders': 5", "`start_all_orders` must be a list of orders or None, got 5"),
        ("'start_all_orders': make()", r"got the expression make\(\) \(line 4\)"),
        ("'start_all_orders': [{'ingredients': ['beef']}]", "order 1 of `start_all_orders` must be ingredients out of"),
        ("'start_all_orders': [['onion'], {'parts': []}]", "order 2 of `start_all_orders` has no `ingredients`"),
        ("'start_order_list': ['onion', 'soup']", "order 2 of `start_order_list` must be one of"),
        ("'start_order_list': ['onion'], 'num_items_for_soup': 0", "`num_items_for_soup` must be an integer from 1 to"),
    ],
)
def test_malformed_orders_are_named_and_do_not_matter_where_recipes_are_given(orders, message):
    text = f"{{'grid': '''{DRAWING}''', {orders}}}"
    with pytest.raises(LayoutError, match=message):
        KitchenFile.from_text(text)
    with pytest.raises(LayoutError, match=message):
        gym.make(NAME, layout=text)
    env = gym.make(NAME, layout=text, recipes=[ONIONS])
    assert env.unwrapped.layout == ROOM
    assert OvercookedLayout.from_overcooked_ai(text) == ROOM
    env.reset(options={"layout": text})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{'a': 1}", r"no kitchen: expected an entry `grid`, `rows` or `wall_idx`, got \['a'\]$"),
        ('{"schema": 1, "objects": []}', "the JSON of a table"),
        ("{'grid': open('x')}", r"`grid` must be text or rows, got the expression open\('x'\) \(line 1\)"),
        ("{'grid': 'XXX\\nX X\\nXXX',\n 'b': [}", r"line 2, column 8: closing parenthesis '}'"),
        ("\n\n{'grid': 'XXX'", r"line 3, column 1: '{' was never closed"),
        ("[1, 2", "line 1, column 1"),
        ("{'grid': '\ud800'}", "half a character"),
        ("[[1, 1, 1], [1, 0], [1, 1, 1]]", r"ragged rows of \[2, 3\] cell codes"),
        ("[[1, 1, 1], [1, 0, 61], [1, 1, 1]]", "row 1, column 2: unknown cell code 61; expected 0..9"),
        ("XXXX\nX\nXXXX", "row 1 has 1 cells, row 0 has 4; every row needs the 4 of row 0, and floor at its end too"),
        ("XWX\nX X\nXSX", r"unknown symbol 'W' \(JaxMARL's, but the drawing also has 'S', which JaxMARL has not\)"),
        ("xxx\nX X\nXXX", "did you mean 'X'"),
        ("WWWW\nW?AW\nWWWW", "unknown symbol '\\?'; expected one of .* in a drawing of JaxMARL"),
        ("  \n \n", "empty"),
        ("XXX\n" * 65, "both sides must have 3 to 64 cells, got 65 rows of up to 3"),
        (json.dumps({**NUMBERED, "pot_idx": [18]}), r"cell 18 \(row 3, column 3\) in `pot_idx` already is a serving"),
        (json.dumps({**NUMBERED, "pot_idx": [20]}), "a cell in `pot_idx` must be an integer from 0 to 19, got 20"),
        (json.dumps({**NUMBERED, "pot_idx": "2"}), "`pot_idx` must be a list of cell numbers, got '2'"),
        (json.dumps({**NUMBERED, "width": None}), "`width` must be an integer from 3 to 64 cells, got None"),
        (json.dumps({"wall_idx": []}), r"lacks \['height', 'width'\]"),
        ("[" * 500, "nested"),
        ("{'grid': " + "-" * 50_000 + "1}", "nested too deeply"),
        ("[" + "1," * 300_000 + "]", "expected at most 500,000"),
    ],
)
def test_what_is_wrong_is_said_in_words(text, message):
    with pytest.raises(LayoutError, match=message) as caught:
        KitchenFile.from_text(text)
    assert "<ast" not in str(caught.value)


def test_nothing_in_a_file_is_run(tmp_path):
    trap = tmp_path / "trap"
    text = f"{{'grid': '''{DRAWING}''', 'x': open({str(trap)!r}, 'w')}}"
    assert KitchenFile.from_text(text).layout == ROOM
    assert not trap.exists()


def test_jaxmarl_symbols_of_both_versions():
    layout = OvercookedLayout.from_jaxmarl("WW2WWWWW\nW  WB  0\nR ALPA X\nW  WB  1\nWW3WWWWW")
    assert layout.starts == ((2, 2), (2, 5))
    assert layout.stations["onion"] == (1, 7)
    assert layout.stations["tomato"] == (3, 7)
    assert layout.stations["cabbage"] == (0, 2)
    assert layout.stations["fish"] == (4, 2)
    assert layout.stations["serving"] == (2, 7)
    assert len(layout.named("dish")) == 2
    assert not layout.is_floor((2, 0))
    assert not layout.is_floor((2, 3))
    arrays = {key: np.array(value) for key, value in NUMBERED.items()}
    assert OvercookedLayout.from_jaxmarl(arrays) == OvercookedLayout.from_jaxmarl(JAXMARL) == ROOM
    with pytest.raises(LayoutError, match="from_jaxmarl"):
        OvercookedLayout.from_ascii(JAXMARL)
    with pytest.raises(LayoutError, match="as text, rows or a dict"):
        OvercookedLayout.from_jaxmarl(5)


def test_a_margin_of_blanks_is_no_floor_and_floor_at_the_edge_survives():
    for indent in ("    ", "\t"):
        changed = "\n".join(["", *(f"{indent}{row}  " for row in ROWS), indent])
        assert OvercookedLayout.from_ascii(changed).layout_id == ROOM.layout_id
    cells = np.ones((5, 5), dtype=int)
    cells[2, 2] = cells[:, 4] = cells[0] = 0
    open_room = OvercookedLayout(cells, [(2, 2)])
    assert open_room.to_ascii() == ".....\nXXXX.\nXX1X.\nXXXX.\nXXXX."
    assert OvercookedLayout.from_ascii(open_room.to_ascii()) == open_room
    assert gym.make(NAME, layout="XTOCX\nXF  X\nXD P \nXXSXX", recipes=[["fish"]]).unwrapped.shape == (4, 5)
    with pytest.raises(LayoutError, match="did you mean ' '"):
        OvercookedLayout.from_ascii("XXX\nX.X\nXXX")


def test_a_file_plays_with_its_own_orders_unless_others_are_given():
    for layout in (LAYOUT_FILE, KitchenFile.from_text(LAYOUT_FILE), KitchenFile.from_text(LAYOUT_FILE).to_dict()):
        # Gymnasium's own SyncVectorEnv keeps arguments as they are, and its spec is JSON where they are.
        for mode in (None, "vector_entry_point", *(["sync"] if not isinstance(layout, KitchenFile) else [])):
            env = gym.make(NAME, layout=layout) if mode is None else gym.make_vec(NAME, 2, mode, layout=layout)
            spec = gym.envs.registration.EnvSpec.from_json(env.spec.to_json())
            if mode is None:
                again = gym.make(spec).unwrapped
                found = again.settings.rules.recipes, again.layout
            else:
                again = gym.make_vec(spec, 2, mode)
                found = again.get_attr("settings")[1].rules.recipes, again.get_attr("layout")[1]
            assert found == ((ONIONS,), ROOM)
            assert env.reset(seed=0)[0].shape[-3:] == (4, 5, 23)
            env.close()
    assert gym.make(NAME, layout=LAYOUT_FILE, recipes=[["onion"]]).unwrapped.settings.rules.recipes == (("onion",),)
    assert gym.make(NAME).unwrapped.settings.rules.recipes == PAPER_SOUPS


def test_a_name_of_a_file_is_no_drawing(tmp_path):
    path = tmp_path / "cramped_room.layout"
    path.write_text(LAYOUT_FILE)
    with pytest.raises(LayoutError, match=r"looks like the name of one; read it with `KitchenFile\.read\("):
        gym.make(NAME, layout=str(path))
    with pytest.raises(LayoutError, match=r"a file is read with `KitchenFile\.read\(path\)`"):
        gym.make(NAME, layout=path)
    assert gym.make(NAME, layout=KitchenFile.read(path)).unwrapped.layout == ROOM


def test_lines_of_csv_files_hold_every_form():
    kind = kind_named("overcooked")
    assert kind.read_line("/".join(ROWS)) == kind.read_line(json.dumps(ROWS)) == ROOM
    assert kind.read_line("/".join(JAXMARL.strip().split("\n"))) == ROOM
    assert kind.read_line(json.dumps(NUMBERED)) == ROOM
    for line in ("/".join(ROWS), json.dumps(ROWS), json.dumps(NUMBERED), json.dumps({"rows": ROWS})):
        assert kind_of_line(line) is kind
    assert kind_of_line('{"schema": 1, "objects": []}').name == "tabletop"


def test_a_design_starts_from_any_form():
    rows = ["XTXOXCX", "F     X", "X     D", "X  V  X", "P     X", "X     X", "XXXSXXX"]
    expected = OvercookedWorkspace((7, 7)).encode("\n".join(rows))
    for text in (json.dumps(rows), str({"grid": "\n".join(rows), "bonus": 1}), "\ufeff" + "  \r\n".join(rows)):
        assert np.array_equal(OvercookedWorkspace((7, 7), start_from=text).encode(text), expected)


def test_bad_values_of_the_class():
    with pytest.raises(LayoutError, match="`layout` must be an OvercookedLayout"):
        KitchenFile("XXX")
    with pytest.raises(TaskError, match="recipe 1"):
        KitchenFile(ROOM, [["beef"]])
    with pytest.raises(LayoutError, match="expected the text"):
        KitchenFile.from_text(5)


# -- whatever comes ----------------------------------------------------------------------------------------------------

SEEDS = [form[0] for form in FORMS.values()]
PIECES = [
    *" XVTOCFDPSWAB0123456789\n\r\t{}[]()\"':,.#-\\\0é",
    "\ufeff",
    "float('inf')",
    "null",
    '"""',
    "onion",
    "1e999",
]
INTERNAL = re.compile(r"<ast|object at 0x|NoneType'|subscriptable|unhashable|not iterable|np\.int")


def result_of(read, value):
    """What a reader makes of a value; None where it refuses it, in words."""
    message, found = "", None
    try:
        found = read(value)
    except LayoutError as error:
        message = str(error)
    assert not INTERNAL.search(message)
    assert len(message) < 800
    return found


@st.composite
def changed_texts(draw):
    text = draw(st.sampled_from(SEEDS))
    for _ in range(draw(st.integers(0, 5))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.sampled_from([0, 0, 1, 2, 20])))
        text = text[:start] + draw(st.sampled_from(PIECES)) * draw(st.sampled_from([0, 1, 1, 9])) + text[end:]
    return text


@given(st.one_of(changed_texts(), st.text(max_size=40), st.binary(max_size=60)))
@settings(max_examples=500, deadline=None)
def test_any_text_is_a_kitchen_or_a_layout_error_in_words(text):
    kind = kind_named("overcooked")
    for read in (KitchenFile.from_text, read_kitchen, kind.from_text, kind.read_line, OvercookedLayout.from_jaxmarl):
        if isinstance(text, bytes) and read in (kind.read_line,):
            continue
        found = result_of(read, text)
        if found is not None:
            layout = getattr(found, "layout", found)
            assert OvercookedLayout.from_ascii(layout.to_ascii()) == layout
            assert kind.read_line(kind.line(layout)) == layout


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text("XVTOCFDPSWAB12 \n", max_size=12),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["grid", "rows", "height", "width", *NUMBERED, "recipes", "start_all_orders", "a"]), inner
        )
    ),
    max_leaves=15,
)


@given(PLAIN)
@settings(max_examples=500, deadline=None)
def test_any_data_is_a_kitchen_or_a_layout_error_in_words(data):
    for read in (KitchenFile.from_data, read_kitchen):
        result_of(read, data)
