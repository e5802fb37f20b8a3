"""The loop of training: play, learn, log, keep checkpoints, and go on from one as if nothing had happened."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.csv_tables import write_table
from benchmarks.experiments.learning.checkpoints import (
    FILE,
    Checkpoint,
    CheckpointError,
    check_same,
    load_checkpoint,
)
from benchmarks.experiments.learning.environments import PlayerSpace, make_envs, observation_scale
from benchmarks.experiments.learning.settings import TrainingSettings, require_torch
from legible_envs.support.files import write_text

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.learning.ppo import PPO, Games

__all__ = ["COLUMNS", "Moment", "curve_of", "train"]

COLUMNS: Final = (
    "steps", "episodes", "score", "length", "finished", "policy_loss", "value_loss", "entropy", "kl", "clipped",
)  # fmt: skip
"""Of the learning curve: steps so far; episodes that ended since the last row, with their mean sum of rewards, mean
length and share that terminated (all NaN where none has ended); and what :meth:`.PPO.update` tells."""

_TORCH_STATE: Final = ("step", "exp_avg", "exp_avg_sq")


@dataclass(frozen=True)
class Moment:
    """Where a training stands; handed to ``progress`` after every update.

    Attributes:
        steps: So far.
        total: That there will be.
        row: The newest row of the curve, by column.
        saved: Steps at the newest checkpoint.
    """

    steps: int
    total: int
    row: Mapping[str, float]
    saved: int


def train(
    settings: TrainingSettings,
    folder: str | Path,
    *,
    resume: bool = False,
    progress: Callable[[Moment], object] | None = None,
    most_updates: int | None = None,
) -> Checkpoint:
    """Train, and write ``checkpoint.npz``, ``curve.csv``, ``settings.json``, ``speed.json`` and TensorBoard's logs.

    A run that is resumed ends with the same bits as one that was never interrupted: all randomness is that of one
    generator, whose state is kept, torch runs on one thread, and all games start anew at each checkpoint. What was
    played after the newest checkpoint is played again.

    Args:
        settings: All that decides what the run comes to.
        folder: Where to write.
        resume: Whether to go on from a checkpoint there; without one, the training begins.
        progress: Called with a :class:`Moment` after every update.
        most_updates: Stop early, as an interruption would, after so many updates.

    Returns:
        The newest checkpoint, on disk too.

    Raises:
        CheckpointError: There is a run already and ``resume`` is off; or it was begun with other settings, is damaged,
            or of another space; or the training was stopped before its first checkpoint.
        ImportError: PyTorch is not installed.
        ValueError: Settings that fit no environment.
    """
    require_torch()
    from benchmarks.experiments.learning.networks import one_thread

    folder = Path(folder)
    before = None
    if (folder / FILE).exists():
        if not resume:
            raise CheckpointError(f"{folder} holds a training already; resume it, or choose another folder")
        before = load_checkpoint(folder)
        check_same(before, settings, folder)
    folder.mkdir(parents=True, exist_ok=True)
    with one_thread():
        return _Run(settings, folder, before).go_on(progress or (lambda moment: None), most_updates)


class _Run:
    """A training under way."""

    def __init__(self, settings: TrainingSettings, folder: Path, before: Checkpoint | None) -> None:
        from benchmarks.experiments.learning.ppo import PPO, Seconds

        self.settings, self.folder = settings, folder
        per_update = settings.ppo.rollout * settings.ppo.num_envs
        self.per_update = per_update
        self.total = math.ceil(settings.steps / per_update)
        self.between = max(1, round(settings.checkpoint_every / per_update))
        envs = make_envs(settings.environment, settings.ppo.num_envs)
        self.space = PlayerSpace.of(envs)
        scale = observation_scale(envs, self.space)
        envs.close()
        if before is not None and before.space != self.space:
            raise CheckpointError(
                f"the checkpoint in {folder} is of {before.space}, and the environment has {self.space}"
            )
        self.rng = np.random.default_rng(settings.seed) if before is None else before.generator()
        self.learner = PPO(self.space, settings, scale, self.rng if before is None else np.random.default_rng(0))
        self.learner.rng = self.rng
        self.updates, self.rows = 0, list[list[float]]()
        self.checkpoint = before
        self.seconds = Seconds()
        if before is not None:
            _restore(self.learner, before)
            self.updates, self.rows = before.updates, before.curve.tolist()

    def go_on(self, progress: Callable[[Moment], object], most_updates: int | None) -> Checkpoint:
        """Train to the end, from checkpoint to checkpoint."""
        last = self.total if most_updates is None else min(self.total, self.updates + most_updates)
        writer = _tensorboard(self.folder, self.updates * self.per_update)
        begun = self.updates
        try:
            while self.updates < last:
                self._go_to_checkpoint(last, progress, writer)
        finally:
            if writer is not None:
                writer.close()
        if begun < self.updates:
            self._write_speed(self.updates - begun)
        if self.checkpoint is None:
            raise CheckpointError(f"the training in {self.folder} was stopped before its first checkpoint")
        return self.checkpoint

    def _go_to_checkpoint(self, last: int, progress: Callable[[Moment], object], writer: Any) -> None:
        from benchmarks.experiments.learning.ppo import Games

        target = min(self.total, (self.updates // self.between + 1) * self.between)
        envs = make_envs(self.settings.environment, self.settings.ppo.num_envs)
        try:
            games = Games.begin(envs, self.space, self.settings.ppo, int(self.rng.integers(2**31)))
            while self.updates < min(target, last):
                self._update(games)
                row = dict(zip(COLUMNS, self.rows[-1], strict=True))
                saved = 0 if self.checkpoint is None else self.checkpoint.steps
                progress(Moment(int(row["steps"]), self.total * self.per_update, row, saved))
                if writer is not None:
                    for name, value in row.items():
                        if name != "steps" and not math.isnan(value):
                            writer.add_scalar(f"training/{name}", value, int(row["steps"]))
        finally:
            envs.close()
        if self.updates == target:
            self._save()

    def _update(self, games: Games) -> None:
        """Play a rollout, learn from it, and log a row."""
        import time

        from benchmarks.experiments.learning.ppo import collect

        rollout = collect(games, self.learner, self.settings.ppo.rollout, self.seconds, self.updates / self.total)
        begun = time.perf_counter()
        said = self.learner.update(rollout, self.updates / self.total)
        self.seconds.learning += time.perf_counter() - begun
        self.updates += 1
        ended = np.array(games.ended, dtype=np.float64).reshape(-1, 3)
        games.ended.clear()
        means = ended.mean(axis=0).tolist() if len(ended) else [math.nan] * 3
        self.rows.append([float(self.updates * self.per_update), float(len(ended)), *means, *said.values()])

    def _save(self) -> None:
        learner = self.learner
        weights = {name: values.detach().numpy().copy() for name, values in learner.network.state_dict().items()}
        optimizer = {
            f"{name}.{part}": state[part].numpy().copy()
            for name, parameter in learner.network.named_parameters()
            if (state := learner.optimizer.state.get(parameter))
            for part in _TORCH_STATE
        }
        moments = {
            f"{name}.{part}": np.array(values)
            for name, running in (("obs", learner.obs_moments), ("return", learner.return_moments))
            for part, values in running.arrays().items()
        }
        self.checkpoint = Checkpoint(
            self.settings,
            self.space,
            self.updates,
            self.updates * self.per_update,
            weights,
            optimizer,
            moments,
            dict(self.rng.bit_generator.state),
            COLUMNS,
            np.array(self.rows, dtype=np.float64).reshape(-1, len(COLUMNS)),
        )
        self.checkpoint.save(self.folder)
        write_table(self.folder / "curve.csv", curve_of(self.checkpoint))
        write_text(self.folder / "settings.json", json.dumps(self.settings.to_dict(), indent=2) + "\n")

    def _write_speed(self, updates: int) -> None:
        """How fast this process was, and where its time went; no result, and never the same twice."""
        seconds = asdict(self.seconds)
        total = sum(seconds.values())
        steps = updates * self.per_update
        told = {
            "steps": steps,
            "steps_per_second": round(steps / total, 1),
            "seconds": {name: round(value, 3) for name, value in seconds.items()},
            "shares": {name: round(value / total, 3) for name, value in seconds.items()},
            "threads": 1,
        }
        write_text(self.folder / "speed.json", json.dumps(told, indent=2) + "\n")


def _restore(learner: PPO, before: Checkpoint) -> None:
    """Let a learner go on from a checkpoint."""
    import torch

    learner.network.load_state_dict({name: torch.from_numpy(np.array(v)) for name, v in before.weights.items()})
    for name, parameter in learner.network.named_parameters():
        state = {}
        for part in _TORCH_STATE:
            stored = before.optimizer.get(f"{name}.{part}")
            wanted = () if part == "step" else tuple(parameter.shape)
            if stored is None or stored.shape != wanted:
                raise CheckpointError(f"the checkpoint lacks the optimiser's `{name}.{part}` of shape {wanted}")
            state[part] = torch.from_numpy(np.array(stored, dtype=np.float32))
        learner.optimizer.state[parameter] = state
    for name, running in (("obs", learner.obs_moments), ("return", learner.return_moments)):
        running.restore({part: before.moments[f"{name}.{part}"] for part in ("mean", "variance", "count")})


def curve_of(checkpoint: Checkpoint) -> pd.DataFrame:
    """The learning curve as a table with the columns :data:`COLUMNS`."""
    import pandas as pd

    table = pd.DataFrame(checkpoint.curve, columns=list(checkpoint.columns))
    whole: dict[str, type[np.int64]] = {"steps": np.int64, "episodes": np.int64}
    return table.astype({name: kind for name, kind in whole.items() if name in table})


def _tensorboard(folder: Path, steps: int) -> Any:
    """A writer of TensorBoard's logs; None where TensorBoard is not installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(str(folder / "tensorboard"), purge_step=steps or None)
