"""A robot that shares the table: what it believes, how it moves, and how fluent the team is."""
