"""Soups as data, and the task of cooking them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

from legible_envs.errors import TaskError
from legible_envs.overcooked.layout import INGREDIENTS
from legible_envs.support.validation import entries, shown
from legible_envs.tasks import Subtask, TaskGraph

__all__ = ["PAPER_SOUPS", "Recipe", "check_recipes", "soup_task"]

Recipe = tuple[str, ...]

PAPER_SOUPS: Final[tuple[Recipe, ...]] = (
    ("tomato", "tomato", "onion"),
    ("onion", "onion", "cabbage"),
    ("fish", "fish", "fish"),
)
"""The three soups of the paper's study, each cooked and delivered once, in any order."""


def check_recipes(recipes: Sequence[Sequence[str]]) -> tuple[Recipe, ...]:
    """Normalise recipes: ingredients in the order of ``INGREDIENTS``, soups in the order given.

    Raises:
        TaskError: No recipe, an empty one, an unknown ingredient, or one soup's ingredients strictly contained in
            another's (a pot that starts by itself could never tell which is meant).
    """
    listed = entries(recipes)
    if not listed:
        raise TaskError(f"`recipes` must be at least one recipe, each a sequence of ingredients, got {shown(recipes)}")
    normalised = []
    for number, given in enumerate(listed, 1):
        recipe = entries(given)
        if not recipe or not all(isinstance(i, str) and i in INGREDIENTS for i in recipe):
            raise TaskError(
                f"recipe {number} of `recipes` must be ingredients out of {list(INGREDIENTS)}, got {shown(given)}"
            )
        normalised.append(tuple(sorted(recipe, key=INGREDIENTS.index)))
    for small in normalised:
        for large in normalised:
            if len(small) < len(large) and not Counter(small) - Counter(large):
                raise TaskError(f"recipe {small} is contained in {large}: the pot would start at the smaller one")
    return tuple(normalised)


def soup_task(recipes: Sequence[Sequence[str]] = PAPER_SOUPS, pots: int | None = None) -> TaskGraph:
    """The precedence graph of cooking and delivering every soup once.

    Fetching an ingredient ends at the pot; fetching a dish passes the pot and ends at serving. The person starts at
    serving.

    Args:
        recipes: The soups, each a sequence of ingredients.
        pots: How many soups may be in progress at once; None (the paper's appendix) means precedence only.

    Example:
        >>> soup_task().num_sequences, soup_task(pots=1).num_sequences
        (7484400, 1296)
    """
    subtasks, groups = [], {}
    for number, recipe in enumerate(check_recipes(recipes), 1):
        counts = Counter(recipe)
        fetches = [
            Subtask(f"soup {number}: {kind}", goals=(kind,), then=("pot",), count=n) for kind, n in counts.items()
        ]
        before = tuple(s.name for s in fetches)
        serve = Subtask(f"soup {number}: serve", goals=("dish",), after=before, then=("pot", "serving"))
        subtasks += [*fetches, serve]
        groups[f"soup {number}"] = (*before, serve.name)
    return TaskGraph(subtasks, start="serving", groups=groups, max_open=pots)
