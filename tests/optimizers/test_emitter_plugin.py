"""Plugging in emitters: names, entry points, plain functions, and check_emitter's sentences."""

import re
from importlib.metadata import entry_points

import numpy as np
import pytest
from ribs.emitters import EmitterBase

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import EmitterError, check_emitter, list_emitters, make_archive, make_emitter, register_emitter, search
from optimizers.archives import archive_arrays
from optimizers.emitters import registry
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
KITCHEN = OvercookedWorkspace(shape=(5, 5))


@pytest.fixture(autouse=True)
def _clean_registry(monkeypatch):
    monkeypatch.setattr(registry._registry, "_registered", {})


class Shift(EmitterBase):
    """A well-behaved third-party emitter: some elites, with one gene shifted."""

    def __init__(self, archive, workspace, *, seed, step=1):
        super().__init__(
            archive,
            solution_dim=archive.solution_dim,
            bounds=None,
            lower_bounds=workspace.lower_bounds,
            upper_bounds=workspace.upper_bounds,
        )
        self.rng, self.step = np.random.default_rng(seed), step
        self.settings = {"step": step}

    def ask(self):
        genomes = self.archive.data("solution").astype(int)
        genomes = genomes[self.rng.integers(len(genomes), size=40)]
        genomes[np.arange(40), self.rng.integers(genomes.shape[1], size=40)] += self.step
        return genomes


def reshuffle(archive, workspace, rng, size=30):
    """A proposing function: random layouts."""
    return workspace.sample(size, rng)


# -- the example package -----------------------------------------------------------------------------------------------


def test_the_example_package_is_installed_and_found():
    points = [point for point in entry_points(group="legible.emitters") if point.name == "crossover"]
    assert points, "run: pip install -e docs/examples/legible-emitter-example (`make test` does)"
    info = list_emitters()["crossover"]
    assert info.origin.startswith("entry point of legible-emitter-example ")
    assert info.target == "legible_emitter_example:CrossoverEmitter"
    assert info.summary() == "Each child takes each gene from one of two random elites."


@pytest.mark.parametrize("workspace", [SHELF, KITCHEN], ids=["shelf", "kitchen"])
def test_the_example_keeps_the_contract_and_searches(workspace, tmp_path):
    check_emitter("crossover", workspace)
    result = search(workspace, emitter=["improve", "crossover"], evaluations=4000, checkpoint=tmp_path)
    assert [emitter["name"] for emitter in result.config["emitter"]] == ["improve", "crossover"]
    assert result.config["emitter"][1]["settings"] == {"batch_size": 1024}
    start = search(workspace, emitter="crossover", evaluations=1000)
    assert search(workspace, emitter="crossover", evaluations=4000).qd_score > start.qd_score


# -- names -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["improve", "random"])
@pytest.mark.parametrize("workspace", [SHELF, None], ids=["shelf", "default"])
def test_built_in_emitters_keep_the_contract(name, workspace):
    check_emitter(name, workspace)
    assert list_emitters()[name].origin == "built in"
    assert list_emitters()[name].summary().endswith(".")


def test_a_registered_emitter_is_known_by_name_with_its_options():
    register_emitter("shift", Shift)
    assert list_emitters()["shift"].target == f"{__name__}:Shift"
    check_emitter("shift", SHELF)
    result = search(SHELF, emitter="shift", emitter_options={"step": 2}, evaluations=2000)
    assert result.config["emitter"] == {"name": "shift", "options": {"step": 2}, "settings": {"step": 2}}
    with pytest.raises(EmitterError, match="'shift' is taken"):
        register_emitter("shift", Shift)
    register_emitter("shift", reshuffle, overwrite=True)
    assert list_emitters()["shift"].target == f"{__name__}:reshuffle"


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
        ("imprve", r"no emitter named 'imprve'; known: .*improve, .*random"),
        ("no_such_module:X", "cannot be imported: No module named"),
        ("optimizers.errors:Nothing", "cannot be imported"),
        ("optimizers.errors:__all__", "not a class or function but a list"),
        (7, "a name, 'module:Class' or a callable"),
        (lambda archive: object(), "returned a object, which has no 'ask'"),
        (lambda archive, workspace, seed, missing: None, "could not be called with archive, seed, workspace"),
    ],
)
def test_an_emitter_that_cannot_be_had_is_explained(spec, message):
    with pytest.raises(EmitterError, match=message):
        make_emitter(spec, make_archive(SHELF), SHELF, seed=0)


@pytest.mark.parametrize("emitter", ["improve", Shift, reshuffle, "ribs.emitters:IsoLineEmitter"])
def test_options_an_emitter_does_not_have_are_refused_by_name(emitter):
    with pytest.raises(EmitterError, match=r"has no option fan_out; its options: .*"):
        search(SHELF, emitter=emitter, emitter_options={"fan_out": 3})


def test_a_value_an_emitter_refuses_is_passed_on_in_its_words():
    with pytest.raises(EmitterError, match="improve: fanout must be at least 1, got 0"):
        search(SHELF, emitter_options={"fanout": 0})


def test_module_and_class_is_enough():
    by_path = search(SHELF, emitter="optimizers.emitters.random:RandomWorkspaceEmitter", evaluations=1500)
    by_name = search(SHELF, emitter="random", evaluations=1500)
    np.testing.assert_array_equal(
        archive_arrays(by_path.archive)["solution"], archive_arrays(by_name.archive)["solution"]
    )


