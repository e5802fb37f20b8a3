"""How well predictors predict the goals of real people in recorded play: settings, run and analysis."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
