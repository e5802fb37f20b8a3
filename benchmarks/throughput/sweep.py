"""The settings of the speed benchmark as data: sizes, repeats, and the promised figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

__all__ = ["FULL", "OPTIMUM_5X5", "QUICK", "TARGETS", "Settings", "Target"]

OPTIMUM_5X5: Final = -11.684924681147868
"""Best legibility of all valid 5x5 kitchens with ``prefix="sum"``, known from exhaustive search."""


@dataclass(frozen=True)
class Settings:
    """Sizes and repeats.

    Attributes:
        rounds: Number of samples of each figure; all figures of a group take turns, medians are reported.
        seconds: Duration of one sample of a rate.
        shapes: Kitchens whose scoring is measured.
        batch: Layouts scored per call.
        oracle_layouts: Layouts the readable definition scores per sample.
        seeds: Searches for the known 5x5 optimum.
        optimum_evaluations: Budget of each.
        search_evaluations: Budget of the search whose overhead is measured.
        num_envs: Size of the vector environment.
        fresh_starts: Number of new processes for import and compile times.
        trajectories: Number of trajectories that predictors are cross-validated on.
        evaluations: Number of cross-validations.
        tables: Tables scored per call.
        table_obstacles: How many obstacles they have, one figure each.
        table_climbs: Random tables, and climbs, of the searches for tables; by default those of the paper.
        table_episodes: Episodes at tables that are replayed.
        table_people: Simulated participants per call.
        study_participants: How many play at once at a study's server in kitchens.
        study_tables: How many at tables with robots.
        study_seconds: How long.
    """

    rounds: int = 7
    seconds: float = 0.5
    shapes: tuple[tuple[int, int], ...] = ((5, 5), (7, 7), (9, 9))
    batch: int = 2048
    oracle_layouts: int = 5
    seeds: int = 10
    optimum_evaluations: int = 1_000_000
    search_evaluations: int = 200_000
    num_envs: int = 64
    fresh_starts: int = 5
    trajectories: int = 500
    evaluations: int = 2
    tables: int = 1024
    table_obstacles: tuple[int, ...] = (0, 3, 4)
    table_climbs: tuple[int, int] = (1_000, 1_000)
    table_episodes: int = 3
    table_people: int = 20
    study_participants: tuple[int, ...] = (20, 60, 200)
    study_tables: int = 8
    study_seconds: float = 20.0


FULL: Final = Settings()
QUICK: Final = Settings(rounds=3, seconds=0.1, oracle_layouts=1, seeds=2, search_evaluations=50_000, fresh_starts=1,
                        evaluations=1, study_seconds=5.0)  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A promised bound of a figure, from below or above."""

    sense: Literal[">=", "<="]
    value: float

    def met_by(self, value: float) -> bool:
        """Whether a measured value reaches the target."""
        return value >= self.value if self.sense == ">=" else value <= self.value


TARGETS: Final[dict[str, Target]] = {
    "score 5x5": Target(">=", 250_000),
    "score 7x7": Target(">=", 100_000),
    "score / oracle": Target(">=", 1_000),
    "optimum found": Target(">=", 1.0),
    "optimum seconds": Target("<=", 5.0),
    "search overhead": Target("<=", 0.35),
    "env": Target(">=", 100_000),
    "vector env": Target(">=", 1_500_000),
    "cooks grid": Target(">=", 1_000_000),
    "cooks vector": Target(">=", 1_000_000),
    "agents cost": Target("<=", 1.5),
    "reset": Target("<=", 100e-6),
    "env / peer": Target(">=", 10),
    "vector env / peer": Target(">=", 150),
    "dtw": Target("<=", 50e-6),
    "gaussian update": Target("<=", 1e-3),
    "gaussian velocity update": Target("<=", 1e-3),
    "maxent gradient": Target("<=", 0.3e-3),
    "maxent fit": Target("<=", 0.5),
    "imitation / gradient": Target(">=", 100),
    "irl-maxent / gradient": Target(">=", 300),
    "evaluation": Target("<=", 10.0),
    "update Eq. 1": Target("<=", 100e-6),
    "update MaxEnt": Target("<=", 100e-6),
    "update n-gram": Target("<=", 100e-6),
    "update k-NN": Target("<=", 100e-6),
    "update logistic": Target("<=", 100e-6),
    "score table 0": Target(">=", 150_000),
    "score table 3": Target(">=", 25_000),
    "score table 4": Target(">=", 18_000),
    "score tea / tea loss": Target(">=", 1_000),
    "table searches": Target("<=", 60.0),
    "table env": Target(">=", 5_000),
    "table env belief": Target(">=", 2_000),
    "table env robot": Target(">=", 2_000),
    "table frames": Target(">=", 60),
    "study p95 200": Target("<=", 0.020),
    "study flat": Target("<=", 1.25),
    "study memory": Target("<=", 300),
    "import": Target("<=", 0.3),
    "compile": Target("<=", 20.0),
}
