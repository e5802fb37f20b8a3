"""Prediction of a person's next goal, and its evaluation on recorded and simulated participants.

>>> from predictors import BayesianGoalPredictor
>>> predictor = BayesianGoalPredictor().fit(trajectories)         # doctest: +SKIP
>>> predictor.predict_proba_at(trajectories, fractions=(0.25, 0.5))   # doctest: +SKIP
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
