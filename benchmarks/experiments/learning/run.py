"""Train every policy of the experiment and try it out; nothing that has finished is run again."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np

from benchmarks.experiments.learning.settings import Environment, TrainingSettings, require_torch
from benchmarks.experiments.learning.sweep import FULL, QUICK, TASKS, Settings, trials_of
from benchmarks.experiments.running import Rows, RunOptions, log_trials
from benchmarks.trials import TrialName, trial_function

__all__ = ["learn", "reproduce"]

_HIDDEN: Final = ("training", "places", "episodes")
_POINTS: Final = 60
"""Of a learning curve that is logged."""


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    settings: Settings | None = None,
    **how: Unpack[RunOptions],
) -> None:
    """Run the trainings that have no result yet, and write ``learning.csv``, of which ``sections`` makes tables.

    Args:
        folder: Folder of the experiment.
        quick: Short trainings.
        seeds: Trainings of each task; None for those of the settings.
        settings: In place of the full or quick ones.
        how: ``workers``, ``scheduler`` and ``progress`` of :func:`benchmarks.trials.run_trials`.

    Raises:
        TrialsFailed: Some trainings failed; everything else is finished and on disk.
        ImportError: PyTorch is not installed.
    """
    from benchmarks.experiments.overcooked.run import find_layout
    from benchmarks.experiments.overcooked.sweep import Settings as Conditions
    from benchmarks.experiments.overcooked.sweep import layout_trials

    require_torch()
    settings = settings or (QUICK if quick else FULL)
    if seeds is not None:
        settings = settings.with_seeds(seeds)
    folder = Path(folder)
    kitchens: list[dict[str, Any]] = []
    if any(TASKS[name].elsewhere for name in settings.tasks):
        conditions = Conditions(layouts=settings.layouts, initial=settings.initial, improvements=settings.improvements)
        found = log_trials(find_layout, layout_trials(conditions), folder / "layouts.csv", **how)
        own = found[found["table"] == "layout"]
        kitchens = [
            {"condition": name, "drawing": at} for name, at in zip(own["condition"], own["drawing"], strict=True)
        ]
    log_trials(learn, trials_of(settings, kitchens), folder / "learning.csv", hidden=_HIDDEN, **how)


@trial_function(TrialName("learning/learn"))
def learn(trial: dict[str, Any]) -> Rows:
    """One training, and how well its policy plays; a training that is interrupted begins again.

    Rows of tables: ``curve`` (``steps, score, length, finished``: means over the episodes that ended since the row
    before), ``played`` (``where, player, score, length, finished, done, episodes``: of the policy, of its most probable
    actions, and of the scripted cook; ``where`` is ``"trained"`` or other kitchens) and ``speed``
    (``steps_per_second`` and shares of the time).
    """
    import json

    from benchmarks.experiments.learning.policy import TrainedPolicy
    from benchmarks.experiments.learning.train import train

    settings = TrainingSettings.from_dict(trial["training"])
    with tempfile.TemporaryDirectory() as folder:
        checkpoint = train(settings, folder)
        speed = json.loads((Path(folder) / "speed.json").read_text())
    rows: Rows = [{"table": "curve", **row} for row in thinned(checkpoint.curve)]
    shares = {f"{name}_share": share for name, share in speed["shares"].items()}
    rows.append({"table": "speed", "steps_per_second": speed["steps_per_second"], **shares})
    for where, environment in places_of(settings.environment, trial["places"]):
        players = {
            "policy": TrainedPolicy(checkpoint, rng=np.random.default_rng(trial["seed"])),
            "most probable actions": TrainedPolicy(checkpoint, greedy=True),
        }
        rows += _play(where, environment, players, trial["episodes"])
    return rows


def _play(where: str, environment: Environment, players: Mapping[str, Any], episodes: int) -> Rows:
    """How well policies and the scripted cook play in one place; nothing where nobody can cook alone."""
    from benchmarks.experiments.learning.evaluation import evaluate_policy, evaluate_scripted, summary
    from legible_envs.errors import LayoutError

    try:
        played = {name: evaluate_policy(policy, environment, episodes, 1) for name, policy in players.items()}
        if "Overcooked" in environment.id and environment.arguments.get("num_players", 1) == 1:
            played["scripted"] = evaluate_scripted(environment, episodes, 1)
    except LayoutError:
        return []
    return [{"table": "played", "where": where, "player": name, **summary(rows)} for name, rows in played.items()]


def places_of(environment: Environment, kitchens: list[dict[str, Any]]) -> list[tuple[str, Environment]]:
    """Where a policy is tried: where it was trained, and, if there are kitchens, in others.

    Args:
        environment: Of the training.
        kitchens: ``where`` and ``drawing`` of those of the paper's conditions; empty: no other place.
    """
    places = [("trained", environment)]
    if not kitchens:
        return places
    own = {name: value for name, value in environment.arguments.items() if name != "layouts"}
    places.append(("held out", Environment(id=environment.id, arguments={**own, "layouts": "random:test"})))
    drawings: dict[str, list[str]] = {}
    for place in kitchens:
        drawings.setdefault(place["where"], []).append(place["drawing"])
    for where, found in drawings.items():
        places.append((where, Environment(id=environment.id, arguments={**own, "layouts": found})))
    for name, drawing in _classic_kitchens().items():
        arguments = {key: value for key, value in own.items() if key != "shape"}
        places.append((name, Environment(id=environment.id, arguments={**arguments, "layout": drawing})))
    return places


def _classic_kitchens() -> dict[str, str]:
    """The five kitchens of recorded play; none where the recordings are absent."""
    from legible_envs.datasets.overcooked_2019 import RecordingsError, recorded_layouts

    try:
        return {name: layout.to_ascii() for name, layout in recorded_layouts().items()}
    except RecordingsError:
        return {}


def thinned(curve: np.ndarray[Any, np.dtype[np.float64]]) -> Rows:
    """At most 60 rows: means over episodes, of so many updates each; rows without episodes are left out."""
    rows: Rows = []
    for part in np.array_split(curve, min(_POINTS, len(curve))):
        ended = part[:, 1]
        if ended.sum():
            score, length, finished = (np.nansum(part[:, 2:5] * ended[:, None], axis=0) / ended.sum()).tolist()
            rows.append({"steps": int(part[-1, 0]), "score": score, "length": length, "finished": finished})
    return rows
