"""Where the kitchens of an episode come from: one fixed kitchen, a set, or a seeded, splittable random stream."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from inspect import signature
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.overcooked.drawings import COUNTER, FLOOR, STATION_CODES, STATION_TYPES
from legible_envs.overcooked.kitchen_file import ENTRIES, KitchenFile
from legible_envs.overcooked.layout import OvercookedLayout, check_shape
from legible_envs.support.validation import choice, entries, integer, real, shown

__all__ = [
    "DEFAULT_KITCHEN",
    "LayoutDistribution",
    "LayoutSet",
    "RandomLayouts",
    "default_layout",
    "read_distribution",
    "read_kitchen",
    "read_layout",
]

DEFAULT_KITCHEN: Final = """\
XXTXOXX
X     X
C     D
X  V  X
F     P
X  1  X
XXXSXXX"""

DEFAULT_SHAPE: Final = (7, 7)
SPLITS: Final = ("all", "train", "test")
MAX_TRIES: Final = 10_000
MOST_LAYOUTS: Final = 100_000
"""Kitchens that are made beforehand: `num_layouts`."""
_ENDINGS: Final = (".layout", ".txt", ".json", ".yaml", ".npz", ".csv", ".py")


@runtime_checkable
class LayoutDistribution(Protocol):
    """Anything that draws kitchens."""

    def sample(self, rng: np.random.Generator) -> OvercookedLayout:
        """Draw one kitchen."""
        ...


class RandomLayouts:
    """Random valid kitchens of one shape, split into disjoint train and test kitchens by their content.

    Whether a kitchen is for training or for testing depends on nothing but the kitchen (a hash of its drawing and
    ``split_seed``), so the two never share one, whatever the seeds, versions and machines they are drawn with.

    Args:
        shape: Rows and columns.
        split: ``"all"``, ``"train"`` or ``"test"``.
        test_fraction: Share of all kitchens that are test kitchens.
        split_seed: Another seed is another split.
        obstacle_rate: Probability of a virtual obstacle on each inner cell, before invalid kitchens are rejected.
        num_layouts: Draw uniformly out of this many kitchens, at most 100,000, made from ``layout_seed``; None means
            no limit.
        layout_seed: Seed of the kitchens when ``num_layouts`` is given.
        workspace: Further arguments of :class:`~legible_envs.overcooked.design.workspace.OvercookedWorkspace`, such as
            ``{"locked": …, "forbidden": …}``.

    Raises:
        ValueError: Arguments out of range or unknown; when kitchens are drawn, also those of ``workspace`` that it
            refuses, and a split so small that no kitchen of it turned up in 10,000 draws.

    Example:
        >>> train, test = RandomLayouts((7, 7)).split(test_fraction=0.25)
        >>> train.to_config()["split"], test.test_fraction
        ('train', 0.25)
    """

    def __init__(
        self,
        shape: Sequence[int] = (7, 7),
        *,
        split: str = "all",
        test_fraction: float = 0.2,
        split_seed: int = 0,
        obstacle_rate: float = 0.2,
        num_layouts: int | None = None,
        layout_seed: int = 0,
        workspace: Mapping[str, Any] | None = None,
    ) -> None:
        self.shape = check_shape(shape)
        self.split_name = choice("split", split, SPLITS)
        self.test_fraction = real("test_fraction", test_fraction, 0, 1, closed="neither")
        self.split_seed = integer("split_seed", split_seed, high=math.inf, whole_floats=True)
        self.obstacle_rate = real("obstacle_rate", obstacle_rate, 0, 1, closed="left")
        self.num_layouts = (
            None if num_layouts is None else integer("num_layouts", num_layouts, 1, MOST_LAYOUTS, also="None")
        )
        self.layout_seed = integer("layout_seed", layout_seed, 0, math.inf, whole_floats=True)
        self.workspace = _checked_workspace(workspace)
        self._workspace: Any = None
        self._layouts: tuple[OvercookedLayout, ...] | None = None

    def sample(self, rng: np.random.Generator) -> OvercookedLayout:
        """Draw one kitchen; all randomness comes from ``rng``."""
        if self.num_layouts is None:
            return self._draw(rng)
        if self._layouts is None:
            own = np.random.default_rng(self.layout_seed)
            self._layouts = tuple(self._draw(own) for _ in range(self.num_layouts))
        return self._layouts[int(rng.integers(len(self._layouts)))]

    def _draw(self, rng: np.random.Generator) -> OvercookedLayout:
        if self._workspace is None:
            from legible_envs.overcooked.design.workspace import OvercookedWorkspace

            self._workspace = OvercookedWorkspace(shape=self.shape, **self.workspace)
        for _ in range(MAX_TRIES):
            genome = self._workspace.sample(1, rng, obstacle_rate=self.obstacle_rate)[0]
            layout: OvercookedLayout = self._workspace.decode(genome)
            if self.split_name == "all" or self.is_test(layout) == (self.split_name == "test"):
                return layout
        raise ValueError(f"no {self.split_name} kitchen in {MAX_TRIES:,} draws; test_fraction={self.test_fraction}")

    def is_test(self, layout: OvercookedLayout) -> bool:
        """Whether a kitchen is one of the test kitchens."""
        import hashlib

        digest = hashlib.sha256(f"{self.split_seed}:{layout.to_ascii()}".encode()).digest()
        return int.from_bytes(digest[:8], "big") < self.test_fraction * 2**64

    def split(self, test_fraction: float | None = None) -> tuple[RandomLayouts, RandomLayouts]:
        """The train and the test part of this distribution."""
        config = self.to_config()
        del config["kind"]
        if test_fraction is not None:
            config["test_fraction"] = test_fraction
        return RandomLayouts(**{**config, "split": "train"}), RandomLayouts(**{**config, "split": "test"})

    def to_config(self) -> dict[str, Any]:
        """Plain data that :func:`read_distribution` reads back."""
        return {
            "kind": "random",
            "shape": list(self.shape),
            "split": self.split_name,
            "test_fraction": self.test_fraction,
            "split_seed": self.split_seed,
            "obstacle_rate": self.obstacle_rate,
            "num_layouts": self.num_layouts,
            "layout_seed": self.layout_seed,
            "workspace": dict(self.workspace),
        }

    def __repr__(self) -> str:
        arguments = ", ".join(f"{key}={value!r}" for key, value in self.to_config().items() if key != "kind")
        return f"RandomLayouts({arguments})"


def _checked_workspace(workspace: object) -> dict[str, Any]:
    if not isinstance(workspace, Mapping | None):
        raise ValueError(f"`workspace` must be None or a mapping of arguments, got {shown(workspace)}")
    arguments = dict(workspace or {})
    if arguments:
        from legible_envs.overcooked.design.workspace import OvercookedWorkspace

        known = [name for name in signature(OvercookedWorkspace).parameters if name != "shape"]
        if unknown := [key for key in arguments if key not in known]:
            raise ValueError(f"`workspace` has unknown arguments {shown(unknown)}; known: {known}")
    return arguments


class LayoutSet:
    """Uniform over given kitchens.

    Args:
        layouts: Kitchens, or anything that :func:`read_layout` understands.
        shape: Rows and columns they must have; None: those of the first.

    Raises:
        LayoutError: No kitchen, or one that is not one of this shape.
    """

    def __init__(self, layouts: Sequence[Any], shape: Sequence[int] | None = None) -> None:
        if not len(layouts):
            raise LayoutError("`layouts` must hold at least one kitchen, got none", rule="type")
        first = read_layout(layouts[0], None if shape is None else check_shape(shape))
        self.shape = first.shape
        self.layouts = (first, *(read_layout(layout, self.shape) for layout in layouts[1:]))

    def sample(self, rng: np.random.Generator) -> OvercookedLayout:
        """Draw one kitchen; all randomness comes from ``rng``."""
        return self.layouts[int(rng.integers(len(self.layouts)))]

    def to_config(self) -> list[str]:
        """Plain data that :func:`read_distribution` reads back."""
        return [layout.to_ascii() for layout in self.layouts]


def read_distribution(value: Any, shape: tuple[int, int] | None = None) -> LayoutDistribution:
    """Turn whatever describes a distribution of kitchens into one.

    Args:
        value: ``"random"``, ``"random:train"``, ``"random:test"``; a mapping with ``"kind": "random"`` and arguments of
            :class:`RandomLayouts`; a list of kitchens; or an object with a method ``sample(rng)``.
        shape: Rows and columns of the kitchens; None takes the distribution's own, or 7 and 7 where it has none.

    Raises:
        ValueError: Not a distribution, or one of another shape.
        LayoutError: A kitchen in a list is bad.
    """
    if isinstance(value, str):
        kind, _, split = value.partition(":")
        if kind == "random" and (not split or split in SPLITS):
            return RandomLayouts(shape or DEFAULT_SHAPE, split=split or "all")
    elif isinstance(value, Mapping):
        arguments = {"shape": shape or DEFAULT_SHAPE, **value}
        if arguments.pop("kind", None) == "random":
            known = list(signature(RandomLayouts).parameters)
            unknown = sorted(str(key) for key in arguments if key not in known)
            if unknown:
                raise ValueError(f"`layouts` has unknown keys {unknown}; known: {known}")
            own = check_shape(arguments["shape"])
            if own != (shape or own):
                raise ValueError(f"`layouts` is of shape {own}, the environment of shape {shape}")
            return RandomLayouts(**arguments)
    elif isinstance(value, LayoutDistribution):
        if shape is not None and (own := tuple(getattr(value, "shape", shape))) != shape:
            raise ValueError(f"`layouts` draws kitchens of shape {own}, the environment needs {shape}")
        return value
    elif isinstance(value, Sequence):
        return LayoutSet(value, shape)
    raise ValueError(
        "`layouts` must be 'random', 'random:train', 'random:test', a mapping with kind='random', a list of "
        f"kitchens or an object with sample(rng), got {shown(value)}"
    )


def shape_of(distribution: LayoutDistribution) -> tuple[int, int]:
    """Rows and columns of a distribution's kitchens: what it says, or those of one that it draws."""
    own = getattr(distribution, "shape", None)
    if own is not None:
        return check_shape(own)
    return read_layout(distribution.sample(np.random.default_rng(0))).shape


