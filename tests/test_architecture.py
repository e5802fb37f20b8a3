"""The shape of the house: imports form no cycle, follow the floors, and the picture shows the floors as they are."""

from __future__ import annotations

import ast
import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import networkx as nx
import pytest

grimp = pytest.importorskip("grimp")

ROOT = Path(__file__).parents[1]
PACKAGES = ("legible_envs", "optimizers", "predictors", "benchmarks")
LAZY = {
    ("legible_envs.tabletop.layout", "legible_envs.tabletop.geometry.paths"),
    ("legible_envs.tabletop.design.workspace", "legible_envs.tabletop.design.differentiable"),
}
"""The two imports that close a cycle and stay: a method's convenience, imported when it is called."""


@pytest.fixture(scope="module")
def imports() -> list[tuple[str, str]]:
    """All imports among the packages: at the top, in functions, and for types alone."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    return [
        (importer, imported)
        for importer in graph.modules
        for imported in graph.find_modules_directly_imported_by(importer)
    ]


def cycles(imports: list[tuple[str, str]]) -> list[list[str]]:
    """Rooms of one folder that import one another in a circle, at any depth below any package."""
    rooms = nx.DiGraph()
    for importer, imported in imports:
        ours, theirs = importer.split("."), imported.split(".")
        shared = next((i for i, (a, b) in enumerate(zip(ours, theirs, strict=False)) if a != b), None)
        if shared is not None:
            rooms.add_edge(".".join(ours[: shared + 1]), ".".join(theirs[: shared + 1]))
    return [sorted(found) for found in nx.strongly_connected_components(rooms) if len(found) > 1]


def test_imports_form_no_cycle(imports):
    assert cycles([pair for pair in imports if pair not in LAZY]) == []


def test_the_two_lazy_imports_are_needed_and_lazy(imports):
    assert set(imports) >= LAZY
    for importer, imported in LAZY:
        source = (ROOT / f"{importer.replace('.', '/')}.py").read_text(encoding="utf-8")
        home, _, name = imported.rpartition(".")
        at_the_top = [
            line for line in source.splitlines() if line.startswith((f"from {imported} ", f"import {imported}"))
        ]
        assert at_the_top == []
        assert f"from {home} import {name}\n" not in source.partition("\nclass ")[0]


def test_a_cycle_would_be_found():
    assert cycles([("p.a.x", "p.b"), ("p.b.y", "p.c"), ("p.c", "p.a.z")]) == [["p.a", "p.b", "p.c"]]
    assert cycles([("p.a.x", "p.a.y"), ("p.a.y", "p.b"), ("q.a", "p.b")]) == []


def architecture() -> ModuleType:
    spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs/_ext/architecture.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_picture_and_the_table_of_rooms_are_current():
    page = architecture()
    again = "run `python docs/_ext/architecture.py`"
    assert page.PICTURE.read_text(encoding="utf-8") == page.draw(), again
    assert page.ROOMS.read_text(encoding="utf-8") == page.rooms(), again


def test_every_room_says_in_a_sentence_what_is_in_it():
    page = architecture()
    for row in page.house():
        for package in row:
            for module, _ in page._rooms_in(package):
                assert page.sentence(module).endswith((".", "?")), module


READERS = {"json.load", "json.loads", "tomllib.load", "tomllib.loads", "yaml.load", "yaml.safe_load", "numpy.load"}
"""Readers that trust what they read; files go through `plain_data` and `open_npz`."""

TRUSTED = {
    "legible_envs/support/plain_data.py": {"json.loads", "tomllib.loads"},  # the one place
    "legible_envs/workspace_checks.py": {"json.loads"},  # what the line has just written
    "legible_envs/datasets/overcooked_ai/states.py": {"json.loads"},  # a state per row, each value checked when used
    "optimizers/search_run.py": {"json.loads"},  # what the line has just written
    "optimizers/runs/checkpoint.py": {"json.loads"},  # a header of limited length, whose digest was compared
    "legible_envs/support/digests.py": {"json.loads"},  # what the line has just written
    "benchmarks/trials/store.py": {"json.loads"},  # what the line has just written
    "benchmarks/study/store/values.py": {"json.loads"},  # rows that the study's server wrote
    "benchmarks/throughput/study.py": {"json.loads"},  # answers of a server that this process started
    "benchmarks/study/bots/link.py": {"json.loads"},  # answers of a server that this process started
    "benchmarks/experiments/optimizers/run.py": {"json.loads"},  # a key that this process made
    "benchmarks/experiments/learning/run.py": {"json.loads"},  # what the training before has just written
    "benchmarks/throughput/predictors_grid.py": {"json.loads"},  # answers of a process that this one started
    "benchmarks/throughput/peer_maxent_irl.py": {"numpy.load"},  # a file that the process which started it wrote
}


def trusting_calls(source: str) -> set[str]:
    """Calls of READERS in a program, by whatever name they were imported."""
    tree, names = ast.parse(source), {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name | ast.Attribute):
            first, dot, rest = ast.unparse(node).partition(".")
            found.add(f"{names.get(first, first)}{dot}{rest}")
    return found & READERS


def test_files_are_read_in_one_place():
    calls = {
        path.relative_to(ROOT).as_posix(): found
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        if (found := trusting_calls(path.read_text(encoding="utf-8")))
    }
    assert calls == TRUSTED


@pytest.mark.parametrize(
    "source", ["from json import loads as f\nf(x)", "import numpy as np\nnp.load(x)", "json.load(x)"]
)
def test_a_trusting_reader_would_be_found(source):
    assert len(trusting_calls(source)) == 1


def test_every_folder_of_modules_is_a_package():
    folders = {path.parent for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    assert sorted(str(folder) for folder in folders if not (folder / "__init__.py").exists()) == []


def test_no_source_is_ignored():
    """What ``.gitignore`` names is in no clone and in no wheel: tracked files, too, are left out of the latter."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        pytest.skip("needs git and a clone")
    paths = [path for name in (*PACKAGES, "tests") for path in (ROOT / name).rglob("*.py")]
    names = "\n".join(str(path.relative_to(ROOT)) for path in paths)
    command = [git, "check-ignore", "--no-index", "--stdin"]
    found = subprocess.run(command, input=names, capture_output=True, text=True, cwd=ROOT, check=False)
    assert found.stdout.splitlines() == []
