"""What the README shows is run: a reader's first lines must work."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

README = Path(__file__).parent.parent / "README.md"
BLOCKS = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_python_block(number, capsys, tmp_path, monkeypatch):
    (tmp_path / f"readme_block_{number}.py").write_text(BLOCKS[number], encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module(f"readme_block_{number}")
    assert capsys.readouterr().out


def test_there_are_blocks_and_every_picture_and_link_is_there():
    text = README.read_text(encoding="utf-8")
    assert len(BLOCKS) >= 3
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert target.startswith("http") or (README.parent / target).exists(), target


def test_command_lines_name_commands_that_exist():
    from benchmarks.cli import main

    named = set(re.findall(r"^\$ legible (\w+)", README.read_text(encoding="utf-8"), re.MULTILINE))
    assert named
    assert named <= set(main.commands)
