from .csv_files import read_csv, write_csv
from .minari_files import to_minari
from .npz_files import load_trajectories, save_trajectories
from .reading import TrajectoryFormat, read_any, register_trajectory_format
from .recording import Episode, RecordTrajectories, record_episode
from .trajectory import CUTS, Cut, Trajectory

__all__ = [
    "CUTS",
    "Cut",
    "Episode",
    "RecordTrajectories",
    "Trajectory",
    "TrajectoryFormat",
    "load_trajectories",
    "read_any",
    "read_csv",
    "record_episode",
    "register_trajectory_format",
    "save_trajectories",
    "to_minari",
    "write_csv",
]
