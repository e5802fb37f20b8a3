"""Tables, senses and predictors that the tests of the robot partner share."""

import numpy as np

from legible_envs.tabletop import TabletopTask, VirtualObstacle
from legible_envs.tabletop.partner.interface import Senses
from legible_envs.tabletop.partner.robot import RobotPartner
from tests.legible_envs.tabletop.table_team import RATE

COLUMNS = TabletopTask.named("columns")
TEA = TabletopTask.named("tea")
WALLED = COLUMNS.layout.with_obstacles([VirtualObstacle((0.33, 0.45)), VirtualObstacle((0.57, 0.45), 1.5)])
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


def commands(team):
    return [
        (c.velocity.tolist(), c.grasp, c.release, c.target, c.belief, c.predicted, c.state, c.conflict)
        for _, c in team.log
    ]


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
