from .archives import WorkspaceArchive, make_archive
from .emitters.annealing import AnnealingEmitter
from .emitters.base import WorkspaceEmitter
from .emitters.checks import check_emitter
from .emitters.covariance import CmaMaeEmitter, CmaMeEmitter
from .emitters.differential_evolution import DifferentialEvolutionEmitter
from .emitters.gradient_arborescence import GradientArborescenceEmitter
from .emitters.improve import ImproveWorkspaceEmitter
from .emitters.mutation import MutationEmitter
from .emitters.novelty import NoveltyLocalCompetitionEmitter
from .emitters.policy_gradient import PolicyGradientEmitter
from .emitters.random import RandomWorkspaceEmitter
from .emitters.registry import list_emitters, make_emitter, register_emitter
from .errors import CheckpointError, ClusterError, EmitterError, SearchError, SearchInterrupted
from .evaluator import Evaluator
from .runs.folder import is_run_folder
from .runs.result import Elites, SearchResult, load_run
from .searching import search

__all__ = [
    "AnnealingEmitter",
    "CheckpointError",
    "ClusterError",
    "CmaMaeEmitter",
    "CmaMeEmitter",
    "DifferentialEvolutionEmitter",
    "Elites",
    "EmitterError",
    "Evaluator",
    "GradientArborescenceEmitter",
    "ImproveWorkspaceEmitter",
    "MutationEmitter",
    "NoveltyLocalCompetitionEmitter",
    "PolicyGradientEmitter",
    "RandomWorkspaceEmitter",
    "SearchError",
    "SearchInterrupted",
    "SearchResult",
    "WorkspaceArchive",
    "WorkspaceEmitter",
    "check_emitter",
    "is_run_folder",
    "list_emitters",
    "load_run",
    "make_archive",
    "make_emitter",
    "register_emitter",
    "search",
]
