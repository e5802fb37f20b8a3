"""Scores, seeded searches, pictures and episodes are those that were recorded; see tests/golden/golden.py."""

import json

import numpy as np
import pytest

from tests.golden import golden

pytestmark = pytest.mark.slow

BY_PROCESSOR = "kitchen search/cma-me/"
"""Its covariances go through LAPACK, which rounds as the processor does; a search does not forget a last digit."""


def test_figures_are_those_recorded():
    then, now = golden.read_figures(), golden.figures()
    assert then.keys() == now.keys()
    for name, expected in then.items():
        if name.startswith(BY_PROCESSOR):
            assert len(now[name]) > 0.75 * len(expected)
            continue
        np.testing.assert_allclose(now[name], expected, rtol=1e-9, atol=1e-9, err_msg=name)


def test_pictures_and_steps_of_kitchens_are_those_recorded():
    then, now = json.loads(golden.DIGESTS.read_text()), golden.digests()
    assert then.keys() == now.keys()
    # The table's physics rounds as the processor does; its own tests replay it exactly on one machine.
    exact = [name for name in then if "Tabletop" not in name]
    assert {name: now[name] for name in exact} == {name: then[name] for name in exact}
