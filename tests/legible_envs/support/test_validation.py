"""Checks of single arguments: every number in range is accepted, everything else is refused by name."""

import math
from decimal import Decimal
from fractions import Fraction

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from legible_envs.errors import LayoutError, TaskError
from legible_envs.support.validation import (
    LARGEST,
    choice,
    entries,
    flag,
    integer,
    integers,
    is_integer,
    is_real,
    real,
    shown,
)

finite = st.floats(allow_nan=False, allow_infinity=False)
floats = st.sampled_from([np.float16, np.float32, np.float64, np.longdouble])
whole = st.sampled_from([np.int8, np.uint8, np.int16, np.int32, np.uint32, np.int64, np.uint64])
no_numbers = st.one_of(
    st.none(),
    st.booleans(),
    st.booleans().map(np.bool_),
    st.text(),
    finite.map(str),
    st.decimals(allow_nan=False).map(str),
    st.binary(),
    st.complex_numbers(),
    st.complex_numbers().map(np.complex128),
    st.lists(st.integers()),
    st.tuples(finite),
    st.dictionaries(st.text(), finite),
    finite.map(np.array),
    st.integers(-5, 5).map(lambda n: np.array([n])),
    st.sampled_from([math.nan, math.inf, -math.inf, np.nan, np.float32("inf"), Decimal("1.5"), Fraction(1, 2), object]),
)
no_integers = st.one_of(no_numbers, finite, finite.map(np.float64))


@given(finite)
def test_every_finite_float_is_a_number(value):
    assert is_real(value)
    found = real("x", value)
    assert type(found) is float
    assert found == value


@given(st.integers())
def test_every_int_is_a_number_and_an_integer(value):
    assert is_real(value) == (abs(value) < 2**1024)
    assert is_integer(value)
    assert real("x", value) == float(value)
    assert integer("x", value, high=math.inf) == value


@given(whole, st.integers(0, 127), st.integers(-10, 0))
def test_whole_scalars_of_numpy_become_ints(kind, value, low):
    found = integer("x", kind(value), low)
    assert type(found) is int
    assert found == value
    assert type(real("x", kind(value))) is float


@given(floats, st.integers(-100, 100))
def test_scalars_of_numpy_become_floats(kind, value):
    found = real("x", kind(value / 4))
    assert type(found) is float
    assert found == value / 4


@given(no_numbers)
def test_nothing_else_is_a_number(value):
    assert not is_real(value)
    with pytest.raises(ValueError, match=r"^`x` must be a finite number, got "):
        real("x", value)


@given(no_integers)
def test_nothing_else_is_an_integer(value):
    assert not is_integer(value)
    with pytest.raises(ValueError, match=r"^`x` must be an integer, got "):
        integer("x", value)


@given(no_numbers)
def test_whole_floats_are_integers_only_where_asked_for(value):
    assert integer("x", 2.0, 1, whole_floats=True) == 2
    assert type(integer("x", np.float32(2), 1, whole_floats=True)) is int
    for bad in (2.5, 0.0, 1e300, value):
        with pytest.raises(ValueError, match=r"^`x` must be an integer (>= 1|from 1 to \d+), got "):
            integer("x", bad, 1, whole_floats=True)
    with pytest.raises(ValueError, match=r"^`x` must be an integer >= 1, got 2\.0$"):
        integer("x", 2.0, 1)


@given(finite, finite, finite, st.sampled_from(["both", "left", "right", "neither"]))
def test_ranges(value, one, other, closed):
    low, high = sorted((one, other))
    inside = low < value < high
    inside |= value == low and closed in ("both", "left") and (low < high or closed == "both")
    inside |= value == high and closed in ("both", "right") and (low < high or closed == "both")
    if inside:
        assert real("x", value, low, high, closed=closed) == value
    else:
        with pytest.raises(ValueError, match=r"^`x` must be a finite number "):
            real("x", value, low, high, closed=closed)


@pytest.mark.parametrize(
    ("closed", "accepted", "wanted"),
    [
        ("both", (0, 0.5, 1), "a finite number from 0 to 1"),
        ("left", (0, 0.5), "a finite number >= 0 and < 1"),
        ("right", (0.5, 1), "a finite number > 0 and <= 1"),
        ("neither", (0.5,), "a finite number > 0 and < 1"),
    ],
)
def test_open_and_closed_ends(closed, accepted, wanted):
    for value in (-1e-300, 0, 0.5, 1, 1 + 2**-52):
        if value in accepted:
            assert real("share", value, 0, 1, closed=closed) == value
        else:
            with pytest.raises(ValueError, match=r"^`share`") as error:
                real("share", value, 0, 1, closed=closed)
            assert str(error.value) == f"`share` must be {wanted}, got {value!r}"


@given(st.integers(), st.integers(), st.integers())
def test_ranges_of_integers(value, one, other):
    low, high = sorted((one, other))
    if low <= value <= high:
        assert integer("x", value, low, high) == value
    else:
        with pytest.raises(ValueError, match=rf"^`x` must be an integer from {low} to {high}, got {value}$"):
            integer("x", value, low, high)


