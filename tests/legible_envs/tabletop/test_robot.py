"""The robot partner: alone against what it senses, and in closed loop with people who reach straight."""

import copy
import itertools
import math
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.partner.belief import GoalBelief
from legible_envs.tabletop.partner.interface import Senses
from legible_envs.tabletop.partner.robot import RobotPartner
from legible_envs.tabletop.partner.steering import Steering
from tests.legible_envs.tabletop.table_team import RATE, Team

COLUMNS = TabletopTask.named("columns")
TEA = TabletopTask.named("tea")
WALLED = COLUMNS.layout.with_obstacles([VirtualObstacle((0.33, 0.45)), VirtualObstacle((0.57, 0.45), 1.5)])


def shuffled(rng):
    """The columns' cubes anywhere in the region, 8 cm apart."""
    centres = []
    while len(centres) < 8:
        at = rng.uniform((0.10, 0.20), (0.80, 0.70))
        if all(math.dist(at, other) > 0.08 for other in centres):
            centres.append(tuple(at))
    objects = zip(COLUMNS.layout.objects, centres, strict=True)
    return TabletopLayout([TableObject(o.name, at) for o, at in objects])


AT_RED = (0.185, 0.345)  # all but at the red circle


def senses(*way, task=COLUMNS, time=0.0, start=(0.6, 0.05), number=1, **more):
    """What a robot sees of a person who reached from the start to here, with the first column to build."""
    free = tuple(more.pop("free", task.layout.goals[:4]))
    reach = [start, *way]
    return Senses(
        **{
            "time": time,
            "hand": np.array(reach[-1], dtype=float),
            "reach": np.array(reach, dtype=float),
            "times": np.arange(len(reach)) / RATE,
            "reach_number": number,
            "start": np.array(start),
            "goals": free,
            "free": free,
            "positions": task.layout.centres,
            "person_holding": None,
            "gripper": np.array((0.60, 0.75)),
            "holding": None,
            **more,
        }
    )


def ready(task=COLUMNS, layout=None, **options):
    robot = RobotPartner(**options)
    robot.reset(layout or task.layout, task)
    return robot


# -- what it decides ---------------------------------------------------------------------------------------------------


def test_it_waits_until_it_is_sure():
    robot = ready()
    unsure = robot.step(senses())
    assert (unsure.state, unsure.decided, unsure.target, unsure.velocity.tolist()) == ("wait", False, None, [0, 0])
    assert unsure.belief == dict.fromkeys(COLUMNS.layout.goals[:4], 0.25)
    sure = robot.step(senses(AT_RED))
    belief = GoalBelief(COLUMNS.layout, start=(0.6, 0.05), goals=COLUMNS.layout.goals[:4]).update(AT_RED)
    assert sure.belief == belief
    assert belief["red-circle"] > 0.8
    assert (sure.decided, sure.predicted, sure.state) == (True, "red-circle", "approach")
    assert sure.target == "yellow-triangle"  # of the other three the nearest to the gripper
    assert np.hypot(*sure.velocity) > 0


def test_of_the_others_it_takes_the_nearest_to_its_gripper():
    rng = np.random.default_rng(3)
    for _ in range(50):
        robot = ready(threshold=0)
        gripper, hand = rng.uniform((0, 0), (1.2, 0.8), (2, 2))
        command = robot.step(senses(hand, gripper=gripper))
        others = [g for g in COLUMNS.layout.goals[:4] if g != command.predicted]
        assert command.target == min(others, key=lambda g: math.dist(COLUMNS.layout.place(g), gripper))
        assert command.belief[command.predicted] == max(command.belief.values())


def test_if_the_predicted_goal_is_all_there_is_it_waits():
    robot = ready()
    command = robot.step(senses(free=["red-circle"]))
    assert command.belief == {"red-circle": 1.0}
    assert (command.predicted, command.state, command.target) == ("red-circle", "wait", None)


