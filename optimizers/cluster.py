"""The way to a Dask scheduler: an address, someone there who speaks Dask, and workers."""

from __future__ import annotations

import contextlib
import logging
import pickle
import socket
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from optimizers.errors import ClusterError
from optimizers.fingerprint import Fingerprint, differences, fingerprint, fingerprint_here, remarks

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["SILENCE", "WORKERS", "Cluster", "Process", "check_address", "connect"]

Process = tuple[str, str]
"""A worker: its address, and its folder, which tells it from one that had the address before."""

_SCHEMES: Final = ("tcp", "tls", "ws", "wss")

SILENCE: Final = 5.0
"""Seconds after which someone who has not said a word is taken not to speak Dask; schedulers speak first."""

WORKERS: Final = 60.0
"""Seconds to wait for a worker where there is none."""

_ANSWER: Final = 30.0
"""Seconds after which a scheduler that does not answer is lost."""

_FETCH: Final = 5.0
"""Seconds that results may take to come; a worker that is gone meanwhile would never send them."""

_POLL: Final = 0.1
"""Seconds between two looks at the workers while there is none."""

_GREETING: Final = 1 << 16
"""Bytes that no scheduler's greeting reaches."""


def check_address(address: str) -> tuple[str, str, int]:
    """Scheme, host and port of an address such as ``"tcp://10.0.0.1:8786"``; TCP where it names no scheme.

    Raises:
        ValueError: It is something else; says what is wrong with it.
    """
    expected = "expected an address such as tcp://10.0.0.1:8786"
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ValueError(f"{address!r} is no address of a scheduler: {error}; {expected}") from error
    if parts.scheme not in _SCHEMES:
        raise ValueError(f"{address!r} is no address of a scheduler: {parts.scheme}:// is none of its protocols "
                         f"({', '.join(f'{scheme}://' for scheme in _SCHEMES)}); {expected}")  # fmt: skip
    if not host or not port:
        raise ValueError(f"{address!r} is no address of a scheduler: its {'port' if host else 'host'} is missing; "
                         f"{expected}")  # fmt: skip
    if parts.path.strip("/") or parts.query or parts.fragment:
        raise ValueError(f"{address!r} is no address of a scheduler: it goes on after the port; {expected}")
    return parts.scheme, host, port


def connect(scheduler: str, timeout: float = 10.0) -> Client:
    """A client of a running scheduler.

    Args:
        scheduler: Its address, such as ``"tcp://10.0.0.1:8786"``.
        timeout: Seconds to wait for it.

    Raises:
        ImportError: Dask is not installed; the message says how to get it.
        ValueError: That is no address.
        ClusterError: Nobody answers at that address, or someone who does not speak Dask.
    """
    scheme, host, port = check_address(scheduler)
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError("a cluster needs Dask: pip install 'legible-envs[distributed]'") from error
    how = "start one with `dask scheduler` and workers with `dask worker ADDRESS`"
    if scheme == "tcp" and (problem := _greeting_problem(host, port, min(timeout, SILENCE))):
        raise ClusterError(f"no Dask scheduler answers at {scheduler!r}: {problem}; {how}")
    try:
        return Client(scheduler, timeout=timeout, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"no Dask scheduler answers at {scheduler!r} ({error}); {how}") from error


def _greeting_problem(host: str, port: int, patience: float) -> str:
    """Why whoever listens there is no scheduler; empty if its first words are those of one.

    Dask's own client takes the first bytes of any answer for the length of a message, and waits for ever for one that
    does not come.
    """
    heard = b""
    try:
        with socket.create_connection((host, port), timeout=patience) as line:
            deadline = time.monotonic() + patience
            while len(heard) < 8 or len(heard) < 8 + int.from_bytes(heard[:8], "little"):
                line.settimeout(max(0.01, deadline - time.monotonic()))
                piece = line.recv(4096)
                heard += piece
                if not piece or int.from_bytes(heard[:8].ljust(8, b"\0"), "little") > _GREETING:
                    break
    except socket.gaierror as error:
        return f"the name {host} is not known here ({error.strerror})"
    except TimeoutError:
        return f"whoever listens there said nothing in {patience:g} s" if _listens(host, port) else "it does not answer"
    except OSError as error:
        return error.strerror or str(error)
    if b"compression" in heard and b"pickle-protocol" in heard:
        return ""
    return "whoever listens there does not speak Dask" if heard else "whoever listens there hangs up"


