"""Packages that only some parts need."""

from __future__ import annotations

from typing import Any

__all__ = ["import_torch"]


def import_torch(need: str, without: str) -> Any:
    """PyTorch, an optional dependency.

    Args:
        need: The beginning of the message where it is not installed, such as ``"training needs"``.
        without: What works without it.

    Raises:
        ImportError: It is not installed; the message says how to.
    """
    try:
        import torch
    except ImportError as error:
        raise ImportError(
            f"{need} PyTorch, which is not installed: pip install legible-envs[torch] ({without}). "
            f"The import said: {error}"
        ) from error
    return torch
