"""`legible study serve`, `recruit` and `code`: running a study, and what goes with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from benchmarks.console import tell

__all__ = ["code", "recruit", "serve"]

_folder = click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))


def _root_path(_: click.Context, option: click.Parameter, value: str) -> str:
    path = value.rstrip("/")
    if path and not path.startswith("/"):
        raise click.BadParameter(f"expected a path that begins with /, such as /study, got {value!r}", param=option)
    return path


def _base_url(_: click.Context, option: click.Parameter, value: str | None) -> str:
    if not value:
        return ""
    from urllib.parse import urlsplit

    parts = urlsplit(value)
    if parts.scheme not in ("http", "https") or not parts.netloc or parts.query or parts.fragment:
        raise click.BadParameter(f"expected an address such as https://example.org/study, got {value!r}", param=option)
    return value.rstrip("/")


@click.command()
@_folder
@click.option("--host", default="127.0.0.1", show_default=True,
              help="Address to listen on; 0.0.0.0 lets other machines in.")  # fmt: skip
@click.option("--port", type=click.IntRange(0, 65535), default=8000, show_default=True, help="0: any that is free.")
@click.option("--root-path", default="", callback=_root_path, metavar="/PATH",
              help="Behind a reverse proxy: the path that it serves the study under and takes off.")  # fmt: skip
@click.option("--trust-proxy", "trusted", default="", metavar="ADDRESSES",
              help="Believe X-Forwarded-* headers of these addresses (separated by commas).")  # fmt: skip
@click.option("--tls-cert", type=click.Path(exists=True, dir_okay=False), help="Certificate chain (PEM).")
@click.option("--tls-key", type=click.Path(exists=True, dir_okay=False), help="Its private key (PEM).")
@click.option("--base-url", callback=_base_url, metavar="URL", help="What participants reach it by, for the links.")
@click.option("--debug-only", is_flag=True, help="Serve debug participants alone; the live database is not touched.")
@click.option("--new-design", is_flag=True,
              help="Go on although the design was changed since live participants took part.")  # fmt: skip
def serve(
    folder: Path,
    base_url: str,
    debug_only: bool,
    new_design: bool,
    tls_cert: str | None,
    tls_key: str | None,
    **at: Any,
) -> None:
    """Serve a study.

    Checks FOLDER, prints the links for participants, for trying it out and for the monitor (which shows how
    participants are doing; keep that link to yourself), and serves until Ctrl-C.
    """
    from benchmarks.study.design.study import check_study, load_study
    from benchmarks.study.errors import StudyError
    from benchmarks.study.server.run import Address
    from benchmarks.study.server.run import serve as serve_study
    from benchmarks.study.store import Mode

    if problems := [problem for problem in check_study(folder) if problem.is_error]:
        for problem in problems:
            tell(str(problem), err=True)
        count = f"{len(problems)} thing{'s are' if len(problems) > 1 else ' is'}"
        raise StudyError(f"{count} missing or wrong in {click.format_filename(folder)}; nobody is served")
    study = load_study(folder)
    address = Address(tls_cert=tls_cert or "", tls_key=tls_key or "", **at)
    modes: tuple[Mode, ...] = ("debug",) if debug_only else ("live", "debug")

    def ready(port: int, secrets: Any) -> None:
        _tell_links(base_url or _base(address, port), secrets, study, debug_only=debug_only)

    serve_study(study, address, modes=modes, new_design=new_design, ready=ready)


def _base(address: Any, port: int) -> str:
    """The address that a browser on this machine reaches the server by."""
    host = {"0.0.0.0": "localhost", "::": "localhost"}.get(address.host, address.host)
    scheme = "https" if address.tls_cert else "http"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}{address.root_path}"


def _tell_links(base: str, secrets: Any, study: Any, *, debug_only: bool) -> None:
    from benchmarks.study.server.run import Links

    links = Links.of(base, secrets, study.content.recruitment.source)
    tell(f"{study.content.title} (design {study.design_hash})")
    if not debug_only:
        tell(f"  participants: {links.participant}")
    tell(f"  debug:        {links.debug}")
    tell(f"  monitor:      {links.monitor}  (keep it to yourself)")
    tell("Ctrl-C stops; whoever takes part meanwhile goes on when it is served again.")


@click.command()
@_folder
@click.argument("state", type=click.Choice(["open", "pause", "close"]))
def recruit(folder: Path, state: str) -> None:
    """Open, pause or close recruitment.

    Who has begun may finish in any case; after `pause` or `close` nobody joins. Works while the study is served, and
    holds after it is served again.
    """
    from benchmarks.study.server.recruitment import set_recruitment
    from benchmarks.study.store import database_path

    wanted: Any = {"open": "open", "pause": "paused", "close": "closed"}[state]
    before = set_recruitment(database_path(folder, "live"), wanted)
    tell(f"recruitment: {wanted}" + (f" (was {before})" if before != wanted else " already"))


@click.command()
@_folder
@click.argument("code")
@click.pass_context
def code(ctx: click.Context, folder: Path, code: str) -> None:
    """Say whose completion code this is.

    Prints the participant, the ending that the code stands for, and how far the database says that they came. Exits
    with 1 where it is nobody's.
    """
    from benchmarks.study.server.codes import find_code

    found = find_code(folder, code)
    for line in found:
        tell(line)
    if not found:
        tell("this is nobody's code")
        ctx.exit(1)
