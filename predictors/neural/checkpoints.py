"""What the configuration in a neural predictor's file may hold: keys, types and bounds."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

from legible_envs.support.models import Checked, FileModel, Flag, Length, Real, Text, Whole
from legible_envs.support.validation import shown

__all__ = ["MOST_CELLS", "CheckpointConfig", "EncodingConfig"]

MOST_CELLS: Final = 256 * 256
"""Cells of a grid that a network is given one number for each of."""

_MOST_NAMES: Final = 100_000

Name = Annotated[str, Text(100_000)]
Label = Annotated[str, Text(100_000, empty=True)]
Positive = Annotated[float, Real(0, closed="neither")]


def _grid(name: str, value: object) -> object:
    """Rows and columns of a grid, or nothing."""
    if not isinstance(value, list) or len(value) not in (0, 2) or not all(type(n) is int and n > 0 for n in value):
        raise ValueError(f"{name} must be two numbers of cells, or empty for positions, got {shown(value)}")
    if math.prod(value) > MOST_CELLS:
        raise ValueError(f"{name} must have at most {MOST_CELLS:,} cells, got {shown(value)}")
    return value


class EncodingConfig(FileModel):
    """See :class:`~predictors.neural.encoding.Encoding`."""

    grid: Annotated[bool, Flag()]
    dimension: Annotated[int, Whole(1, 1000)]
    shape: Annotated[list[int], Checked(_grid)]
    scale: Positive
    stride: Positive
    starts: Annotated[list[Label], Length(0, _MOST_NAMES)]
    layouts: Annotated[list[Label], Length(0, _MOST_NAMES)]


class CheckpointConfig(FileModel):
    """See :meth:`~predictors.neural.base.NeuralPredictor.save`."""

    predictor: Name
    parameters: Annotated[dict[str, Any], Length(0, 100)]
    classes: Annotated[list[Name], Length(1, _MOST_NAMES)]
    encoding: EncodingConfig
