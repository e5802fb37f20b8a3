"""What the documentation shows is run: every block of Python, page by page, and every command and link it names."""

from __future__ import annotations

import importlib
import re
import tomllib
from pathlib import Path

import matplotlib
import pytest

ROOT = Path(__file__).parent.parent
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if not {"_build", "examples"} & set(page.relative_to(ROOT).parts) and not page.name.startswith("Legible")
]

LEARNING = (pytest.mark.slow, pytest.mark.timeout(900))


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def name_of(page: Path) -> str:
    return re.sub(r"\W", "_", str(page.relative_to(ROOT).with_suffix("")))


REGISTRIES = (
    "benchmarks.presenters.registry",
    "legible_envs.layout_kinds",
    "legible_envs.workspace",
    "optimizers.emitters.registry",
    "predictors.registry",
)
"""Modules that pages register something with."""


@pytest.fixture
def own_registries(request):
    """What a page registers is known to no other test, also where the page is the first to import a registry."""
    for module in REGISTRIES:
        importlib.import_module(module)
    request.getfixturevalue("clean_registries")


@pytest.mark.usefixtures("own_registries")
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=LEARNING if "stable_baselines3" in text else ())
        for page in PAGES
        for text in ["\n".join(blocks(page, "python"))]
        if text
    ],
)
def test_python_blocks_run_one_after_the_other(page, capsys, tmp_path, monkeypatch):
    if "stable_baselines3" in page.read_text(encoding="utf-8"):
        pytest.importorskip("stable_baselines3", reason="the extra `rl`, which `make test TORCH=` goes without")
    # `gymnasium.utils.play`, which other tests import, switches the whole process to Tk.
    matplotlib.use("agg")
    # A module of its own: what is defined on a page can be pickled and imported by name, as in a reader's file.
    module = f"page_{name_of(page)}"
    (tmp_path / f"{module}.py").write_text("\n".join(blocks(page, "python")), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    importlib.import_module(module)
    assert capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} <= {f"{module}.py", "__pycache__"}, "a block wrote files"


def test_there_are_pages_with_blocks():
    assert sum(bool(blocks(page, "python")) for page in PAGES) >= 7


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pictures_and_links_are_there(page):
    for target in re.findall(r"\]\(([^)#\s]+)\)", page.read_text(encoding="utf-8")):
        assert target.startswith("http") or (page.parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_command_lines_name_commands_that_exist(page):
    from benchmarks.cli.app import main

    text = "\n".join(blocks(page, "console"))
    named = set(re.findall(r"^\$ legible (\w+)", text, re.MULTILINE))
    assert named <= set(main.commands)


WITH_TOML = [page for page in PAGES if blocks(page, "toml")]


def test_there_are_pages_with_toml():
    assert {page.name for page in WITH_TOML} >= {"sweeps.md", "emitter.md"}


@pytest.mark.parametrize("page", WITH_TOML, ids=name_of)
def test_sweep_files_are_toml(page):
    for block in blocks(page, "toml"):
        assert tomllib.loads(block)
