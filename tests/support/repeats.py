"""The type of the fixture ``repeats``: ``repeats(few, many)`` is ``few`` in the suite, ``many`` with ``--thorough``."""

from collections.abc import Callable

Repeats = Callable[[int, int], int]
