"""Arguments of every environment here: a spec that stays JSON, and options that are checked."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from legible_envs.support.validation import shown

__all__ = ["JsonSpec", "check_options", "plain"]


def check_options(options: object, known: Sequence[str] = ("layout",)) -> Mapping[str, Any]:
    """The options of a reset.

    Raises:
        ValueError: Not a mapping, or unknown keys.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"`options` must be None or a mapping with keys among {list(known)}, got {shown(options)}")
    unknown = sorted(str(key) for key in options if key not in known)
    if unknown:
        raise ValueError(f"unknown reset options {unknown}; known: {list(known)}")
    return options


class JsonSpec:
    """Keeps an environment's spec JSON: layouts, tasks and distributions are recorded as plain data."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """How the environment was made, as ``gymnasium.make`` can repeat it."""
        return self._spec

    @spec.setter
    def spec(self, value: EnvSpec | None) -> None:
        if value is not None:
            value = copy.copy(value)
            value.kwargs = {key: plain(argument) for key, argument in value.kwargs.items()}
        self._spec = value


def plain(value: Any) -> Any:
    """JSON data that means the same to an environment: of a layout, task, array, path, or nests of them."""
    for convert in ("to_ascii", "to_dict", "to_config"):
        if hasattr(value, convert):
            return plain(getattr(value, convert)())
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray | np.generic) or hasattr(value, "tolist"):  # arrays of other libraries too
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    return value