# -- the default -------------------------------------------------------------------------------------------------------


def default_layout(shape: tuple[int, int], kinds: Sequence[str] = STATION_TYPES) -> OvercookedLayout:
    """The kitchen of an environment that was given none: always the same one for a shape.

    It is a random one under the rules of design where the shape has room for one, with all types of stations. Where it
    has not, stations stand closer: along the walls, all types if they fit, else those that are needed.

    Args:
        shape: Rows and columns.
        kinds: Types of stations that are needed.

    Raises:
        LayoutError: The walls have fewer places than are needed.
    """
    return _default(tuple(shape), tuple(kind for kind in STATION_TYPES if kind in kinds))


@lru_cache(maxsize=64)
def _default(shape: tuple[int, int], needed: tuple[str, ...]) -> OvercookedLayout:
    if shape == DEFAULT_SHAPE:
        return OvercookedLayout.from_ascii(DEFAULT_KITCHEN)
    from legible_envs.overcooked.design.rules import DesignRules

    rules = DesignRules(shape, STATION_TYPES, locked={}, forbidden=(), distinct_access=False)
    if len(STATION_TYPES) <= rules.most_stations:
        return RandomLayouts(shape, obstacle_rate=0.1).sample(np.random.default_rng(0))
    kinds = STATION_TYPES if len(STATION_TYPES) <= len(rules.slots) else needed
    if len(kinds) > len(rules.slots):
        raise LayoutError(
            f"a {shape[0]}x{shape[1]} kitchen has places for {len(rules.slots)} stations along its walls, and the "
            f"recipes need {len(kinds)} ({', '.join(kinds)}); give a larger `shape=`, or `recipes=` with fewer "
            "ingredients",
            rule="room",
        )
    cells = np.full(shape, COUNTER, dtype=np.int8)
    cells[1:-1, 1:-1] = FLOOR
    for number, kind in enumerate(kinds):
        cells[rules.slots[number * len(rules.slots) // len(kinds)]] = STATION_CODES[kind]
    return OvercookedLayout(cells)


# -- one kitchen -------------------------------------------------------------------------------------------------------


def read_kitchen(value: Any, shape: tuple[int, int] | None = None, *, orders: bool = True) -> KitchenFile:
    """Turn whatever describes a kitchen into its layout, with the orders that come with it.

    Args:
        value: An :class:`OvercookedLayout`, a :class:`.KitchenFile`, the text or the entries of a kitchen in any form
            that :class:`.KitchenFile` reads, a list of row strings, nested lists of symbols, a 2-D array of cell codes,
            or a genome (1-D integers) of ``OvercookedWorkspace(shape)``. A string is never the name of a file.
        shape: Rows and columns it must have; None: any, and genomes are those of 7 x 7 kitchens.
        orders: Whether orders are read; without, what they hold does not matter.

    Raises:
        LayoutError: Not a layout, of another shape, or a genome that is invalid; names the cell where there is one.
    """
    kitchen = _read_any(value, shape, orders)
    if shape is not None and kitchen.layout.shape != shape:
        raise LayoutError(
            f"this environment was made for kitchens of shape {shape}, got one of shape {kitchen.layout.shape}; "
            "make another with `shape=`",
            rule="shape",
        )
    return kitchen


def read_layout(value: Any, shape: tuple[int, int] | None = None) -> OvercookedLayout:
    """The layout of whatever describes a kitchen; see :func:`read_kitchen`.

    Raises:
        LayoutError: Not a layout, of another shape, or a genome that is invalid; names the cell where there is one.
    """
    return read_kitchen(value, shape, orders=False).layout


def _read_any(value: Any, shape: tuple[int, int] | None, orders: bool) -> KitchenFile:
    if isinstance(value, KitchenFile):
        return value
    if isinstance(value, OvercookedLayout):
        return KitchenFile(value)
    if isinstance(value, str):
        return _read_text(value, orders)
    if (isinstance(value, Mapping) and not ENTRIES.isdisjoint(value)) or (
        isinstance(value, Sequence) and value and all(isinstance(r, str) for r in value)
    ):
        return KitchenFile.from_data(value, orders=orders)
    if entries(value) and isinstance(value, Sequence | np.ndarray):
        return KitchenFile(_read_array(value, shape or DEFAULT_SHAPE))
    file = "; a file is read with `KitchenFile.read(path)`" if isinstance(value, os.PathLike) else ""
    raise LayoutError(
        "a `layout` must be an OvercookedLayout, a KitchenFile, an ASCII drawing, a nested list of symbols, a mapping "
        f"with one of {sorted(ENTRIES)}, or a genome, got {type(value).__name__}: {shown(value)}{file}",
        rule="type",
    )


def _read_text(text: str, orders: bool) -> KitchenFile:
    try:
        return KitchenFile.from_text(text, orders=orders)
    except LayoutError as error:
        name = text.strip()
        if "\n" in name or not name.endswith(_ENDINGS):
            raise
        raise LayoutError(
            f"a `layout` is a drawing or the text of a file, and {shown(name)} looks like the name of one; read it "
            f"with `KitchenFile.read({shown(name)})`",
            rule="type",
        ) from error


def _read_array(value: Any, shape: tuple[int, int]) -> OvercookedLayout:
    first = value[0]
    if isinstance(first, Sequence) and first and isinstance(first[0], str):
        try:
            return OvercookedLayout.from_rows(value)
        except TypeError as error:
            raise LayoutError(f"nested lists must hold rows of one-character symbols: {error}", rule="type") from error
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise LayoutError(f"ragged nested list: {error}", rule="ragged") from error
    if array.dtype.kind == "U" and array.ndim == 2:
        return OvercookedLayout.from_rows(array.tolist())
    if array.dtype.kind not in ("iu" if array.ndim == 2 else "biuf") or array.ndim not in (1, 2):
        raise LayoutError(
            f"expected a genome (1-D numbers) or cells (2-D integers or symbols), got {array.ndim}-D {array.dtype}",
            rule="type",
        )
    if array.ndim == 2:
        return OvercookedLayout(array)
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace

    try:
        return OvercookedWorkspace(shape=shape).decode(array)
    except LayoutError:
        raise
    except ValueError as error:
        raise LayoutError(
            f"not a genome of kitchens of shape {shape}: {error}; genomes of others need their `shape=`", rule="genome"
        ) from error
