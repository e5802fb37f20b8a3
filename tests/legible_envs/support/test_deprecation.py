"""Retired names work, and say what to use instead, at the line that uses them."""

from __future__ import annotations

import warnings

import pytest

from legible_envs.support.deprecation import deprecated, renamed_argument


@deprecated("new()", since="0.2", removed_in="0.3")
def old(value, *, twice=False):
    """Documentation that stays."""
    return 2 * value if twice else value


@deprecated("New", since="0.2", removed_in="0.3")
class Old:
    def __init__(self, value):
        self.value = value


@renamed_argument("count", "n", since="0.2", removed_in="0.3")
def draw(n, rest=()):
    return [n, *rest]


def test_a_retired_function_works_and_names_its_successor():
    with pytest.warns(
        DeprecationWarning, match=r"^old is deprecated since 0\.2 and goes in 0\.3; use new\(\)$"
    ) as caught:
        assert old(3, twice=True) == 6
    assert caught[0].filename == __file__
    assert old.__name__ == "old"
    assert old.__doc__ == "Documentation that stays."


def test_a_retired_class_is_still_the_class():
    with pytest.warns(DeprecationWarning, match="^Old is deprecated .* use New$") as caught:
        made = Old(4)
    assert (made.value, type(made)) == (4, Old)
    assert caught[0].filename == __file__
    assert isinstance(made, Old)


def test_a_renamed_argument_is_taken_by_both_names():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert draw(2) == draw(n=2) == [2]
    with pytest.warns(DeprecationWarning, match=r"^draw\(count=\) is deprecated .* use n=$") as caught:
        assert draw(count=5, rest=[1]) == [5, 1]
    assert caught[0].filename == __file__
    with pytest.raises(TypeError, match="got both 'n' and its old name 'count'; give 'n' alone"):
        draw(n=1, count=2)
