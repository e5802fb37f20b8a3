"""A robot that shares the table: its beliefs, its motion, and the fluency of the team."""
