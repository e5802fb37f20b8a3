"""Values in rows: this program wrote them as JSON, and reads them back."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["from_row"]


def from_row(text: str) -> Any:
    """What :mod:`benchmarks.study.store.rows` wrote as JSON.

    Raises:
        ValueError: Another hand has changed the row.
    """
    return json.loads(text)
