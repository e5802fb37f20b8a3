"""An export read back: its tables and trajectories, for the analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.csv_tables import as_written
from benchmarks.study.analysis.export import KIND
from legible_envs.support.plain_data import parse_json

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["StudyData", "read_export"]


@dataclass(frozen=True, eq=False)
class StudyData:
    """What an export holds, as far as the analysis needs it.

    Attributes:
        manifest: Of the export.
        tables: ``participants, rounds, scales, questionnaires, problems``.
        trajectories: Those with two goals or more to choose from, of the participants who are analysed.
        excluded: ``participant, state, why``: who is not analysed.
    """

    manifest: dict[str, Any]
    tables: dict[str, pd.DataFrame] = field(repr=False)
    trajectories: list[Trajectory] = field(repr=False)
    excluded: pd.DataFrame = field(repr=False)

    @property
    def participants(self) -> list[str]:
        """Who is analysed."""
        table = self.tables["participants"]
        left_out = set(self.excluded["participant"])
        return [str(name) for name in table["participant"] if name not in left_out]

    def of_analysed(self, name: str) -> pd.DataFrame:
        """A table's rows of the participants who are analysed."""
        table = self.tables[name]
        return table[table["participant"].isin(self.participants)].reset_index(drop=True)


def read_export(folder: Path, *, exclude: Sequence[str] = ()) -> StudyData:
    """Read an export.

    Args:
        folder: Of the export.
        exclude: Participants to leave out, for reasons that are not in the data.

    Raises:
        FileNotFoundError: There is no export.
        ValueError: It is none, or there is no such participant to leave out.
    """
    import pandas as pd

    from legible_envs.rollouts import load_trajectories

    manifest = parse_json((folder / "manifest.json").read_text(encoding="utf-8"))
    if not isinstance(manifest, dict) or manifest.get("kind") != KIND:
        raise ValueError(f"{folder} holds no export of a study")
    tables = {
        name: as_written(
            pd.read_csv(folder / f"{name}.csv", keep_default_na=False, na_values=[""], dtype=_TEXTS, low_memory=False)
        )
        for name in ("participants", "rounds", "scales", "questionnaires", "problems")
    }
    for name, table in tables.items():
        texts = [column for column in ("sitting", "condition") if column in table]
        tables[name] = table.fillna(dict.fromkeys(texts, ""))
    people = tables["participants"]
    unknown = sorted(set(exclude) - set(people["participant"]))
    if unknown:
        raise ValueError(f"there is no participant {unknown[0]!r} to exclude; there are {list(people['participant'])}")
    out = people[(people["included"] == 0) | people["participant"].isin(exclude)]
    why = ["excluded by hand" if name in exclude else "not complete" for name in out["participant"]]
    excluded = out[["participant", "state"]].assign(why=why).reset_index(drop=True)
    gone = set(excluded["participant"])
    trajectories = [
        each
        for path in sorted(folder.glob("trajectories*.npz"), key=lambda path: (len(path.name), path.name))
        for each in load_trajectories(path)
        if len(each.candidates) > 1 and each.participant not in gone
    ]
    return StudyData(manifest, tables, trajectories, excluded)


_TEXTS = {
    "participant": str, "screen": str, "kind": str, "sitting": str, "condition": str, "questionnaire": str,
    "item": str, "scale": str, "state": str, "value": object,
}  # fmt: skip
"""Columns that are read as they stand: a condition may be called 7."""
