"""Predictors of a person's next goal, and how well they read recorded or simulated people.

>>> from predictors import BayesianGoalPredictor
>>> predictor = BayesianGoalPredictor().fit(walks)                # doctest: +SKIP
>>> predictor.predict_proba_at(walks, fractions=(0.25, 0.5))      # doctest: +SKIP
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
