"""A hand that reaches straight along shortest paths, and partners that are easy to foresee."""

from __future__ import annotations

import math

import numpy as np

from legible_envs.tabletop.partner.interface import Command

SPEED = 1.2


def towards(env, point, speed=SPEED):
    """The action that takes the hand towards a point, slower when it is near."""
    game = env.unwrapped
    offset = np.asarray(point) - game.hand
    distance = np.hypot(*offset)
    velocity = offset * 8 * min(1.0, speed / max(8 * distance, 1e-12))
    return (velocity / game.max_speed).astype(np.float32)


def next_point(env, goal):
    """Where to go next on the shortest path to an object."""
    game = env.unwrapped
    paths = game.layout.paths
    if not game.layout.obstacles:
        return game.positions[game.layout.index(goal)]
    path = paths.polyline(paths.nearest_free([game.hand])[0], goal)
    return path[1] if math.dist(path[0], path[1]) > 1e-3 or len(path) < 3 else path[2]


def go_to(env, point, limit=120, near=1e-3, speed=SPEED):
    """Move the hand to a point; returns the last result of ``step``, or None if it is there already."""
    result = None
    for _ in range(limit):
        if math.dist(env.unwrapped.hand, point) <= near:
            return result
        result = env.step(towards(env, point, speed))
        if result[2] or result[3]:
            return result
    raise AssertionError(f"the hand is at {env.unwrapped.hand}, not at {point}")


def fetch(env, goal, limit=200):
    """Take an object and place it; returns the last result of ``step``."""
    game = env.unwrapped
    for _ in range(limit):
        if game.holding is None:
            result = env.step(towards(env, next_point(env, goal)))
        else:
            result = env.step(towards(env, game.carry_to))
            if game.holding is None:
                return result
    raise AssertionError(f"{goal} is not placed after {limit} steps; the hand is at {game.hand}")


class Player:
    """Chooses among the valid goals, always the same way for one seed, and waits while there is none."""

    def __init__(self, seed=0):
        self.rng = np.random.default_rng(seed)
        self.goal = None

    def __call__(self, env):
        game = env.unwrapped
        if game.carry_to is not None:
            return towards(env, game.carry_to)
        goals = game.goals
        if self.goal not in goals:
            self.goal = str(self.rng.choice(goals)) if goals else None
        if self.goal is None:
            return np.zeros(2, dtype=np.float32)
        return towards(env, next_point(env, self.goal))


def play(env, seed=0, options=None):
    """Play one episode; returns every result of ``step``."""
    player, results = Player(seed), []
    env.reset(seed=seed, options=options)
    while not results or not (results[-1][2] or results[-1][3]):
        results.append(env.step(player(env)))
    return results


class Grabber:
    """A partner that fetches the objects it is told, whatever the person does, from where they lie."""

    def __init__(self, *targets, speed=0.8, drop_after=None):
        self.targets, self.speed, self.drop_after = targets, speed, drop_after
        self.log = []

    def reset(self, layout, task, rng):
        self.task, self.layout, self.carried = task, layout, 0
        self.left = list(self.targets)

    def step(self, senses):
        self.log.append(senses)
        if senses.holding is not None:
            self.carried += 1
            there, target = self.task.configuration[senses.holding], senses.holding
        else:
            self.left = [name for name in self.left if name in senses.free]
            target = self.left[0] if self.left else None
            there = senses.gripper if target is None else senses.positions[self.layout.index(target)]
        offset = np.asarray(there) - senses.gripper
        distance = float(np.hypot(*offset))
        velocity = offset * min(30.0, self.speed / max(distance, 1e-12))
        is_near = distance < 0.005
        drop = senses.holding is not None and (is_near or self.carried == self.drop_after)
        if drop and self.carried == self.drop_after:
            self.left = []
        grasp = target if senses.holding is None and is_near else None
        return Command(velocity=velocity, grasp=grasp, release=drop, target=target)


class Mute:
    """A predictor that raises."""

    classes_ = ()

    def stream(self, context):
        return self

    def update(self, point, time=None):
        raise RuntimeError("no idea")


class Doubtful(Mute):
    """A predictor that says NaN."""

    def stream(self, context):
        self.goals = context.candidates
        return self

    def update(self, point, time=None):
        return dict.fromkeys(self.goals, float("nan"))
