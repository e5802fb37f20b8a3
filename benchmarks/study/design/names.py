"""Names of conditions, sittings and questionnaires, which become columns, files and parts of ids."""

from __future__ import annotations

from pydantic import BeforeValidator

from legible_envs.support.models import Checked
from legible_envs.support.names import check_file_name

__all__ = ["Slug"]

_LONGEST = 80


def Slug() -> BeforeValidator:
    """A text of at most 80 characters that is the name of a file on every system, and holds no ``#``."""

    def check(name: str, value: object) -> str:
        text = check_file_name(name, value)
        if len(text) > _LONGEST or "#" in text:
            raise ValueError(f"{name} must be a name of at most {_LONGEST} characters without '#', got {text!r}")
        return text

    return Checked(check)
