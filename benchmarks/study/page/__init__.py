"""The pages of a study in the browser: what participants meet, and what researchers watch."""

from __future__ import annotations

import json
from functools import cache
from html import escape

__all__ = ["sprites"]


@cache
def sprites(domain: str) -> str:
    """All drawings of a domain's page as one SVG file.

    Args:
        domain: ``"overcooked"`` or ``"tabletop"``.

    Returns:
        Symbols by id, and in the attribute ``data-measures`` of the root where they go and in which colours, as JSON.
    """
    if domain == "overcooked":
        from legible_envs.overcooked.rendering.symbols import game_measures, game_symbols, kitchen_symbols

        symbols, measures = kitchen_symbols() | game_symbols(), game_measures()
    else:
        from legible_envs.tabletop.rendering.symbols import table_measures, table_symbols

        symbols, measures = table_symbols(), table_measures()
    data = escape(json.dumps(measures, separators=(",", ":"), allow_nan=False))
    return f'<svg xmlns="http://www.w3.org/2000/svg" data-measures="{data}">{"".join(symbols.values())}</svg>'
