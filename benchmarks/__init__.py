"""Experiments and figures by one command; see ``legible --help``."""
