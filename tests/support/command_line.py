"""The command line as a user calls it, and what it prints and writes, for the tests of its commands."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from click.testing import CliRunner, Result

from benchmarks.cli.app import main


def legible(*arguments: str | Path | int, text: str | None = None) -> Result:
    """Run ``legible`` with these arguments, and ``text`` as its standard input."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments], input=text)


def values(result: Result) -> dict[str, str]:
    """The lines ``name  value`` of ``legible score``."""
    pairs = [line.split("  ", 1) for line in result.output.splitlines() if "  " in line]
    return {name: value.strip() for name, value in pairs}


def page_data(folder: Path) -> Any:
    """The data that the report of a run carries."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    return json.loads(text.split('<script type="application/json" id="data">')[1].split("</script>")[0])
