"""How the robot's gripper moves: smoothly, and never near a hand at rest."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.tabletop.partner.robot import RobotPartner
from legible_envs.tabletop.partner.steering import Steering
from tests.legible_envs.tabletop.robot_cases import COLUMNS
from tests.legible_envs.tabletop.table_team import RATE, Team

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
