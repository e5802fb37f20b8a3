"""The database of a study: a few plain tables, where an acknowledged row is on disk."""
