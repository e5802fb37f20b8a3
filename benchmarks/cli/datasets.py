"""The commands ``legible datasets``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from benchmarks.cli.destinations import DestinationFolder
from benchmarks.cli.options import Assignment, LayoutSource, given_options, settings_from
from benchmarks.cli.program import Commands

__all__ = ["datasets"]

_RECORDED = "recorded"
_ONLY_PLAYED = {"participants": "--participants", "seed": "--seed", "shape": "--shape", "task": "--task"}


@click.group(cls=Commands)
def datasets() -> None:
    """Make data sets to learn from, in Minari's format."""


@datasets.command()
@click.option("--env", "domain", type=click.Choice(["overcooked", "tabletop"]), default="overcooked", show_default=True,
              help="Kitchen or table.")  # fmt: skip
@click.option("--player", metavar="NAME|module:Name", default="scripted", show_default=True,
              help="Kitchens: scripted, boltzmann, planner, cloned or recorded. Tables: scripted or reach. Or a policy "
                   "of yours, called with (observation, info), or a class of one, made with (env, rng).")  # fmt: skip
@click.option("--layout", "sources", type=LayoutSource(), metavar="LAYOUT", multiple=True,
              help="A layout's file or -; in kitchens repeatable, and also random, random:train, random:test. With "
                   "recorded games: name of a kitchen. [default: the environment's own; all]")  # fmt: skip
@click.option("--shape", nargs=2, type=click.IntRange(3, 64), metavar="ROWS COLS", help="Kitchens: their size.")
@click.option("--task", metavar="NAME|FILE.yaml", help="Tables: what is built.")
@click.option("--obs-type", type=click.Choice(["grid", "vector"]), help="Kitchens: observations. [default: grid]")
@click.option("--argument", "assigned", type=Assignment(), multiple=True, metavar="NAME=VALUE",
              help="Another argument of the environment, such as max_episode_steps=600; repeatable.")  # fmt: skip
@click.option("--episodes", type=click.IntRange(1, 1_000_000),
              help="How many. [default: 100; all recorded games]")  # fmt: skip
@click.option("--participants", type=click.IntRange(1, 100_000),
              help="Simulated participants, who take turns. [default: one per episode]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--name", "dataset_id", metavar="NAMESPACE/NAME-v0",
              help="What Minari calls it. [default: such as overcooked/scripted-v0]")  # fmt: skip
@click.option("--author", multiple=True, help="Who makes it; repeatable.")
@click.option("--description", help="In sentences. [default: what is known]")
@click.option("--from", "recordings", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="Recorded games: the folder `legible humans fetch --out` wrote.")  # fmt: skip
@click.option("--out", type=DestinationFolder(), required=True,
              help="The folder of data sets, as MINARI_DATASETS_PATH would name it.")  # fmt: skip
@click.pass_context
def make(
    ctx: click.Context,
    domain: str,
    player: str,
    sources: tuple[str, ...],
    shape: tuple[int, int] | None,
    task: str | None,
    obs_type: str | None,
    assigned: tuple[tuple[str, Any], ...],
    episodes: int | None,
    participants: int | None,
    seed: int,
    dataset_id: str | None,
    author: tuple[str, ...],
    description: str | None,
    recordings: Path | None,
    out: Path,
) -> None:
    """Make a Minari data set of played or recorded episodes.

    The same options make the same arrays. Read it with minari.load_dataset, where MINARI_DATASETS_PATH names the
    folder, or with minari.MinariDataset(PATH).
    """
    from benchmarks.console import plural, say, tell

    _check_options(ctx, domain, player, sources)
    arguments = settings_from(assigned, "--argument")
    arguments |= {key: value for key, value in {"obs_type": obs_type, "task": task}.items() if value is not None}
    about: dict[str, Any] = {"dataset_id": dataset_id, "description": description}
    about |= {"author": author} if author else {}
    with say().status("") as status:

        def progress(done: int, of: int) -> None:
            status.update(f"{done:,} of {plural(of, 'episode')}")

        about["progress"] = progress
        if player == _RECORDED:
            found = _convert(out, recordings, sources, episodes, about | arguments)
        else:
            arguments |= _layouts(domain, sources, shape)
            numbers: dict[str, Any] = {"episodes": episodes or 100, "participants": participants, "seed": seed}
            found = _play(out, domain, player, numbers, about | arguments)
    for dataset in found:
        place = click.format_filename(dataset.storage.data_path.parent)
        tell(
            f"{dataset.id}: {plural(dataset.total_episodes, 'episode')}, {plural(dataset.total_steps, 'step')}, {place}"
        )


def _play(out: Path, domain: str, player: str, numbers: dict[str, Any], arguments: dict[str, Any]) -> list[Any]:
    from legible_envs.datasets.played import make_played_dataset

    return [make_played_dataset(out, domain, player=player, **numbers, **arguments)]


def _convert(
    out: Path, recordings: Path | None, kitchens: tuple[str, ...], games: int | None, arguments: dict[str, Any]
) -> list[Any]:
    from legible_envs.datasets.overcooked_2019 import recorded_layouts
    from legible_envs.datasets.recorded import make_recorded_dataset

    names = kitchens or tuple(recorded_layouts(recordings))
    return [make_recorded_dataset(out, name, recordings=recordings, games=games, **arguments) for name in names]


def _check_options(ctx: click.Context, domain: str, player: str, sources: tuple[str, ...]) -> None:
    """Refuse options of the other domain, or of played episodes with recorded ones."""
    if player == _RECORDED:
        if domain != "overcooked":
            raise click.UsageError("games were recorded in kitchens: --player recorded goes with --env overcooked")
        if given := given_options(ctx, _ONLY_PLAYED):
            raise click.UsageError(f"{_ONLY_PLAYED[given[0]]} has no meaning for recorded games")
        if given_options(ctx, ["dataset_id"]) and len(sources) != 1:
            raise click.UsageError("each recorded kitchen makes a data set of its own; --name takes one --layout")
        return
    if given_options(ctx, ["recordings"]):
        raise click.UsageError("--from goes with --player recorded")
    other = {"shape": "--shape", "obs_type": "--obs-type"} if domain == "tabletop" else {"task": "--task"}
    if given := given_options(ctx, other):
        wanted = "overcooked" if domain == "tabletop" else "tabletop"
        raise click.UsageError(f"{other[given[0]]} goes with --env {wanted}")


def _layouts(domain: str, sources: tuple[str, ...], shape: tuple[int, int] | None) -> dict[str, Any]:
    """The arguments of the environment that say which layouts are played on.

    Raises:
        click.UsageError: More layouts than the environment takes.
    """
    from benchmarks.presenters.registry import read_source

    arguments: dict[str, Any] = {} if shape is None else {"shape": list(shape)}
    if not sources:
        return arguments
    drawn = [source for source in sources if source.partition(":")[0] == "random"] if domain == "overcooked" else []
    if len(sources) > 1 and (drawn or domain == "tabletop"):
        what = f"{drawn[0]} draws its own kitchens" if drawn else "a data set of tables has one"
        raise click.UsageError(f"--layout is given {len(sources)} times; {what}")
    if drawn:
        return {**arguments, "layouts": drawn[0]}
    texts = [read_source(source)[1] for source in sources]
    return {**arguments, **({"layout": texts[0]} if len(texts) == 1 else {"layouts": texts})}
