"""The command ``legible``, a file per group of commands."""
