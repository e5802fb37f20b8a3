"""Trajectories with the names that files get wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts import Trajectory
from legible_envs.tabletop import TableObject, TabletopLayout, VirtualObstacle

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nX 1 X\nXXSPX")
OPEN_KITCHEN = OvercookedLayout.from_ascii("  O  \n     \nD   P\n S   ")
TABLE = TabletopLayout([TableObject("a cup, red", (0.1 + 0.2, 0.5))], [VirtualObstacle((0.4, 0.2), 1 / 3)])

HARD_NAMES = (
    " a", "a ", "\ta", "a\t", " ", "a;b", ";", "a,b", ",", '"', '""', 'a"b', '"a"', '"a";b', "a\nb", "a\rb",
    "a\r\nb", "\n", "\r", "a/b", "|", "Zoë", "手", "🍅", "e\u0301", "\ufeff", "\ufeffa", "\u200b", "\u2028", "\x85",
    "\xa0a\xa0", "nan", "NaN", "None", "null", "inf", "1", "1.0", "0x1", "1_0", "-", "=1+1", "=cmd|'/c calc'!A1",
    "+1", "@a", "'a", "#", "# a", "{}", "[1]", "a: b", "true", "~", "\\", "\\n", "\\;", "%s", "{0}", "<b>", "&amp;",
    "\x01", "\x1b[31m", "\x1c", "a" * 300,
)  # fmt: skip
"""Blanks, separators, quotes, line breaks, other scripts, marks, look-alikes of numbers and formulas."""

NAMES: st.SearchStrategy[str] = st.one_of(
    st.sampled_from(HARD_NAMES), st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1)
)
"""Any name but those that no text file can hold."""

TEXTS = st.one_of(st.just(""), NAMES)


@st.composite
def trajectories(draw: st.DrawFn, grid: bool, names: st.SearchStrategy[str] = NAMES) -> Trajectory:
    count = draw(st.integers(1, 6))
    # distinct neighbours, so that nothing depends on whether waiting is kept
    number: Any = st.integers(-(10**9), 10**9) if grid else st.floats(-1e9, 1e9)
    states = draw(st.lists(st.tuples(number, number), min_size=count, max_size=count, unique=True))
    candidates = draw(st.lists(names, min_size=1, max_size=3, unique=True))
    texts = st.one_of(st.just(""), names)
    return Trajectory(
        np.array(states, dtype=int if grid else float),
        times=np.cumsum(draw(st.lists(st.floats(0, 3), min_size=count, max_size=count))),
        start=draw(texts),
        goal=draw(st.sampled_from([None, *candidates])),
        candidates=tuple(candidates),
        participant=draw(texts),
        condition=draw(texts),
        layout=draw(st.sampled_from([None, KITCHEN, OPEN_KITCHEN, TABLE])),
        layout_name=draw(texts),
        candidate_set=draw(st.sampled_from(["task", "game", "all"])),
        complete=draw(st.booleans()),
        goal_positions=draw(st.sampled_from([None, tuple((0.1 * i, -1e-9) for i in range(len(candidates)))])),
    )


MANY = st.booleans().flatmap(lambda grid: st.lists(trajectories(grid), max_size=5))
"""Lists that one file can hold."""
