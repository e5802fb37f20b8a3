"""Plugging in emitters: names, entry points, options, plain functions."""

from importlib.metadata import entry_points

import numpy as np
import pytest

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import (
    EmitterError,
    check_emitter,
    list_emitters,
    make_archive,
    make_emitter,
    register_emitter,
    search,
)
from optimizers.archives import archive_arrays
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.third_party_emitters import Shift, reshuffle

pytestmark = pytest.mark.usefixtures("clean_registries")

SHELF = ShelfWorkspace()
KITCHEN = OvercookedWorkspace(shape=(5, 5))


# -- the example package -----------------------------------------------------------------------------------------------


def test_the_example_package_is_installed_and_found():
    points = [point for point in entry_points(group="legible.emitters") if point.name == "crossover"]
    assert points, "run: pip install -e docs/examples/legible-emitter-example (`make test` does)"
    info = list_emitters()["crossover"]
    assert info.origin.startswith("entry point of legible-emitter-example ")
    assert info.target == "legible_emitter_example:CrossoverEmitter"
    assert info.summary() == "Each child takes each gene from one of two random elites."


@pytest.mark.parametrize("workspace", [SHELF, KITCHEN], ids=["shelf", "kitchen"])
def test_the_example_searches_beside_another(workspace, tmp_path):
    result = search(workspace, emitter=["improve", "crossover"], evaluations=4000, checkpoint=tmp_path)
    assert [emitter["name"] for emitter in result.config["emitter"]] == ["improve", "crossover"]
    assert result.config["emitter"][1]["settings"] == {"batch_size": 1024}
    start = search(workspace, emitter="crossover", evaluations=1000)
    assert search(workspace, emitter="crossover", evaluations=4000).qd_score > start.qd_score


# -- names -------------------------------------------------------------------------------------------------------------


def test_a_registered_emitter_is_known_by_name_with_its_options():
    register_emitter("shift", Shift)
    assert list_emitters()["shift"].target == f"{Shift.__module__}:Shift"
    check_emitter("shift", SHELF)
    result = search(SHELF, emitter="shift", emitter_options={"step": 2}, evaluations=2000)
    assert result.config["emitter"] == {"name": "shift", "options": {"step": 2}, "settings": {"step": 2}}
    with pytest.raises(EmitterError, match="'shift' is taken"):
        register_emitter("shift", Shift)
    register_emitter("shift", reshuffle, overwrite=True)
    assert list_emitters()["shift"].target == f"{reshuffle.__module__}:reshuffle"


@pytest.mark.parametrize(
    ("name", "factory", "message"),
    [
        ("improve", Shift, "'improve' is built in"),
        ("", Shift, "non-empty"),
        ("a:b", Shift, "without ':'"),
        ("x", 3, "must be callable"),
    ],
)
def test_a_bad_registration_is_refused(name, factory, message):
    with pytest.raises(EmitterError, match=message):
        register_emitter(name, factory, overwrite=True)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("imprve", r"no emitter named 'imprve'; did you mean 'improve'\? known: .*improve, .*random"),
        ("no_such_module:X", "cannot be imported: No module named"),
        ("optimizers.errors:Nothing", "cannot be imported"),
        ("optimizers.errors:__all__", "not a class or function but a list"),
        (7, "a name, 'module:Class' or a callable"),
        (lambda archive: object(), "returned a object, which has no 'ask'"),
        (lambda archive, workspace, seed, missing: None, "needs the emitter option missing, without a default"),
    ],
)
def test_an_emitter_that_cannot_be_had_is_explained(spec, message):
    with pytest.raises(EmitterError, match=message):
        make_emitter(spec, make_archive(SHELF), SHELF, seed=0)


def test_a_value_an_emitter_refuses_is_passed_on_in_its_words():
    with pytest.raises(EmitterError, match="improve: `fanout` must be an integer from 1 to 1000000, got 0"):
        search(SHELF, emitter_options={"fanout": 0})


def test_module_and_class_is_enough():
    by_path = search(SHELF, emitter="optimizers.emitters.random:RandomWorkspaceEmitter", evaluations=1500)
    by_name = search(SHELF, emitter="random", evaluations=1500)
    np.testing.assert_array_equal(
        archive_arrays(by_path.archive)["solution"], archive_arrays(by_name.archive)["solution"]
    )


def test_a_function_proposes_with_options_and_seed():
    sizes = []
    search(
        SHELF,
        emitter=reshuffle,
        emitter_options={"size": 7},
        evaluations=1070,
        callbacks=[lambda state: sizes.append(state.evaluations)],
    )
    assert sizes == [1000 + 7 * i for i in range(11)]
