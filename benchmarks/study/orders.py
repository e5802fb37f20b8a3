"""Orders of conditions."""


def next_order(policy, conditions, counts, rng):
    return 0, list(conditions)
