"""Which search finds the most legible kitchens? Settings, run and analysis.

The comparison of optimisers in Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to Improve
Prediction of Human Motion During Human-Robot Collaboration* (HRI 2024), with more optimisers, and at equal numbers of
evaluations too.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
