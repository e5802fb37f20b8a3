from .csv_files import read_csv, write_csv
from .minari_files import from_minari, to_minari
from .npz_files import save_trajectories
from .reading import TrajectoryFormat, load_trajectories, register_trajectory_format
from .recording import Episode, RecordTrajectories, record_episode
from .trajectory import CUTS, Cut, Trajectory

__all__ = [
    "CUTS",
    "Cut",
    "Episode",
    "RecordTrajectories",
    "Trajectory",
    "TrajectoryFormat",
    "from_minari",
    "load_trajectories",
    "read_csv",
    "record_episode",
    "register_trajectory_format",
    "save_trajectories",
    "to_minari",
    "write_csv",
]
