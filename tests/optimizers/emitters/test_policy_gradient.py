"""The designer that learns: its advantages, its updates, what it proposes, and that it does learn."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.workspace import make_workspace
from optimizers import PolicyGradientEmitter, make_archive, search
from optimizers.emitters.policy_gradient import _advantages

torch = pytest.importorskip("torch")
KITCHEN = OvercookedWorkspace(shape=(5, 5), prefix="sum")


def rounds(emitter, evaluate, count):
    """``(count, designs)`` scores of what it proposes, told to it and its archive."""
    scores = []
    for _ in range(count):
        genomes = emitter.ask()
        values, measures = evaluate(genomes)
        emitter.tell(genomes, values, measures, emitter.archive.add(genomes, values, measures))
        scores.append(values)
    return np.array(scores)


def test_advantages_are_those_of_the_definition():
    rng = np.random.default_rng(0)
    rewards, values = rng.normal(size=(2, 6, 3))
    discount, trace = 0.8, 0.6
    later = np.vstack([values[1:], np.zeros(3)])
    surprises = rewards + discount * later - values
    expected = [sum((discount * trace) ** (t - start) * surprises[t] for t in range(start, 6)) for start in range(6)]
    assert _advantages(rewards, values, discount, trace) == pytest.approx(np.array(expected))
    assert _advantages(rewards, values, 0.0, 0.9) == pytest.approx(rewards - values)


def test_every_proposal_is_one_valid_edit_of_the_last(started):
    archive, evaluate = started(KITCHEN, 300)
    emitter = PolicyGradientEmitter(archive, KITCHEN, designs=8, horizon=5, seed=0)
    before = None
    for step in range(12):
        genomes = emitter.ask()
        assert KITCHEN.valid(genomes).all()
        if step % 5:  # at the start of an episode they are edits of elites
            changed = (genomes != before).sum(axis=1)
            assert ((changed == 1) | (changed == 2)).all()  # a gene set, or two swapped; never none
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
        before = genomes
    assert emitter.updates == 2


def test_designs_start_from_the_best_share_of_elites(started):
    archive, _ = started(KITCHEN, 400)
    emitter = PolicyGradientEmitter(archive, KITCHEN, designs=64, best=0.1, seed=0)
    scores = np.sort(archive.data("objective"))[::-1]
    genomes, drawn = emitter._starts()
    assert drawn.min() >= scores[round(0.1 * len(scores)) - 1]
    assert len(np.unique(drawn)) > 3
    assert KITCHEN.objective("legibility")(genomes) == pytest.approx(drawn)


def test_no_design_goes_where_there_is_no_score(started):
    archive, evaluate = started(KITCHEN, 300)
    emitter = PolicyGradientEmitter(archive, KITCHEN, designs=6, horizon=4, seed=0)
    first = emitter.ask()
    scores, measures = evaluate(first)
    emitter.tell(first, scores, measures, archive.add(first, scores, measures))
    second = emitter.ask()
    scores, measures = evaluate(second)
    scores[:3] = np.nan
    emitter.tell(second, scores, measures, archive.add(second, scores, measures))
    third = emitter.ask()
    away = [(third != genomes).sum(axis=1) <= 2 for genomes in (first, second)]
    assert away[0][:3].all()  # an edit of where they were before
    assert away[1][3:].all()


def test_a_step_raises_the_probability_of_what_gained():
    from optimizers.emitters.policy_learning import Learner

    rng = np.random.default_rng(0)
    settings = {"hidden": 16, "learning_rate": 1e-2, "epochs": 5, "minibatch": 16, "clip": 0.2, "entropy": 0.0}
    learner = Learner(4, rng, **settings)
    n, edits = 40, 5
    masks = rng.random((n, edits)) < 0.6
    masks[:, 0] = True
    ahead = rng.normal(size=(masks.sum(), 4)).astype(np.float32)
    observed = rng.normal(size=(n, 4)).astype(np.float32)
    logs, values = learner.evaluate(observed, masks, ahead)
    assert np.exp(logs).sum(axis=1) == pytest.approx(np.ones(n), abs=1e-5)
    assert (np.exp(logs[~masks]) == 0).all()
    assert values.shape == (n,)
    # Taken edits that lead to layouts with a high first number gained, the others lost.
    actions = np.array([rng.choice(np.flatnonzero(mask)) for mask in masks])
    place = np.cumsum(masks.ravel()).reshape(masks.shape) - 1
    gained = np.sign(ahead[place[np.arange(n), actions], 0]).astype(float)
    chosen = logs[np.arange(n), actions]
    batch = {"observed": observed, "masks": masks, "ahead": ahead, "actions": actions, "chosen": chosen}
    before = torch.get_rng_state()
    learner.update(batch | {"advantages": gained, "returns": np.full(n, 3.0)}, rng)
    assert torch.equal(before, torch.get_rng_state())
    after, valued = learner.evaluate(observed, masks, ahead)
    moved = after[np.arange(n), actions] - chosen
    crowded = masks.sum(axis=1) > 1
    assert moved[crowded & (gained > 0)].mean() > 0.02
    assert moved[crowded & (gained < 0)].mean() < -0.02
    assert np.abs(valued - 3.0).mean() < np.abs(values - 3.0).mean()


def test_a_copy_in_the_middle_of_an_episode_goes_on_alike(started):
    archive, evaluate = started(KITCHEN, 300)
    emitter = PolicyGradientEmitter(archive, KITCHEN, designs=8, horizon=3, seed=0)
    rounds(emitter, evaluate, 7)
    twin = pickle.loads(pickle.dumps(emitter))
    assert np.array_equal(rounds(emitter, evaluate, 8), rounds(twin, evaluate, 8))


@pytest.mark.slow
def test_it_learns_to_gain(started):
    """Episodes begin to lose less than those of the untrained policy, from the same archive."""
    lost = {}
    for rate in (1e-12, 3e-3):
        archive, evaluate = started(KITCHEN, 500)
        emitter = PolicyGradientEmitter(archive, KITCHEN, learning_rate=rate, best=1.0, seed=1)
        rounds(emitter, evaluate, 16 * 12)
        last = rounds(emitter, evaluate, 16 * 4).reshape(4, 16, -1)
        lost[rate] = (last[:, -1] - last[:, 0]).mean()
    assert lost[3e-3] > lost[1e-12] + 10


def test_every_evaluation_counts():
    found = search(KITCHEN, emitter="ppo", evaluations=1500, initial=500, seed=0, emitter_options={"designs": 50})
    assert found.evaluations == 1500
    assert found.iterations == 20


def test_too_large_an_episode_is_refused():
    large = make_workspace("overcooked", shape=(20, 20))
    with pytest.raises(ValueError, match=r"`designs` times `horizon` make episodes of up to"):
        PolicyGradientEmitter(make_archive(large), large)


def test_without_torch_all_else_works_and_this_says_what_is_missing():
    code = """
import sys


class NoTorch:
    def find_spec(self, name, *_):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, NoTorch())
from optimizers import PolicyGradientEmitter, list_emitters, make_archive
from legible_envs.overcooked import OvercookedWorkspace
assert list_emitters()["ppo"].summary().startswith("A designer that learns")
workspace = OvercookedWorkspace(shape=(5, 5))
try:
    PolicyGradientEmitter(make_archive(workspace), workspace)
except ImportError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240, check=True)
    assert 'the emitter "ppo" needs PyTorch, which is not installed' in result.stdout
