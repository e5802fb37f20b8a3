"""``legible study``: what becomes of a study's data - export, analysis, replay, power, and one person's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.destinations import DestinationFile, DestinationFileOrFolder, DestinationFolder, check_folder
from benchmarks.cli.options import PositiveNumber
from benchmarks.console import number as shown_number
from benchmarks.console import plural, say, table, tell

if TYPE_CHECKING:
    from benchmarks.study.analysis.database import PersonRow
    from benchmarks.study.analysis.power import Power
    from benchmarks.study.analysis.report import Analysed
    from benchmarks.study.design.study import Study

__all__ = ["DATA_COMMANDS"]

study_folder = click.argument("folder", metavar="STUDY", type=click.Path(exists=True, file_okay=False, path_type=Path))
debug_option = click.option("--debug", is_flag=True, help="The debug data: of simulate, or of debug links.")
design_option = click.option(
    "--design", metavar="HASH", help="Only participants who met this design. [default: all must have met one]"
)
person_argument = click.argument("participant", metavar="PARTICIPANT")
quiet_option = click.option("--quiet", is_flag=True, help="Show no progress.")


def _opened(folder: Path, debug: bool) -> tuple[Study, Path]:
    """A study and its database."""
    from benchmarks.study.analysis.database import database_path
    from benchmarks.study.design.study import load_study

    study = load_study(folder)
    return study, database_path(study, debug=debug)


@contextmanager
def _status(quiet: bool) -> Iterator[Callable[[str], object] | None]:
    """A line on the terminal that says what is being done; nothing where the output is no terminal."""
    console = say()
    if quiet or not console.is_terminal:
        yield None
        return
    with console.status("…") as status:
        yield status.update


def _person(connection: Any, participant: str) -> PersonRow:
    from benchmarks.study.analysis.database import people

    known = {row.participant: row for row in people(connection)}
    if participant not in known:
        some = ", ".join(list(known)[:5]) + (", …" if len(known) > 5 else "")
        raise click.UsageError(f"there is no participant {participant!r}; there are {some or 'none yet'}")
    return known[participant]


# -- export and analysis ----------------------------------------------------------------------------------------------


@click.command()
@study_folder
@click.option("--out", type=DestinationFolder(), required=True, help="Folder to write to.")
@debug_option
@click.option("--include-incomplete", is_flag=True, help="Trajectories of participants who are not complete, too.")
@click.option("--minari", metavar="ID", help="A Minari data set of the rounds, too, such as lab/kitchens-v0.")
@design_option
@quiet_option
def export(
    folder: Path, out: Path, debug: bool, include_incomplete: bool, minari: str | None, design: str | None, quiet: bool
) -> None:
    """Write trajectories, tables and a manifest of a study.

    No worker ids, links or codes are in it. What cannot be read is listed in problems.csv.
    """
    from benchmarks.study.analysis.export import export as write

    study, database = _opened(folder, debug)
    with _status(quiet) as status:

        def progress(done: int, whole: int, name: str) -> None:
            if status is not None:
                status(f"{name}: {done} of {plural(whole, 'participant')}")

        found = write(
            study, database, out, include_incomplete=include_incomplete, design=design, minari=minari, progress=progress
        )
    for name, count in found.counts.items():
        tell(f"{name:<15} {count:,}")
    tell(f"manifest {out / 'manifest.json'}")
    if minari is not None:
        tell(f"minari {minari}")
    if found.counts["problems"]:
        tell(f"{plural(found.counts['problems'], 'row')} could not be read: {out / 'problems.csv'}", err=True)


@click.command()
@study_folder
@click.option("--out", type=DestinationFolder(), help="Folder to write to. [default: STUDY/analysis]")
@debug_option
@click.option("--quick", is_flag=True, help="Fewer predictors, splits and points of learning curves.")
@click.option("--include-incomplete", is_flag=True, help="Count participants who are not complete, too.")
@click.option("--exclude", multiple=True, metavar="PARTICIPANT", help="Leave a participant out; repeatable.")
@click.option("--treatment", metavar="CONDITION",
              help="Where goals should be predicted better. [default: the paper's, where they are]")  # fmt: skip
@click.option("--control", "controls", multiple=True, metavar="CONDITION",
              help="Than where; repeatable. [default: all others]")  # fmt: skip
@design_option
@quiet_option
def analyse(
    folder: Path,
    out: Path | None,
    debug: bool,
    quick: bool,
    include_incomplete: bool,
    exclude: tuple[str, ...],
    treatment: str | None,
    controls: tuple[str, ...],
    design: str | None,
    quiet: bool,
) -> None:
    """Make the tables, figures and report of a study.

    Writes the export, tables, figures and report.html, and prints what matters most.
    """
    from benchmarks.study.analysis.report import analyse as run

    if controls and treatment is None:
        raise click.UsageError("--control is about --treatment, which is not given")
    study, database = _opened(folder, debug)
    target = out or folder / ("analysis-debug" if debug else "analysis")
    check_folder(target, "--out")
    with _status(quiet) as status:
        found = run(
            study,
            database,
            target,
            quick=quick,
            include_incomplete=include_incomplete,
            exclude=exclude,
            treatment=treatment,
            controls=controls,
            design=design,
            progress=status,
        )
    _print_analysis(study, found)
    tell(f"report {found.report}")


def _print_analysis(study: Study, found: Analysed) -> None:
    findings, console = found.findings, say()
    data = findings.data
    tell(f"{plural(len(data.participants), 'participant')} analysed, {len(data.excluded)} not")
    if len(findings.metrics):
        columns = ["predictor", "condition", "accuracy", "f1"]
        rows = findings.metrics[columns].to_dict("records")
        console.print(table([{str(key): value for key, value in row.items()} for row in rows]))
    for treatment, hypotheses in findings.hypotheses.items():
        for row in hypotheses.verdicts().to_dict("records"):
            tell(f"{treatment}: {row['hypothesis']} {row['every predictor']} for every predictor")
    for line in findings.unsaid:
        tell(f"not said: {line}")


# -- power ------------------------------------------------------------------------------------------------------------


class Counts(click.ParamType):
    """Numbers of participants, such as ``8,12,16``."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """The numbers, rising."""
        if isinstance(value, tuple):
            return value
        try:
            found = sorted({int(part) for part in str(value).split(",")})
        except ValueError:
            found = []
        if not found or found[0] < 2 or found[-1] > 10_000:
            self.fail(f"{value!r} is no list of numbers from 2 to 10,000 such as 8,12,16", param, ctx)
        return tuple(found)


class EffectSize(click.ParamType):
    """A multiple of what is observed, ``x0.5``, or a difference, ``0.1``."""

    name = "xFACTOR|difference"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float | None]:
        """Factor and difference, one of them 1 or None."""
        import math

        if isinstance(value, tuple):
            return value
        text = str(value)
        try:
            size = float(text.removeprefix("x"))
        except ValueError:
            size = math.nan
        if not math.isfinite(size):
            self.fail(f"{value!r} is neither a factor such as x0.5 nor a difference such as 0.1", param, ctx)
        return (size, None) if text.startswith("x") else (1.0, size)


@click.command()
@study_folder
@click.option("--from", "source", type=click.Choice(["pilot", "simulated"]), default="pilot", show_default=True,
              help="Draw from participants of the study, or from simulated people.")  # fmt: skip
@debug_option
@click.option("--measure", default="accuracy", show_default=True, metavar="NAME",
              help="accuracy, a measure of rounds.csv, or QUESTIONNAIRE:SCALE.")  # fmt: skip
@click.option("--predictor", metavar="LABEL", help="Whose accuracy. [default: the paper's first]")
@click.option("--treatment", metavar="CONDITION", help="Compared with --control. [default: any difference at all]")
@click.option("--control", metavar="CONDITION", help="What --treatment is compared with.")
@click.option("--effect", type=EffectSize(), default=(1.0, None), metavar="xFACTOR|DIFFERENCE",
              help="Of what is observed, such as x0.5, or the true difference. [default: x1]")  # fmt: skip
@click.option("--participants", type=Counts(), default=(8, 12, 16, 20, 24, 32, 40, 48), metavar="N,N,...",
              help="Numbers to try. [default: 8,12,16,20,24,32,40,48]")  # fmt: skip
@click.option(
    "--power", "wanted", type=click.FloatRange(0, 1, min_open=True, max_open=True), default=0.8, show_default=True
)
@click.option("--alpha", type=click.FloatRange(0, 1, min_open=True, max_open=True), default=0.05, show_default=True)
@click.option("--people", type=click.IntRange(2, 10_000), default=24, show_default=True, help="To be simulated.")
@click.option("--draws", type=click.IntRange(100, 1_000_000), default=2000, show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@quiet_option
def power(
    folder: Path,
    source: str,
    debug: bool,
    measure: str,
    predictor: str | None,
    treatment: str | None,
    control: str | None,
    effect: tuple[float, float | None],
    participants: tuple[int, ...],
    wanted: float,
    alpha: float,
    people: int,
    draws: int,
    seed: int,
    quiet: bool,
) -> None:
    """Say how many participants an effect needs.

    Participants are drawn with replacement, and the analysis's own test is made on them: a repeated-measures analysis
    of variance over all conditions, or a paired t between two. A pilot of few participants makes a rough answer.
    """
    import numpy as np

    from benchmarks.study.analysis.power import Effect, power_curve, wide_table
    from benchmarks.study.analysis.power_data import pilot_values, simulated_values
    from benchmarks.study.design.study import load_study

    if (treatment is None) != (control is None):
        raise click.UsageError("--treatment and --control go together")
    rng = np.random.default_rng(seed)
    with _status(quiet) as status:
        if source == "simulated":
            study = load_study(folder)
            values = simulated_values(study, people, measure, rng, predictor=predictor, progress=status)
        else:
            study, database = _opened(folder, debug)
            values = pilot_values(study, database, measure, predictor=predictor, progress=status)
        wide = wide_table(values, "value", study.conditions)
        asked = Effect(treatment, control, *effect)
        found = power_curve(wide, asked, participants, rng, wanted=wanted, alpha=alpha, draws=draws)
    _print_power(found, measure, source)


def _print_power(found: Power, measure: str, source: str) -> None:
    effect = found.effect
    who = plural(found.pilot, "simulated person" if source == "simulated" else "participant").replace(
        "persons", "people"
    )
    if found.observed is not None and found.standardised is not None:
        tell(
            f"{measure}: {effect.treatment} less {effect.control} is {shown_number(found.observed, 4)} in {who} "
            f"(d_z {shown_number(found.standardised)})"
        )
    else:
        tell(f"{measure}: any difference between conditions, as in {who}")
    from benchmarks.study.analysis.power import as_rows

    say().print(table(as_rows(found)))
    if found.needed is None:
        tell(f"power {found.wanted:g} is reached by none of these numbers; try more with --participants")
        raise click.exceptions.Exit(1)
    tell(f"participants {found.needed} for power {found.wanted:g} at level {found.alpha:g}")
    if found.pilot < 10:
        tell(f"Warning: {who} say little about others; take this for a rough guess", err=True)


# -- replay and verify ------------------------------------------------------------------------------------------------


@click.command()
@study_folder
@person_argument
@debug_option
@click.option("--round", "number", type=click.IntRange(min=1), metavar="N",
              help="Only this game, from 1, the practice among them. [default: all, one after the other]")  # fmt: skip
@click.option("--speed", type=PositiveNumber(), default=1.0, show_default=True, help="Times as fast as it was played.")
@click.option("--out", type=DestinationFileOrFolder(".gif"), metavar="FILE.gif|FOLDER",
              help="Write a GIF, or PNG files into a folder, instead of opening a window.")  # fmt: skip
def replay(folder: Path, participant: str, debug: bool, number: int | None, speed: float, out: Path | None) -> None:
    """Watch a participant's games again."""
    from itertools import chain

    from benchmarks.study.analysis.database import read_only
    from benchmarks.study.analysis.watching import chosen_visits, frames_of, save_frames, show_frames

    study, database = _opened(folder, debug)
    with read_only(database) as connection:
        person = _person(connection, participant)
        visits = chosen_visits(connection, person, number)
        frames = chain.from_iterable(frames_of(study, connection, person, visit, speed=speed) for visit in visits)
        if out is None:
            try:
                show_frames(frames, f"{study.content.title}: {participant}")
            except RuntimeError as error:
                raise click.ClickException(f"{error}; or write a file with --out {participant}.gif") from error
            return
        count = save_frames(frames, out)
    tell(f"{plural(count, 'picture')} {out}")


