"""Conditions of a new study: those that come with the package, or layouts of searches, reproductions and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.design.models import ConditionEntry
from benchmarks.study.design.package_files import list_files, read_file
from benchmarks.study.errors import StudyError
from legible_envs.support.models import problems_of

if TYPE_CHECKING:
    from optimizers import SearchResult

__all__ = ["DOMAINS", "NewCondition", "conditions_of", "practice_layout", "shipped_conditions"]

DOMAINS: Final = ("overcooked", "tabletop")
_SUFFIX: Final = {"overcooked": ".txt", "tabletop": ".json"}
_PAPER: Final = {
    "overcooked": ("Random", "Efficient", "Legible-Efficient", "Legible"),
    "tabletop": ("Baseline", "Placement", "Virtual Obstacle", "Both"),
}
_OBJECTIVES: Final = {"legibility": "Legible", "efficiency": "Efficient", "legible-efficient": "Legible-Efficient"}
_DESIGNS: Final = {"placement": "Placement", "obstacles": "Virtual Obstacle", "both": "Both"}
_PRACTICE: Final = "practice"


@dataclass(frozen=True, slots=True)
class NewCondition:
    """A condition to be written into a new study.

    Attributes:
        name: Of the condition.
        layout: The text of its layout: a drawing, or JSON.
    """

    name: str
    layout: str

    def file(self, domain: str) -> str:
        """Path of its layout in the study's folder."""
        return f"layouts/{slug(self.name)}{_SUFFIX[domain]}"


def slug(name: str) -> str:
    """The name of a file for a condition.

    Example:
        >>> slug("Virtual Obstacle"), slug("Legible-Efficient")
        ('virtual-obstacle', 'legible-efficient')
    """
    from legible_envs.support.names import file_name

    return file_name("-".join(name.casefold().split()))


def shipped_conditions(domain: str) -> list[NewCondition]:
    """The paper's four conditions with layouts that come with the package."""
    return [NewCondition(name, read_file(f"layouts/{domain}/{slug(name)}{_SUFFIX[domain]}")) for name in _PAPER[domain]]


def practice_layout(domain: str) -> NewCondition:
    """The layout of the practice that comes with the package."""
    assert f"{_PRACTICE}{_SUFFIX[domain]}" in list_files(f"layouts/{domain}")
    return NewCondition(_PRACTICE, read_file(f"layouts/{domain}/{_PRACTICE}{_SUFFIX[domain]}"))


def conditions_of(source: str, domain: str) -> list[NewCondition]:
    """The conditions that a source gives.

    Args:
        source: The folder of a search; a folder of ``legible reproduce``, which gives the best layout of each of the
            paper's conditions; or a layout file. ``NAME=`` before it sets the name of a single condition.
        domain: ``"overcooked"`` or ``"tabletop"``.

    Raises:
        StudyError: It is none of these, or of the other domain.
    """
    name, path = _named(source)
    try:
        found = _read(path, domain)
    except StudyError:
        raise
    except (OSError, ValueError, KeyError) as error:
        raise StudyError(f"{path}: no conditions can be taken from there: {error}") from error
    if name is None:
        return found
    if len(found) > 1:
        names = ", ".join(each.name for each in found)
        raise StudyError(f"{path} gives the conditions {names}, which have their names; leave out {name!r}=")
    return [NewCondition(name, found[0].layout)]


def _named(source: str) -> tuple[str | None, Path]:
    name, equals, path = source.partition("=")
    if not equals or Path(source).exists():
        return None, Path(source)
    if not name.strip() or not path.strip():
        raise StudyError(f"{source!r} is not NAME=PATH")
    return name.strip(), Path(path.strip())


def _read(path: Path, domain: str) -> list[NewCondition]:
    from optimizers.runs.folder import is_run_folder

    if is_run_folder(path):
        return _of_run(path, domain)
    if (path / "layouts.csv").is_file():
        return _of_reproduction(path, domain)
    if path.is_dir():
        raise StudyError(f"{path} is neither the folder of a search nor one of `legible reproduce`")
    return [NewCondition(path.stem, _text_of(_layout_in(path, domain), domain))]


