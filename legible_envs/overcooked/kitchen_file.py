"""Kitchens as files hold them, in every form that is in use: the layout, and the orders where there are any."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked.drawings import INGREDIENTS, is_jaxmarl, rows_of, trim
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.recipes import Recipe, check_recipes
from legible_envs.support.literals import Expression, read_literal
from legible_envs.support.text import clean_text, decode_text, read_text
from legible_envs.support.validation import entries, integer, shown

__all__ = ["ENTRIES", "KitchenFile"]

_GRIDS: Final = ("grid", "rows")
ENTRIES: Final = frozenset((*_GRIDS, "wall_idx"))
"""What tells a kitchen among data: one of these entries."""

_SOUP_SIZE: Final = 3
"""Ingredients of a soup in files of the old style that do not say how many."""


@dataclass(frozen=True)
class KitchenFile:
    """What a file says about a kitchen: the layout, and what is ordered there.

    Forms that are read, told apart by their content alone:

    =============================  ====================================================================================
    A drawing                      Of :class:`.OvercookedLayout`, or of JaxMARL (see :meth:`.OvercookedLayout.from_jaxmarl`).
                                   It is JaxMARL's if it has ``W``, ``A`` or ``B``, and none of ``V T C F D S``.
    Overcooked-AI's ``.layout``    A Python dictionary with a ``grid``; comments are allowed, nothing of it is run.
    JSON                           The rows of a drawing: ``["XXPXX", …]``, ``{"rows": […]}`` or ``{"grid": …}``.
    JaxMARL's dictionary           ``height``, ``width``, ``wall_idx``, …, as JSON or Python.
    =============================  ====================================================================================

    Orders are read from these entries, the first that holds any; each ordered soup is cooked and delivered once:

    * ``recipes``: lists of ingredients, as an environment takes them;
    * ``start_all_orders``: Overcooked-AI's orders, ``{"ingredients": […]}`` each;
    * ``start_bonus_orders``: the same form; read only where no other order is given, since they are among those;
    * ``start_order_list``: the old style, such as ``["onion", "onion", "any"]``, each a soup of ``num_items_for_soup``
      (3) of that ingredient; ``any`` and None order nothing.

    A pot here starts by itself as soon as a soup is complete, so an order whose ingredients another contains can never
    be told from the beginning of that one: it is left out, and named in ``left_out``. All other entries (values, times,
    rewards, states) describe another game and are ignored, whatever they hold.

    Attributes:
        layout: The kitchen.
        recipes: The ordered soups; None if the file orders nothing.
        left_out: Orders that the file has too, but that another one contains.
        form: In which form it was written, in words.

    Raises:
        LayoutError: ``layout`` is no layout.
        TaskError: Bad recipes.

    Example:
        >>> text = '''{"grid": \"\"\"XXPXX
        ...                       O  2O
        ...                       X1  X
        ...                       XDXSX\"\"\",
        ...     "start_all_orders": [{"ingredients": ["onion", "onion", "onion"]}, {"ingredients": ["onion"]}],
        ...     "order_bonus": float("inf")}'''
        >>> file = KitchenFile.from_text(text)
        >>> file.layout.shape, file.recipes, file.left_out
        ((4, 5), (('onion', 'onion', 'onion'),), (('onion',),))
    """  # noqa: E501

    layout: OvercookedLayout
    recipes: tuple[Recipe, ...] | None = None
    left_out: tuple[Recipe, ...] = ()
    form: str = "drawing"

    def __post_init__(self) -> None:
        if not isinstance(self.layout, OvercookedLayout):
            raise LayoutError(f"`layout` must be an OvercookedLayout, got {shown(self.layout)}", rule="type")
        if self.recipes is not None:
            object.__setattr__(self, "recipes", check_recipes(self.recipes))

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, orders: bool = True) -> KitchenFile:
        """Read a file; see :meth:`from_text`.

        Raises:
            OSError: The file cannot be read.
            LayoutError: It is no kitchen; the message begins with the path.
        """
        name = os.fspath(path)
        try:
            return cls.from_text(read_text(path), orders=orders)
        except LayoutError as error:
            raise LayoutError(f"{name}: {error}", rule=error.rule, cell=error.cell) from error
        except ValueError as error:  # not text; says which file
            raise LayoutError(str(error), rule="type") from error

    @classmethod
    def from_text(cls, text: str | bytes, *, orders: bool = True) -> KitchenFile:
        """Read the text of a file in any of the forms above.

        Args:
            text: The text; bytes are decoded.
            orders: Whether orders are read as well; without, what they hold does not matter.

        Raises:
            LayoutError: It is no kitchen, or its orders are malformed; names line, row and column, or the entry.
        """
        if isinstance(text, bytes):
            try:
                text = decode_text(text, "the layout")
            except ValueError as error:
                raise LayoutError(str(error), rule="type") from error
        if not isinstance(text, str):
            raise LayoutError(f"expected the text of a kitchen, got {type(text).__name__}", rule="type")
        text = clean_text(text)
        if not _is_literal(text):
            return cls(*_from_rows(rows_of(text)))
        try:
            data = read_literal(text)
        except ValueError as error:
            raise LayoutError(f"no layout can be read: {error}", rule="type") from error
        if isinstance(data, str):
            return cls(*_from_rows(rows_of(data)))
        return cls.from_data(data, orders=orders)

    @classmethod
    def from_data(cls, data: Any, *, orders: bool = True) -> KitchenFile:
        """Read what such a file holds as plain data: a mapping, or the rows of a drawing.

        Args:
            data: The mapping or the rows.
            orders: See :meth:`from_text`.

        Raises:
            LayoutError: It is no kitchen, or its orders are malformed; names row and column, or the entry.
        """
        if not isinstance(data, Mapping):
            return cls(*_from_rows(data))
        if "wall_idx" in data:
            layout, form = OvercookedLayout.from_jaxmarl(data), "numbered cells of JaxMARL"
        else:
            layout, form = _from_entries(data)
        found, left_out = _read_orders(data) if orders else ((), ())
        return cls(layout, found or None, left_out, form)

    def to_dict(self) -> dict[str, Any]:
        """Plain data that :meth:`from_data` reads back: the rows, and the recipes if there are any."""
        rows = {"rows": self.layout.to_ascii().split("\n")}
        return rows if self.recipes is None else {**rows, "recipes": [list(recipe) for recipe in self.recipes]}


def _is_literal(text: str) -> bool:
    """Whether a text begins as data do, comments aside; no drawing begins with a bracket or a quote."""
    for line in text.split("\n"):
        if line.strip() and not line.lstrip().startswith("# "):
            return line.lstrip().startswith(("{", "[", "(", '"', "'"))
    return False


def _from_rows(rows: Any) -> tuple[OvercookedLayout, None, tuple[Recipe, ...], str]:
    """The layout of rows, and no orders; the arguments of a :class:`KitchenFile`."""
    if isinstance(rows, str | bytes) or not isinstance(rows, Sequence):
        raise LayoutError(f"expected the rows of a kitchen, got {shown(rows)}", rule="type")
    if all(isinstance(row, str) for row in rows):
        rows = trim(rows)
        if is_jaxmarl(rows):
            return OvercookedLayout.from_jaxmarl(rows), None, (), "drawing of JaxMARL"
    elif all(isinstance(row, list | tuple) and row and all(isinstance(n, int) for n in row) for row in rows):
        if len({len(row) for row in rows}) > 1:
            raise LayoutError(f"ragged rows of {sorted({len(row) for row in rows})} cell codes", rule="ragged")
        return OvercookedLayout(rows), None, (), "cell codes"
    return OvercookedLayout.from_rows(rows), None, (), "drawing"


def _from_entries(data: Mapping[Any, Any]) -> tuple[OvercookedLayout, str]:
    """The layout of a mapping with a grid, and in which form it was."""
    key = next((key for key in _GRIDS if key in data), None)
    if key is None:
        others = " (the JSON of a table?)" if "objects" in data else ""
        raise LayoutError(
            f"no kitchen: expected an entry `grid`, `rows` or `wall_idx`, got {shown(sorted(map(str, data)))}{others}",
            rule="type",
        )
    grid = data[key]
    if isinstance(grid, str):
        # Overcooked-AI's files indent every row but the first; no row of theirs starts with floor.
        rows = [line.strip() for line in clean_text(grid).strip().split("\n")]
        return _from_rows(rows)[0], "Overcooked-AI layout" if key == "grid" else "rows"
    if isinstance(grid, list | tuple):
        return _from_rows(grid)[0], "rows"
    raise LayoutError(f"`{key}` must be text or rows, got {shown(grid)}", rule="type")


# -- orders ------------------------------------------------------------------------------------------------------------


def _read_orders(data: Mapping[Any, Any]) -> tuple[tuple[Recipe, ...], tuple[Recipe, ...]]:
    """The ordered soups that no other one contains, and those that one does.

    Raises:
        LayoutError: Malformed orders; names the entry and the order.
    """
    for key, read in _READERS.items():
        if found := read(data, key):
            kept = [soup for soup in found if not any(_is_part(soup, other) for other in found)]
            left_out = dict.fromkeys(soup for soup in found if soup not in kept)
            try:
                return check_recipes(kept), tuple(left_out)
            except TaskError as error:
                raise LayoutError(f"`{key}`: {error}", rule="orders") from error
    return (), ()


def _is_part(soup: Recipe, other: Recipe) -> bool:
    return len(soup) < len(other) and not Counter(soup) - Counter(other)


def _listed(data: Mapping[Any, Any], key: str) -> list[Any]:
    value = data.get(key)
    if value is not None and (isinstance(value, str | Mapping | Expression) or not isinstance(value, Sequence)):
        raise LayoutError(f"`{key}` must be a list of orders or None, got {shown(value)}", rule="orders")
    return entries(value)


def _recipe(given: Any, what: str) -> Recipe:
    ingredients = entries(given)
    if not ingredients or not all(isinstance(i, str) and i in INGREDIENTS for i in ingredients):
        raise LayoutError(f"{what} must be ingredients out of {list(INGREDIENTS)}, got {shown(given)}", rule="orders")
    return tuple(sorted(ingredients, key=INGREDIENTS.index))


def _recipes(data: Mapping[Any, Any], key: str) -> list[Recipe]:
    """Lists of ingredients; a soup may be ordered twice."""
    return [_recipe(given, f"order {number} of `{key}`") for number, given in enumerate(_listed(data, key), 1)]


def _orders(data: Mapping[Any, Any], key: str) -> list[Recipe]:
    """Overcooked-AI's orders: kinds of soups that are accepted, so that a repeated one says nothing."""
    found = []
    for number, given in enumerate(_listed(data, key), 1):
        what = f"order {number} of `{key}`"
        if isinstance(given, Mapping):
            if "ingredients" not in given:
                raise LayoutError(f"{what} has no `ingredients`: {shown(dict(given))}", rule="orders")
            given = given["ingredients"]
        found.append(_recipe(given, what))
    return list(dict.fromkeys(found))


def _order_list(data: Mapping[Any, Any], key: str) -> list[Recipe]:
    """The old style: one ingredient, of which every soup has equally many."""
    size = _SOUP_SIZE
    if data.get("num_items_for_soup") is not None:
        size = integer("num_items_for_soup", data["num_items_for_soup"], 1, 9, whole_floats=True, error=_order_error)
    found = []
    for number, kind in enumerate(_listed(data, key), 1):
        if kind in (None, "any"):
            continue
        if not isinstance(kind, str) or kind not in INGREDIENTS:
            raise LayoutError(
                f"order {number} of `{key}` must be one of {[*INGREDIENTS, 'any']} or None, got {shown(kind)}",
                rule="orders",
            )
        found.append((kind,) * size)
    return found


def _order_error(message: str) -> LayoutError:
    return LayoutError(message, rule="orders")


_READERS: Final[Mapping[str, Callable[[Mapping[Any, Any], str], list[Recipe]]]] = {
    "recipes": _recipes,
    "start_all_orders": _orders,
    "start_bonus_orders": _orders,
    "start_order_list": _order_list,
}
"""How each entry that may hold orders is read, in the order in which they are asked."""
