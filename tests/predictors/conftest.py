"""Shared by the tests of predictors."""

from __future__ import annotations

import pytest

from predictors import GoalPredictor
from tests.predictors import cases
from tests.predictors.cases import CASES, Case


@pytest.fixture(params=CASES, ids=str)
def case(request: pytest.FixtureRequest) -> Case:
    """Every predictor in turn; a test about some of them parametrises ``case`` itself."""
    return request.param


@pytest.fixture
def predictor(case: Case) -> GoalPredictor:
    """That of the case, fitted; must not be changed."""
    return cases.fitted(case)
