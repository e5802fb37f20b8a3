"""Team measures from a log, against counts by hand and sums over intervals."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.partner.fluency import TeamMetrics, Tick, tick_of
from legible_envs.tabletop.partner.interface import Command, Senses


def measured(log, end=None):
    metrics = TeamMetrics()
    for tick in log:
        metrics.add(tick)
    if end is not None:
        metrics.complete(end)
    return metrics


def timeline(human, robot, step=1.0):
    """A log from texts: a letter is an action, a dot is idleness."""
    return [
        Tick(i * step, None if h == "." else h, None if r == "." else r)
        for i, (h, r) in enumerate(zip(human, robot, strict=True))
    ]


def test_turn_taking_as_in_a_textbook():
    # The person acts for 3 s, the robot 1 s later for 4 s, the person in the same moment for 1 s, the robot 1 s later.
    found = measured(timeline("aaa.....b...", "....AAAA..BB"), end=12.0).summary()
    assert found["time"] == found["completion_time"] == 12.0
    assert found["human_idle"] == pytest.approx(8 / 12)
    assert found["robot_idle"] == pytest.approx(6 / 12)
    assert found["concurrent_activity"] == 0
    assert found["functional_delay"] == pytest.approx((1 + 0 + 1) / 12)


def test_overlap_is_a_delay_below_0():
    found = measured(timeline("aaaa....", "..AAAAAA"), end=8.0).summary()
    assert found["concurrent_activity"] == pytest.approx(2 / 8)
    assert found["functional_delay"] == pytest.approx(-2 / 8)


def test_another_label_is_another_action():
    joined = measured(timeline("aaaa", "..A."), end=4.0).summary()
    parted = measured(timeline("aaab", "..A."), end=4.0).summary()
    assert joined["human_idle"] == parted["human_idle"] == 0
    assert joined["functional_delay"] == pytest.approx(-2 / 4)  # the robot begins 2 s before a ends
    assert parted["functional_delay"] == pytest.approx((-1 + 0) / 4)  # 1 s before; b begins when A ends


def actions_of(log, agent, end):
    """``(begin, end)`` of every stretch with one label."""
    found, ends = [], [tick.time for tick in log[1:]] + [end]
    for label, stretch in itertools.groupby(zip(log, ends, strict=True), key=lambda pair: getattr(pair[0], agent)):
        pairs = list(stretch)
        if label is not None:
            found.append((pairs[0][0].time, pairs[-1][1]))
    return found


labels = st.sampled_from([None, "a", "b"])


@settings(max_examples=150)
@given(st.lists(st.tuples(st.floats(0.001, 5), labels, labels), min_size=1, max_size=25), st.floats(0.001, 5))
def test_measures_are_sums_over_intervals(rows, last):
    times = np.cumsum([0.5] + [step for step, _, _ in rows[1:]]).tolist()
    log = [Tick(time, human, robot) for time, (_, human, robot) in zip(times, rows, strict=True)]
    end = times[-1] + last
    found = measured(log, end).summary()
    total = end - times[0]
    spans = {agent: actions_of(log, agent, end) for agent in ("human", "robot")}

    def length(agent):
        return sum(b - a for a, b in spans[agent])

    both = sum(max(0.0, min(b, d) - max(a, c)) for a, b in spans["human"] for c, d in spans["robot"])
    in_order = sorted([(a, 0, b) for a, b in spans["human"]] + [(a, 1, b) for a, b in spans["robot"]])
    delay = sum(y[0] - x[2] for x, y in itertools.pairwise(in_order) if x[1] != y[1])
    assert found["completion_time"] == pytest.approx(total)
    assert found["human_idle"] == pytest.approx(1 - length("human") / total, abs=1e-9)
    assert found["robot_idle"] == pytest.approx(1 - length("robot") / total, abs=1e-9)
    assert found["concurrent_activity"] == pytest.approx(both / total, abs=1e-9)
    assert found["functional_delay"] == pytest.approx(delay / total, abs=1e-9)


READ = [
    Tick(0.0, reach=0),
    Tick(1.0, reach=1),
    Tick(1.5, reach=1, predicted="cup"),
    Tick(1.8, reach=1, predicted="milk"),  # the first goal it was sure of counts
    Tick(2.0, reach=1, predicted="cup", taken="cup"),
    Tick(2.5, reach=1, predicted="cup", taken="cup"),
    Tick(3.0, reach=1),
    Tick(4.0, reach=2, predicted="milk"),
    Tick(5.0, reach=2, taken="tea", conflict=True),
    Tick(6.0, reach=3),
    Tick(7.0, reach=4),  # the third reach was given up
    Tick(8.0, reach=4, taken="milk"),
    Tick(9.0, reach=5, predicted="tea"),  # not ended yet
]


def test_when_the_robot_was_sure_and_whether_rightly():
    metrics = measured(READ, 9.5)
    assert [(r.reach, r.taken, r.duration, r.decision_time, r.predicted) for r in metrics.predictions] == [
        (1, "cup", 1.0, 0.5, "cup"),
        (2, "tea", 1.0, 0.0, "milk"),
        (4, "milk", 1.0, 1.0, None),
    ]
    assert [(r.fraction, r.correct) for r in metrics.predictions] == [(0.5, True), (0.0, False), (1.0, False)]
    found = metrics.summary()
    assert found["conflicts"] == metrics.conflicts == 1
    assert found["reaches"] == 3
    assert found["decision_time"] == found["decision_fraction"] == 0.5
    assert found["decided"] == pytest.approx(2 / 3)
    assert found["decided_rightly"] == pytest.approx(1 / 3)


def test_a_reach_that_takes_no_time_was_read_at_its_end():
    (prediction,) = measured([Tick(1.0, reach=1, taken="cup", predicted="cup")]).predictions
    assert (prediction.duration, prediction.fraction, prediction.predicted) == (0.0, 1.0, None)


def test_waiting_is_no_reach_and_without_a_choice_there_is_nothing_to_read():
    metrics = measured(
        [
            Tick(0.0, reach=1, choices=0),
            Tick(3.0, reach=1, choices=2),
            Tick(4.0, reach=1, choices=1, predicted="cup"),
            Tick(5.0, reach=1, choices=0, taken="cup"),
            Tick(6.0, reach=2, choices=1, predicted="tea"),
            Tick(7.0, reach=2, choices=0, taken="tea"),
        ]
    )
    assert [(r.duration, r.decision_time, r.choices) for r in metrics.predictions] == [(2.0, 1.0, 2), (1.0, 0.0, 1)]
    found = metrics.summary()
    assert (found["reaches"], found["decision_time"], found["decision_fraction"]) == (2, 1.0, 0.5)


def test_before_anything_happened_shares_are_not_numbers():
    found = TeamMetrics().summary()
    assert found["time"] == found["conflicts"] == found["goals_lost"] == found["reaches"] == 0
    assert all(math.isnan(found[key]) for key in found if key not in ("time", "conflicts", "goals_lost", "reaches"))
    found = measured([Tick(3.0, "a", "b")]).summary()
    assert math.isnan(found["human_idle"])
    assert math.isnan(found["completion_time"])


def test_measures_are_the_same_however_often_they_are_asked_for():
    asked, metrics = TeamMetrics(), TeamMetrics()
    for tick in READ:
        asked.add(tick)
        asked.summary()
        metrics.add(tick)
    assert repr(asked.summary()) == repr(metrics.summary())


@pytest.mark.parametrize("time", [0.5, math.nan, math.inf])
def test_time_does_not_run_backwards(time):
    metrics = measured([Tick(1.0, "a")])
    with pytest.raises(ValueError, match="never decrease"):
        metrics.add(Tick(time))
    with pytest.raises(ValueError, match="never decrease"):
        metrics.complete(time)
    metrics.add(Tick(2.0))
    assert metrics.summary()["human_idle"] == 0


def test_a_line_from_what_the_robot_sensed_and_did():
    origin = np.zeros(2)
    senses = Senses(
        2.0, origin, np.zeros((1, 2)), np.zeros(1), 3, origin, (), (), np.zeros((2, 2)), "cup", origin, None
    )
    command = Command(origin, target="milk", predicted="cup", decided=True, conflict=True)
    assert tick_of(senses, command, True) == Tick(2.0, 3, "milk", 3, "cup", "cup", 0, True)
    assert tick_of(senses, command, False).human is None
    assert tick_of(senses, command, False, lost=True).lost


def test_conflicts_are_lost_by_the_robot_or_by_the_person():
    log = [Tick(0.0, conflict=True), Tick(1.0), Tick(2.0, lost=True), Tick(3.0, conflict=True)]
    found = measured(log, 4.0).summary()
    assert (found["conflicts"], found["goals_lost"]) == (3, 1)
