"""What docs/reliability.md promises, tested as the testers of a database would: kills, flipped bits, malformed files.

With ``--thorough``, which takes hours, tests try as often as that page says. Attempts are drawn from fixed seeds, so
that what failed can be tried again.
"""
