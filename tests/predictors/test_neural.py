"""Predictors learned by networks: against torch's own modules, in what they may know, and in their files."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import StratifiedKFold

from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.rollouts import Trajectory
from predictors import RecurrentPredictor, TransformerPredictor, check_predictor, make_predictor
from predictors.checks import example_trajectories
from predictors.neural.base import NeuralPredictor
from predictors.neural.encoding import Encoding
from predictors.neural.networks import NUMPY, Gru, Network, Transformer
from tests.support.pointing import grouped_accuracy, needs_pointing

torch = pytest.importorskip("torch", reason="the extra `torch` is not installed")

NETWORKS = [Gru(8, 1), Gru(6, 2), Transformer(8, 2, 2)]
SMALL: list[NeuralPredictor] = [
    RecurrentPredictor(8, members=2, max_epochs=4),
    RecurrentPredictor(6, 2, members=1, max_epochs=3, validation_fraction=0.0),
    TransformerPredictor(8, 1, 2, members=2, max_epochs=3),
]
TWO = ("left", "right")


def reaches(count: int, rng: np.random.Generator, noise: float = 0.01) -> list[Trajectory]:
    """Reaches that curve to one of two sides, from a different place each."""
    found = []
    for number in range(count):
        goal = TWO[number % 2]
        steps = int(rng.integers(5, 12))
        way = np.linspace(0, 1, steps)
        side = -1 if goal == "left" else 1
        points = np.stack([side * 0.3 * way**2, 0.4 * way], axis=1) + rng.normal(0, noise, (steps, 2))
        points += rng.uniform(-1, 1, 2)
        found.append(Trajectory(points, goal=goal, candidates=TWO, participant=f"p{number % 5}"))
    return found


@pytest.fixture(scope="module", params=SMALL, ids=lambda p: f"{type(p).__name__}-{p.members}")
def on_cells(request: pytest.FixtureRequest) -> NeuralPredictor:
    return clone(request.param).fit(example_trajectories())


@pytest.fixture(scope="module", params=SMALL, ids=lambda p: f"{type(p).__name__}-{p.members}")
def on_reaches(request: pytest.FixtureRequest) -> NeuralPredictor:
    return clone(request.param).fit(reaches(24, np.random.default_rng(0)))


# -- the networks -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layers", [1, 2])
def test_gru_is_torchs(layers: int) -> None:
    rng = np.random.default_rng(0)
    weights = Gru(5, layers).initial_weights(2, 3, 4, rng)
    weights = {name: value + rng.normal(0, 0.3, value.shape) for name, value in weights.items()}
    x = rng.normal(size=(1, 6, 7, 3))
    logits, state = Gru(5, layers)(NUMPY, weights, x)
    for member in range(2):
        oracle = torch.nn.GRU(3, 5, layers, batch_first=True).double()
        for layer in range(layers):
            for ours, theirs in (
                ("input", "weight_ih"),
                ("hidden", "weight_hh"),
                ("input_bias", "bias_ih"),
                ("hidden_bias", "bias_hh"),
            ):
                # The same equations, the matrices transposed.
                value = torch.tensor(weights[f"{ours}{layer}"][member].T.copy())
                getattr(oracle, f"{theirs}_l{layer}").data.copy_(value)
        outputs, last = oracle(torch.tensor(x[0]))
        expected = outputs.detach().numpy() @ weights["out"][member] + weights["out_bias"][member]
        np.testing.assert_allclose(logits[member], expected, atol=1e-12)
        for layer in range(layers):
            np.testing.assert_allclose(state[layer][member], last[layer].detach().numpy(), atol=1e-12)


def test_transformer_block_is_torchs() -> None:
    rng = np.random.default_rng(1)
    network = Transformer(8, 1, 2)
    weights = network.initial_weights(1, 3, 4, rng)
    weights = {name: value + rng.normal(0, 0.3, value.shape) for name, value in weights.items()}
    x = rng.normal(size=(1, 5, 6, 3))

    def tensor(name: str) -> Any:
        return torch.tensor(weights[name][0].T.copy())

    block = torch.nn.TransformerEncoderLayer(
        8, 2, 32, dropout=0.0, activation="relu", batch_first=True, norm_first=True, dtype=torch.float64
    )
    for module, name in (
        (block.norm1, "norm_attention0"),
        (block.norm2, "norm_perceptron0"),
        (block.linear1, "widen0"),
        (block.linear2, "narrow0"),
        (block.self_attn.out_proj, "project0"),
    ):
        module.weight.data.copy_(tensor(name))
        module.bias.data.copy_(tensor(f"{name}_bias"))
    block.self_attn.in_proj_weight.data.copy_(tensor("attend0"))
    block.self_attn.in_proj_bias.data.copy_(tensor("attend0_bias"))

    steps = np.arange(6)[:, None]
    rates = 1000.0 ** (-np.arange(4) / 4)
    positions = np.zeros((6, 8))
    positions[:, 0::2], positions[:, 1::2] = np.sin(steps * rates), np.cos(steps * rates)
    tokens = torch.tensor(x[0] @ weights["embed"][0] + weights["embed_bias"][0] + positions)
    mask = torch.nn.Transformer.generate_square_subsequent_mask(6, dtype=torch.float64)
    seen = block(tokens, src_mask=mask)
    seen = torch.nn.functional.layer_norm(seen, (8,), tensor("norm_out"), tensor("norm_out_bias"))
    expected = seen.detach().numpy() @ weights["out"][0] + weights["out_bias"][0]
    np.testing.assert_allclose(network(NUMPY, weights, x)[0][0], expected, atol=1e-10)


@pytest.mark.parametrize("network", NETWORKS, ids=lambda n: type(n).__name__)
@settings(max_examples=15, deadline=None)
@given(steps=st.integers(1, 7), cut=st.integers(0, 7), seed=st.integers(0, 99))
def test_in_parts_is_at_once_and_the_future_changes_nothing(network: Network, steps: int, cut: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cut = min(cut, steps - 1)
    weights = network.initial_weights(3, 4, 2, rng)
    x = rng.normal(size=(1, 2, steps, 4))
    whole, _ = network(NUMPY, weights, x)
    changed = np.concatenate([x[:, :, : cut + 1], rng.normal(size=(1, 2, steps - cut - 1, 4))], axis=2)
    np.testing.assert_allclose(network(NUMPY, weights, changed)[0][:, :, : cut + 1], whole[:, :, : cut + 1], atol=1e-12)
    state, parts = None, []
    for begin, end in ((0, cut), (cut, steps)):
        if begin < end:
            part, state = network(NUMPY, weights, x[:, :, begin:end], state)
            parts.append(part)
    np.testing.assert_allclose(np.concatenate(parts, axis=2), whole, atol=1e-12)


@pytest.mark.parametrize("network", NETWORKS, ids=lambda n: type(n).__name__)
def test_members_do_not_see_each_other(network: Network) -> None:
    rng = np.random.default_rng(0)
    weights = network.initial_weights(3, 4, 2, rng)
    x = rng.normal(size=(1, 2, 5, 4))
    alone = {name: value[1:2] for name, value in weights.items()}
    np.testing.assert_allclose(network(NUMPY, alone, x)[0][0], network(NUMPY, weights, x)[0][1], atol=1e-12)


# -- the contract -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["recurrent", "transformer"])
def test_keeps_the_contract_on_reaches_without_positions(name: str) -> None:
    check_predictor(name, reaches(12, np.random.default_rng(0)), members=1, max_epochs=3)


def test_nothing_observed_is_how_often_goals_were_chosen(on_cells: NeuralPredictor) -> None:
    # Of eight walks all offer onion (chosen 3 times) and tomato (3); six offer dish (2).
    prior = np.array([(2 + 1) / (6 + 3), (3 + 1) / (8 + 3), (3 + 1) / (8 + 3)])
    assert on_cells.classes_.tolist() == ["dish", "onion", "tomato"]
    three, two = example_trajectories()[0], example_trajectories()[1]
    rows = on_cells.predict_proba([three.first(0), two.first(0)])
    np.testing.assert_allclose(rows, [prior / prior.sum(), [0, 0.5, 0.5]])
    assert list(on_cells.stream(three).belief.values()) == pytest.approx((prior / prior.sum())[[1, 2, 0]])


def test_where_a_recording_begins_tells_nothing(on_reaches: NeuralPredictor) -> None:
    walks = reaches(8, np.random.default_rng(5))
    moved = [Trajectory(w.states + 7.5, goal=w.goal, candidates=w.candidates) for w in walks]
    np.testing.assert_allclose(on_reaches.predict_proba(moved), on_reaches.predict_proba(walks), atol=1e-9)
    first = on_reaches.predict_proba([w.first(1) for w in walks])
    assert np.ptp(first, axis=0).max() < 1e-12


@pytest.mark.parametrize("make", [RecurrentPredictor, TransformerPredictor])
def test_learns_to_tell_reaches_apart(make: Any) -> None:
    rng = np.random.default_rng(0)
    predictor = make(16, members=2, max_epochs=25).fit(reaches(60, rng))
    test = reaches(40, rng)
    rows = predictor.predict_proba_at(test, (0.01, 0.9))
    goals = predictor.goal_columns(test)
    assert (rows[:, 1].argmax(axis=1) == goals).mean() > 0.9
    assert np.abs(rows[:, 0] - 0.5).max() < 0.2  # nothing to be learned from one point
    assert predictor.validation_loss_[-1].mean() < predictor.validation_loss_[0].mean()


def test_reads_the_start_and_the_kitchen() -> None:
    """Two starts and kitchens lead to different goals over the same cells."""
    walks = []
    for number in range(40):
        start, name = ("pot", "serving")[number % 2], ("a", "b")[number // 2 % 2]
        goal = TWO[(number + number // 2) % 2]
        cells = [(1, 1), (1, 2), (1, 3)]
        walks.append(Trajectory(cells, start=start, goal=goal, candidates=TWO, layout_name=name))
    predictor = RecurrentPredictor(16, members=2, max_epochs=60, dropout=0.0).fit(walks)
    assert predictor.encoding_.layouts == ("a", "b")
    goals = predictor.goal_columns(walks)
    assert (predictor.predict_proba([w.first(1) for w in walks]).argmax(axis=1) == goals).all()
    stranger = Trajectory([(1, 1)], start="sink", candidates=TWO, layout_name="c", complete=False)
    assert predictor.predict_proba([stranger]).sum() == pytest.approx(1)


# -- training ---------------------------------------------------------------------------------------------------------


def test_fits_are_repeatable_and_leave_no_trace() -> None:
    walks = reaches(24, np.random.default_rng(0))
    torch.manual_seed(3)
    before, threads = torch.get_rng_state(), torch.get_num_threads()
    first = RecurrentPredictor(8, members=2, max_epochs=3, random_state=1).fit(walks)
    assert torch.equal(torch.get_rng_state(), before)
    assert torch.get_num_threads() == threads
    torch.manual_seed(4)
    again = RecurrentPredictor(8, members=2, max_epochs=3, random_state=1).fit(walks)
    other = RecurrentPredictor(8, members=2, max_epochs=3, random_state=2).fit(walks)
    assert np.array_equal(first.predict_proba(walks), again.predict_proba(walks))
    assert not np.allclose(first.predict_proba(walks), other.predict_proba(walks))


def test_stops_when_it_no_longer_gets_better() -> None:
    rng = np.random.default_rng(0)
    noise = [Trajectory(rng.normal(size=(6, 2)), goal=TWO[int(rng.integers(2))], candidates=TWO) for _ in range(40)]
    predictor = RecurrentPredictor(16, members=2, max_epochs=200, patience=3).fit(noise)
    assert len(predictor.validation_loss_) < 60
    best = predictor.validation_loss_.min(axis=0)
    assert (best < np.log(2) + 0.1).all()  # the best weights on pure noise hardly beat, and hardly lose to, guessing


def test_candidates_alone_are_possible(on_cells: NeuralPredictor) -> None:
    walk = example_trajectories()[1]
    row = on_cells.predict_proba([walk])[0]
    assert row[on_cells.classes_.tolist().index("dish")] == 0
    only = Trajectory(walk.states[:2], start="serving", candidates=("onion",), layout=walk.layout, complete=False)
    assert on_cells.predict_proba([only])[0].tolist() == [0.0, 1.0, 0.0]


# -- real people ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ("layout", "known"),
    [
        pytest.param("asymmetric_advantages", 0.935, marks=pytest.mark.benchmark),
        pytest.param("coordination_ring", 0.439, marks=pytest.mark.benchmark),
        ("cramped_room", 0.676),
        pytest.param("random3", 0.488, marks=pytest.mark.benchmark),
    ],
)
def test_reads_recorded_people_as_well_as_a_gru_did_before(layout: str, known: float) -> None:
    walks = recorded_trajectories(None, [layout], "all")
    scores = np.zeros(len(walks))
    for train, test in StratifiedKFold(4, shuffle=True, random_state=0).split(walks, [w.goal for w in walks]):
        predictor = RecurrentPredictor().fit([walks[i] for i in train])
        scores[test] = [predictor.score([walks[i]], cut="cells") for i in test]
    assert scores.mean() > known - 0.02


@pytest.mark.slow
@pytest.mark.benchmark
@pytest.mark.timeout(1200)
@needs_pointing
def test_reads_real_pointing_as_well_as_a_gru_did_before() -> None:
    assert grouped_accuracy(RecurrentPredictor()) > 0.798 - 0.015


# -- files ------------------------------------------------------------------------------------------------------------


def test_files_of_others_are_refused(on_reaches: NeuralPredictor, tmp_path: Path) -> None:
    path = on_reaches.save(tmp_path / "p.npz")
    other = TransformerPredictor if isinstance(on_reaches, RecurrentPredictor) else RecurrentPredictor
    with pytest.raises(ValueError, match=f"not '{'transformer' if other is TransformerPredictor else 'recurrent'}'"):
        other.load(path)
    with pytest.raises(FileNotFoundError):
        RecurrentPredictor.load(tmp_path / "nothing.npz")
    arrays = dict(np.load(path))
    parameters = json.loads(arrays["config"].tobytes())["parameters"]
    for name, changes in (
        ("kind", {"kind": "something"}),
        ("schema", {"schema": 99}),
        ("fit its parameters", {"weights/out": np.zeros((1, 1, 1))}),
        ("not finite", {"weights/out": np.full_like(arrays["weights/out"], np.nan)}),
        ("pickled objects", {"weights/out": np.array([{}], dtype=object)}),
    ):
        np.savez(tmp_path / "bad.npz", **{**arrays, **changes})
        with pytest.raises(ValueError, match=name if name != "kind" else "not a file of a neural"):
            type(on_reaches).load(tmp_path / "bad.npz")
    for name, changes in (
        ("unknown parameters", {"parameters": {"units": 3}}),
        ("`num_layers` must be an integer from 1", {"parameters": {"num_layers": 10**9}}),
        ("fit its parameters", {"parameters": {**parameters, "num_layers": 64}}),
        (r"`classes\[0\]` must be a non-empty text, got 3", {"classes": [3]}),
        ("`encoding` must be a mapping", {"encoding": []}),
        ("it holds a 'x' predictor", {"predictor": "x"}),
    ):
        config = json.dumps({**json.loads(arrays["config"].tobytes()), **changes}).encode()
        np.savez(tmp_path / "bad.npz", **{**arrays, "config": np.frombuffer(config, dtype=np.uint8)})
        with pytest.raises(ValueError, match=name):
            type(on_reaches).load(tmp_path / "bad.npz")
    (tmp_path / "cut.npz").write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match="cannot read"):
        type(on_reaches).load(tmp_path / "cut.npz")


@pytest.mark.slow
def test_without_torch(tmp_path: Path) -> None:
    """Importing, making, loading, predicting and streaming do not even look for torch; fitting says what to install."""
    names = [type(p).__name__ for p in (SMALL[0], SMALL[2])]
    for name, predictor in zip(names, (SMALL[0], SMALL[2]), strict=True):
        clone(predictor).fit(example_trajectories()).save(tmp_path / f"{name}.npz")
    code = f"""