@click.command()
@study_folder
@click.argument("participants", metavar="[PARTICIPANT]...", nargs=-1)
@debug_option
@design_option
@quiet_option
def verify(folder: Path, participants: tuple[str, ...], debug: bool, design: str | None, quiet: bool) -> None:
    """Play every game again and compare every state.

    Exit code 1 if a single one differs: then the study's files, or this package, are not those of the recording.
    """
    from benchmarks.study.analysis.database import check_design, people, read_only
    from benchmarks.study.analysis.replaying import verify as compare

    study, database = _opened(folder, debug)
    with read_only(database) as connection, _status(quiet) as status:
        chosen = [_person(connection, name) for name in participants] or people(connection)
        chosen = check_design(study, chosen, design)
        found = compare(study, connection, chosen, progress=status)
    for mismatch in found.mismatches:
        tell(f"differs: {mismatch}")
    tell(
        f"{plural(found.participants, 'participant')}, {plural(found.games, 'game')}, {plural(found.states, 'state')} "
        f"compared: {plural(len(found.mismatches), 'game')} differ"
        if found.mismatches
        else f"{plural(found.participants, 'participant')}, {plural(found.games, 'game')}, "
        f"{plural(found.states, 'state')} compared: all as recorded"
    )
    if found.mismatches:
        raise click.exceptions.Exit(1)


