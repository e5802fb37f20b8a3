"""Does the legibility score tell how well the goals of real people are predicted? Settings, run and analysis."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