import sys
tried = []
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            tried.append(name)
            raise ModuleNotFoundError("No module named 'torch'", name="torch")
sys.meta_path.insert(0, Absent())
import predictors
from predictors.checks import example_trajectories
walks = example_trajectories()
predictors.ThresholdDecision
for name in {names}:
    kind = getattr(predictors, name)
    loaded = kind.load({str(tmp_path)!r} + f"/{{name}}.npz")
    assert loaded.predict_proba(walks).shape == (8, 3)
    loaded.stream(walks[0]).update((3, 2))
assert not tried, "torch takes seconds to import; only fitting may"
for name in {names}:
    try:
        getattr(predictors, name)().fit(walks)
    except ImportError as error:
        assert "pip install legible-envs[torch]" in str(error), error
    else:
        raise SystemExit("fitted without torch")
"""
    subprocess.run([sys.executable, "-c", code], check=True)


# -- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"hidden_size": 0}, "`hidden_size` must be an integer from 1 to 8192, got 0"),
        ({"members": 1.5}, "`members`"),
        ({"dropout": 1.0}, "`dropout`"),
        ({"learning_rate": -1}, "`learning_rate`"),
        ({"validation_fraction": 0.8}, "`validation_fraction`"),
        ({"random_state": -1}, "`random_state`"),
        ({"device": "abacus"}, "`device` 'abacus'"),
    ],
)
def test_parameters_out_of_range(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_predictor("recurrent", **parameters).fit(example_trajectories())


@pytest.mark.parametrize("kind", [0, 2])
def test_bad_input(kind: int) -> None:
    on_cells = clone(SMALL[kind]).fit(example_trajectories())
    on_reaches = clone(SMALL[kind]).fit(reaches(8, np.random.default_rng(0)))
    walk, reach = example_trajectories()[0], reaches(1, np.random.default_rng(0))[0]
    fresh = clone(on_cells)
    with pytest.raises(ValueError, match="at least one trajectory"):
        fresh.fit([])
    with pytest.raises(ValueError, match="no known goal"):
        fresh.fit([Trajectory(walk.states, candidates=walk.candidates)])
    with pytest.raises(ValueError, match="2-d cells and 2-d positions"):
        fresh.fit([walk, reach])
    with pytest.raises(ValueError, match="all 1 are empty"):
        fresh.fit([walk.first(0)])
    with pytest.raises(ValueError, match=r"row 0, column 0"):
        fresh.fit([Trajectory([(0, 0), (1, 1)], goal="onion", candidates=("onion",), layout=walk.layout)])
    with pytest.raises(NotFittedError):
        clone(on_cells).predict_proba([walk])
    with pytest.raises(NotFittedError):
        clone(on_cells).save("nowhere.npz")
    with pytest.raises(ValueError, match="unknown goals"):
        on_cells.predict_proba([reach])
    with pytest.raises(ValueError, match="`fit` saw 2-d positions, this trajectory has 2-d cells"):
        on_reaches.predict_proba([Trajectory([(1, 1), (1, 2)], candidates=TWO, complete=False)])
    with pytest.raises(ValueError, match="this trajectory has 3-d positions"):
        on_reaches.predict_proba([Trajectory(np.zeros((3, 3)), candidates=TWO, complete=False)])


def test_a_point_that_does_not_fit_is_not_part_of_the_way(on_cells: NeuralPredictor) -> None:
    walk = example_trajectories()[0]
    stream = on_cells.stream(walk)
    stream.update((3, 2))
    before = stream.belief
    with pytest.raises(ValueError, match="row 0, column 0"):
        stream.update((0, 0))
    with pytest.raises(ValueError, match="expected a point that is a cell"):
        stream.update((2.5, 2.0))
    assert stream.belief == before
    assert stream.update((2, 2)) == pytest.approx(
        dict(zip(on_cells.classes_, on_cells.predict_proba([walk.first(2)])[0], strict=True))
    )


def test_positions_scale_with_their_unit() -> None:
    walks = reaches(10, np.random.default_rng(0))
    in_millimetres = [Trajectory(w.states * 1000, goal=w.goal, candidates=TWO) for w in walks]
    metres, millimetres = Encoding.learn(walks), Encoding.learn(in_millimetres)
    for a, b in zip(walks, in_millimetres, strict=True):
        np.testing.assert_allclose(metres.encode(a), millimetres.encode(b), atol=1e-9)
    still = [Trajectory(np.zeros((3, 2)), goal="left", candidates=TWO)]
    assert Encoding.learn(still).encode(still[0]).tolist() == [[0, 0, 0, 0, 1]] * 3


def test_parameters_shared_by_all_networks_are_named_by_each() -> None:
    import inspect

    shared = set(inspect.signature(NeuralPredictor.__init__).parameters) - {"self"}
    assert len(shared) == 10
    for kind, own in ((RecurrentPredictor, 2), (TransformerPredictor, 3)):
        signature = inspect.signature(kind)
        assert shared < set(signature.parameters) == set(kind().get_params())
        assert len(signature.parameters) == len(shared) + own
        changed = kind(8, members=3, random_state=5)
        assert clone(changed).get_params() == changed.get_params()
        assert {"members": 3, "random_state": 5}.items() < changed.get_params().items()
        assert repr(kind(members=2)) == f"{kind.__name__}(members=2)"
        with pytest.raises(TypeError, match="membres"):
            kind(membres=2)  # type: ignore[call-arg]


@pytest.mark.parametrize("network", [Gru(3, 2), Transformer(8, 2, 4)])
def test_shapes_of_weights_are_known_before_they_are_made(network: Network) -> None:
    weights = network.initial_weights(2, 5, 4, np.random.default_rng(0))
    assert dict(network.shapes(2, 5, 4)) == {name: value.shape for name, value in weights.items()}
