"""Joining, playing and going on: the server as a page meets it."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.study.games import make_game
from benchmarks.study.timeline import timeline
from tests.benchmarks.study.pages_by_hand import ANSWERS, WAY, served, tiny_study


def test_a_whole_session(tmp_path: Path) -> None:
    """Every screen leaves a finished visit, every step a row with the digest before it, every item an answer."""
    study = tiny_study(tmp_path)
    with served(study) as server, server.page(server.join()) as page:
        assert page.name == "device"
        end = page.finish()
        assert (end["ending"], end["progress"]) == ("complete", 1.0)
        names = [row["name"] for row in server.rows("SELECT name FROM visits WHERE finished IS NOT NULL")]
        assert names == [screen.name for screen in timeline(study, study.conditions)]
        steps = server.rows("SELECT * FROM steps ORDER BY visit, step")
        assert len(steps) == 2 * len(WAY)
        round_one = server.rows("SELECT * FROM visits WHERE kind = 'round'")[0]
        game = make_game(study, timeline(study, study.conditions)[3], round_one["seed"])
        for row, action in zip(steps, WAY, strict=False):
            assert (row["before"], json.loads(row["action"])) == (game.digest(), action)
            game.step(action)
        assert json.loads(round_one["outcome"]) == game.outcome()
        answers = {row["item"]: json.loads(row["value"]) for row in server.rows("SELECT * FROM answers")}
        assert {name: answers[name] for name in ANSWERS} == ANSWERS
