"""How every command ends: errors and warnings are one line each, Ctrl-C is a sentence, and exit codes say which.

Exit codes: 0 done; 1 ran, but did not find or finish everything; 2 the input cannot be used; 130 stopped by Ctrl-C.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, Final, NoReturn

import click

from benchmarks.console import tell
from legible_envs.support.names import printable

__all__ = ["STOPPED", "Commands", "Program", "leave"]

STOPPED: Final = 130
"""Exit code of a command that Ctrl-C ended."""

_LONGEST: Final = 1_000
"""Characters of a message; the middle of a longer one, such as of a value of many digits, is left out."""

_COLOUR_CODES: Final = re.compile(r"\x1b\[[0-9;]*m")


class _BadInput(click.ClickException):
    exit_code = 2


class Commands(click.Group):
    """A group whose commands answer bad input with one line and exit code 2 instead of a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        with _one_line_warnings(), _one_line_errors(bool(ctx.find_root().params.get("traceback"))):
            return super().invoke(ctx)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is named, or the names that it may have meant."""
        name = args[0] if args else ""
        if name and not name.startswith("-") and self.get_command(ctx, name) is None:
            near = get_close_matches(name, self.commands, 3, 0.5)
            meant = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(self.commands)}"
            ctx.fail(f"no such command {name!r}; {meant}")
        return super().resolve_command(ctx, args)


class Program(Commands):
    """The whole command: what one of its commands raises never reaches a user as a traceback or a bare 'Aborted!'."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """Run the command line; ends the process with its exit code unless ``standalone_mode`` is off."""
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
        code = 0
        _write_what_can_be_written()
        try:
            found = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            code = found if isinstance(found, int) else 0
            _flush()
        except click.ClickException as error:
            code = error.exit_code
            with contextlib.suppress(AttributeError, OSError):  # there is no standard error to write to
                _show(error)
        except (click.Abort, KeyboardInterrupt):
            tell("stopped", err=True)
            code = STOPPED
        sys.exit(code)


def _show(error: click.ClickException) -> None:
    """Print an error as click does, but for what in its message would steer the terminal: messages quote names."""
    shown = _shortened(error)
    shown.message = printable(shown.message, lines=True)
    stream = io.StringIO()
    shown.show(stream)
    tell(stream.getvalue().removesuffix("\n"), err=True)


def _shortened(error: click.ClickException) -> click.ClickException:
    """The error, without the middle of its message where that is very long."""
    text = error.message
    if len(text) <= _LONGEST:
        return error
    return _BadInput(f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}")


@contextlib.contextmanager
def _one_line_errors(show_traceback: bool) -> Iterator[None]:
    """Turn the errors that the libraries raise about input, files and settings into clicks of exit code 2."""
    try:
        yield
    except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
        raise
    except (ValueError, OSError, RuntimeError, ImportError, MemoryError) as error:
        if show_traceback:
            raise
        raise _BadInput(_message(error)) from error


def _message(error: BaseException) -> str:
    if isinstance(error, RecursionError):
        return "the input is nested too deeply to be read"
    if isinstance(error, MemoryError):
        return "there is not enough memory for this"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {_file_name(error.filename)}" if error.filename else error.strerror
    return " ".join(str(error).split()) or type(error).__name__


def _file_name(name: Any) -> str:
    return click.format_filename(name) if isinstance(name, str | bytes | os.PathLike) else str(name)


@contextlib.contextmanager
def _one_line_warnings() -> Iterator[None]:
    """Print warnings of the libraries as one line of what they say, without the line of code that gave them."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        text = " ".join(_COLOUR_CODES.sub("", str(message)).removeprefix("WARN: ").split())
        tell(f"Warning: {text}", err=True)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _write_what_can_be_written() -> None:
    """Characters that the terminal's encoding lacks become question marks, not an error in mid-command."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _flush() -> None:
    """Write what is still in the buffer of standard output, so that a full disk is an error and not a shrug.

    Raises:
        click.ClickException: It cannot be written.
    """
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        _discard_output()  # whoever reads the output has seen enough
    except OSError as error:
        _discard_output()
        raise _BadInput(f"the output cannot be written: {_message(error)}") from error


def _discard_output() -> None:
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def leave(code: int) -> NoReturn:
    """End the process; further Ctrl-C do not change its exit code while Python cleans up."""
    with contextlib.suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Where Ctrl-C interrupted an exec() of a library, Python remembers that and would end by the signal, not by the
    # exit code, although it was handled; the next exec() makes it forget.
    exec("")
    sys.exit(code)
