"""The paper's kitchens: are goals in legible ones predicted better? Settings, run and analysis.

Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to Improve Prediction of Human Motion During
Human-Robot Collaboration* (HRI 2024), the study in Overcooked, with simulated participants fitted to recorded play.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
