"""People simulated directly in a study's layouts: what its data may look like before anybody has taken part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.study.analysis.played import cell_of_cook, named, setting_name
from benchmarks.study.design.study import Study
from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.timeline import Screen, timeline

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.study.games.base import Game
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Simulated", "person_of", "player_of", "simulate_people"]


@dataclass
class Simulated:
    """What simulated people did.

    Attributes:
        trajectories: With two goals or more to choose from.
        rounds: A row per round: ``participant, condition, sitting, round`` and its outcome.
    """

    trajectories: list[Trajectory] = field(default_factory=list)
    rounds: list[dict[str, Any]] = field(default_factory=list)


def simulate_people(
    study: Study,
    participants: int,
    rng: np.random.Generator,
    *,
    people: Mapping[str, Any] | None = None,
    progress: Callable[[str], object] | None = None,
) -> Simulated:
    """Let people who walk or reach as fitted ones do play every round of a study.

    Each has habits of their own, the same in all conditions. Conditions come in the order of the file, and nobody
    learns.

    Args:
        study: The design.
        participants: How many.
        rng: Source of all randomness.
        people: Kitchens: as of :func:`~legible_envs.overcooked.humans.planner_fitting.draw_person`; None for those
            that were fitted to recorded play.
        progress: Called with the name of each.
    """
    found = Simulated()
    screens = [screen for screen in timeline(study, study.conditions) if screen.kind == "round"]
    for number in range(1, participants + 1):
        name = f"S{number:03d}"
        if progress is not None:
            progress(f"simulate: {name} ({number} of {participants})")
        person = person_of(study, rng, people)
        finished: list[tuple[Screen, dict[str, Any]]] = []
        for screen in screens:
            left = reaches_left(study, screen, finished)
            if left == 0:
                continue
            game = make_game(study, screen, int(rng.integers(2**31)), reaches_left=left)
            try:
                outcome = _play(study, game, person, rng)
                reaches = game.trajectories(participant=name, condition=screen.condition)
            finally:
                game.close()
            finished.append((screen, outcome))
            layout = setting_name(study, screen.condition, screen.sitting)
            found.trajectories += [each for each in named(reaches, layout) if len(each.candidates) > 1]
            sittings = study.content.sittings
            sitting = sittings[screen.sitting].name if sittings else ""
            labels = {"participant": name, "condition": screen.condition, "sitting": sitting, "round": screen.round}
            found.rounds.append(labels | outcome)
    return found


def person_of(study: Study, rng: np.random.Generator, people: Mapping[str, Any] | None = None) -> Any:
    """How somebody walks or reaches."""
    if study.content.domain == "overcooked":
        from benchmarks.experiments.overcooked.sweep import FITTED, PREFERENCE
        from legible_envs.overcooked.humans.planner_fitting import draw_person
        from legible_envs.overcooked.layouts import read_layout

        shape = read_layout(study.layout_of(study.conditions[0])).shape
        fitted = {"walker": "boltzmann", "preference": PREFERENCE, **FITTED["boltzmann"]}
        return draw_person(people or fitted)(shape, rng)
    from legible_envs.tabletop.humans.simulation import Person, ReachModel, sample_person

    return sample_person(rng, ReachModel(Person(crossing_rate=0.0)))


def player_of(study: Study, env: Any, person: Any, rng: np.random.Generator) -> Callable[[Any, Any], Any]:
    """The person at a game."""
    if study.content.domain == "overcooked":
        from legible_envs.overcooked.policies import WalkingPlayer

        return WalkingPlayer(env, person, rng)
    from legible_envs.tabletop.policies import ReachingPlayer

    return ReachingPlayer(env, person, rng)


def _play(study: Study, game: Game, person: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Play a round to its end; its outcome, of kitchens with the cells walked and the seconds at 0.15 s a step."""
    act, moves = player_of(study, game.env, person, rng), 0
    is_kitchen = study.content.domain == "overcooked"
    cell = cell_of_cook(game) if is_kitchen else None
    while not game.is_over:
        game.step(game.read_action(np.asarray(act(game.obs, game.info)).tolist()))  # type: ignore[attr-defined]
        if is_kitchen:
            after = cell_of_cook(game)
            moves, cell = moves + (after != cell), after
    outcome = game.outcome()
    if is_kitchen:
        return outcome | {"path_length": float(moves), "seconds": 0.15 * outcome["steps"]}
    return outcome | {"seconds": outcome["time"]}
