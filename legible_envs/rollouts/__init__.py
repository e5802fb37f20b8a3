"""Rollouts and trajectories: their types, how they are recorded, and the files that keep them (npz, CSV, Minari).

>>> from legible_envs.rollouts import RecordTrajectories, write_csv
>>> env = gymnasium.make("LegibleTabletop-v0", render_mode="rgb_array")  # doctest: +SKIP
>>> env = RecordTrajectories(env, participant="p1")  # doctest: +SKIP
>>> gymnasium.utils.play.play(env, noop=np.zeros(2))  # doctest: +SKIP
>>> write_csv("reaches.csv", env.trajectories())  # doctest: +SKIP
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