def test_what_the_person_holds_is_certain():
    robot = ready()
    left = COLUMNS.layout.goals[1:4]
    command = robot.step(senses(person_holding="red-circle", goals=(), free=left))
    assert (command.predicted, command.belief, command.state) == ("red-circle", None, "approach")
    assert command.target in left
    # Once they have placed it the old reach says nothing of the next.
    robot = ready()
    robot.step(senses((0.3, 0.3), person_holding="red-circle", goals=(), free=()))
    assert robot.step(senses((0.2, 0.35), (0.95, 0.6), free=left)).belief is None
    assert robot.step(senses(number=2, start=(0.95, 0.6), free=left)).belief


def test_it_yields_what_the_person_takes_and_decides_anew():
    robot = ready()
    first = robot.step(senses(AT_RED))
    assert first.target == "yellow-triangle"
    left = tuple(g for g in COLUMNS.layout.goals[:4] if g != "yellow-triangle")
    taken = robot.step(senses(AT_RED, (0.72, 0.55), person_holding="yellow-triangle", goals=(), free=left))
    assert taken.conflict
    assert taken.predicted == "yellow-triangle"
    assert (taken.state, taken.target) == ("approach", "green-triangle")
    assert not robot.step(senses(AT_RED, (0.72, 0.55), person_holding="yellow-triangle", goals=(), free=left)).conflict


def test_it_yields_as_soon_as_it_is_sure_that_the_person_wants_the_same():
    robot = ready()
    assert robot.step(senses(AT_RED)).target == "yellow-triangle"
    turned = robot.step(senses(AT_RED, (0.5, 0.45), (0.718, 0.547)))
    assert (turned.predicted, turned.conflict) == ("yellow-triangle", False)
    assert turned.target == "green-triangle"


def test_once_decided_it_keeps_its_target_when_unsure():
    robot = ready()
    target = robot.step(senses(AT_RED)).target
    unsure = robot.step(senses(AT_RED, (0.6, 0.06)))
    assert (unsure.decided, unsure.target, unsure.state) == (False, target, "approach")


def test_what_vanished_without_the_person_is_no_conflict():
    robot = ready()
    robot.step(senses(AT_RED))
    gone = robot.step(senses(AT_RED, free=COLUMNS.layout.goals[:3]))
    assert not gone.conflict
    assert gone.target == "green-triangle"


def test_it_takes_only_what_has_a_place():
    task = TabletopTask("half", TEA.layout, TEA.graph, {"cup": (1.0, 0.45)})
    robot = ready(task)
    command = robot.step(senses(person_holding="cup", goals=(), free=("teabag",), task=task))
    assert command.state == "wait"
    by_other_hands = robot.step(senses(holding="teabag", free=(), task=task, time=1.0))
    assert by_other_hands.velocity.tolist() == [0, 0]
    assert robot.step(senses(holding="teabag", free=(), task=task, time=2.0)).release


def test_a_fetch_from_wait_to_wait():
    team = Team(RobotPartner(grasp_time=0.2), COLUMNS, seed=1).play()
    states = [command.state for _, command in team.log]
    changes = states[:1] + [b for a, b in itertools.pairwise(states) if a != b]
    followers = {"wait": {"approach"}, "approach": {"grasp", "wait"}, "grasp": {"carry", "wait", "approach"}}
    followers |= {"carry": {"place"}, "place": {"wait", "approach"}}
    assert all(b in followers[a] for a, b in itertools.pairwise(changes))
    assert set(states) == set(followers)
    grasps = [s.time for s, c in team.log if c.grasp]
    begins = [s.time for (_, a), (s, c) in itertools.pairwise(team.log) if a.state != "grasp" == c.state]
    assert len(grasps) == list(team.placed_by.values()).count("robot")
    for grasp in grasps:
        begin = max(time for time in begins if time <= grasp)  # it may have begun others, and yielded
        assert grasp - begin == pytest.approx(0.2, abs=0.6 / RATE)


