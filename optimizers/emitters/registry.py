"""Plugging in emitters: names, entry points, and the contract between an emitter and a search.

**What an emitter is.** A pyribs emitter (``ribs.emitters.EmitterBase``; :class:`~optimizers.WorkspaceEmitter` is one
that already knows bounds, workspace and seed), made by a *factory* that :func:`make_emitter`
calls with keyword arguments, those it accepts:

=============== ======================================================================================================
``archive``     the archive of the search (``GridArchive`` on genomes); read elites from it, the scheduler adds to it
``workspace``   the design problem: ``sample``, ``perturb``, ``valid``, ``lower_bounds``, ``upper_bounds``, ...
``seed``        an integer; all randomness must come from it
``evaluations`` planned number of evaluations, or None (optional)
``iterations``  number of the emitter's own iterations to run before its ``done`` turns true, or None (optional)
``**options``   whatever the user gave as ``emitter_options``
=============== ======================================================================================================

``ask()`` returns ``(n, d)`` genomes, ``n`` may vary; invalid ones are left out before scoring. ``tell(solution,
objective, measures, add_info)`` gets results in the same order. An emitter that only ever proposes valid genomes of the
workspace's type may say so with ``emits_valid = True``; it is then used as it is, and layouts that are not allowed
score NaN. Any other is wrapped in :class:`~optimizers.emitters.adapter.GenomeAdapter`, which rounds, clips and filters.
An emitter must pickle, or runs with it cannot be checkpointed. ``settings`` (a dict) is written to the run's manifest
if present.

**Emitters that know no workspace** (pyribs' own): where the factory has no ``workspace`` parameter it gets the archive
with real-valued genomes, and a random layout as ``x0`` where it takes one. It is not told the bounds: what it proposes
is rounded and clipped (pyribs' evolution strategies would redraw until every gene is inside, which on small integer
ranges may take forever).

**A plain function** works too: any function with a parameter named ``rng``, called as ``propose(archive, workspace,
rng, **options)`` for each batch and returning ``(n, d)`` genomes.

**Names.** ``register_emitter("mine", factory)``; or an entry point in group ``legible.emitters``; or, without either,
``"module:Class"``. Run :func:`~optimizers.emitters.checks.check_emitter` over yours in its tests.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from legible_envs.support.plugins import Plugin, Registry, target_of
from legible_envs.workspace import Workspace
from optimizers.errors import EmitterError

__all__ = ["ENTRY_POINT_GROUP", "EmitterInfo", "EmitterSpec", "emitter_name", "list_emitters", "make_emitter"]
__all__ += ["register_emitter", "resolve_emitter"]

ENTRY_POINT_GROUP = "legible.emitters"
EmitterSpec = str | Callable[..., Any]

EmitterInfo = Plugin

_registry = Registry(
    "emitter",
    ENTRY_POINT_GROUP,
    {
        "annealing": "optimizers.emitters.annealing:AnnealingEmitter",
        "cma-mae": "optimizers.emitters.covariance:CmaMaeEmitter",
        "cma-me": "optimizers.emitters.covariance:CmaMeEmitter",
        "differential-evolution": "optimizers.emitters.differential_evolution:DifferentialEvolutionEmitter",
        "gradient-arborescence": "optimizers.emitters.gradient_arborescence:GradientArborescenceEmitter",
        "improve": "optimizers.emitters.improve:ImproveWorkspaceEmitter",
        "mutation": "optimizers.emitters.mutation:MutationEmitter",
        "nslc": "optimizers.emitters.novelty:NoveltyLocalCompetitionEmitter",
        "random": "optimizers.emitters.random:RandomWorkspaceEmitter",
    },
    EmitterError,
)


def register_emitter(name: str, factory: Callable[..., Any], *, overwrite: bool = False) -> None:
    """Make an emitter available by name for the rest of this process.

    Args:
        name: The name; must not be taken unless ``overwrite``.
        factory: A class, a factory or a proposing function; see the module's documentation.
        overwrite: Whether an earlier registration of that name may be replaced. Built-in names are never replaced.

    Raises:
        EmitterError: The name is taken or not a name, or the factory cannot be called.
    """
    _registry.register(name, factory, overwrite=overwrite)


def list_emitters() -> dict[str, EmitterInfo]:
    """Every emitter known by name: built in, registered in this process, and installed as entry points."""
    return _registry.list()


def resolve_emitter(spec: EmitterSpec) -> Callable[..., Any]:
    """Find a factory by name, ``"module:Class"``, or return the callable given.

    Raises:
        EmitterError: Nothing of that name, or it cannot be imported.
    """
    return _registry.resolve(spec)


def emitter_name(spec: EmitterSpec) -> str:
    """How a manifest names an emitter: as given, or ``module:Name`` for a callable."""
    return spec if isinstance(spec, str) else target_of(spec)


def make_emitter(
    spec: EmitterSpec,
    archive: Any,
    workspace: Workspace,
    *,
    seed: int,
    evaluations: int | None = None,
    iterations: int | None = None,
    options: Mapping[str, Any] | None = None,
) -> Any:
    """Make an emitter ready for a pyribs ``Scheduler`` over this archive.

    Args:
        spec: Name, ``"module:Class"``, factory or proposing function.
        archive: The archive of the search.
        workspace: The design problem.
        seed: Seed of everything the emitter draws.
        evaluations: Planned number of evaluations, for emitters that want to know.
        iterations: Number of own iterations, for emitters that count them.
        options: Further keyword arguments of the factory.

    Returns:
        An emitter that proposes valid genomes only.

    Raises:
        EmitterError: Unknown emitter, options it does not take, or something that is not an emitter came out.
    """
    from optimizers.emitters.adapter import FloatArchiveView, FunctionEmitter, GenomeAdapter

    factory = resolve_emitter(spec)
    name = emitter_name(spec)
    options = dict(options or {})
    parameters, takes_any = _parameters(factory)
    if not inspect.isclass(factory) and "rng" in parameters:
        _refuse_unknown(name, options, parameters, takes_any, {"archive", "workspace", "rng"})
        emitter: Any = FunctionEmitter(archive, workspace, propose=factory, options=options, seed=seed)
    else:
        offered: dict[str, Any] = {"archive": archive, "workspace": workspace, "seed": seed}
        offered |= {"evaluations": evaluations, "iterations": iterations}
        if "workspace" not in parameters and not takes_any:
            offered["archive"] = FloatArchiveView(archive)
            if "x0" in parameters and not {"x0", "initial_solutions"} & options.keys():
                offered["x0"] = workspace.sample(1, np.random.default_rng(seed))[0].astype(np.float64)
        _refuse_unknown(name, options, parameters, takes_any, set())
        wanted = {key: value for key, value in offered.items() if takes_any or key in parameters}
        emitter = _call(factory, name, {**wanted, **options})
    for needed in ("ask", "tell", "solution_dim"):
        if not hasattr(emitter, needed):
            raise EmitterError(f"{name}: the factory returned a {type(emitter).__name__}, which has no {needed!r}")
    if getattr(emitter, "emits_valid", False):
        return emitter
    return GenomeAdapter(archive, workspace, emitter, name=name, seed=np.random.SeedSequence((seed, 1)))


def _call(factory: Callable[..., Any], name: str, arguments: dict[str, Any]) -> Any:
    try:
        return factory(**arguments)
    except TypeError as error:
        given = ", ".join(sorted(arguments))
        raise EmitterError(f"{name}: the factory could not be called with {given}: {error}") from error
    except ValueError as error:
        raise EmitterError(f"{name}: {error}") from error


def _parameters(factory: Callable[..., Any]) -> tuple[set[str], bool]:
    """Names a factory accepts as keywords, and whether it takes any others too."""
    try:
        parameters = inspect.signature(factory).parameters.values()
    except (TypeError, ValueError):
        return set(), True
    names = {p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)}
    return names, any(p.kind is p.VAR_KEYWORD for p in parameters)


def _refuse_unknown(name: str, options: Mapping[str, Any], known: set[str], takes_any: bool, ours: set[str]) -> None:
    unknown = sorted(options.keys() - (known - ours))
    if unknown and not takes_any:
        reserved = {"archive", "workspace", "seed", "self", *ours}
        raise EmitterError(
            f"{name} has no option {', '.join(unknown)}; its options: {', '.join(sorted(known - reserved))}"
        )