def test_a_function_proposes_with_options_and_seed():
    check_emitter(reshuffle, KITCHEN)
    sizes = []
    search(
        SHELF,
        emitter=reshuffle,
        emitter_options={"size": 7},
        evaluations=1070,
        callbacks=[lambda state: sizes.append(state.evaluations)],
    )
    assert sizes == [1000 + 7 * i for i in range(11)]


# -- check_emitter -----------------------------------------------------------------------------------------------------


class WrongShape(Shift):
    def ask(self):
        return super().ask()[:, :-1]


class OneDimensional(Shift):
    def ask(self):
        return super().ask()[0]


class NotNumbers(Shift):
    def ask(self):
        return [["a"] * 6]


class AsksForNaN(Shift):
    def ask(self):
        out = super().ask().astype(float)
        out[0, 0] = np.nan
        return out


class AlwaysInvalid(Shift):
    def ask(self):
        return np.ones_like(super().ask())


class ClaimsValid(Shift):
    emits_valid = True

    def ask(self):
        out = super().ask().astype(np.int8)
        out[:, 1] = out[:, 0]
        return np.clip(out, self.lower_bounds, self.upper_bounds)


class ClaimsType(Shift):
    emits_valid = True

    def ask(self):
        return self.archive.data("solution").astype(float)


class OutOfBounds(Shift):
    emits_valid = True

    def ask(self):
        out = np.clip(super().ask(), self.lower_bounds, self.upper_bounds).astype(np.int8)
        out[2, 1] = 77
        return out


class GlobalRandom(Shift):
    def ask(self):
        out = super().ask()
        return out[np.random.permutation(len(out))]  # noqa: NPY002


class SeedsGlobally(Shift):
    def __init__(self, archive, workspace, *, seed):
        super().__init__(archive, workspace, seed=seed)
        np.random.seed(seed)  # noqa: NPY002


class IgnoresSeed(Shift):
    def __init__(self, archive, workspace, *, seed):
        super().__init__(archive, workspace, seed=0)


class Unseeded(Shift):
    def __init__(self, archive, workspace, *, seed):
        super().__init__(archive, workspace, seed=None)


class NotPicklable(Shift):
    def __init__(self, archive, workspace, *, seed):
        super().__init__(archive, workspace, seed=seed)
        self.rule = lambda x: x


class WrongTell(Shift):
    def tell(self, solution, objective):
        pass


class FailsInTell(Shift):
    def tell(self, solution, objective, measures, add_info):
        raise KeyError("novelty")


class ChokesOnNaN(Shift):
    emits_valid = True

    def ask(self):
        return self.archive.data("solution")[self.rng.integers(len(self.archive), size=9)]

    def tell(self, solution, objective, measures, add_info):
        if np.isnan(objective).any():
            raise ValueError("objective must be finite")


class AddsItself(Shift):
    def ask(self):
        genomes = SHELF.sample(30, self.rng)
        self.archive.add(genomes, np.full(30, 100.0), SHELF.measures(genomes))
        return genomes


class FailsInAsk(Shift):
    def ask(self):
        raise RuntimeError("out of ideas")


class Empty(Shift):
    def ask(self):
        return super().ask()[:0]


def fails_when_made(archive, workspace, seed):
    raise RuntimeError("no licence")


@pytest.mark.parametrize(
    ("emitter", "sentence"),
    [
        (WrongShape, "ask() must return numbers of shape (n, 6), it returned int64 of shape (40, 5)"),
        (OneDimensional, "it returned int64 of shape (6,)"),
        (NotNumbers, "ask() must return numbers"),
        (AsksForNaN, "ask() returned NaN"),
        (AlwaysInvalid, "no valid layout in 100 consecutive batches"),
        (ClaimsValid, "it claims emits_valid but 40 of 40 layouts are not valid"),
        (ClaimsType, "it claims emits_valid but ask() returns float64, genomes are int8"),
        (OutOfBounds, "ask() left the bounds: gene 1 is 77, not 0..5"),
        (GlobalRandom, "numpy's global random state"),
        (SeedsGlobally, "numpy's global random state"),
        (IgnoresSeed, "the seed is not used"),
        (Unseeded, "two runs with the same seed proposed different layouts"),
        (NotPicklable, "it does not pickle"),
        (WrongTell, "tell(solution, objective, measures, add_info) raised TypeError"),
        (FailsInTell, "raised KeyError: 'novelty' in round 0"),
        (ChokesOnNaN, "scores of layouts that are not allowed are NaN"),
        (AddsItself, "ask() adds to the archive"),
        (FailsInAsk, "ask() raised RuntimeError: out of ideas"),
        (Empty, "ask() returned no layouts"),
        (fails_when_made, "making it raised RuntimeError: no licence"),
        ("nothing-like-it", "no emitter named 'nothing-like-it'"),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_check_emitter_says_in_words_what_is_wrong(emitter, sentence):
    with pytest.raises(EmitterError, match=re.escape(sentence)) as caught:
        check_emitter(emitter, SHELF)
    assert any(sentence in problem for problem in (*caught.value.problems, str(caught.value)))


def test_check_emitter_has_nothing_to_say_about_a_good_one():
    check_emitter(Shift, SHELF)
    check_emitter(Shift, KITCHEN, options={"step": -1}, seed=5)
    check_emitter("ribs.emitters:GaussianEmitter", SHELF, options={"sigma": 0.7})
