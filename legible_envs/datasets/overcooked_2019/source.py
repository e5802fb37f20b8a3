"""Getting the published recordings: one file, known by its hash, from the user's own package index.

Overcooked-AI's 2019 human-human games are part of the source distribution of its Python package. The file is found on
whatever index pip is set up to use, read as an archive, and neither built, imported nor executed.
"""

from __future__ import annotations

import ast
import hashlib
import io
import logging
import os
import ssl
import subprocess
import sys
import tarfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from legible_envs.datasets.overcooked_ai.games import Progress, RecordingsError

__all__ = ["PipSettings", "download_archive", "read_archive", "read_members"]

PACKAGE: Final = "overcooked-ai"
VERSION: Final = "1.1.0"
FILE_NAME: Final = "overcooked_ai-1.1.0.tar.gz"
SHA256: Final = "478bf319274bdb6c5bede8048ee901d088912353111ab85e9fb2bf389c6ccddf"
SIZE: Final = 2_344_591
_DATA: Final = "overcooked_ai-1.1.0/src/overcooked_ai_py/data/human_data"
MEMBERS: Final = {
    "train": (f"{_DATA}/clean_train_trials.pickle", 27_723_418),
    "test": (f"{_DATA}/clean_test_trials.pickle", 27_549_202),
}
"""Name and size in bytes of the two tables inside the archive."""

_TIMEOUT: Final = 15.0
_OFFLINE: Final = f"Get {FILE_NAME} on a machine with access, and give it with `legible humans fetch --from FILE`."


@dataclass(frozen=True, slots=True)
class PipSettings:
    """Where pip looks for packages.

    Attributes:
        index_urls: Indexes, the main one first; empty means the default one.
        find_links: Folders or pages that list files.
        trusted_hosts: Hosts whose certificates are not checked.
        cert: Bundle of certificates to trust, if not the system's.
        proxy: Proxy for all connections.
        timeout: Seconds to wait for an answer.
    """

    index_urls: tuple[str, ...] = ()
    find_links: tuple[str, ...] = ()
    trusted_hosts: tuple[str, ...] = ()
    cert: str | None = None
    proxy: str | None = None
    timeout: float = _TIMEOUT

    @classmethod
    def from_pip(cls) -> PipSettings:
        """The settings of the running interpreter's pip: configuration files, then ``PIP_*`` variables."""
        found = _configuration()

        def words(name: str) -> tuple[str, ...]:
            return tuple(str(found.get(name, "")).split())

        no_index = str(found.get("no-index", "")).lower() in ("1", "true", "yes", "on")
        main = words("index-url") or (_default_index(),)
        try:
            timeout = float(found.get("timeout", found.get("default-timeout", "")))
        except ValueError:
            timeout = _TIMEOUT
        return cls(
            index_urls=() if no_index else main + words("extra-index-url"),
            find_links=words("find-links"),
            trusted_hosts=words("trusted-host"),
            cert=found.get("cert") or None,
            proxy=found.get("proxy") or None,
            timeout=timeout,
        )


def _configuration() -> dict[str, str]:
    """Settings of pip by bare name. Later sections win: global, then install and download, then the environment."""
    found = {
        key[4:].lower().replace("_", "-"): value
        for key, value in os.environ.items()
        if key.startswith("PIP_") and value
    }
    try:
        listing = subprocess.run(
            [sys.executable, "-m", "pip", "config", "list"],
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
            stdin=subprocess.DEVNULL,
        ).stdout
    except (OSError, subprocess.SubprocessError):
        return found  # an environment without pip still has its variables
    by_section: dict[str, dict[str, str]] = {"global": {}, "install": {}, "download": {}, ":env:": {}}
    for line in listing.splitlines():
        key, _, value = line.partition("=")
        section, _, name = key.rpartition(".")
        if section in by_section:
            try:
                by_section[section][name] = str(ast.literal_eval(value))
            except (ValueError, SyntaxError):
                continue
    merged: dict[str, str] = {}
    for settings in by_section.values():
        merged.update(settings)
    return merged | found


def _default_index() -> str:
    """The index that is asked where none is set up: the finder's own default."""
    from unearth import PackageFinder

    return str(PackageFinder().sources[0]["url"])


