"""Rollouts and trajectories: their types, how they are recorded, and the files that keep them (npz, CSV, Minari).

>>> from legible_envs.rollouts import RecordTrajectories, write_csv
>>> env = RecordTrajectories(gym.make("LegibleOvercooked-v0"))      # doctest: +SKIP
>>> gymnasium.utils.play.play(env)                              # doctest: +SKIP
>>> write_csv("reaches.csv", env.trajectories(participant="p1"))  # doctest: +SKIP
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
