"""What the file of recorded play may hold beside its arrays: keys, types and bounds."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from legible_envs.overcooked.drawings import INGREDIENTS
from legible_envs.support.models import Choice, FileModel, Length, Text, Whole

__all__ = ["SCHEMA", "PlayedContent"]

SCHEMA: Final = 1
_MOST_RECIPES: Final = 64
_LONGEST_SEED: Final = 2**128

Soup = Annotated[list[Annotated[str, Choice(*INGREDIENTS)]], Length(1, 64)]


class PlayedContent(FileModel):
    """See :class:`~legible_envs.overcooked.human_play.Played`."""

    version: Annotated[int, Choice(SCHEMA)] = Field(alias="schema")
    env: Annotated[str, Text()]
    layout: Annotated[str, Text(100_000)]
    recipes: Annotated[list[Soup], Length(1, _MOST_RECIPES)]
    virtual_obstacles: Annotated[str, Choice("hard", "soft")]
    seed: Annotated[int, Whole(0, _LONGEST_SEED)] | None