# -- one person, and everybody ----------------------------------------------------------------------------------------


@click.command()
@study_folder
@person_argument
@debug_option
@click.option("--yes", is_flag=True, help="Do not ask.")
def forget(folder: Path, participant: str, debug: bool, yes: bool) -> None:
    """Delete everything about a participant, for good.

    Works while the server runs.
    """
    from benchmarks.study.analysis.database import read_only
    from benchmarks.study.analysis.person_data import forget as delete

    _, database = _opened(folder, debug)
    with read_only(database) as connection:
        person = _person(connection, participant)
    if not yes:
        click.confirm(f"Delete everything about {participant} ({person.state}) from {database}?", abort=True)
    found = delete(database, participant)
    tell(f"deleted {participant}: " + ", ".join(f"{count:,} {name}" for name, count in found.items()))
    if not found.is_log_clear:
        tell("the server was reading: deleted rows leave the database's log when it next writes or stops", err=True)
    tell("earlier exports and copies still hold them", err=True)


@click.command("hand-out")
@study_folder
@person_argument
@click.option("--out", type=DestinationFileOrFolder(".zip"), required=True, metavar="FILE.zip|FOLDER", help="Where to.")
@debug_option
def hand_out(folder: Path, participant: str, out: Path, debug: bool) -> None:
    """Write everything that is stored about one participant.

    For them to have: who they are is among it.
    """
    from benchmarks.study.analysis.person_data import hand_out as write

    study, database = _opened(folder, debug)
    found = write(study, database, participant, out)
    tell(f"{participant}: " + ", ".join(f"{count:,} {name}" for name, count in found.items()))
    tell(f"written {out}")


