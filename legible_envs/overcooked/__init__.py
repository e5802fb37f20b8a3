"""The kitchen: layouts, the workspace of their design, the playable game, and participants in it."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