# -- in closed loop ----------------------------------------------------------------------------------------------------


def check_episode(team):
    """What must hold in every episode."""
    robot, column = team.robot, set(team.layout.goals[:4])
    for s, c in team.log:
        assert c.target is None or c.target not in (s.person_holding, c.predicted) or c.target == s.holding
        if c.grasp is not None:
            assert c.grasp in s.free
            assert c.grasp != c.predicted
            assert c.grasp != s.person_holding
        if c.state in ("approach", "grasp"):
            assert c.target in s.free
        if c.belief is not None:
            assert tuple(c.belief) == s.goals
            assert c.predicted == (
                max(c.belief, key=c.belief.get) if max(c.belief.values()) > robot.threshold else None
            ) or sorted(c.belief.values())[-1] == pytest.approx(sorted(c.belief.values())[-2])
        assert np.hypot(*c.velocity) <= robot.max_speed + 1e-12
    first = next((i for i, (_, c) in enumerate(team.log) if c.decided), len(team.log))
    assert all(c.state == "wait" and not c.velocity.any() for _, c in team.log[:first])
    assert team.finished
    if team.task is COLUMNS:
        assert set(team.done[:4]) == column


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.3, 0.6, 0.8, 0.95, 0.999]),
    st.floats(0.1, 1.5),
    st.floats(0.2, 1.5),
    st.sampled_from(["columns", "walled", "shuffled", "tea"]),
)
def test_teams_always_finish_and_the_robot_keeps_its_rules(seed, threshold, robot_speed, hand_speed, table):
    layouts = {"walled": WALLED, "shuffled": shuffled(np.random.default_rng(seed))}
    robot = RobotPartner(threshold=threshold, max_speed=robot_speed)
    task = TEA if table == "tea" else COLUMNS
    check_episode(Team(robot, task, layouts.get(table), seed=seed, hand_speed=hand_speed).play())


def test_the_robot_does_its_share():
    by_robot = [list(Team(RobotPartner(), COLUMNS, seed=s).play().placed_by.values()).count("robot") for s in range(6)]
    assert min(by_robot) >= 1
    alone = Team(RobotPartner(threshold=1.0), COLUMNS).play()
    together = Team(RobotPartner(), COLUMNS).play()
    assert together.time < alone.time


def test_threshold_1_never_acts_and_threshold_0_acts_at_once():
    never = Team(RobotPartner(threshold=1.0), COLUMNS, seed=2).play()
    assert never.finished
    assert set(never.placed_by.values()) == {"person"}
    assert all(c.state == "wait" and not c.decided and not c.velocity.any() for _, c in never.log)
    # even where there is but one goal, and where the hand is at it
    assert any(c.belief is not None and max(c.belief.values()) == 1 for _, c in never.log)
    at_once = Team(RobotPartner(threshold=0), COLUMNS, seed=2).play()
    first = next(i for i, (s, _) in enumerate(at_once.log) if len(s.reach))
    assert at_once.log[first][1].state == "approach"
    tie = ready(threshold=0).step(senses())
    assert (tie.predicted, tie.decided) == ("blue-circle", True)  # of tied goals the nearest to the hand


def test_a_lower_threshold_decides_earlier():
    fractions = [
        np.mean([Team(RobotPartner(threshold=t), COLUMNS, seed=s).play().metrics.summary()["decision_fraction"]
                 for s in range(3)])
        for t in (0.0, 0.5, 0.9)
    ]  # fmt: skip
    assert fractions == sorted(fractions)
    assert fractions[0] < fractions[-1]


def test_beside_a_person_who_does_nothing_it_stays_at_home():
    team = Team(RobotPartner(), COLUMNS, idle=True).play(5.0)
    assert not team.done
    assert all(c.state == "wait" and not c.velocity.any() and c.belief is None for _, c in team.log)