def read_archive(path: str | os.PathLike[str]) -> bytes:
    """Read a local copy of the archive.

    Raises:
        RecordingsError: The file cannot be read, or is any other file.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(SIZE + 1)
    except OSError as error:
        raise RecordingsError(f"cannot read {os.fspath(path)}: {error.strerror or error}") from error
    return _checked(data, str(os.fspath(path)))


def _checked(data: bytes, where: str) -> bytes:
    digest = hashlib.sha256(data).hexdigest()
    if digest != SHA256:
        got = f"more than {SIZE} bytes" if len(data) > SIZE else f"{len(data)} bytes with sha256 {digest}"
        raise RecordingsError(
            f"{where} is not the recorded games: expected {FILE_NAME} with {SIZE} bytes and sha256 {SHA256}, "
            f"got {got}; nothing was read from it"
        )
    return data


def download_archive(index_urls: Iterable[str] | None = None, progress: Progress | None = None) -> bytes:
    """Download the archive from a package index, in memory.

    Args:
        index_urls: Indexes to ask instead of those that pip is set up with.
        progress: Told about every piece that arrives.

    Raises:
        RecordingsError: No index answers, none has the file, or what arrives is another file.
    """
    settings = PipSettings.from_pip() if index_urls is None else PipSettings(index_urls=tuple(index_urls))
    try:
        session = _session(settings)
    except (OSError, ValueError) as error:
        raise RecordingsError(f"pip's settings cannot be used: {error}. {_OFFLINE}") from error
    with session:
        links, problems = _find_links(settings, session)
        for link in links:
            try:
                return _checked(_stream(session, link, progress), str(link.redacted))
            except RecordingsError as error:
                problems.append(str(error))
            except Exception as error:  # each mirror fails in its own way; the next one may still have the file
                problems.append(f"{link.redacted}: {_short(error)}")
    detail = "; ".join(problems) if problems else "no index lists it"
    raise RecordingsError(f"could not get {FILE_NAME}: {detail}. {_OFFLINE}")


def _session(settings: PipSettings) -> Any:
    from unearth.auth import MultiDomainBasicAuth
    from unearth.fetchers import PyPIClient

    options: dict[str, Any] = {"follow_redirects": True, "timeout": settings.timeout}
    if settings.cert:
        options["verify"] = ssl.create_default_context(cafile=settings.cert)
    if settings.proxy:
        options["proxy"] = settings.proxy
    session = PyPIClient(trusted_hosts=settings.trusted_hosts, **options)
    session.auth = MultiDomainBasicAuth(prompting=False, index_urls=list(settings.index_urls))
    return session


def _find_links(settings: PipSettings, session: Any) -> tuple[list[Any], list[str]]:
    """Links to the file, those whose index vouches for the hash first, and what went wrong meanwhile."""
    from unearth import Link, PackageFinder

    links: list[Any] = []
    problems: list[str] = []
    sources = [{"index_urls": [url]} for url in settings.index_urls]
    sources += [{"find_links": [_as_url(place)]} for place in settings.find_links]
    for source in sources:
        # One finder each: an index that is down must not hide the others.
        finder = PackageFinder(session=session, no_binary=[PACKAGE], ignore_compatibility=True, **source)
        try:
            with _listening(problems):
                found = list(finder.find_all_packages(PACKAGE, allow_yanked=True))
            links += [package.link for package in found if package.link.filename == FILE_NAME]
        except Exception as error:  # any transport error; the message is reported if nothing else works
            problems.append(f"{Link(next(iter(source.values()))[0]).redacted}: {_short(error)}")
    return sorted(links, key=lambda link: (link.hashes or {}).get("sha256") != SHA256), problems


@contextmanager
def _listening(problems: list[str]) -> Iterator[None]:
    """Collect what the finder only logs, such as an index that does not know the package."""

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            problems.append(" ".join(record.getMessage().split()))

    logger, collector = logging.getLogger("unearth"), Collector(logging.WARNING)
    logger.addHandler(collector)
    try:
        yield
    finally:
        logger.removeHandler(collector)


def _as_url(place: str) -> str:
    path = Path(place).expanduser()
    return path.absolute().as_uri() if "://" not in place and path.exists() else place


def _stream(session: Any, link: Any, progress: Progress | None) -> bytes:
    data = bytearray()
    with session.get_stream(link.url_without_fragment) as answer:
        answer.raise_for_status()
        for piece in answer.iter_bytes(chunk_size=65_536):
            data += piece
            if progress is not None:
                progress("downloading", min(len(data), SIZE), SIZE)
            if len(data) > SIZE:
                break  # another file: the check below says so
    return bytes(data)


def _short(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text[:200]}" if text else type(error).__name__


def read_members(archive: bytes) -> dict[str, bytes]:
    """The two pickled tables of the archive, by split (``"train"``, ``"test"``); nothing is written to disk.

    Raises:
        RecordingsError: The archive is damaged, or lacks a table of the expected size.
    """
    wanted = {name: (split, size) for split, (name, size) in MEMBERS.items()}
    tables: dict[str, bytes] = {}
    try:
        with tarfile.open(fileobj=io.BytesIO(archive), mode="r|gz") as tar:
            for member in tar:
                if member.name not in wanted or not member.isreg():
                    continue
                split, size = wanted[member.name]
                file = tar.extractfile(member)
                if member.size != size or file is None:
                    raise RecordingsError(f"{member.name} has {member.size} bytes in the archive, expected {size}")
                tables[split] = file.read(size)
    except (tarfile.TarError, OSError, EOFError) as error:
        raise RecordingsError(f"the archive is damaged: {error}") from error
    missing = sorted(name for name, (split, _) in wanted.items() if split not in tables)
    if missing:
        raise RecordingsError(f"the archive lacks {missing}")
    return {split: tables[split] for split in MEMBERS}
