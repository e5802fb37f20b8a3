"""The experiments of ``legible reproduce``: settings, run and analysis each."""