def _listens(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


class Cluster:
    """A Dask scheduler, and those of its workers that run the same code as this process.

    Every worker is asked for its fingerprint before it is given work, also one that joins later. One that differs is
    named in a warning and not used.

    Args:
        scheduler: Address of the scheduler.
        packages: What the workers run; they must have the same files of each.
        patience: Seconds to wait for a worker that may be used, at first and where none is left.
        deadline: ``time.monotonic()`` at which waiting ends in any case; None for no such time.

    Attributes:
        scheduler: Address of the scheduler.
        client: The client that speaks with it.
        digests: Of the packages, to be checked by each piece of work itself (:func:`.fingerprint.expect`): under the
            address of a worker there may be another one by now.

    Raises:
        ClusterError: No scheduler answers at the address.
    """

    def __init__(
        self, scheduler: str, packages: Iterable[str], patience: float = WORKERS, deadline: float | None = None
    ) -> None:
        self.scheduler = scheduler
        self.client = connect(scheduler)
        self._ours = fingerprint(*packages)
        self.digests = self._ours.digests
        self._patience = patience
        self._deadline = deadline
        self._asked: dict[Process, Future] = {}
        self._refused: dict[Process, str] = {}
        self._accepted: set[Process] = set()
        if self._ours.changed:
            warnings.warn(
                f"{self._ours.changed[0]} was changed since this process loaded it, so workers run other code; "
                "start this process again",
                stacklevel=2,
            )

    def workers(self) -> dict[Process, int]:
        """Numbers of threads of the workers that may be used now; asks those that have joined since.

        Raises:
            ClusterError: The scheduler was lost.
        """
        found = {(address, str(about.get("local_directory"))): about for address, about in self._described().items()}
        for known in (self._asked, self._refused):
            for process in known.keys() - found.keys():
                known.pop(process)
        self._accepted &= found.keys()
        for process in found.keys() - self._accepted - self._refused.keys():
            self._ask(process)
        return {
            process: int(about["nthreads"])
            for process, about in found.items()
            if process in self._accepted and about.get("status", "running") == "running"
        }

    def wait(self) -> dict[Process, int]:
        """The same once there is one.

        Raises:
            ClusterError: The scheduler was lost, or no worker that may be used came in time; says why.
        """
        began, said = time.monotonic(), False
        limit = self._patience
        if self._deadline is not None:
            limit = max(0.0, min(limit, self._deadline - began))
        while not (workers := self.workers()):
            waited = time.monotonic() - began
            if waited >= limit:
                raise ClusterError(f"{self._why_none(limit)}; start some with `dask worker {self.scheduler}`")
            if not said and not self._asked:
                said = True
                state = "has no other workers" if self._refused else "has no workers"
                warnings.warn(
                    f"the scheduler at {self.scheduler} {state}; waiting up to {limit:.3g} s for one: "
                    f"`dask worker {self.scheduler}`",
                    stacklevel=2,
                )
            time.sleep(_POLL)
        return workers

    def there(self, process: Process) -> bool:
        """Whether this worker could be used when the workers were last looked at."""
        return process in self._accepted

    def forget(self) -> None:
        """Ask all workers again: one of them turned out to run other code."""
        self._accepted.clear()

    def submit(self, function: Callable[..., Any], *arguments: Any, workers: Iterable[Process]) -> Future:
        """Give work to any of these workers, and to no other.

        Raises:
            ClusterError: The scheduler was lost.
        """
        addresses = [address for address, _ in workers]
        with self._speaking():
            return self.client.submit(function, *arguments, pure=False, workers=addresses, allow_other_workers=False)

    def ended(self, futures: Sequence[Future], seconds: float, *, any_of: bool = False) -> list[Future]:
        """Those that ended, well or not, after waiting for all or for any of them up to some seconds.

        Raises:
            ClusterError: The scheduler was lost.
        """
        from distributed import wait

        with self._speaking(), self.client.as_current(), contextlib.suppress(TimeoutError):
            wait(list(futures), timeout=seconds, return_when="FIRST_COMPLETED" if any_of else "ALL_COMPLETED")
        with self._speaking():
            found = [future for future in futures if future.done()]
            if any(future.cancelled() for future in found):
                raise self._lost()
            return found

    def results(self, futures: Sequence[Future]) -> list[Any] | None:
        """What came of work that ended; None where a worker that held some of it is gone.

        Raises:
            ClusterError: The scheduler was lost.
            Exception: What the work raised.
        """
        for future in futures:
            if future.status == "error":
                with self._speaking():
                    error = future.exception(timeout=_ANSWER)
                if "deserialization of the task graph" in str(error):
                    raise ClusterError(
                        f"the scheduler at {self.scheduler} cannot read what it is sent; start it in an environment "
                        "with the same packages as the workers"
                    )
                raise error.with_traceback(None)
        with self._speaking(), contextlib.suppress(TimeoutError):
            return self.client.sync(
                lambda: self.client.gather(list(futures), asynchronous=True), callback_timeout=_FETCH
            )
        return None

    def cancel(self, futures: Sequence[Future]) -> None:
        """Have work not done that nobody waits for any more."""
        with contextlib.suppress(Exception):  # the scheduler may be gone, and all work with it
            self.client.cancel(list(futures))

    def close(self) -> None:
        """Leave the cluster."""
        log = logging.getLogger("distributed")
        # A client whose scheduler is gone reports that it tried to find it again.
        with _muted(log, *(logging.getLogger(f"distributed.{name}") for name in ("client", "core", "batched"))):
            self.client.close(timeout=2)

    @contextlib.contextmanager
    def _speaking(self) -> Iterator[None]:
        """Errors of the connection are one of ours, whichever of its own kinds Dask has for them."""
        if self.client.status != "running":
            raise self._lost()
        try:
            yield
        except (ClusterError, TimeoutError):
            raise
        except (OSError, CancelledError):
            raise self._lost() from None
        except Exception:
            if self.client.status == "running":
                raise
            raise self._lost() from None

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"the scheduler at {self.scheduler} was lost: it ended, was restarted, or cannot be reached any more"
        )

    def _described(self) -> Mapping[str, Mapping[str, Any]]:
        """What the scheduler says of each worker, by its address."""
        with self._speaking():
            try:
                return self.client.sync(self.client.scheduler.identity, callback_timeout=_ANSWER)["workers"]
            except TimeoutError:
                raise self._lost() from None

    def _ask(self, process: Process) -> None:
        """Ask a worker for its fingerprint, or judge its answer."""
        answer = self._asked.get(process)
        if answer is None or answer.status in ("cancelled", "lost"):
            question = pickle.dumps(_Call(fingerprint_here, list(self.digests)))
            self._asked[process] = self.submit(pickle.loads, question, workers=[process])
            return
        if not answer.done():
            return
        del self._asked[process]
        reasons, minor = self._judged(answer)
        if reasons:
            self._refused[process] = "; ".join(reasons)
            warnings.warn(f"the worker {process[0]} is not used: {self._refused[process]}", stacklevel=2)
            return
        self._accepted.add(process)
        if minor:
            warnings.warn(f"the worker {process[0]} may differ in the last digits: {'; '.join(minor)}", stacklevel=2)

    def _judged(self, answer: Future) -> tuple[list[str], list[str]]:
        """Why a worker is not used, and in what it differs less."""
        try:
            if answer.status != "error":
                theirs = Fingerprint.from_plain(answer.result(timeout=_ANSWER))
                return differences(self._ours, theirs), remarks(self._ours, theirs)
            error = answer.exception(timeout=_ANSWER)
        except Exception as failure:
            error = failure
        return [f"it cannot say which code it runs ({type(error).__name__}: {error})"], []

    def _why_none(self, seconds: float) -> str:
        limited = self._deadline is not None and seconds < self._patience
        within = "before the time limit" if limited else f"within {seconds:.3g} s"
        reasons = [f"{address} is not used: {why}" for (address, _), why in self._refused.items()]
        reasons += [f"{address} is short of memory and takes no work" for address, _ in self._accepted]
        reasons += [f"{address} does not answer, or is busy with other work" for address, _ in self._asked]
        if not reasons:
            return f"no worker joined the scheduler at {self.scheduler} {within}"
        return f"no worker of the scheduler at {self.scheduler} can be used {within}: {'; '.join(reasons)}"


class _Call:
    """What pickles as a call, made where the bytes are read.

    Dask's workers read tasks as they arrive, and end where they cannot. Bytes are read by the task itself: a worker
    without our packages answers with an error, and stays for others.
    """

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self._made = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self._made


@contextlib.contextmanager
def _muted(*loggers: logging.Logger) -> Iterator[None]:
    """Nothing that these loggers are told meanwhile is shown."""

    def nothing(record: logging.LogRecord) -> bool:
        return False

    for logger in loggers:
        logger.addFilter(nothing)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(nothing)
