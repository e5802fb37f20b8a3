"""The manifest of a run, ``config.json``: what it must hold, its digest, and what of it a search depends on.

Schema 2 carries the SHA-256 of its own content. Schema 1, of earlier versions, has none: it is read after the same
checks of its keys and values, and cannot be verified beyond them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final

import numpy.typing as npt
from pydantic import AfterValidator, Field

from legible_envs.support.digests import broken_seal, digest_of_arrays, digest_of_json, unsealed
from legible_envs.support.models import FileModel, Length, Real, Text, Whole, validated
from legible_envs.support.plain_data import parse_json
from legible_envs.support.validation import shown
from optimizers.archives import check_archive_dims
from optimizers.errors import SearchError

__all__ = ["SCHEMA", "digests_of", "manifest_from", "settings_of"]

SCHEMA: Final = 2
_UNSEALED: Final = 1
_SETTINGS: Final = (
    "workspace",
    "continuous",
    "objective",
    "emitter",
    "archive",
    "seed",
    "initial",
    "evaluations",
    "iterations",
)
"""What the result of a search depends on."""

Count = Annotated[int, Whole(0)]
Word = Annotated[str, Text(10_000)]
Number = Annotated[float, Real()]
Range = Annotated[list[Number], Length(2, 2)]
Digest = Annotated[str, Text(64)]


class _Objective(FileModel):
    name: Word
    max_distance: Number | None = None


class _Emitter(FileModel):
    name: Word
    options: dict[str, Any] = Field(default_factory=dict)
    settings: dict[str, Any] = Field(default_factory=dict)


def _few_cells(dims: list[int]) -> list[int]:
    """Refuse too many cells before anything is allocated for them."""
    return check_archive_dims(dims, "archive.dims")


class _Archive(FileModel):
    dims: Annotated[list[Annotated[int, Whole(1)]], Length(2, 2), AfterValidator(_few_cells)]
    ranges: Annotated[list[Range], Length(2, 2)]
    measure_names: Annotated[list[Word], Length(2, 2)]
    score_floor: Number


class _Result(FileModel):
    best_objective: Number | None = None
    best_genome: list[Number] | None = None
    pruned: bool = False
    pruning_changed_best: bool = False
    evaluations: Count = 0
    iterations: Count = 0
    seconds: Number = 0.0
    evaluation_seconds: Number = 0.0
    qd_score: float = 0.0
    coverage: float = 0.0
    stopped: Word = ""


class _Digests(FileModel):
    archive: Digest
    metrics: Digest


class _Manifest(FileModel):
    """All but ``schema``, which says whether this is the model to check."""

    workspace: dict[str, Any]
    objective: _Objective
    archive: _Archive
    versions: dict[str, str] = Field(default_factory=dict)
    created: Word = ""
    git_revision: Word | None = None
    platform: Word = ""
    continuous: bool = False
    seed: Count = 0
    initial: Annotated[int, Whole(1)] = 1
    evaluations: Annotated[int, Whole(1)] | None = None
    iterations: Annotated[list[Count], Length(2, 2)] | None = None
    calibration: dict[str, float] | None = None
    result: _Result | None = None
    digests: _Digests | None = None


class _ManifestOfOneEmitter(_Manifest):
    emitter: _Emitter


class _ManifestOfEmitters(_Manifest):
    emitter: Annotated[list[_Emitter], Length(1, 1000)]


def manifest_from(text: str, file: str) -> dict[str, Any]:
    """The manifest that the text of a file holds, checked; without its own digest.

    Args:
        text: Of the whole file.
        file: What messages call it.

    Raises:
        SearchError: It is no JSON, no manifest, of an unknown schema, or not what its digest says; names file and key.
    """
    try:
        content = parse_json(text, finite=False)
    except ValueError as error:
        raise SearchError(f"{file}: {error}") from error
    if not isinstance(content, dict):
        raise SearchError(f"{file} is not the manifest of a search: it holds a {type(content).__name__}")
    if "schema" not in content:
        raise SearchError(f"{file} is not the manifest of a search: it lacks `schema`")
    schema = content["schema"]
    if isinstance(schema, bool) or schema not in (_UNSEALED, SCHEMA):
        raise SearchError(f"{file} has schema {shown(schema)}, this version reads schema {SCHEMA}")
    plain = unsealed(content) if schema == SCHEMA else content
    several = isinstance(content.get("emitter"), list)
    model = _ManifestOfEmitters if several else _ManifestOfOneEmitter
    validated(model, {key: value for key, value in plain.items() if key != "schema"}, file, error=SearchError)
    if schema == SCHEMA and (why := broken_seal(content)):
        raise SearchError(f"{file}: {why}. Restore it; a search with a checkpoint writes it anew when resumed")
    return plain


def settings_of(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What of a manifest the result of the search depends on, in the form that checkpoints keep it in."""
    found = {name: manifest[name] for name in _SETTINGS if name in manifest}
    emitters = found["emitter"] if isinstance(found["emitter"], list) else [found["emitter"]]
    return {**found, "emitter": [{"name": one["name"], "options": one.get("options", {})} for one in emitters]}


def digests_of(arrays: Mapping[str, npt.NDArray[Any]], history: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Digests of what a finished search left: the arrays of its archive, and the rows of its metrics."""
    return {"archive": digest_of_arrays(arrays), "metrics": digest_of_json([dict(row) for row in history])}
