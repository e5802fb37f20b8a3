"""Playing the rounds of a study with simulated participants, before anybody is invited: can they be finished?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.study.games import make_game
from benchmarks.study.timeline import GAMES, Screen, timeline

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.games.base import Game

__all__ = ["Rehearsal", "rehearse"]


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """A round as a simulated participant played it.

    Attributes:
        screen: The round, or the practice.
        rounds: How many rounds it stands for: of one condition in one sitting.
        steps: Steps it took.
        max_steps: After which it would have ended.
        finished: Whether it was done by then: the task, or the reaches that are wanted.
    """

    screen: Screen
    rounds: int
    steps: int
    max_steps: int
    finished: bool


def rehearse(study: Study, rng: np.random.Generator) -> Iterator[Rehearsal]:
    """Play the practice and the rounds of each condition in each sitting, as one participant would.

    Kitchens are cooked in by the scripted player, who takes shortest paths to goals drawn at random; tables by a
    simulated person, beside the study's robot. A condition that ends after so many reaches is played until then.

    Args:
        study: The design.
        rng: Source of all randomness.

    Yields:
        One for each practice and condition, its steps summed over the rounds.
    """
    screens = [screen for screen in timeline(study, study.conditions) if screen.kind in GAMES]
    firsts = [screen for screen in screens if screen.round <= 1]
    for first in firsts:
        own = [s for s in screens if (s.kind, s.sitting, s.condition) == (first.kind, first.sitting, first.condition)]
        yield _play_condition(study, own, rng)


def _play_condition(study: Study, screens: list[Screen], rng: np.random.Generator) -> Rehearsal:
    """Play the rounds of one condition, or the practice once."""
    content, is_practice = study.content, screens[0].kind == "practice"
    rules = content.practice if is_practice and content.practice is not None else content.rounds
    wanted = content.rounds.reaches if not is_practice and content.domain == "tabletop" else 0
    rounds = steps = made = 0
    is_done = True
    for screen in screens:
        game = make_game(study, screen, int(rng.integers(2**31)), reaches_left=wanted - made if wanted else None)
        try:
            _play(game, rng)
            outcome = game.outcome()
            is_done &= bool(outcome["finished"]) or game.steps < rules.max_steps  # over before: what was wanted is made
        finally:
            game.close()
        rounds, steps, made = rounds + 1, steps + outcome["steps"], made + outcome.get("reaches", 0)
        if wanted and made >= wanted:
            break
    return Rehearsal(screens[0], rounds, steps, rules.max_steps * rounds, made >= wanted if wanted else is_done)


def _play(game: Game, rng: np.random.Generator) -> None:
    player: Any
    if game.scene()["kind"] == "kitchen":
        from legible_envs.overcooked.policies import ScriptedPlayer

        player = ScriptedPlayer(game.env, rng)
    else:
        from legible_envs.tabletop.humans import sample_person
        from legible_envs.tabletop.policies import ReachingPlayer

        player = ReachingPlayer(game.env, sample_person(rng), rng)
    view: Any = game
    while not game.is_over:
        action = player(view.obs, view.info)
        game.step(action if isinstance(action, int) else [float(v) for v in np.asarray(action).ravel()])
