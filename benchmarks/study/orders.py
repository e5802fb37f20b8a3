"""Orders of conditions: Williams squares, simple random, fixed, or a policy of one's own; the least filled comes next."""
