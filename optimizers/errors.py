"""Errors of a search; every error that ends one carries what was found until then."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["CheckpointError", "ClusterError", "EmitterError", "SearchError", "SearchInterrupted"]


class SearchError(RuntimeError):
    """A search could not go on, or its folder cannot be read; the message names the file and what is wrong with it.

    Attributes:
        partial: The :class:`~optimizers.SearchResult` at that moment, or None where nothing had been found.
    """

    def __init__(self, message: str, *, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class CheckpointError(SearchError):
    """A checkpoint cannot be written, read, or continued with these settings; the message says what to do."""


class ClusterError(ConnectionError):
    """A Dask cluster cannot be reached, has no worker that may be used, or was lost; the message says which.

    Attributes:
        partial: The :class:`~optimizers.SearchResult` at that moment, where a search was under way; else None.
    """

    def __init__(self, message: str, *, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class SearchInterrupted(KeyboardInterrupt):
    """Ctrl-C during a search, raised after the batch in progress was finished and everything saved.

    Attributes:
        partial: The :class:`~optimizers.SearchResult` at that moment.
    """

    def __init__(self, message: str, *, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class EmitterError(ValueError):
    """An emitter is unknown, or breaks the contract of :mod:`optimizers.emitters.registry`.

    Attributes:
        problems: Each fault, in a sentence; a single one for errors raised while searching.
    """

    def __init__(self, message: str, *, problems: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems) or (message,)
