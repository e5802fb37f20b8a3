from .csv_files import read_csv, write_csv
from .minari_files import to_minari
from .reading import read_any
from .recording import Episode, RecordTrajectories, record_episode
from .trajectory import CUTS, Cut, Trajectory, load_trajectories, save_trajectories, trajectories_from_rollout

__all__ = [
    "CUTS",
    "Cut",
    "Episode",
    "RecordTrajectories",
    "Trajectory",
    "load_trajectories",
    "read_any",
    "read_csv",
    "record_episode",
    "save_trajectories",
    "to_minari",
    "trajectories_from_rollout",
    "write_csv",
]
