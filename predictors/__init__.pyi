from .base import CandidatePredictor, GoalPredictor
from .evaluation.decisions import ThresholdDecision
from .grid.baselines import GridLogistic, GridNeighbours, GridNGram
from .grid.bayesian import BayesianGoalPredictor
from .grid.behaviour_cloning import BehaviourCloning
from .grid.maxent_irl import MaxEntIRL
from .grid.shortest_distance import ShortestDistance
from .inputs import TrajectoryError
from .neural.models import RecurrentPredictor, TransformerPredictor
from .reaching.baselines import ReachLogistic, ReachNeighbours
from .reaching.bayesian import StraightLineBayesian
from .reaching.gaussian import TimeSeriesGaussian
from .registry import check_predictor, list_predictors, make_predictor, register_predictor
from .uniform import UniformPredictor

__all__ = [
    "BayesianGoalPredictor",
    "BehaviourCloning",
    "CandidatePredictor",
    "GoalPredictor",
    "GridLogistic",
    "GridNGram",
    "GridNeighbours",
    "MaxEntIRL",
    "ReachLogistic",
    "ReachNeighbours",
    "RecurrentPredictor",
    "ShortestDistance",
    "StraightLineBayesian",
    "ThresholdDecision",
    "TimeSeriesGaussian",
    "TrajectoryError",
    "TransformerPredictor",
    "UniformPredictor",
    "check_predictor",
    "list_predictors",
    "make_predictor",
    "register_predictor",
]
