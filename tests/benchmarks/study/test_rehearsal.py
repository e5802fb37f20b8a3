"""Rehearsals: simulated participants play every round before anybody is invited."""

import numpy as np
import pytest

from benchmarks.study.design.new import new_study
from benchmarks.study.design.study import load_study
from benchmarks.study.games.rehearsal import rehearse


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    place = tmp_path_factory.mktemp("studies")
    for domain in ("overcooked", "tabletop"):
        new_study(place / domain, domain=domain)
    return place


def test_every_round_of_the_new_studies_can_be_finished(folders):
    for domain in ("overcooked", "tabletop"):
        study = load_study(folders / domain)
        played = list(rehearse(study, np.random.default_rng(0)))
        assert [each.screen.condition for each in played] == ["", *study.conditions]
        assert all(each.finished and 0 < each.steps < each.max_steps for each in played)


def test_rounds_are_played_until_the_reaches_are_made_and_again_in_each_sitting(folders, tmp_path):
    text = (folders / "tabletop/study.toml").read_text()
    text = text.replace("reaches = 8 ", "reaches = 11 ").replace('kind = "robot"', 'kind = "robot"\n#')
    begin, end = text.index("[partner]"), text.index("[orders]")
    text = text[:begin] + text[end:] + '[[sittings]]\nname = "on"\n[[sittings]]\nname = "off"\nobstacles = false\n'
    (folders / "tabletop/study.toml").write_text(text.replace('name = "fluency"', 'name = "comments"'))
    played = list(rehearse(load_study(folders / "tabletop"), np.random.default_rng(1)))
    rounds = {(each.screen.condition, each.screen.sitting): each.rounds for each in played if each.screen.condition}
    assert rounds == {(c, s): 2 for c in ("Baseline", "Placement", "Virtual Obstacle", "Both") for s in (0, 1)}
    assert [each.screen.obstacles for each in played if each.screen.condition] == [True] * 4 + [False] * 4


def test_a_round_that_is_too_short_is_told(folders):
    path = folders / "overcooked/study.toml"
    path.write_text(path.read_text().replace("max_steps = 1200", "max_steps = 100"))
    played = list(rehearse(load_study(folders / "overcooked"), np.random.default_rng(0)))
    assert [each.finished for each in played] == [True, False, False, False, False]
    assert all(each.steps == each.max_steps == 100 for each in played[1:])