def commands(team):
    return [
        (c.velocity.tolist(), c.grasp, c.release, c.target, c.belief, c.predicted, c.state, c.conflict)
        for _, c in team.log
    ]


def test_episodes_are_deterministic_and_leave_nothing_behind():
    robot = RobotPartner()
    first = commands(Team(robot, COLUMNS, seed=5).play())
    assert commands(Team(RobotPartner(), COLUMNS, seed=5).play()) == first
    Team(robot, TEA, seed=1).play(3.0)
    assert commands(Team(robot, COLUMNS, seed=5).play()) == first  # used before, in the middle of another task


def test_it_can_be_copied_and_pickled_in_the_middle_of_an_episode():
    team = Team(RobotPartner(), COLUMNS, seed=4)
    team.play(3.1)
    for twin in (copy.deepcopy(team), pickle.loads(pickle.dumps(team))):
        twin.play()
        twin_commands = commands(twin)
    assert commands(team.play()) == twin_commands


# -- how it moves ------------------------------------------------------------------------------------------------------

points = st.tuples(st.floats(0, 1.2), st.floats(0, 0.8))


@settings(deadline=None, max_examples=80)
@given(points, points, points)
def test_it_goes_smoothly_and_arrives_without_coming_near_a_hand_at_rest(gripper, there, hand):
    steering = Steering(max_speed=0.5, acceleration=1.0, clearance=0.06, rate=RATE)
    near = math.dist(gripper, hand)
    velocity = (0.0, 0.0)
    for _ in range(400):
        velocity, before = steering.towards(there, gripper, hand), velocity
        assert math.hypot(*velocity) <= 0.5 + 1e-9
        if near >= 0.06 + 0.13:  # far enough to stop without keeping clear
            assert math.dist(velocity, before) <= 1.0 / RATE + 1e-9 or math.dist(gripper, hand) < 0.06 + 0.13
        gripper = (gripper[0] + velocity[0] / RATE, gripper[1] + velocity[1] / RATE)
        now = math.dist(gripper, hand)
        assert now >= min(near, 0.06) - 1e-9
        near = max(near, now) if near < 0.06 else near
    if math.dist(there, hand) > 0.075:
        assert math.dist(gripper, there) < 0.005


def test_it_backs_off_from_a_hand_that_comes_nearer():
    steering = Steering(max_speed=0.5, acceleration=1.0, clearance=0.06, rate=RATE)
    gripper, hand = (0.6, 0.5), (0.6, 0.3)
    for _ in range(120):
        hand = (0.6, hand[1] + 0.4 / RATE)  # slower than the robot
        velocity = steering.towards((0.6, 0.5), gripper, hand)
        gripper = (gripper[0] + velocity[0] / RATE, gripper[1] + velocity[1] / RATE)
        assert math.dist(gripper, hand) > 0.06 - 0.4 / RATE - 1e-9
    assert steering.towards((0.6, 0.5), (0.6, 0.4), (0.6, 0.4))[1] > 0  # even from under it: away from the person


def test_where_a_hand_rests_on_its_way_it_waits_beside_it():
    team = Team(RobotPartner(), COLUMNS)
    place = COLUMNS.configuration["red-circle"]
    team.hand = np.array(place)
    team.caught, team.idle = "red-circle", True
    team.play(8.0)
    assert team.caught == "red-circle"
    assert math.dist(team.gripper, place) == pytest.approx(0.06, abs=0.003)
    team.hand = np.array((0.6, 0.05))
    team.play(10.0)
    assert team.done == ["red-circle"]


# -- predictors --------------------------------------------------------------------------------------------------------


class Uniform:
    """A predictor that notes what it is shown."""

    def __init__(self):
        self.streams = []

    def stream(self, context):
        self.context, self.points, self.times = context, [], []
        self.streams.append((context, self.points, self.times))
        return self

    def update(self, point, time=None):
        self.points.append(tuple(point))
        self.times.append(time)
        return dict.fromkeys(self.context.candidates, 1 / len(self.context.candidates))


