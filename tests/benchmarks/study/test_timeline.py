"""What participants go through, screen by screen."""

from collections import Counter
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.study.design.models import StudyContent
from benchmarks.study.timeline import timeline


def study_of(**settings):
    content = StudyContent.model_validate(
        {
            "schema": 1,
            "name": "s",
            "title": "S",
            "domain": "overcooked",
            "conditions": [{"name": name, "layout": f"{name}.txt"} for name in "ABC"],
            **settings,
        }
    )
    return SimpleNamespace(content=content)


def test_a_study_of_one_sitting_in_the_order_of_the_participant():
    study = study_of(
        practice={"layout": "p.txt"},
        rounds={"per_condition": 2},
        questionnaires=[
            {"name": "how", "after": "practice"},
            {"name": "load"},
            {"name": "day", "after": "sitting"},
            {"name": "end", "after": "study"},
        ],
    )
    screens = timeline(study, ["C", "A", "B"])
    assert [screen.name for screen in screens] == [
        "device", "consent", "instructions", "practice", "practice#how",
        "round#C#1", "round#C#2", "C#load", "round#A#1", "round#A#2", "A#load", "round#B#1", "round#B#2", "B#load",
        "day", "study#end",
    ]  # fmt: skip
    assert [screen.condition for screen in screens if screen.questionnaire == "load"] == ["C", "A", "B"]
    assert all(screen.obstacles for screen in screens)


def test_sittings_have_their_conditions_their_obstacles_and_a_pause_between():
    study = study_of(
        sittings=[{"name": "on"}, {"name": "off", "obstacles": False, "conditions": ["A", "C"]}, {"name": "again"}]
    )
    screens = timeline(study, ["C", "B", "A"])
    games = [(s.sitting, s.condition, s.obstacles) for s in screens if s.kind == "round"]
    assert games == [
        (0, "C", True), (0, "B", True), (0, "A", True),
        (1, "C", False), (1, "A", False),
        (2, "C", True), (2, "B", True), (2, "A", True),
    ]  # fmt: skip
    assert [(s.name, s.sitting) for s in screens if s.kind == "pause"] == [("off#pause", 1), ("again#pause", 2)]


@given(
    st.integers(1, 3),
    st.lists(st.tuples(st.booleans(), st.sets(st.sampled_from("ABC"), min_size=1)), max_size=3),
    st.lists(
        st.tuples(st.sampled_from(["x", "y"]), st.sampled_from(["condition", "sitting", "study"])),
        unique=True,
        max_size=6,
    ),
    st.permutations("ABC"),
)
def test_screens_have_names_of_their_own_and_every_round_is_there_once(rounds, sittings, asked, order):
    study = study_of(
        rounds={"per_condition": rounds},
        sittings=[
            {"name": f"s{n}", "obstacles": on, "conditions": sorted(own)} for n, (on, own) in enumerate(sittings)
        ],
        questionnaires=[{"name": name, "after": after} for name, after in asked],
    )
    screens = timeline(study, order)
    assert max(Counter(screen.name for screen in screens).values()) == 1
    played = Counter((s.sitting, s.condition, s.round) for s in screens if s.kind == "round")
    blocks = [own for _, own in sittings] or [set("ABC")]
    wanted = {(n, c, r) for n, own in enumerate(blocks) for c in own for r in range(1, rounds + 1)}
    assert played == dict.fromkeys(wanted, 1)
    for number in range(len(blocks)):
        seen = [s.condition for s in screens if s.kind == "round" and s.sitting == number and s.round == 1]
        assert seen == [name for name in order if name in blocks[number]]
