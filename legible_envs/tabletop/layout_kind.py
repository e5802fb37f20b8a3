"""How tables are written in trajectory files: as their JSON."""

from __future__ import annotations

import json
from typing import Final

from legible_envs.layout_kinds import LayoutKind
from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["TABLE"]


def _to_line(layout: TabletopLayout) -> str:
    return json.dumps(layout.to_dict(), separators=(",", ":"))


TABLE: Final = LayoutKind(
    name="tabletop",
    layout=TabletopLayout,
    to_text=TabletopLayout.to_json,
    from_text=TabletopLayout.from_json,
    to_line=_to_line,
    from_line=TabletopLayout.from_json,
    recognises=lambda line: line.startswith("{"),
    schema=3,
)