def test_one_form_of_message():
    assert message(real, "beta", "a", 0, closed="neither") == "`beta` must be a finite number > 0, got 'a'"
    assert message(real, "cost", -1, 0) == "`cost` must be a finite number >= 0, got -1"
    assert message(real, "debt", 1, high=0, closed="neither") == "`debt` must be a finite number < 0, got 1"
    assert message(real, "band", 2, 0, 1, also="None") == "`band` must be None or a finite number from 0 to 1, got 2"
    assert message(real, "the robot's `rate`", 0, 1) == "the robot's `rate` must be a finite number >= 1, got 0"
    assert message(integer, "tile", 7, 8, 256, unit="pixels") == "`tile` must be an integer from 8 to 256 pixels, got 7"
    assert message(choice, "a", "x", ("b", "c")) == "`a` must be 'b' or 'c', got 'x'"
    assert message(choice, "a", 4, (1, 2, 3), also="None") == "`a` must be None or one of [1, 2, 3], got 4"
    assert message(flag, "on", 1) == "`on` must be True or False, got 1"


def message(check, *arguments, **options):
    with pytest.raises(ValueError, match="must be") as error:
        check(*arguments, **options)
    return str(error.value)


def test_the_limit_of_arrays_is_said_to_those_who_exceed_it():
    assert integer("n", LARGEST, 0) == LARGEST
    assert message(integer, "n", LARGEST + 1, 0) == f"`n` must be an integer from 0 to {LARGEST}, got {LARGEST + 1}"
    assert message(integer, "n", -1, 0) == "`n` must be an integer >= 0, got -1"
    assert integer("seed", 10**400, 0, math.inf) == 10**400


def test_long_values_are_cut_and_unspeakable_ones_named():
    class Mute:
        def __repr__(self):
            raise RuntimeError

    assert len(shown(10**400)) == 160
    assert shown(10**400).endswith("0…")
    assert shown(10**10_000) == "an object of type int that cannot be shown"
    assert shown(Mute()) == "an object of type Mute that cannot be shown"
    assert (
        message(real, "x", 10**10_000) == "`x` must be a finite number, got an object of type int that cannot be shown"
    )
    assert message(integer, "x", Mute()) == "`x` must be an integer, got an object of type Mute that cannot be shown"


def test_the_caller_says_which_error():
    with pytest.raises(TaskError, match="`count`"):
        integer("count", "a", 1, error=TaskError)
    with pytest.raises(LayoutError, match="`hand`") as error:
        real("hand", "a", 0, error=lambda text: LayoutError(text, rule="number"))
    assert error.value.rule == "number"


def test_integers_by_name():
    integers(1, a=1, b=np.int8(5), c=None)
    with pytest.raises(ValueError, match=r"^`b` must be an integer >= 1, got 0$"):
        integers(1, a=1, b=0)
    with pytest.raises(ValueError, match=r"^`a` must be an integer >= 0, got True$"):
        integers(0, a=True)


@given(st.lists(st.one_of(st.text(), st.integers(2)), min_size=1, unique=True), st.data())
def test_choices(options, data):
    chosen = data.draw(st.sampled_from(options))
    assert choice("x", chosen, options) == chosen
    for other in (None, math.nan, True, np.True_, [], {}, object(), np.arange(3), np.array(chosen), [chosen]):
        with pytest.raises(ValueError, match=r"(?s)^`x` must be "):
            choice("x", other, options)


def test_a_choice_is_the_option_itself():
    found = choice("x", np.str_("hard"), ("hard", "soft"))
    assert type(found) is str
    assert choice("phase", np.int64(1), range(2)) == 1
    assert choice("resume", True, (True, False, "auto")) is True
    for one in (1, 0, 1.0):
        with pytest.raises(ValueError, match="`resume` must be one of"):
            choice("resume", one, (True, False, "auto"))


@pytest.mark.parametrize("value", [True, False, np.True_, np.False_])
def test_flags(value):
    assert flag("x", value) is bool(value)


@given(st.one_of(no_integers, st.integers()))
def test_nothing_else_is_a_flag(value):
    if not isinstance(value, bool | np.bool_):
        with pytest.raises(ValueError, match=r"(?s)^`x` must be True or False, got "):
            flag("x", value)


@given(st.lists(st.integers(-9, 9)))
def test_entries_of_whatever_lists_them(values):
    for listed in (values, tuple(values), np.array(values, dtype=np.int8), iter(values)):
        assert entries(listed) == values
    assert all(type(value) is int for value in entries(np.array(values, dtype=np.int8)))


@pytest.mark.parametrize("value", ["ab", b"ab", {"a": 1}, None, 5, math.nan, np.array(5), object], ids=repr)
def test_nothing_else_has_entries(value):
    assert entries(value) == []
