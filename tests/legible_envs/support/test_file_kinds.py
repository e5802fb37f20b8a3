"""What files look like, in words."""

from __future__ import annotations

import gzip
import json
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from legible_envs.support.file_kinds import describe_file
from legible_envs.support.files import open_npz

EXAMPLES: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "an empty file"),
    "png": (b"\x89PNG\r\n\x1a\n" + bytes(20), "a PNG picture"),
    "jpeg": (b"\xff\xd8\xff\xe0", "a JPEG picture"),
    "pdf": (b"%PDF-1.7\n", "a PDF document"),
    "hdf5": (b"\x89HDF\r\n\x1a\n" + bytes(9), "an HDF5 file"),
    "gzip": (gzip.compress(b"a"), "a gzip archive, which has to be unpacked first"),
    "pickle": (pickle.dumps([1]), "a Python pickle"),
    "object": (json.dumps({"a": 1, "b": [2]}).encode(), "JSON, an object with the keys 'a', 'b'"),
    "list": (b"[1, 2]\n", "JSON, a list of 2 entries"),
    "nothing": (b"{}", "JSON, an empty object"),
    "long": (json.dumps([{"a": "b" * 90}] * 1000).encode(), "JSON"),
    "text": (b"Dear all,\nhello", "text that begins with 'Dear all,'"),
    "braces": (b"[not json\n", "text that begins with '[not json'"),
    "blank": (b" \n\n", "a text without content"),
    "latin": ("Zoë says\n".encode("latin-1"), "text in another encoding than UTF-8"),
    "utf-16": ("Zoë".encode("utf-16"), "text that begins with 'Zoë'"),
    "page": (b"<!DOCTYPE html><html>", "a web page or XML"),
    "bytes": (bytes(range(256)), "binary data of an unknown kind"),
    "cut": (b"PK\x03\x04" + bytes(40), "a damaged or incomplete ZIP archive (.npz files are ZIP archives)"),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_files_are_described_by_what_is_in_them(tmp_path: Path, name: str) -> None:
    content, words = EXAMPLES[name]
    path = tmp_path / "file.csv"
    path.write_bytes(content)
    assert describe_file(path) == words


def test_archives_name_what_they_hold(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for number in range(8):
            archive.writestr(f"{number}.txt", "a")
    assert describe_file(tmp_path / "a.zip").startswith("a ZIP archive with '0.txt', '1.txt'")
    assert describe_file(tmp_path / "a.zip").endswith("'5.txt' and 2 more")
    np.savez(tmp_path / "b.npz", a=1, c=2)
    assert describe_file(tmp_path / "b.npz") == "an .npz with the arrays 'a', 'c'"
    assert describe_file(tmp_path) == "a folder"
    with pytest.raises(FileNotFoundError):
        describe_file(tmp_path / "none")


def test_arrays_are_read_and_pickles_are_not(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, a=np.arange(3))
    with open_npz(path) as arrays:
        assert arrays["a"].tolist() == [0, 1, 2]
    np.savez(path, a=np.array([{"a": 1}]))
    with pytest.raises(ValueError, match="it holds pickled objects, which are never loaded"), open_npz(path) as arrays:
        arrays["a"]
    path.write_bytes(path.read_bytes()[:90])
    with pytest.raises(ValueError, match="damaged or incomplete"), open_npz(path):
        pass
    path.write_text('{"a": 1}')
    with (
        pytest.raises(ValueError, match=r"it looks like JSON, an object with the keys 'a', and is no \.npz"),
        open_npz(path),
    ):
        pass
    with pytest.raises(FileNotFoundError), open_npz(tmp_path / "none.npz"):
        pass
