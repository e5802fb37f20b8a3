"""check_emitter's sentences: each way to break the contract is named."""

import re

import numpy as np
import pytest
from ribs.emitters import EmitterBase

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import EmitterError, check_emitter
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
KITCHEN = OvercookedWorkspace(shape=(5, 5))


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
