"""Search for legible layouts: pyribs archives and schedulers with emitters made for workspaces.

Start with :func:`search`. To plug in an algorithm of your own, read :mod:`optimizers.emitters.registry`. Nothing here
imports pyribs before it is used: pyribs brings pandas, scikit-learn and (where installed) torch with it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optimizers.archives import WorkspaceArchive, make_archive
    from optimizers.emitters.annealing import AnnealingEmitter
    from optimizers.emitters.checks import check_emitter
    from optimizers.emitters.covariance import CmaMaeEmitter, CmaMeEmitter
    from optimizers.emitters.differential_evolution import DifferentialEvolutionEmitter
    from optimizers.emitters.gradient_arborescence import GradientArborescenceEmitter
    from optimizers.emitters.improve import ImproveWorkspaceEmitter
    from optimizers.emitters.mutation import MutationEmitter
    from optimizers.emitters.novelty import NoveltyLocalCompetitionEmitter
    from optimizers.emitters.random import RandomWorkspaceEmitter
    from optimizers.emitters.registry import list_emitters, make_emitter, register_emitter
    from optimizers.errors import CheckpointError, EmitterError, SearchError, SearchInterrupted
    from optimizers.evaluate import Evaluator
    from optimizers.result import SearchResult, load_run
    from optimizers.searching import search

_HOME = {
    "AnnealingEmitter": "optimizers.emitters.annealing",
    "CheckpointError": "optimizers.errors",
    "CmaMaeEmitter": "optimizers.emitters.covariance",
    "CmaMeEmitter": "optimizers.emitters.covariance",
    "DifferentialEvolutionEmitter": "optimizers.emitters.differential_evolution",
    "EmitterError": "optimizers.errors",
    "Evaluator": "optimizers.evaluate",
    "GradientArborescenceEmitter": "optimizers.emitters.gradient_arborescence",
    "ImproveWorkspaceEmitter": "optimizers.emitters.improve",
    "MutationEmitter": "optimizers.emitters.mutation",
    "NoveltyLocalCompetitionEmitter": "optimizers.emitters.novelty",
    "RandomWorkspaceEmitter": "optimizers.emitters.random",
    "SearchError": "optimizers.errors",
    "SearchInterrupted": "optimizers.errors",
    "SearchResult": "optimizers.result",
    "WorkspaceArchive": "optimizers.archives",
    "check_emitter": "optimizers.emitters.checks",
    "list_emitters": "optimizers.emitters.registry",
    "load_run": "optimizers.result",
    "make_archive": "optimizers.archives",
    "make_emitter": "optimizers.emitters.registry",
    "register_emitter": "optimizers.emitters.registry",
    "search": "optimizers.searching",
}

__all__ = [
    "AnnealingEmitter",
    "CheckpointError",
    "CmaMaeEmitter",
    "CmaMeEmitter",
    "DifferentialEvolutionEmitter",
    "EmitterError",
    "Evaluator",
    "GradientArborescenceEmitter",
    "ImproveWorkspaceEmitter",
    "MutationEmitter",
    "NoveltyLocalCompetitionEmitter",
    "RandomWorkspaceEmitter",
    "SearchError",
    "SearchInterrupted",
    "SearchResult",
    "WorkspaceArchive",
    "check_emitter",
    "list_emitters",
    "load_run",
    "make_archive",
    "make_emitter",
    "register_emitter",
    "search",
]


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
