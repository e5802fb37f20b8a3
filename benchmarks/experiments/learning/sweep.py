"""The settings of the experiment, as data: what is learned, with which seeds, and where it is tried afterwards."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from benchmarks.experiments.learning.recipes import recipe

__all__ = ["FULL", "QUICK", "TASKS", "Settings", "Task", "trials_of"]

_ONION: Final = [["onion"]]


@dataclass(frozen=True)
class Task:
    """Something to be learned.

    Attributes:
        domain: ``"overcooked"`` or ``"tabletop"``.
        arguments: Of the environment.
        steps: Of all games of a training.
        quick_steps: In the quick version.
        changes: Of the recipe's settings, by path.
        elsewhere: Whether the policy is tried in other kitchens too: held-out ones, those of the paper's conditions,
            and those of recorded play.
    """

    domain: str
    arguments: Mapping[str, Any]
    steps: int
    quick_steps: int
    changes: Mapping[str, Any] = field(default_factory=dict)
    elsewhere: bool = False


TASKS: Final[Mapping[str, Task]] = {
    "5x5, one onion": Task("overcooked", {"shape": [5, 5], "recipes": _ONION}, 200_000, 100_000),
    "7x7, three soups": Task("overcooked", {}, 1_000_000, 100_000),
    "7x7, three soups, two cooks": Task("overcooked", {"num_players": 2}, 1_000_000, 50_000),
    "7x7, three soups, grids": Task("overcooked", {"obs_type": "grid"}, 1_000_000, 20_000),
    "random kitchens, one onion": Task(
        "overcooked", {"recipes": _ONION, "layouts": "random:train"}, 2_000_000, 100_000, elsewhere=True
    ),
    "table": Task("tabletop", {}, 1_000_000, 20_000),
}
"""By name. One network plays both of two cooks."""


@dataclass(frozen=True)
class Settings:
    """What is run.

    Attributes:
        tasks: Of :data:`TASKS`.
        seeds: Trainings of each.
        quick: Whether trainings are short: curves begin, and nothing is learned to the end.
        episodes: Of each evaluation.
        layouts: Kitchens of each of the paper's conditions, in which policies are tried.
        initial: Random layouts that the search of such a kitchen begins with.
        improvements: Climbs of such a search.
    """

    tasks: tuple[str, ...] = tuple(TASKS)
    seeds: int = 5
    quick: bool = False
    episodes: int = 96
    layouts: int = 3
    initial: int = 1_000
    improvements: int = 200

    def with_seeds(self, seeds: int) -> Settings:
        """The same with so many trainings of each."""
        return dataclasses.replace(self, seeds=seeds)


FULL: Final = Settings()
"""Some hours on two idle cores."""

QUICK: Final = Settings(seeds=2, quick=True, episodes=16, layouts=1, initial=200, improvements=20)
"""Some minutes: trainings are cut short."""


def trials_of(settings: Settings, kitchens: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One training for each task and seed; short ones first.

    Args:
        settings: What is run.
        kitchens: ``condition`` and ``drawing`` of the kitchens in which policies are tried.
    """
    places = [{"where": str(place["condition"]), "drawing": str(place["drawing"])} for place in kitchens]
    trials = []
    for seed in range(settings.seeds):
        for name in settings.tasks:
            task = TASKS[name]
            steps = task.quick_steps if settings.quick else task.steps
            changes = {**task.changes, "steps": steps, "seed": seed}
            trials.append(
                {
                    "task": name,
                    "seed": seed,
                    "training": recipe(task.domain, task.arguments).replaced(changes).to_dict(),
                    "episodes": settings.episodes,
                    "places": places if task.elsewhere else [],
                }
            )
    return sorted(trials, key=lambda trial: (trial["seed"], trial["training"]["steps"]))
