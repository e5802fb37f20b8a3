"""Search for legible layouts: pyribs archives and schedulers with emitters made for workspaces.

Start with :func:`search`. To plug in an algorithm of your own, read :mod:`optimizers.emitters.registry`. Nothing here
imports pyribs before it is used: pyribs brings pandas, scikit-learn and (where installed) torch with it.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
