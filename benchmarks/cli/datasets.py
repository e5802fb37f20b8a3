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
              help="A layout's file or -; repeatable. In kitchens also random, random:train and random:test. For "
                   "recorded games the names of their kitchens. [default: the environment's own; all recorded]")  # fmt: skip
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
    """Play episodes, or convert recorded games, and write them as a Minari data set.

    The same options make the same arrays. Read it with minari.load_dataset, where MINARI_DATASETS_PATH names the
    folder, or with minari.MinariDataset(PATH).
    """
    from benchmarks.console import plural, say, tell
    from legible_envs.datasets.played import make_played_dataset
    from legible_envs.datasets.recorded import make_recorded_dataset

    arguments = settings_from(assigned, "--argument")
    arguments |= {key: value for key, value in {"obs_type": obs_type, "task": task}.items() if value is not None}
    _check_domain(ctx, domain, player)
    shared: dict[str, Any] = {"author": author, "description": description, "dataset_id": dataset_id}
    with say().status("") as status:

        def progress(done: int, of: int) -> None:
            status.update(f"{plural(done, 'episode')} of {of:,}")

        if player == _RECORDED:
            found = make_recorded_dataset(
                out, recordings=recordings, layouts=sources or None, games=episodes, progress=progress,
                **shared, **arguments,
            )  # fmt: skip
        else:
            found = make_played_dataset(
                out, domain, player=player, episodes=episodes or 100, participants=participants, seed=seed,
                progress=progress, **shared, **_layouts(domain, sources, shape), **arguments,
            )  # fmt: skip
    tell(f"{found.id}: {plural(found.total_episodes, 'episode')}, {plural(found.total_steps, 'step')}")
    tell(f"data set: {click.format_filename(found.storage.data_path.parent)}")


def _check_domain(ctx: click.Context, domain: str, player: str) -> None:
    """Refuse options of the other domain, or of played episodes with recorded ones."""
    if player == _RECORDED:
        if domain != "overcooked":
            raise click.UsageError("--player recorded: games were recorded in kitchens; leave out --env tabletop")
        if given := given_options(ctx, list(_ONLY_PLAYED)):
            raise click.UsageError(f"{_ONLY_PLAYED[given[0]]} has no meaning for recorded games")
        return
    if given_options(ctx, ["recordings"]):
        raise click.UsageError("--from goes with --player recorded")
    other = {"shape": "--shape", "obs_type": "--obs-type"} if domain == "tabletop" else {"task": "--task"}
    if given := given_options(ctx, list(other)):
        raise click.UsageError(
            f"{other[given[0]]} goes with --env {'overcooked' if domain == 'tabletop' else 'tabletop'}"
        )


def _layouts(domain: str, sources: tuple[str, ...], shape: tuple[int, int] | None) -> dict[str, Any]:
    """The arguments of the environment that say in which layouts is played.

    Raises:
        click.UsageError: More layouts than the environment takes.
    """
    from benchmarks.presenters.registry import read_source

    arguments: dict[str, Any] = {} if shape is None else {"shape": list(shape)}
    if not sources:
        return arguments
    drawn = [source for source in sources if source.partition(":")[0] == "random"] if domain == "overcooked" else []
    if len(sources) > 1 and (drawn or domain == "tabletop"):
        what = "tables: one layout" if domain == "tabletop" else f"{drawn[0]} is a distribution of its own"
        raise click.UsageError(f"--layout is given {len(sources)} times; {what}")
    if drawn:
        return {**arguments, "layouts": drawn[0]}
    texts = [read_source(source)[1] for source in sources]
    return {**arguments, **({"layout": texts[0]} if len(texts) == 1 else {"layouts": texts})}
