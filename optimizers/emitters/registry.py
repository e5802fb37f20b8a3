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
ranges may take forever). Few of its proposals are then valid layouts; ``search(workspace.continuous(), ...)`` gives
such emitters :class:`random keys <legible_envs.key_space.KeySpace>` to move in, and all are. Beside them, emitters that
know the workspace get the workspace itself, and share the archive of layouts.

**A plain function** works too: any function with a parameter named ``rng``, called as ``propose(archive, workspace,
rng, **options)`` for each batch and returning ``(n, d)`` genomes.

**Names.** ``register_emitter("mine", factory)``; or an entry point in group ``legible.emitters``; or, without either,
``"module:Class"``. Run :func:`~optimizers.emitters.checks.check_emitter` over yours in its tests.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Set
from typing import Any

import numpy as np

from legible_envs.key_space import KeySpace
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
        "ppo": "optimizers.emitters.policy_gradient:PolicyGradientEmitter",
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
    _refuse_instance(factory)
    _registry.register(name, factory, overwrite=overwrite)


def list_emitters() -> dict[str, EmitterInfo]:
    """Every emitter known by name: built in, registered in this process, and installed as entry points."""
    return _registry.list()


def resolve_emitter(spec: EmitterSpec) -> Callable[..., Any]:
    """Find a factory by name, ``"module:Class"``, or return the callable given.

    Raises:
        EmitterError: Nothing of that name, it cannot be imported, or it is an emitter made already.
    """
    _refuse_instance(spec)
    return _registry.resolve(spec)


def _refuse_instance(spec: Any) -> None:
    """Refuse an emitter where what makes one is expected."""
    if not inspect.isclass(spec) and hasattr(spec, "ask") and hasattr(spec, "tell"):
        kind = type(spec).__name__
        raise EmitterError(
            f"got a {kind} that is made already; give its class, and its arguments as emitter options: "
            f"emitter={kind}, emitter_options={{...}}. A search makes its emitters itself, with its archive and seed"
        )


def emitter_name(spec: EmitterSpec) -> str:
    """How a manifest names an emitter: as given, or ``module:Name`` for a callable."""
    return spec if isinstance(spec, str) else target_of(spec)


