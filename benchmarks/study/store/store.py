"""The database of a study: rows are acknowledged once they are on disk, many of them at a time.

One thread writes. It takes whatever waits, puts it into one transaction and commits that (``synchronous=FULL``), so
that the price of a commit is shared by everybody who acts at the same moment. What awaits :meth:`Store.write` goes on
when its rows would survive a loss of power.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import queue
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, TypeVar

from benchmarks.study.errors import StudyError
from benchmarks.study.store.joining import Statement, is_many, joined
from benchmarks.study.store.schema import SCHEMA, TABLES

__all__ = ["Mode", "NoParticipant", "Statement", "Store", "database_path", "open_readonly"]

Mode = Literal["live", "debug"]
_Result = TypeVar("_Result")

_MOST_AT_ONCE: Final = 512
_KNOWN: Final = "SELECT 1 FROM participants WHERE participant = ?"
_WAIT: Final = 30.0
"""Seconds to wait for another process, such as one that forgets a participant."""


def database_path(folder: Path, mode: Mode) -> Path:
    """Where the database of a study lies."""
    return folder / "data" / f"{mode}.sqlite"


@contextlib.contextmanager
def open_readonly(path: Path) -> Iterator[sqlite3.Connection]:
    """A connection that cannot write, rows by name; the server may go on beside it.

    Raises:
        StudyError: There is no database, or it is of another version.
    """
    if not path.is_file():
        raise StudyError(f"there is no database {path}: nobody has taken part yet")
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=_WAIT)
    connection.row_factory = sqlite3.Row
    try:
        _check_schema(connection, path)
        yield connection
    finally:
        connection.close()


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    try:
        row = connection.execute("SELECT value FROM study WHERE key = 'schema'").fetchone()
    except sqlite3.DatabaseError as error:
        raise StudyError(f"{path} is no database of a study: {error}") from error
    if row is None or row[0] != str(SCHEMA):
        raise StudyError(f"{path} has tables of version {row and row[0]}; this program reads version {SCHEMA}")


class NoParticipant(sqlite3.IntegrityError):
    """Rows are of a participant whom the database does not know: they are forgotten. Nothing was written."""


class _Job(NamedTuple):
    statements: Sequence[Statement]
    of: str
    done: asyncio.Future[None]
    loop: asyncio.AbstractEventLoop


class Store:
    """The database of one study and mode, for the one server that writes it.

    Args:
        path: The file; made with its folder where it is missing.
        mode: ``"live"`` or ``"debug"``: a database keeps the mode it was made with.
        name: Of the study; likewise.

    Raises:
        StudyError: The file is no such database, or another server is writing it.
    """

    def __init__(self, path: Path, *, mode: Mode, name: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._closed = False
        self.mode = mode
        self._lock = _lock(path)
        try:
            _only_for_owner(path)
            self._writer = self._open()
            self._prepare(mode, name)
        except sqlite3.DatabaseError as error:
            self._unlock()
            raise StudyError(f"{path} cannot be used as the database of a study: {error}") from error
        except BaseException:
            self._unlock()
            raise
        self._reader = sqlite3.connect(
            f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=_WAIT, check_same_thread=False
        )
        self._reading = threading.Lock()
        self._reader.row_factory = sqlite3.Row
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=f"store-{mode}", daemon=True)
        self._thread.start()

    def _open(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, timeout=_WAIT, isolation_level=None, check_same_thread=False)
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA secure_delete = ON")  # who is forgotten leaves no bytes behind
        return connection

    def _prepare(self, mode: Mode, name: str) -> None:
        try:
            known = dict(self._writer.execute("SELECT key, value FROM study").fetchall())
        except sqlite3.OperationalError:
            known = {}
        except sqlite3.DatabaseError as error:
            raise StudyError(f"{self.path} is no database of a study: {error}") from error
        if not known:
            rows = {"schema": SCHEMA, "mode": mode, "study": name, "created": time.time(), "recruitment": "open"}
            self._writer.executescript(f"BEGIN IMMEDIATE;{TABLES}")
            self._writer.executemany("INSERT INTO study VALUES (?, ?)", [(k, str(v)) for k, v in rows.items()])
            self._writer.execute("COMMIT")
            return
        _check_schema(self._writer, self.path)
        for key, value in (("mode", mode), ("study", name)):
            if known.get(key) != value:
                raise StudyError(f"{self.path} holds data of the {key} {known.get(key)!r}, not of {value!r}")

    # -- writing ------------------------------------------------------------------------------------------------------

    async def write(self, *statements: Statement, of: str = "") -> None:
        """Execute statements together; returns once they are on disk.

        Args:
            *statements: What to write.
            of: The participant that all of it is about, if it is about one who has a row.

        Raises:
            NoParticipant: This participant has no row.
            sqlite3.Error: None of them is on disk.
        """
        if self._closed:
            raise sqlite3.ProgrammingError("the database is closed")
        loop = asyncio.get_running_loop()
        done: asyncio.Future[None] = loop.create_future()
        self._jobs.put(_Job(statements, of, done, loop))
        await done

    def write_now(self, *statements: Statement) -> None:
        """The same for callers without an event loop, before or after the server runs."""
        loop = asyncio.new_event_loop()
        try:
            loop.run_until_complete(self.write(*statements))
        finally:
            loop.close()

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            jobs, stop = [job], False
            with contextlib.suppress(queue.Empty):
                while len(jobs) < _MOST_AT_ONCE:
                    following = self._jobs.get_nowait()
                    if following is None:
                        stop = True
                        break
                    jobs.append(following)
            _answer(self._commit(jobs))
            if stop:
                return

    def _commit(self, jobs: Sequence[_Job]) -> list[tuple[_Job, Exception | None]]:
        """One transaction; a job that fails takes back its own rows alone."""
        try:
            if len(jobs) > 1 and self._commit_together(jobs):
                return [(job, None) for job in jobs]
            return self._transact(lambda: [(job, self._execute(job)) for job in jobs])
        except Exception as error:
            return [(job, error) for job in jobs]

    def _commit_together(self, jobs: Sequence[_Job]) -> bool:
        """All jobs as if they were one; False, and nothing is done, where something is wrong with one of them."""
        statements = joined([statement for job in jobs for statement in job.statements])
        try:
            self._transact(lambda: [self._writer.execute(sql, values) for sql, values in statements])
        except Exception:
            return False
        return True

    def _transact(self, work: Callable[[], _Result]) -> _Result:
        """Do something in a transaction of its own; what raises leaves nothing behind."""
        connection = self._writer
        try:
            connection.execute("BEGIN IMMEDIATE")
            result = work()
            connection.execute("COMMIT")
        except Exception:
            with contextlib.suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise
        return result

    def _execute(self, job: _Job) -> Exception | None:
        """Execute a job; what is wrong with its values, which no other job has to suffer for.

        Raises:
            sqlite3.Error: The database itself failed.
        """
        connection = self._writer
        connection.execute("SAVEPOINT job")
        try:
            if job.of and not connection.execute(_KNOWN, [job.of]).fetchone():
                raise NoParticipant(f"there is no participant {job.of}")
            for sql, values in job.statements:
                if is_many(values):
                    connection.executemany(sql, values)
                else:
                    connection.execute(sql, values)
        except Exception as error:
            if not connection.in_transaction or isinstance(error, sqlite3.OperationalError):
                raise  # the disk is full or fails: nothing of this transaction will be there
            connection.execute("ROLLBACK TO job")
            connection.execute("RELEASE job")
            return error
        connection.execute("RELEASE job")
        return None

    # -- reading ------------------------------------------------------------------------------------------------------

    def read(self, sql: str, values: Sequence[Any] = ()) -> list[sqlite3.Row]:
        """Rows as they are on disk now."""
        with self._reading:
            return self._reader.execute(sql, values).fetchall()

    def value(self, key: str) -> str:
        """A value of the table ``study``; empty where there is none."""
        rows = self.read("SELECT value FROM study WHERE key = ?", (key,))
        return str(rows[0][0]) if rows else ""

    def close(self) -> None:
        """Write what waits, and let go of the files; a second time does nothing."""
        if self._closed:
            return
        self._closed = True
        self._jobs.put(None)
        self._thread.join()
        self._reader.close()
        self._writer.close()
        self._unlock()

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)


def _answer(answers: Sequence[tuple[_Job, Exception | None]]) -> None:
    """Wake whoever waits: one call for each event loop, not one for each row."""
    loops = {id(job.loop): job.loop for job, _ in answers}
    for key, loop in loops.items():
        own = [(job.done, error) for job, error in answers if id(job.loop) == key]
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(_resolve, own)


def _resolve(answers: Sequence[tuple[asyncio.Future[None], Exception | None]]) -> None:
    for done, error in answers:
        if done.done():  # its waiter was cancelled
            continue
        if error is None:
            done.set_result(None)
        else:
            done.set_exception(error)


def _only_for_owner(path: Path) -> None:
    """Make the file where it is missing, readable by its owner alone: it holds the ids of workers."""
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))


def _lock(path: Path) -> int | None:
    """Hold a lock beside the database for as long as this process lives; None where the system has no such locks."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    handle = os.open(path.with_name(f"{path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise StudyError(f"another server is writing {path}; stop it first") from None
    return handle
