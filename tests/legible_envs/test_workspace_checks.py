"""The checker of third-party workspaces: silent on good ones, clear on bad ones."""

from __future__ import annotations

import numpy as np
import pytest

from legible_envs.errors import WorkspaceError
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.workspace import list_workspaces, make_workspace, register_workspace, workspace_class
from legible_envs.workspace_checks import check_workspace


@pytest.mark.parametrize("name", [name for name, found in list_workspaces().items() if found.origin == "built in"])
def test_built_in_workspaces_keep_the_contract(name):
    check_workspace(make_workspace(name))
    assert workspace_class(name).name == name


@pytest.mark.usefixtures("aisle_package")
def test_a_workspace_of_another_package_keeps_the_contract():
    check_workspace(make_workspace("aisle"))
    check_workspace(make_workspace("aisle", heavy=True))
    assert list_workspaces()["aisle"].origin == "entry point of legible-workspace-example 0.1.0"


@pytest.mark.parametrize("arguments", [{}, {"shape": (5, 9), "pots": 1}, {"cell_costs": np.full((7, 7), 1.5)}])
def test_the_kitchen_keeps_the_contract(arguments):
    check_workspace(OvercookedWorkspace(**arguments))


class GlobalRandom(OvercookedWorkspace):
    def sample(self, n, rng, **kwargs):
        return super().sample(n, np.random.default_rng(np.random.randint(2**31)), **kwargs)  # noqa: NPY002


class OutOfBounds(OvercookedWorkspace):
    def perturb(self, genomes, k, rng, phase=0):
        children = super().perturb(genomes, k, rng, phase)
        children[0, 0] = 100
        return children


class WrongShape(OvercookedWorkspace):
    def measures(self, genomes):
        return super().measures(genomes)[:, :1]


class InPlace(OvercookedWorkspace):
    def perturb(self, genomes, k, rng, phase=0):
        children = super().perturb(genomes, k, rng, phase)
        genomes[:] = children[::k]
        return children


class BatchDependent(OvercookedWorkspace):
    def scores(self, genomes):
        legibility, distance = super().scores(genomes)
        return legibility - np.nansum(legibility), distance


class Forgetful(OvercookedWorkspace):
    name = "forgetful"

    def to_config(self):
        return {"workspace": "forgetful"}


class Failing(OvercookedWorkspace):
    def explain(self, genome):
        raise RuntimeError("no idea")


@pytest.mark.parametrize(
    ("cls", "arguments", "problem"),
    [
        (GlobalRandom, {"pots": 1}, "global random state"),
        (GlobalRandom, {"pots": 1}, "different genomes for the same seed"),
        (OutOfBounds, {"pots": 1}, "out of bounds"),
        (WrongShape, {"pots": 1}, "expected \\(n, 2\\)"),
        (InPlace, {"pots": 1}, "in place"),
        (BatchDependent, {"pots": 1}, "depends on the batch"),
        (Forgetful, {"beta": 0.3}, "scores differently"),
        (Failing, {"pots": 1}, "no idea"),
    ],
)
def test_what_is_wrong_is_said(cls, arguments, problem):
    register_workspace("forgetful", Forgetful, overwrite=True)
    with pytest.raises(WorkspaceError, match=problem) as caught:
        check_workspace(cls(**arguments))
    assert caught.value.problems


def test_anything_else_is_refused():
    with pytest.raises(WorkspaceError, match="expected a Workspace"):
        check_workspace(object())
