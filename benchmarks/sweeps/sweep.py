"""The file of a sweep, and the trials it stands for."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from benchmarks.sweeps.sweep_file import MOST, SweepContent
from legible_envs.support.models import as_plain, validated
from legible_envs.support.names import file_name
from legible_envs.support.plain_data import check_plain, parse_toml
from legible_envs.support.text import read_text
from legible_envs.workspace import Workspace, make_workspace
from predictors.registry import make_predictor

__all__ = ["Named", "Prediction", "Sweep", "SweepError", "Variant"]


class SweepError(ValueError):
    """The file of a sweep asks for something that cannot be run; the message names the entry."""


class Named(NamedTuple):
    """One entry of an axis: what tables call it, its settings, and what it has of its own instead of the sweep's."""

    label: str
    settings: dict[str, Any]
    own: Mapping[str, Any] = MappingProxyType({})


class Prediction(NamedTuple):
    """Which predictors are evaluated on simulated participants in the layouts found, and how these are simulated."""

    predictors: tuple[str, ...] = ()
    people: Mapping[str, Any] = MappingProxyType({})


class Variant(NamedTuple):
    """A trial and what tables call its settings."""

    labels: dict[str, Any]
    trial: dict[str, Any]


@dataclass(frozen=True)
class Sweep:
    """Every combination of workspace, objective, emitter, number of evaluations and seed.

    Attributes:
        name: Its name, also that of its default folder.
        workspaces: Settings of :func:`~legible_envs.workspace.make_workspace`.
        emitters: ``emitter`` (a name or ``"module:Class"``) and its options.
        objectives: Names.
        evaluations: Budgets.
        seeds: One search each.
        prediction: By label of a workspace, the predictors evaluated on simulated participants in the best layout of
            every search, and how these are simulated: ``participants`` (8) and what the workspace's ``simulate``
            takes.

    Example:
        >>> sweep = Sweep.from_dict({"workspaces": [{"workspace": "overcooked", "shape": [5, 5]}], "seeds": 3})
        >>> len(list(sweep.variants()))
        3
    """

    name: str
    workspaces: tuple[Named, ...]
    emitters: tuple[Named, ...]
    objectives: tuple[str, ...]
    evaluations: tuple[int, ...]
    seeds: tuple[int, ...]
    prediction: Mapping[str, Prediction]

    @classmethod
    def from_toml(cls, path: str | Path) -> Sweep:
        """Read a file.

        Raises:
            SweepError: It is not TOML, or asks for what cannot be run.
            FileNotFoundError: It does not exist.
        """
        path = Path(path)
        try:
            data = parse_toml(read_text(path))
        except ValueError as error:
            raise SweepError(f"{path}: {error}") from error
        try:
            return cls.from_dict({"name": file_name(path.stem)} | data)
        except SweepError as error:
            raise SweepError(f"{path}: {error}") from error

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Sweep:
        """Build a sweep from plain data, and check everything that can be checked without running it.

        Args:
            data: ``workspaces`` (names or mappings with ``workspace``), and optionally ``name``, ``emitters`` (names
                or mappings with ``emitter``; default ``"improve"``), ``objectives``, ``evaluations``, ``seeds`` (a
                number of seeds from 0, or a list), ``predictors`` and ``people``. Mappings may have a ``label``, those
                of workspaces ``predictors`` and ``people`` of their own, instead of the sweep's.

        Raises:
            SweepError: Unknown keys, unknown names, settings that a workspace or an emitter refuses, predictors that
                cannot predict the goals of the participants of a workspace.
        """
        try:
            plain = as_plain(data)
            check_plain(plain)
        except ValueError as error:
            raise SweepError(f"the sweep: {error}") from error
        content = validated(SweepContent, plain, "the sweep", error=SweepError)
        shared = {"predictors": content.predictors, "people": plain.get("people", {})}
        workspaces = _axis(plain["workspaces"], "workspace", own=("predictors", "people"))
        sweep = cls(
            name=content.name,
            workspaces=workspaces,
            emitters=_axis(plain.get("emitters", ["improve"]), "emitter"),
            objectives=tuple(content.objectives),
            evaluations=tuple(content.evaluations),
            seeds=tuple(content.seeds),
            prediction={
                named.label: _prediction(shared | dict(named.own), f" of workspace {named.label!r}")
                for named in workspaces
            },
        )
        for name in _prediction(shared).predictors:  # also where every workspace has its own
            _try(f"predictor {name!r}", lambda name=name: make_predictor(name))
        sweep._check()
        return sweep

    def variants(self) -> Iterator[Variant]:
        """All trials, seeds fastest."""
        axes = (self.workspaces, self.objectives, self.emitters, self.evaluations, self.seeds)
        for workspace, objective, emitter, evaluations, seed in itertools.product(*axes):
            labels = {
                "workspace": workspace.label,
                "objective": objective,
                "emitter": emitter.label,
                "evaluations": evaluations,
                "seed": seed,
            }
            trial: dict[str, Any] = {
                "workspace": workspace.settings,
                "objective": objective,
                "emitter": emitter.settings,
                "evaluations": evaluations,
                "seed": seed,
            }
            predictors, people = self.prediction[workspace.label]
            if predictors:
                trial |= {"predictors": list(predictors), "people": dict(people)}
            yield Variant(labels, trial)

    def _check(self) -> None:
        from optimizers import make_archive, make_emitter

        for what, values in (("objectives", self.objectives), ("evaluations", self.evaluations), ("seeds", self.seeds)):
            if len(set(values)) < len(values):
                twice = next(value for value, count in Counter(values).items() if count > 1)
                raise SweepError(f"`{what}` has {twice!r} more than once")
        axes = (self.workspaces, self.objectives, self.emitters, self.evaluations, self.seeds)
        if (count := math.prod(map(len, axes))) > MOST:
            raise SweepError(f"that makes {count:,} searches; a sweep has at most {MOST:,}")
        for named in self.workspaces:
            about = f"workspace {named.label!r}"
            workspace = _try(about, lambda named=named: make_workspace(named.settings))
            for emitter in self.emitters:
                _try(
                    f"{about}: emitter {emitter.label!r}",
                    lambda w=workspace, o=emitter.settings: make_emitter(
                        o["emitter"],
                        make_archive(w, seed=0),
                        w,
                        seed=0,
                        evaluations=min(self.evaluations),
                        options=_without(o, "emitter"),
                    ),
                )
            self._check_prediction(named.label, workspace)

    def _check_prediction(self, label: str, workspace: Workspace) -> None:
        """Let every predictor predict the goals of one participant in one random layout."""
        predictors, people = self.prediction[label]
        if not predictors:
            return
        rng = np.random.default_rng(0)
        genome, settings = workspace.sample(1, rng)[0], _without(people, "participants")
        trajectories = _try(f"people of workspace {label!r}", lambda: workspace.simulate(genome, 1, rng, **settings))
        for name in predictors:
            predictor = _try(f"predictor {name!r}", lambda name=name: make_predictor(name))
            _try(
                f"predictor {name!r}, people of workspace {label!r} (which may have `predictors` of its own)",
                lambda it=predictor: it.fit(trajectories).predict_proba(trajectories[:1]),
            )


