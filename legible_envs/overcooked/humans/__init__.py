"""Simulated participants in kitchens: how they walk, whole tasks, and their fit to recorded play."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
