"""What docs/reliability.md promises, tested as the testers of a database would: kills, flipped bits, malformed files.

Every test takes its number of attempts from ``repeats(few, many)``: ``few`` in the suite, ``many`` with ``--thorough``,
which takes hours. The attempts are drawn from fixed seeds, so that what failed can be tried again.
"""
