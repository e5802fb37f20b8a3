"""The contract of presenters: kept by the built-in ones, the plain one and a package's; what breaks it is said."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.presenters import (
    Presenter,
    PresenterError,
    check_presenter,
    list_presenters,
    load_design,
    presenter_of,
    register_presenter,
)
from benchmarks.presenters.losses import loss_row
from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.workspace import register_workspace
from tests.support.shelf_workspace import ShelfWorkspace

pytestmark = pytest.mark.usefixtures("clean_registries")

SHELF = "tests.support.shelf_workspace:ShelfWorkspace"
KITCHEN = "XTXPXXX\nX     O\nX V   X\nC     X\nX   V F\nX     X\nXXDXSXX\n"


@pytest.mark.parametrize("name", ["overcooked", "tabletop", SHELF, "aisle"])
def test_presenters_keep_the_contract(name: str, request: pytest.FixtureRequest) -> None:
    if name == "aisle":
        request.getfixturevalue("aisle_package")
    check_presenter(name)


@pytest.mark.parametrize("workspace", [OvercookedWorkspace(), ShelfWorkspace(scale=2.0)])
def test_the_plain_presenter_keeps_the_contract_on_any_workspace(workspace: Any) -> None:
    check_presenter(Presenter(workspace.to_config()["workspace"]), workspace)


def test_a_workspace_has_its_own_presenter_by_any_of_its_names() -> None:
    assert type(presenter_of("overcooked")).__name__ == "KitchenPresenter"
    long = "legible_envs.overcooked.design.workspace:OvercookedWorkspace"
    assert type(presenter_of(long)).__name__ == "KitchenPresenter"
    assert type(presenter_of(SHELF)) is Presenter
    with pytest.raises(ValueError, match=r"no workspace named 'attic'; known: .*overcooked, .*tabletop"):
        presenter_of("attic")


def test_a_presenter_of_another_workspace_of_the_same_name_is_not_taken() -> None:
    class Other(ShelfWorkspace):
        pass

    class OtherPresenter(Presenter):
        name = "shelf"

    register_workspace("shelf", Other)
    register_presenter("shelf", OtherPresenter)
    assert type(presenter_of("shelf")) is OtherPresenter
    assert type(presenter_of(SHELF)) is Presenter


def test_naming_presenters_imports_none() -> None:
    code = (
        "import sys; from benchmarks.presenters.registry import list_presenters; list_presenters()\n"
        "names = ('benchmarks.presenters.overcooked', 'benchmarks.presenters.tabletop', 'legible_envs.overcooked',"
        " 'legible_envs.tabletop')\n"
        "sys.exit(' '.join(name for name in names if name in sys.modules) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Shelves(Presenter):
    name = "shelf"
    noun = "shelf"

    def recognises(self, text: str, source: str) -> bool:
        return text.count("\n") == 2 and set(text) <= set("ABC.-+\n")


@pytest.fixture
def shelf(clean_registries: None) -> None:
    register_workspace("shelf", ShelfWorkspace)
    register_presenter("shelf", Shelves)


@pytest.mark.usefixtures("shelf")
def test_a_text_is_read_by_the_presenter_that_recognises_it(tmp_path: Path) -> None:
    assert list_presenters()[-2:] == ["tabletop", "overcooked"]
    check_presenter("shelf")
    (tmp_path / "shelf.txt").write_text("A.B..C\n--+\n")
    (tmp_path / "kitchen.txt").write_text(KITCHEN)
    design = load_design(str(tmp_path / "shelf.txt"))
    assert design.layout == "A.B..C\n--+"
    workspace = ShelfWorkspace()
    assert design.summary() == workspace.summary(workspace.encode(design.layout))
    assert load_design(str(tmp_path / "kitchen.txt")).noun == "kitchen"
    assert load_design(str(tmp_path / "shelf.txt"), workspace=SHELF).layout == design.layout
    with pytest.raises(ValueError, match=r"unknown settings \['pots'\] of workspace 'shelf'"):
        load_design(str(tmp_path / "shelf.txt"), pots=1)


def test_a_broken_plug_in_spoils_no_other_layout(tmp_path: Path) -> None:
    def broken() -> Presenter:
        raise ValueError("broken")

    register_workspace("shelf", ShelfWorkspace)
    register_presenter("shelf", broken)  # type: ignore[arg-type]
    (tmp_path / "kitchen.txt").write_text(KITCHEN)
    assert load_design(str(tmp_path / "kitchen.txt")).noun == "kitchen"
    register_presenter("shelf", lambda: "no presenter", overwrite=True)  # type: ignore[arg-type, return-value]
    with pytest.raises(ValueError, match="must be a Presenter, got str"):
        presenter_of("shelf")


@pytest.mark.parametrize(("name", "message"), [("overcooked", "built in"), ("", "non-empty"), ("a:b", "without ':'")])
def test_a_bad_registration_is_refused(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        register_presenter(name, Shelves)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"noun": ""}, "noun is ''"),
        ({"options": {"shape"}}, "expected a frozenset"),
        ({"texts": {}}, "texts is a dict"),
        ({"draw": lambda self, layout, workspace: np.zeros((4, 4))}, r"draw returned float64 of shape \(4, 4\)"),
        ({"encode": lambda self, layout: object()}, "encode is not plain data"),
        ({"encode": lambda self, layout: "same"}, "encode gives the same data for different layouts"),
        ({"place": lambda self, workspace: {"size": float("nan")}}, "place is not plain data"),
        ({"carried": lambda self, workspace, room: room}, "exceed twice over"),
        ({"title": lambda self, data: ""}, "title is ''"),
        ({"script": lambda self: "function draw() {}"}, "does not define `function makePlace"),
        ({"icons": lambda self: "<image href='https://x.org'/>"}, "names an address"),
        ({"text": lambda self, console, layout: 1 / 0}, "terminal: raised ZeroDivisionError"),
        ({"recognises": lambda self, text, source: True}, "recognises a layout of 'overcooked'"),
        ({"design": lambda self, settings: {"colour": 1}}, r"unknown settings \['colour'\]"),
        ({"folder_name": lambda self, settings: "a/b"}, "folder_name is 'a/b'"),
        ({"design": lambda self, settings: np.random.seed(3) or {}}, "global random state"),  # noqa: NPY002
    ],
)
@pytest.mark.usefixtures("shelf")
def test_what_is_wrong_is_said(change: dict[str, Any], problem: str) -> None:
    broken = type("Broken", (Shelves,), change)()
    with pytest.raises(PresenterError, match=problem) as caught:
        check_presenter(broken)
    assert caught.value.problems


def test_anything_else_is_refused() -> None:
    with pytest.raises(PresenterError, match="expected a Presenter, got int"):
        check_presenter(3)  # type: ignore[arg-type]


def test_rows_that_are_no_stages_are_shown_as_they_are() -> None:
    assert loss_row({"goods": "tape", "steps_away": 3}) == {"goods": "tape", "steps away": 3}


@pytest.mark.usefixtures("shelf")
def test_a_plain_design_outside_the_rules_is_refused_in_its_words(tmp_path: Path) -> None:
    class Strict(ShelfWorkspace):
        def encode(self, layout: str) -> Any:
            raise LayoutError("boxes hang in the air", rule="gravity")

    register_workspace("shelf", Strict, overwrite=True)
    (tmp_path / "shelf.txt").write_text("A.B..C\n--+\n")
    with pytest.raises(LayoutError, match="hang in the air"):
        load_design(str(tmp_path / "shelf.txt"))
