"""Evaluation of goal predictors: tidy tables, one row per trajectory and fraction observed.

>>> from predictors.evaluation import compare_conditions, evaluate
>>> found = evaluate(["bayesian", "shortest-distance"], trajectories, groups="participant")   # doctest: +SKIP
>>> found.accuracy()                                        # with confidence bands    # doctest: +SKIP
>>> found.metrics()                # weighted F1, log-loss, calibration error          # doctest: +SKIP
>>> compare_conditions(found, factor="predictor").anova                                # doctest: +SKIP
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