class Faulty(Uniform):
    """Right at first, then wrong."""

    def __init__(self, fault="raise", after=3):
        super().__init__()
        self.fault, self.after = fault, after

    def update(self, point, time=None):
        belief = super().update(point, time)
        first = next(iter(belief))
        if len(self.points) <= self.after:
            return belief
        match self.fault:
            case "raise":
                raise RuntimeError("out of tea")
            case "nan":
                return {**belief, first: math.nan}
            case "negative":
                return {g: (-1.0 if g == first else (2.0 / (len(belief) - 1))) for g in belief}
            case "sum":
                return dict.fromkeys(belief, 1.0 + len(belief))
            case "unknown":
                return {**belief, "elephant": 0.0}
            case "missing":
                return {g: p for g, p in belief.items() if g != first} or {"elephant": 1.0}
            case "none":
                return None
            case "text":
                return dict.fromkeys(belief, "sure")


@pytest.mark.parametrize("fault", ["raise", "nan", "negative", "sum", "unknown", "missing", "none", "text"])
def test_a_predictor_that_fails_is_reported_once_and_the_robot_waits(fault):
    robot = RobotPartner(Faulty(fault))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        team = Team(robot, COLUMNS, seed=1).play()
        Team(robot, COLUMNS, seed=2).play(2.0)
    assert [w.category for w in caught] == [RuntimeWarning]
    assert "Faulty" in str(caught[0].message)
    assert robot.failure in str(caught[0].message)
    assert team.finished  # the episode went on
    for s, c in team.log:  # without a belief it only acts on what it sees the person hold
        if c.belief is None and s.person_holding is None:
            assert not c.decided
    failed = [s.reach_number for s, c in team.log if len(s.reach) > 4 and s.goals and not s.person_holding]
    assert failed
    assert all(c.belief is None for s, c in team.log if len(s.reach) > 4 and s.reach_number in failed)


def test_a_predictor_that_fails_at_first_may_do_better_in_the_next_reach():
    class Late(Faulty):
        def stream(self, context):
            if not self.streams:
                self.streams.append(None)
                raise KeyError("not yet")
            return Uniform().stream(context)

    with pytest.warns(RuntimeWarning, match=r"Late.*not yet"):
        team = Team(RobotPartner(Late()), COLUMNS, seed=1).play()
    beliefs = {s.reach_number for s, c in team.log if c.belief is not None}
    assert 1 not in beliefs
    assert 2 in beliefs


def test_a_predictor_sees_each_reach_from_its_beginning_once_and_nothing_of_the_future():
    spy = Uniform()
    team = Team(RobotPartner(spy, threshold=0), COLUMNS, seed=3)
    while not team.finished:
        team.step()
        if spy.streams and team.log[-1][1].belief is not None:
            s = team.log[-1][0]
            context, points, times = spy.streams[-1]
            assert points == [tuple(p) for p in s.reach]
            assert times == s.times.tolist()
            assert context.candidates == s.goals
            assert context.layout is team.layout
            assert context.goal_positions == tuple(tuple(s.positions[team.layout.index(g)].tolist()) for g in s.goals)
    assert not any(c.num_states for c, _, _ in spy.streams)
    assert len(spy.streams) >= team.number
    assert {c.start for c, _, _ in spy.streams} == {"home", "assembly"}


def test_where_the_valid_goals_change_during_a_reach_the_predictor_sees_it_again():
    spy = Uniform()
    robot = ready(predictor=spy)
    robot.step(senses((0.5, 0.2)))
    robot.step(senses((0.5, 0.2), goals=COLUMNS.layout.goals[:3]))
    assert [c.candidates for c, _, _ in spy.streams] == [COLUMNS.layout.goals[:4], COLUMNS.layout.goals[:3]]
    assert spy.streams[0][1] == spy.streams[1][1] == [(0.6, 0.05), (0.5, 0.2)]


