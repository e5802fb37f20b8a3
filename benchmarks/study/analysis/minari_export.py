"""The rounds of a study as a Minari data set, for offline reinforcement learning."""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Sequence
from typing import Any

from benchmarks.study.analysis.database import PersonRow, VisitRow, steps_of, visits_of
from benchmarks.study.analysis.replaying import ReplayError, begin
from benchmarks.study.design.study import Study
from benchmarks.study.store.values import from_row
from legible_envs.support.plain_data import parse_json

__all__ = ["write_minari"]


def write_minari(study: Study, connection: sqlite3.Connection, persons: Sequence[PersonRow], dataset_id: str) -> int:
    """Write finished rounds of participants into Minari's local folder; returns how many.

    Args:
        study: The design.
        connection: To the database.
        persons: Whose rounds.
        dataset_id: As Minari names data sets: ``namespace/name-v0``.

    Raises:
        ImportError: Minari is not installed.
        ValueError: There is no round, or there is a data set of that name.
    """
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers the environments)
    from legible_envs.rollouts import RecordTrajectories, to_minari

    recorder: RecordTrajectories | None = None
    try:
        for person in persons:
            visits = visits_of(connection, person.participant)
            for visit in visits:
                if visit.kind != "round" or visit.finished is None:
                    continue
                if recorder is None:
                    env_id, settings = _environment(study, visits, person, visit)
                    recorder = RecordTrajectories(gym.make(env_id, max_episode_steps=-1, **settings))
                _record(recorder, study, connection, person, visits, visit)
        if recorder is None:
            raise ValueError(f"there is no finished round to make the Minari data set {dataset_id!r} of")
        title = f"Rounds of the study {study.content.name!r} (design {study.design_hash}) with human participants."
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that nobody is named as author; participants must not be
            to_minari(recorder, dataset_id, algorithm_name="human participants", description=title)
        return len(recorder.episodes)
    finally:
        if recorder is not None:
            recorder.close()


def _environment(
    study: Study, visits: Sequence[VisitRow], person: PersonRow, visit: VisitRow
) -> tuple[str, dict[str, Any]]:
    """Id and arguments of the environment that plays all rounds, as plain data; layouts come with each reset."""
    content = study.content
    game = begin(study, person, visits, visit)
    layout = game.env.layout
    game.close()
    if content.domain == "overcooked":
        kitchen = content.kitchen
        return "LegibleOvercooked-v0", {
            "layout": layout.to_ascii(),
            "recipes": kitchen.soups,
            "cook_time": kitchen.cook_time,
            "obs_type": "vector",
            "virtual_obstacles": kitchen.virtual_obstacles,
        }
    settings = content.table.model_dump()
    task = settings["task"]
    most = max(len(parse_json(text).get("obstacles", ())) for text in study.layouts.values())
    robot: dict[str, Any] = {}
    if content.partner is not None:
        robot["partner"] = content.partner.kind
        if content.partner.kind == "robot":
            robot |= {"predictor": content.partner.predictor, "threshold": content.partner.threshold}
    settings["task"] = str(study.folder / task) if task.endswith((".yaml", ".yml")) else task
    return "LegibleTabletop-v0", {**settings, **robot, "max_obstacles": max(4, most), "max_speed": 3.0}


def _record(
    recorder: Any,
    study: Study,
    connection: sqlite3.Connection,
    person: PersonRow,
    visits: Sequence[VisitRow],
    visit: VisitRow,
) -> None:
    try:
        game = begin(study, person, visits, visit)
    except ReplayError:
        return  # it is among the problems of the export
    try:
        recorder.reset(seed=visit.seed, options={"layout": game.env.layout})
        recorder.participant, recorder.condition = person.participant, visit.condition  # of the episode just begun
        for step in steps_of(connection, visit.visit):
            action = game.read_action(from_row(step.action))
            if study.content.domain == "tabletop":
                import numpy as np

                action = np.array(action, dtype=np.float32)
            recorder.step(action)
    finally:
        game.close()
