"""Soups as data, and the task of cooking them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

from legible_envs.errors import TaskError
from legible_envs.overcooked.layout import INGREDIENTS
from legible_envs.subtasks import names_in
from legible_envs.support.validation import entries, shown
from legible_envs.tasks import AGENTS, Subtask, TaskGraph

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


def soup_task(
    recipes: Sequence[Sequence[str]] = PAPER_SOUPS,
    pots: int | None = None,
    *,
    agents: Mapping[str, str | Sequence[str]] | None = None,
) -> TaskGraph:
    """The precedence graph of cooking and delivering every soup once.

    Fetching an ingredient ends at the pot; fetching a dish passes the pot and ends at serving. The person starts at
    serving.

    Args:
        recipes: The soups, each a sequence of ingredients.
        pots: How many soups may be in progress at once; None (the paper's appendix) means precedence only.
        agents: Who can fetch what, ``{"fish": "robot"}``, by the ingredient or ``"dish"`` (whoever fetches a dish
            serves the soup). Anybody can fetch what is not named.

    Raises:
        TaskError: Malformed recipes, ``agents`` of something that no recipe needs, or unknown agents.

    Example:
        >>> soup_task().num_sequences, soup_task(pots=1).num_sequences
        (7484400, 1296)
        >>> team = soup_task(agents={"fish": "robot"})  # the person fetches 3 dishes and 6 ingredients
        >>> team.num_choices, team.goals_of("human")
        (9, ('cabbage', 'dish', 'onion', 'tomato'))
    """
    recipes = check_recipes(recipes)
    able = _who_fetches(recipes, agents)
    subtasks, groups = [], {}
    for number, recipe in enumerate(recipes, 1):
        fetches = [
            Subtask(f"soup {number}: {kind}", (kind,), then=("pot",), count=n, agents=able.get(kind, AGENTS))
            for kind, n in Counter(recipe).items()
        ]
        before = tuple(s.name for s in fetches)
        able_to_serve = able.get("dish", AGENTS)
        serve = Subtask(f"soup {number}: serve", ("dish",), before, ("pot", "serving"), agents=able_to_serve)
        subtasks += [*fetches, serve]
        groups[f"soup {number}"] = (*before, serve.name)
    return TaskGraph(subtasks, start="serving", groups=groups, max_open=pots)


def _who_fetches(recipes: Sequence[Recipe], agents: object) -> dict[str, tuple[str, ...]]:
    """The ``agents`` of :func:`soup_task`, all of something that is fetched."""
    if agents is not None and not isinstance(agents, Mapping):
        raise TaskError(f"`agents` must map what is fetched to who can fetch it, got {shown(agents)}")
    fetched = [*(kind for kind in INGREDIENTS if any(kind in recipe for recipe in recipes)), "dish"]
    unknown = [kind for kind in agents or {} if kind not in fetched]
    if unknown:
        raise TaskError(f"`agents` names {shown(unknown[0])}, which is not fetched; expected some of {fetched}")
    return {kind: names_in(f"`agents` of {kind!r}", able) for kind, able in (agents or {}).items()}
