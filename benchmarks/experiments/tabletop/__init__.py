"""The paper's tables: are goals at legible ones predicted better, and does a robot profit? Settings, run and analysis.

Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to Improve Prediction of Human Motion During
Human-Robot Collaboration* (HRI 2024): the study at a table, with simulated participants; and the robot, which it lacks.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
