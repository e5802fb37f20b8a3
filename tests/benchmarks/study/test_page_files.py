"""The files of the participant's page: small, of our own, without anything that its security policy forbids."""

from __future__ import annotations

import json
import re
from html import unescape
from importlib.resources import files

import pytest

from benchmarks.study.design.package_files import default_words
from benchmarks.study.page import sprites

LARGEST = 200_000
PAGES = {
    file.name: file.read_text(encoding="utf-8")
    for file in files("benchmarks.study.page").iterdir()
    if file.name.endswith((".js", ".css", ".j2")) and not file.name.startswith("monitor")
}
SCRIPTS = {name: text for name, text in PAGES.items() if name.endswith(".js")}


@pytest.mark.parametrize("domain", ["overcooked", "tabletop"])
def test_a_whole_page_is_small(domain: str) -> None:
    words = json.dumps(default_words())
    assert sum(len(text.encode()) for text in (*PAGES.values(), sprites(domain), words)) < LARGEST


def test_nothing_comes_from_elsewhere_or_is_inline() -> None:
    for name, text in PAGES.items():
        known = text.replace("http://www.w3.org/2000/svg", "")  # a name, not an address
        assert not re.search(r"https?://|//cdn|@import", known), name
        assert not re.search(r"\seval\(|new Function|localStorage|sessionStorage|document\.cookie|indexedDB", text), (
            name
        )
    assert not re.search(r"\sstyle=|\son[a-z]+=|<style|<script>", PAGES["index.html.j2"])


def test_every_word_of_the_page_is_a_word_of_the_study() -> None:
    known = default_words()
    told = re.findall(r"""word\((?:is[^"]*\? )?"(\w+)"(?: : "(\w+)")?""", "".join(SCRIPTS.values()))
    used = {each for pair in told for each in pair if each}
    used |= {f"item_{kind}" for kind in ("tomato", "onion", "cabbage", "fish", "dish", "soup")}
    assert len(used) > 60
    assert used <= known.keys()


def test_modules_import_only_each_other() -> None:
    for name, text in SCRIPTS.items():
        for found in re.findall(r"""(?:from|import\() ?"([^"]+)\"""", text):
            assert found.removeprefix("./") in SCRIPTS, f"{name} imports {found}"


@pytest.mark.parametrize(("domain", "least"), [("overcooked", 50), ("tabletop", 13)])
def test_sprites_are_symbols_with_ids_of_their_own(domain: str, least: int) -> None:
    sheet = sprites(domain)
    ids = re.findall(r'<symbol id="([^"]+)"', sheet)
    assert len(ids) == len(set(ids)) >= least
    assert "style=" not in sheet
    assert "<script" not in sheet
    measures = json.loads(unescape(re.match(r'<svg [^>]*data-measures="([^"]*)"', sheet)[1]))  # type: ignore[index]
    assert measures["colours"]


def test_what_the_scripts_draw_is_in_the_sprites() -> None:
    for domain, script in (("overcooked", "kitchen_board.js"), ("tabletop", "table_board.js")):
        ids = set(re.findall(r'<symbol id="([^"]+)"', sprites(domain)))
        prefixes = {each.split("${")[0] for each in re.findall(r"use\(`([kt]-[^`]+)`", SCRIPTS[script])} - {"k-"}
        assert prefixes
        for prefix in prefixes:
            assert any(name.startswith(prefix) for name in ids), prefix
