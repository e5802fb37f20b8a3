"""Where recorded games come from: package indexes, archives and folders."""

from __future__ import annotations

import os
import subprocess
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from legible_envs.datasets.overcooked_2019 import (
    RecordingsError,
    fetch_recordings,
    load_recorded_games,
    recordings_folder,
    source,
)
from legible_envs.datasets.overcooked_2019.source import PipSettings, download_archive, read_archive, read_members
from tests.legible_envs.datasets.old_pickles import archive

# -- a published-looking archive of simulated games --------------------------------------------------------------------


def test_fetching_again_does_nothing_unless_forced(published: Path, tmp_path: Path) -> None:
    folder = fetch_recordings(tmp_path / "out", source=published)
    assert fetch_recordings(folder, index_urls=["file:///nowhere/"]) == folder
    with pytest.raises(RecordingsError, match="--from FILE"):
        fetch_recordings(folder, index_urls=["file:///nowhere/"], force=True)
    assert len(load_recorded_games(folder)) == 4


# -- package indexes ---------------------------------------------------------------------------------------------------


def write_index(published: Path, *, digest: str | None = None) -> str:
    """A folder that is served as a package index with one file; returns its address."""
    root = published.parent.parent
    fragment = f"#sha256={digest}" if digest else ""
    link = f'<a href="{published.as_uri()}{fragment}">{published.name}</a>'
    (published.parent / "index.html").write_text(f"<!DOCTYPE html><html><body>{link}</body></html>")
    return root.as_uri() + "/"


def test_the_archive_is_found_on_an_index(published: Path) -> None:
    said: list[tuple[str, int, int]] = []
    url = write_index(published, digest=source.SHA256)
    content = download_archive([url], lambda *what: said.append(what))
    assert content == published.read_bytes()
    assert said[-1] == ("downloading", source.SIZE, source.SIZE)
    # Without a hash on the page, and with another index down before it.
    assert download_archive(["file:///nowhere/", write_index(published)]) == content


def test_another_file_of_the_same_name_is_refused(published: Path, tmp_path: Path) -> None:
    published.write_bytes(published.read_bytes()[:-1] + b"x")
    with pytest.raises(RecordingsError, match=r"not the recorded games.*sha256") as caught:
        download_archive([write_index(published)])
    assert "--from FILE" in str(caught.value)
    with pytest.raises(RecordingsError, match="nothing was read from it"):
        fetch_recordings(tmp_path / "out", source=published)
    assert not (tmp_path / "out").exists()
    published.write_bytes(b"0" * 10_000_000)
    with pytest.raises(RecordingsError, match="more than"):
        download_archive([write_index(published)])
    with pytest.raises(RecordingsError, match="more than"):
        read_archive(published)
    with pytest.raises(RecordingsError, match="cannot read"):
        read_archive(tmp_path)


def test_no_network_is_said_in_words() -> None:
    # Port 9 of this machine answers nobody.
    with pytest.raises(RecordingsError, match=r"could not get overcooked_ai-1\.1\.0\.tar\.gz.*--from FILE") as caught:
        download_archive(["http://user:secret@127.0.0.1:9/simple/"])
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("status", [404, 503])
def test_an_index_without_the_package_is_named(status: int) -> None:
    class Refusing(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_error(status)

        def log_message(self, *args: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Refusing) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        with pytest.raises(RecordingsError, match=rf"127\.0\.0\.1:{server.server_port}.*{status}.*--from FILE"):
            download_archive([f"http://127.0.0.1:{server.server_port}/simple/"])
        server.shutdown()


def test_settings_are_those_of_pip(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    config = tmp_path / "pip.conf"
    config.write_text(
        "[global]\nindex-url = https://main.invalid/simple\nextra-index-url =\n  https://a.invalid/\n  https://b.invalid/\n"
        "trusted-host = a.invalid\ntimeout = 7\n[install]\nfind-links = /some/folder\n"
    )
    monkeypatch.setenv("PIP_CONFIG_FILE", str(config))
    monkeypatch.setenv("XDG_CONFIG_DIRS", str(tmp_path))
    found = PipSettings.from_pip()
    assert found.index_urls[:1] == ("https://main.invalid/simple",)
    assert {"https://a.invalid/", "https://b.invalid/"} <= set(found.index_urls)
    assert found.find_links == ("/some/folder",)
    assert (found.trusted_hosts, found.timeout) == (("a.invalid",), 7.0)
    monkeypatch.setenv("PIP_INDEX_URL", "https://env.invalid/simple")
    monkeypatch.setenv("PIP_TIMEOUT", "soon")
    assert PipSettings.from_pip().index_urls[0] == "https://env.invalid/simple"
    assert PipSettings.from_pip().timeout == 15.0
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert PipSettings.from_pip().index_urls == ()


def test_settings_without_pip_are_those_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_pip(*args: Any, **more: Any) -> None:
        raise subprocess.CalledProcessError(1, "pip")

    monkeypatch.setattr(subprocess, "run", no_pip)
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    assert len(PipSettings.from_pip().index_urls) == 1
    monkeypatch.setenv("PIP_INDEX_URL", "https://env.invalid/simple")
    monkeypatch.setenv("PIP_EXTRA_INDEX_URL", "https://more.invalid/")
    assert PipSettings.from_pip().index_urls == ("https://env.invalid/simple", "https://more.invalid/")


# -- archives ----------------------------------------------------------------------------------------------------------


def test_archives_are_read_by_exact_name_and_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "MEMBERS", {"train": ("d/a.pickle", 3), "test": ("d/b.pickle", 2)})
    good = {"d/a.pickle": b"abc", "d/b.pickle": b"de"}
    assert read_members(archive({"../../evil": b"x", **good, "d/c.py": b"y"})) == {"train": b"abc", "test": b"de"}
    with pytest.raises(RecordingsError, match="4 bytes in the archive, expected 3"):
        read_members(archive({**good, "d/a.pickle": b"abcd"}))
    with pytest.raises(RecordingsError, match="lacks"):
        read_members(archive({"d/a.pickle": b"abc"}))
    for damaged in (b"", b"not an archive", archive(good)[:60]):
        with pytest.raises(RecordingsError, match=r"damaged|lacks"):
            read_members(damaged)


# -- conversion and files ----------------------------------------------------------------------------------------------


def test_the_folder_is_the_users_choice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert recordings_folder(tmp_path) == tmp_path
    monkeypatch.setenv("LEGIBLE_DATA", str(tmp_path))
    assert recordings_folder() == tmp_path / "recordings"
    monkeypatch.delenv("LEGIBLE_DATA")
    assert recordings_folder().parts[-2:] == ("legible-envs", "recordings")
