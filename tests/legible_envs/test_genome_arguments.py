"""Genomes, counts and generators at the door of both workspaces: any numeric type is read, all else named."""

import numpy as np
import pytest

from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.tabletop import TabletopWorkspace

WORKSPACES = {"kitchen": OvercookedWorkspace(shape=(5, 5)), "table": TabletopWorkspace(condition="placement")}
every_workspace = pytest.mark.parametrize("ws", WORKSPACES.values(), ids=WORKSPACES)
ON_BATCHES = ("valid", "legibility", "distance", "measures", "penalty", "scores")
ON_ONE = ("decode", "summary", "explain", "simplifications", "prune")


def genomes(ws, n=4):
    return ws.sample(n, np.random.default_rng(0))


@every_workspace
@pytest.mark.parametrize("method", ON_BATCHES)
def test_what_is_no_batch_is_named(ws, method):
    batch, d = genomes(ws), ws.genome_size
    for bad, message in [
        (batch[:, :-1], rf"expected genomes of shape \(n, {d}\).*, got \(4, {d - 1}\)"),
        (batch[None], rf"got \(1, 4, {d}\)"),
        ([[1, 2], [1]], "got rows of different lengths"),
        (None, "expected numeric genomes, got dtype object"),
        (batch.astype(object), "expected numeric genomes, got dtype object"),
        (batch.astype(str), "expected numeric genomes, got dtype <U"),
        (batch.astype(complex), "expected numeric genomes, got dtype complex128"),
        (np.ma.masked_array(batch, mask=True), "without masked entries, got a masked array"),
    ]:
        with pytest.raises(ValueError, match=message):
            getattr(ws, method)(bad)


@every_workspace
@pytest.mark.parametrize("method", ON_ONE)
def test_what_is_no_single_genome_is_named(ws, method):
    batch, d = genomes(ws), ws.genome_size
    for bad, message in [
        (batch, rf"expected one genome of shape \({d},\), got \(4, {d}\)"),
        (batch[0, :-1], rf"got \({d - 1},\)"),
        (batch[0].astype(complex), "expected numeric genomes, got dtype complex128"),
        ([[1, 2], [1]], "rows of different lengths"),
    ]:
        with pytest.raises(ValueError, match=message):
            getattr(ws, method)(bad)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.longdouble, ">f8", np.int64, np.uint8])
def test_whole_numbers_of_any_type_are_a_kitchen(dtype):
    ws, batch = WORKSPACES["kitchen"], genomes(WORKSPACES["kitchen"])
    for method in ("valid", "legibility", "distance", "measures"):
        np.testing.assert_array_equal(getattr(ws, method)(batch.astype(dtype)), getattr(ws, method)(batch))
    assert ws.decode(batch[0].astype(dtype)) == ws.decode(batch[0])
    children = ws.perturb(batch.astype(dtype), 2, np.random.default_rng(0))
    np.testing.assert_array_equal(children, ws.perturb(batch, 2, np.random.default_rng(0)))
    np.testing.assert_array_equal(ws.prune(batch[0].astype(dtype)), ws.prune(batch[0]))


@every_workspace
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_numbers_that_no_layout_has_score_nan_and_are_refused_where_one_is_needed(ws, bad):
    batch = genomes(ws).astype(np.float64)
    batch[2, 1] = bad
    np.testing.assert_array_equal(ws.valid(batch), [True, True, False, True])
    for values in (ws.legibility(batch), ws.distance(batch)):
        np.testing.assert_array_equal(np.isnan(values), [False, False, True, False])
    for method in (ws.decode, ws.prune, ws.legibility):
        with pytest.raises(LayoutError):
            method(batch[2])
    with pytest.raises(LayoutError):
        ws.perturb(batch, 2, np.random.default_rng(0))


def test_fractions_are_no_kitchen():
    ws = WORKSPACES["kitchen"]
    batch = genomes(ws) + np.float32(0.25)
    assert not ws.valid(batch).any()
    assert np.isnan(ws.legibility(batch)).all()
    for refuse in (lambda: ws.decode(batch[0]), lambda: ws.prune(batch[0]), lambda: ws.legibility(batch[0])):
        with pytest.raises(LayoutError):
            refuse()


@every_workspace
def test_counts_and_generators_are_checked(ws):
    batch, rng = genomes(ws), np.random.default_rng(0)
    for count in (2.5, -1, None, "3", True):
        with pytest.raises(ValueError, match="`n` must be an integer from 0 to 1000000, got"):
            ws.sample(count, rng)
        with pytest.raises(ValueError, match=r"`k` must be an integer .*, got"):
            ws.perturb(batch, count, rng)
    for generator in (None, 0, np.random.RandomState(0), np.random):
        with pytest.raises(ValueError, match="`rng` must be a numpy random Generator"):
            ws.sample(2, generator)
        with pytest.raises(ValueError, match="`rng` must be a numpy random Generator"):
            ws.perturb(batch, 2, generator)
    assert ws.sample(np.int64(0), rng).shape == (0, ws.genome_size)


def test_messages_show_plain_numbers():
    ws = WORKSPACES["table"]
    genome = genomes(ws)[0] + 5.0
    with pytest.raises(LayoutError, match=r"gene 0 \(x of '[a-z-]+'\) is 5\.\d+; expected 0\.1 to 0\.8"):
        ws.decode(genome)
