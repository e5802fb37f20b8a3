"""The monitor: how participants are doing, for researchers with the admin token."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.study.server.hub import Hub
    from benchmarks.study.server.secrets import Secrets
    from benchmarks.study.store import Mode

__all__ = ["monitor_routes"]


def monitor_routes(hubs: Mapping[Mode, Hub], secrets: Secrets) -> list[Any]:
    """The routes of the monitor."""
    return []
