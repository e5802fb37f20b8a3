"""Texts as editors of all systems write them."""

from __future__ import annotations

import codecs

import pytest
from hypothesis import given
from hypothesis import strategies as st

from legible_envs.support.text import clean_text, decode_text, read_text

TEXTS = st.text(st.characters(exclude_characters="\r\ufeff\0", exclude_categories=["Cs"]))
MARKS = {
    "utf-8": codecs.BOM_UTF8,
    "utf-16-le": codecs.BOM_UTF16_LE,
    "utf-16-be": codecs.BOM_UTF16_BE,
    "utf-32-le": codecs.BOM_UTF32_LE,
    "utf-32-be": codecs.BOM_UTF32_BE,
}


@given(text=TEXTS, ending=st.sampled_from(["\n", "\r\n", "\r"]), encoding=st.sampled_from(list(MARKS)))
def test_every_encoding_with_a_mark_and_every_line_ending_reads_the_same(text: str, ending: str, encoding: str) -> None:
    assert decode_text(MARKS[encoding] + text.replace("\n", ending).encode(encoding)) == text


@given(text=TEXTS)
def test_plain_utf8_needs_no_mark(text: str) -> None:
    assert decode_text(text.encode()) == text
    assert clean_text(clean_text(text)) == clean_text(text) == text


def test_other_encodings_are_named_with_their_line(tmp_path) -> None:
    path = tmp_path / "kitchen.txt"
    path.write_bytes("XXX\nX é X".encode("latin-1"))
    with pytest.raises(ValueError, match=r"kitchen\.txt, line 2: byte 0xe9 is not UTF-8; expected text in UTF-8"):
        read_text(path)
    path.write_bytes("XXX".encode("utf-16-le"))
    with pytest.raises(ValueError, match=r"is not text: it holds zero bytes"):
        read_text(path)