def test_predict_proba_is_enough():
    class Bare:
        classes_ = np.array(sorted(COLUMNS.layout.goals))

        def predict_proba(self, prefixes):
            rows = []
            for prefix in prefixes:
                stream = GoalBelief(
                    prefix.layout, start=prefix.states[0], goals=prefix.candidates, positions=prefix.goal_positions
                )
                belief = stream.update(prefix.states[-1])
                rows.append([belief.get(g, 0.0) for g in self.classes_])
            return np.array(rows)

    assert commands(Team(RobotPartner(Bare()), COLUMNS, WALLED, seed=1).play()) == commands(
        Team(RobotPartner(), COLUMNS, WALLED, seed=1).play()
    )


@pytest.mark.parametrize(
    ("spec", "error", "message"),
    [
        ("no.such.module:Thing", ValueError, "cannot be imported"),
        ("math:no_such_name", ValueError, "cannot be imported"),
        ("unheard-of", ValueError, "module:Class"),
        ("math:dist", ValueError, "without arguments"),
        ("collections:Counter", TypeError, "stream"),
        (3, TypeError, "stream"),
        (Uniform, TypeError, "stream"),
    ],
)
def test_what_is_no_predictor_is_named(spec, error, message):
    with pytest.raises(error, match=message):
        RobotPartner(spec)


@pytest.mark.parametrize(
    "options",
    [
        {"threshold": -0.1},
        {"threshold": 1.1},
        {"threshold": math.nan},
        {"threshold": True},
        {"threshold": "high"},
        {"rate": 0},
        {"max_speed": 0},
        {"max_speed": math.inf},
        {"acceleration": -1},
        {"reach": 0},
        {"grasp_time": -1},
        {"clearance": -1},
        {"home": (1, 2, 3)},
        {"home": (math.nan, 0)},
    ],
)
def test_wrong_settings_are_named(options):
    with pytest.raises(ValueError, match=f"`{next(iter(options))}`"):
        RobotPartner(**options)


def test_a_home_off_the_table_is_rejected_at_the_table():
    with pytest.raises(ValueError, match="off the table"):
        RobotPartner(home=(2, 0)).reset(COLUMNS.layout, COLUMNS)
    assert RobotPartner(home=(0.2, 0.7)).reset(COLUMNS.layout, COLUMNS).tolist() == [0.2, 0.7]


# -- the predictors of this project ------------------------------------------------------------------------------------


def reaches_of_people(layout=COLUMNS.layout):
    from legible_envs.tabletop.humans import simulate_participants

    return simulate_participants(layout, 4, np.random.default_rng(0), task=COLUMNS)


def test_a_fitted_predictor_plugs_in():
    from predictors import StraightLineBayesian

    straight = StraightLineBayesian(obstacles=False).fit(reaches_of_people())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        team = Team(RobotPartner(straight), COLUMNS, seed=1).play()
    # Without obstacles the built-in belief is the same; rounding may differ.
    own = Team(RobotPartner(), COLUMNS, seed=1).play()
    assert [(c.target, c.predicted, c.state) for _, c in team.log] == [
        (c.target, c.predicted, c.state) for _, c in own.log
    ]
    for (_, theirs), (_, ours) in zip(team.log, own.log, strict=True):
        assert (theirs.belief is None) == (ours.belief is None)
        assert theirs.belief is None or theirs.belief == pytest.approx(ours.belief, abs=1e-9)
    walled = Team(RobotPartner(straight), COLUMNS, WALLED, seed=1).play()
    assert walled.log[20][1].belief != Team(RobotPartner(), COLUMNS, WALLED, seed=1).play().log[20][1].belief


