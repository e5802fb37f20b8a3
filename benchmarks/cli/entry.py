"""Where the program ``legible`` starts: Ctrl-C counts from the first moment on, while the commands are still loaded."""

from __future__ import annotations

__all__ = ["run"]


def run() -> None:
    """Run the command line and end the process with its exit code."""
    code: object = 130
    try:
        from benchmarks.cli.interrupts import spare_imports

        spare_imports()
        from benchmarks.cli.app import main

        main(prog_name="legible")
    except SystemExit as end:
        code = end.code
    except KeyboardInterrupt:
        import sys

        print("stopped", file=sys.stderr)
    from benchmarks.cli.program import leave

    leave(code if isinstance(code, int) else 1)


if __name__ == "__main__":
    run()