def _layout_in(path: Path, domain: str) -> Any:
    if domain == "overcooked":
        from legible_envs.overcooked.kitchen_file import KitchenFile

        return KitchenFile.read(path).layout
    from legible_envs.support.plain_data import parse_json
    from legible_envs.support.text import read_text
    from legible_envs.tabletop.layout import TabletopLayout

    return TabletopLayout.from_dict(parse_json(read_text(path)))


def _text_of(layout: Any, domain: str) -> str:
    return f"{layout.to_ascii() if domain == 'overcooked' else layout.to_json()}\n"


def _of_run(path: Path, domain: str) -> list[NewCondition]:
    from optimizers import load_run

    run = load_run(path)
    _check_domain(run, path, domain)
    if domain == "tabletop":
        from benchmarks.presenters.tabletop_panels import CONDITIONS, listed, panels_of

        if len(listed(path)) > 1:  # conditions that were searched together, with the sorted baseline
            own = {title: _DESIGNS[key] for key, title in CONDITIONS.items()}
            return [NewCondition(own.get(p.name, p.name), _text_of(p.layout, domain)) for p in panels_of(run)]
    run.require_genome()
    return [NewCondition(_name_of(run, path), _text_of(run.best_layout, domain))]


def _check_domain(run: SearchResult, path: Path, domain: str) -> None:
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.tabletop.layout import TabletopLayout

    wanted = OvercookedLayout if domain == "overcooked" else TabletopLayout
    layout = run.workspace.decode(run.require_genome())
    if not isinstance(layout, wanted):
        raise StudyError(f"{path} searched layouts of the class {type(layout).__name__}; the study is of {domain!r}")


def _name_of(run: SearchResult, path: Path) -> str:
    """The paper's name of what was searched for, or the name of the folder."""
    if hasattr(run.workspace, "condition"):
        return _DESIGNS.get(str(run.workspace.condition), path.resolve().name)
    objective = run.config.get("objective")
    named = objective.get("name") if isinstance(objective, dict) else objective
    return _OBJECTIVES.get(str(named), path.resolve().name)


def _of_reproduction(path: Path, domain: str) -> list[NewCondition]:
    """The best layouts of an experiment, those of the paper's conditions."""
    if domain == "overcooked":
        from benchmarks.experiments.overcooked import tables as kitchens
        from legible_envs.overcooked.layouts import read_layout

        rows = kitchens.best_layouts(kitchens.load_results(path)).set_index("condition")
        return [
            NewCondition(name, _text_of(read_layout(str(rows.at[name, "drawing"])), domain)) for name in _PAPER[domain]
        ]
    from benchmarks.experiments.tabletop import tables
    from legible_envs.tabletop.layout import TabletopLayout

    rows = tables.best_layouts(tables.load_results(path)).set_index("condition")
    return [
        NewCondition(name, _text_of(TabletopLayout.from_json(str(rows.at[name, "json"])), domain))
        for name in _PAPER[domain]
    ]


def all_conditions(sources: Sequence[str], domain: str) -> list[NewCondition]:
    """The conditions of all sources, those of the package where there are none.

    Raises:
        StudyError: A source gives none, two conditions have one name, or a name cannot be one.
    """
    if not sources:
        return shipped_conditions(domain)
    found = [condition for source in sources for condition in conditions_of(source, domain)]
    files: dict[str, str] = {}
    for condition in found:
        for _, message in problems_of(ConditionEntry, {"name": condition.name, "layout": condition.file(domain)}):
            raise StudyError(f"a condition cannot be called {condition.name!r}: {message}; name it: NAME=PATH")
        if (before := files.get(condition.file(domain))) is not None:
            raise StudyError(f"two conditions are called {before!r} and {condition.name!r}; name one: NAME=PATH")
        files[condition.file(domain)] = condition.name
    return found
