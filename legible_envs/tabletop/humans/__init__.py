"""Simulated participants at a table: how they reach, whole tasks, and their fit to recorded reaches."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