def make_emitter(
    spec: EmitterSpec,
    archive: Any,
    workspace: Workspace | KeySpace,
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
        workspace: The design problem; or its ``continuous()``, so that emitters that know no workspace move in random
            keys.
        seed: Seed of everything the emitter draws.
        evaluations: Planned number of evaluations, for emitters that want to know.
        iterations: Number of own iterations, for emitters that count them.
        options: Further keyword arguments of the factory.

    Returns:
        An emitter that proposes valid genomes only.

    Raises:
        EmitterError: Unknown emitter, options it does not take or lacks, or something that is not an emitter came out.

    Warns:
        UserWarning: One of pyribs' own emitters is to move in genomes of whole numbers.
    """
    from optimizers.emitters.adapter import FunctionEmitter, GenomeAdapter, KeyAdapter

    space = workspace if isinstance(workspace, KeySpace) else None
    design: Workspace = workspace if space is None else space.workspace  # type: ignore[assignment]
    factory = resolve_emitter(spec)
    name = emitter_name(spec)
    options = dict(options or {})
    parameters, takes_any = _parameters(factory)
    knows_workspace = "workspace" in parameters or takes_any
    if not inspect.isclass(factory) and "rng" in parameters:
        ours = {"archive", "workspace", "rng"}
        _check_options(name, options, parameters, takes_any, ours, given=ours)
        emitter: Any = FunctionEmitter(archive, design, propose=factory, options=options, seed=seed)
        knows_workspace = True
    else:
        offered: dict[str, Any] = {"archive": archive, "workspace": design, "seed": seed}
        offered |= {"evaluations": evaluations, "iterations": iterations}
        if not knows_workspace:
            offered |= _offered_to_strangers(factory, name, archive, workspace, seed, parameters, options)
        wanted = {key: value for key, value in offered.items() if takes_any or key in parameters}
        _check_options(name, options, parameters, takes_any, set(), given=wanted.keys() | options.keys())
        emitter = _call(factory, name, {**wanted, **options})
    for needed in ("ask", "tell", "solution_dim"):
        if not hasattr(emitter, needed):
            raise EmitterError(f"{name}: the factory returned a {type(emitter).__name__}, which has no {needed!r}")
    if getattr(emitter, "emits_valid", False):
        return emitter
    own_seed = np.random.SeedSequence((seed, 1))
    if space is not None and not knows_workspace:
        return KeyAdapter(archive, space, emitter, name=name, seed=own_seed)
    return GenomeAdapter(archive, design, emitter, name=name, seed=own_seed)


def _offered_to_strangers(
    factory: Callable[..., Any],
    name: str,
    archive: Any,
    workspace: Workspace | KeySpace,
    seed: int,
    parameters: Mapping[str, bool],
    options: Mapping[str, Any],
) -> dict[str, Any]:
    """Arguments for an emitter that knows no workspace: the archive in real numbers, and where to begin."""
    from optimizers.emitters.adapter import FloatArchiveView, KeyArchiveView

    offered: dict[str, Any] = {}
    if isinstance(workspace, KeySpace):
        offered["archive"] = KeyArchiveView(archive, workspace)
    else:
        offered["archive"] = FloatArchiveView(archive)
        is_whole = np.issubdtype(workspace.genome_dtype, np.integer)
        if is_whole and inspect.isclass(factory) and factory.__module__.partition(".")[0] == "ribs":
            warnings.warn(
                f"{name} takes steps in real numbers, and genomes of this workspace are whole numbers: its proposals "
                "are rounded, and most are no valid layouts. Search workspace.continuous() instead, where all are",
                stacklevel=3,
            )
    if "x0" in parameters and not {"x0", "initial_solutions"} & options.keys():
        offered["x0"] = workspace.sample(1, np.random.default_rng(seed))[0].astype(np.float64)
    return offered


def _call(factory: Callable[..., Any], name: str, arguments: dict[str, Any]) -> Any:
    try:
        return factory(**arguments)
    except TypeError as error:
        given = ", ".join(sorted(arguments))
        raise EmitterError(f"{name}: the factory could not be called with {given}: {error}") from error
    except ValueError as error:
        raise EmitterError(f"{name}: {error}") from error


def _parameters(factory: Callable[..., Any]) -> tuple[dict[str, bool], bool]:
    """Names a factory accepts as keywords, with whether it needs each, and whether it takes any others too."""
    try:
        parameters = inspect.signature(factory).parameters.values()
    except (TypeError, ValueError):
        return {}, True
    by_keyword = [p for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    return {p.name: p.default is p.empty for p in by_keyword}, any(p.kind is p.VAR_KEYWORD for p in parameters)


def _check_options(
    name: str,
    options: Mapping[str, Any],
    parameters: Mapping[str, bool],
    takes_any: bool,
    ours: set[str],
    *,
    given: Set[str],
) -> None:
    """Refuse options that a factory does not take, and options that it needs and was not given."""
    known = sorted(parameters.keys() - {"archive", "workspace", "seed", "self", *ours})
    unknown = sorted(options.keys() - (parameters.keys() - ours))
    if unknown and not takes_any:
        raise EmitterError(f"{name} has no option {', '.join(unknown)}; its options: {', '.join(known)}")
    missing = [key for key, needed in parameters.items() if needed and key not in given and key not in options]
    if missing:
        spelled = ", ".join(f"{key!r}: ..." for key in missing)
        raise EmitterError(
            f"{name} needs the emitter option{'s' * (len(missing) > 1)} {', '.join(missing)}, without a default "
            f"(in Python: emitter_options={{{spelled}}}); its options: {', '.join(known)}"
        )