@click.command()
@study_folder
@click.option("--out", type=DestinationFile(".csv"), metavar="FILE.csv", help="Write a table instead of printing it.")
@click.option("--with-worker-ids", is_flag=True, help="With --out FILE.csv: who they are, into FILE-workers.csv.")
@debug_option
def progress(folder: Path, out: Path | None, with_worker_ids: bool, debug: bool) -> None:
    """Say who got how far, and why it ended: for partial pay."""
    from benchmarks.csv_tables import write_table
    from benchmarks.study.analysis.person_data import progress_table, worker_table

    if with_worker_ids and out is None:
        raise click.UsageError("--with-worker-ids is about --out, which is not given")
    study, database = _opened(folder, debug)
    rows = progress_table(study, database, told=lambda text: tell(text, err=True))
    if out is None:
        columns = ["participant", "state", "screens_done", "screens", "share", "minutes", "at"]
        records = rows[columns].to_dict("records")
        if records:
            say().print(table([{str(key): value for key, value in row.items()} for row in records]))
        counted = rows["state"].value_counts(sort=False).items()
        tell(f"{plural(len(rows), 'participant')}: " + ", ".join(f"{count} {state}" for state, count in counted))
        return
    tell(f"progress {write_table(out, rows)}")
    if with_worker_ids:
        # A file of its own, so that the other can be passed on.
        known = worker_table(database).merge(rows[["participant", "state", "share", "minutes"]], on="participant")
        tell(f"workers {write_table(out.with_name(f'{out.stem}-workers.csv'), known)}")


DATA_COMMANDS = (export, analyse, replay, verify, power, forget, hand_out, progress)
"""In the order of ``legible study --help``."""