@pytest.mark.parametrize(
    "spec",
    [
        "predictors.reaching.bayesian:StraightLineBayesian",
        "predictors.reaching.gaussian:TimeSeriesGaussian",
        "predictors:ReachLogistic",
    ],
)
def test_a_predictor_named_by_its_class_is_fitted_on_simulated_people(spec):
    robot = RobotPartner(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        team = Team(robot, COLUMNS, WALLED, seed=2).play(4.0)
    assert robot.failure is None
    assert any(c.belief is not None for _, c in team.log)
    assert any(c.target for _, c in team.log)


def test_on_another_table_it_is_fitted_anew():
    spec = "predictors.reaching.bayesian:StraightLineBayesian"
    robot = RobotPartner(spec)
    first = commands(Team(robot, COLUMNS, WALLED, seed=2).play())
    assert Team(robot, TEA, seed=2).play().finished
    assert commands(Team(robot, COLUMNS, WALLED, seed=2).play()) == first
    assert commands(Team(RobotPartner(spec), COLUMNS, WALLED, seed=2).play()) == first
    assert robot.failure is None


def test_fitting_leaves_the_users_predictor_alone():
    from predictors import StraightLineBayesian

    mine = StraightLineBayesian()
    team = Team(RobotPartner(mine), COLUMNS, seed=1).play()
    assert any(c.belief for _, c in team.log)
    assert not hasattr(mine, "classes_")


def test_a_predictor_that_cannot_be_fitted_is_reported():
    class Unteachable(Uniform):
        def fit(self, X):
            raise ValueError("I know better")

    robot = RobotPartner(Unteachable())
    with pytest.warns(RuntimeWarning, match="know better"):
        robot.reset(COLUMNS.layout, COLUMNS)
    assert robot.step(senses(AT_RED)).belief is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot.reset(COLUMNS.layout, COLUMNS)


def test_a_predictor_that_could_be_fitted_elsewhere_is_fitted_there_again():
    class Choosy(Uniform):
        def fit(self, X):
            if X[0].layout == WALLED:
                raise ValueError("no walls")

    def believes_at(layout):
        robot.reset(layout, COLUMNS)
        return robot.step(senses(AT_RED)).belief is not None

    robot = RobotPartner(Choosy())
    assert believes_at(COLUMNS.layout)
    with pytest.warns(RuntimeWarning, match="no walls"):
        assert not believes_at(WALLED)
    assert believes_at(COLUMNS.layout)


def test_importing_the_package_loads_nothing_heavy():
    import subprocess
    import sys

    code = "import sys, legible_envs.tabletop; print([m for m in ('numba', 'sklearn', 'pymunk') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


# -- in the environment ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        {"partner": "robot"},
        {"partner": {"max_speed": 1.0}, "threshold": 0.5, "layout": WALLED},
        {"partner": "robot", "predictor": "predictors.reaching.bayesian:StraightLineBayesian", "layout": WALLED},
        {"partner": "robot", "threshold": 0.0, "virtual_obstacles": "soft", "task": "tea", "contact": "always"},
    ],
)
def test_teams_of_simulated_people_and_robots_finish_in_the_environment(arguments):
    import gymnasium as gym

    from legible_envs.tabletop.humans import sample_person
    from legible_envs.tabletop.policies import ReachingPlayer

    warnings.simplefilter("error", RuntimeWarning)  # the predictor never fails; pytest restores the filters
    env = gym.make("legible_envs:LegibleTabletop-v0", **arguments)
    by_robot = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        player = ReachingPlayer(env, sample_person(rng), rng)
        obs, info = env.reset(seed=seed)
        over = False
        while not over:
            obs, _, terminated, truncated, info = env.step(player(obs, info))
            view = env.unwrapped.view()
            assert view.robot_holding is None or view.robot_holding != view.holding
            over = terminated or truncated
        assert terminated
        assert info["completion_time"] == info["time"]
        assert 0 <= info["concurrent_activity"] <= 1 - max(info["human_idle"], info["robot_idle"]) + 1e-9
        by_robot += info["num_done"] - len(env.unwrapped.trajectories())
    assert by_robot > 0
