"""The database of a study: a few plain tables, where an acknowledged row is on disk."""

from benchmarks.study.store.store import Mode, NoParticipant, Statement, Store, database_path, open_readonly

__all__ = ["Mode", "NoParticipant", "Statement", "Store", "database_path", "open_readonly"]
