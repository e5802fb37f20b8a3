"""The table: layouts of boxes and virtual obstacles, tasks on them, their design, and the shortest paths of a hand."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
