"""The pages and their files, and the headers that everything is sent with."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache, lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from benchmarks.study.server.context import Context

__all__ = ["KINDS", "asset", "headers", "page_of", "participant_page"]

KINDS: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
}
"""What files of pages are sent as."""

_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src 'self'; manifest-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors {ancestors}"
)


def headers(*, framed: bool) -> dict[str, str]:
    """Headers of a response.

    Args:
        framed: Whether another site may show it in a frame, as recruitment platforms do.
    """
    return {
        "Content-Security-Policy": _POLICY.format(ancestors="*" if framed else "'none'"),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Permissions-Policy": "camera=(), microphone=(), geolocation=(), payment=(), usb=()",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
    }


@cache
def _template(name: str) -> Any:
    from jinja2 import Environment

    text = files("benchmarks.study.page").joinpath(name).read_text(encoding="utf-8")
    return Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(text)


def page_of(name: str, data: Mapping[str, Any], **values: Any) -> str:
    """A page.

    Args:
        name: Of the template.
        data: What its script reads from ``<script type="application/json" id="study">``.
        values: Of the template.
    """
    from markupsafe import Markup

    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return str(_template(name).render(study_json=Markup(text), data=data, **values))


def participant_page(context: Context, *, reason: str = "") -> str:
    """The page that participants meet.

    Args:
        context: What sessions share.
        reason: Name of the text that says why nobody can join; empty where they can.
    """
    content = context.study.content
    data = {
        "title": content.title,
        "language": content.language,
        "domain": content.domain,
        "theme": content.look.theme,
        "accent": content.look.accent,
        "words": dict(context.study.words),
        "keys": content.look.keys,
        "show_belief": content.look.show_belief,
        "welcome": context.text("welcome"),
        "can_join": not reason,
        "reason": context.text(reason) if reason else "",
        "debug": context.store.mode == "debug",
    }
    return page_of("index.html.j2", data, title=content.title, language=content.language)


@lru_cache(maxsize=64)
def asset(name: str) -> bytes | None:
    """A file of the pages, or None where there is none of this name.

    Names are looked up among the files that there are; nothing else on the machine can be named.
    """
    from benchmarks.study.page import sprites

    drawn = {"kitchen.svg": "overcooked", "table.svg": "tabletop"}
    if name in drawn:
        return sprites(drawn[name]).encode()
    known = {file.name: file for file in files("benchmarks.study.page").iterdir() if file.is_file()}
    if name not in known or not name.endswith(tuple(KINDS)):
        return None
    return known[name].read_bytes()