def _try(what: str, make: Any) -> Any:
    try:
        return make()
    except Exception as error:  # whatever settings of a file may do to a plug-in
        kind = "" if isinstance(error, ValueError | RuntimeError) else f"{type(error).__name__}: "
        raise SweepError(f"{what}: {kind}{error}") from error


def _without(settings: Mapping[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in settings.items() if name != key}


def _prediction(data: Mapping[str, Any], whose: str = "") -> Prediction:
    predictors = tuple(_listed(data["predictors"]))
    if len(set(predictors)) < len(predictors):
        raise SweepError(f"`predictors`{whose} has one more than once: {', '.join(predictors)}")
    return Prediction(predictors, dict(data["people"]))


def _axis(given: Any, key: str, own: Sequence[str] = ()) -> tuple[Named, ...]:
    """Checked entries of an axis, labelled so that tables can tell them apart; ``own`` are no settings."""
    found = []
    for entry in _listed(given):
        settings = {key: entry} if isinstance(entry, str) else dict(entry)
        label = settings.pop("label", None)
        apart = {name: settings.pop(name) for name in own if name in settings}
        found.append(Named(label if label is not None else _label(settings, key), settings, apart))
    labels = [name.label for name in found]
    if repeated := [label for label, count in Counter(labels).items() if count > 1]:
        raise SweepError(f"`{key}s` has {repeated[0]!r} more than once; add `label`")
    return tuple(found)


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _label(settings: Mapping[str, Any], key: str) -> str:
    """Like ``overcooked shape=7x7 prefix=sum``."""
    shown = (
        f"{name}={'x'.join(map(str, value)) if isinstance(value, list) else value}"
        for name, value in settings.items()
        if name != key
    )
    return " ".join((settings[key], *shown))
