"""How well is the kitchen, and the table, learned by PPO? Settings, run and analysis, and the learner itself."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
