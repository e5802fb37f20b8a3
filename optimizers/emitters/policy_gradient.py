"""Design by reinforcement learning: a policy that edits layouts learns from what its edits gained (PPO)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.design_game.edits import KEEP, Edits
from legible_envs.design_game.observations import GenomeFeatures
from legible_envs.support.validation import integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import AddInfo, Seed, WorkspaceEmitter
from optimizers.emitters.draws import draw_elites

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

    from optimizers.emitters.policy_learning import Learner

__all__ = ["PolicyGradientEmitter"]

MOST_FEATURES: Final = 2**28
"""Numbers of all layouts that edits of one episode could lead to: a gibibyte, if all edits were valid."""


class PolicyGradientEmitter(WorkspaceEmitter):
    """A designer that learns: proximal policy optimisation on the edits of ``LegibleDesign-v0``; needs PyTorch.

    ``designs`` layouts, drawn from the archive's best, are edited side by side: at every ``ask`` a neural policy picks
    one valid edit for each (:class:`~legible_envs.design_game.edits.Edits`; masks come from the workspace's ``valid``)
    by comparing the layouts that the edits lead to, which takes no score of them. The edited layouts are what is
    proposed. ``tell`` turns scores into rewards, the change of the objective. After ``horizon`` edits the policy takes
    some gradient steps on the clipped surrogate of Schulman et al. (*Proximal policy optimization algorithms*, 2017)
    with generalised advantages, and other layouts are drawn. So every evaluation is a layout that the policy went to,
    and archive, budget and checkpoints are those of any other search.

    Rewards are divided by the median change of score in the first episodes, so that the emitter knows nothing of the
    unit of the objective. A layout without a score is not entered: the design stays where it was, for a reward of 0.

    Args:
        archive: Archive of the search.
        workspace: The design problem; must offer ``sample`` and ``valid``.
        designs: Layouts edited side by side.
        horizon: Edits of each, after which the policy learns and other layouts are drawn.
        best: Designs start from this share of the archive's elites, the best ones; 1 draws from all.
        levels: Values that a gene of real numbers can be set to.
        hidden: Units of each of the two hidden layers.
        learning_rate: Of Adam.
        epochs: Passes over the edits of an update.
        minibatch: Edits of a gradient step.
        clip: Most that the probability of an edit gains by, as a share, before its gradient is cut off.
        discount: Of rewards, per edit. By default every edit is for its own gain: with some ten thousand evaluations
            nothing was learned from the noise of later ones.
        trace: Of generalised advantages (lambda); without a discount it makes no difference.
        entropy: Weight of the policy's entropy in the loss.
        initial: Random layouts proposed while the archive is empty.
        seed: Seed of everything random: elites, edits, the first weights, and the order of learning.

    Attributes:
        updates: How often the policy has learned.

    Raises:
        ImportError: PyTorch is not installed.
        ValueError: Another argument is out of range.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        designs: int = 32,
        horizon: int = 16,
        best: float = 0.1,
        levels: int = 15,
        hidden: int = 64,
        learning_rate: float = 3e-3,
        epochs: int = 4,
        minibatch: int = 128,
        clip: float = 0.2,
        discount: float = 0.0,
        trace: float = 0.0,
        entropy: float = 0.003,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        integers(1, MOST_GENOMES, designs=designs, horizon=horizon, minibatch=minibatch, initial=initial)
        integers(1, hidden=hidden, epochs=epochs)
        real("learning_rate", learning_rate, 0, closed="neither")
        real("clip", clip, 0, 1, closed="neither")
        for name, value in (("discount", discount), ("trace", trace)):
            real(name, value, 0, 1)
        real("entropy", entropy, 0)
        real("best", best, 0, 1, closed="right")
        super().__init__(archive, workspace, seed=seed)
        self._edits, self._features = Edits(workspace, levels), GenomeFeatures(workspace)
        room = int(designs) * int(horizon) * self._edits.size * (self._features.size + 1)
        if room > MOST_FEATURES:
            raise ValueError(
                f"`designs` times `horizon` make episodes of up to {room:,} numbers in this workspace; expected "
                f"at most {MOST_FEATURES:,}"
            )
        self._settings = {
            "designs": int(designs),
            "horizon": int(horizon),
            "best": float(best),
            "hidden": int(hidden),
            "learning_rate": float(learning_rate),
            "epochs": int(epochs),
            "minibatch": int(minibatch),
            "clip": float(clip),
            "discount": float(discount),
            "trace": float(trace),
            "entropy": float(entropy),
        }
        self._learner = self._make_learner()
        self._initial = int(initial)
        self.updates = 0
        # One row per design: where it stands, and what that scores.
        self._genomes = self._blank_genomes(int(designs))
        self._scores = np.zeros(int(designs))
        self._episode: list[dict[str, npt.NDArray[Any]]] = []
        self._unit: float | None = None
        self._asked = False

    def _make_learner(self) -> Learner:
        try:
            from optimizers.emitters.policy_learning import Learner
        except ModuleNotFoundError as error:
            raise ImportError(
                'the emitter "ppo" needs PyTorch, which is not installed: pip install "legible-envs[torch]"'
            ) from error
        known = ("hidden", "learning_rate", "epochs", "minibatch", "clip", "entropy")
        settings: dict[str, Any] = {name: self._settings[name] for name in known}
        return Learner(self._features.size + 1, self._rng, **settings)

    @property
    def settings(self) -> dict[str, float]:
        """The settings in force, for the manifest of a run."""
        return dict(self._settings)

    def ask(self) -> npt.NDArray[Any]:
        """Propose what one edit of every design leads to: ``(designs, d)`` valid genomes."""
        self._asked = not self.archive.empty
        if not self._asked:
            return self._workspace.sample(self._initial, self._rng)
        if not self._episode:
            self._genomes, self._scores = self._starts()
        masks = self._masks()
        left = 1.0 - len(self._episode) / self._settings["horizon"]
        observed = self._observed(self._genomes, left)
        ahead = self._observed(self._edits.candidates(self._genomes)[masks], left)
        logs, values = self._learner.evaluate(observed, masks, ahead)
        # The largest of log-probabilities with Gumbel noise is a draw from them.
        actions = np.argmax(logs + self._rng.gumbel(size=logs.shape), axis=1)
        chosen = np.take_along_axis(logs, actions[:, None], axis=1)[:, 0]
        row = {"observed": observed, "masks": masks, "ahead": ahead}
        self._episode.append(row | {"actions": actions, "chosen": chosen, "values": values})
        return self._edits.apply(self._genomes, actions)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Go where the edits led, unless there is no score there; learn at the end of the episodes."""
        if not self._asked:
            return
        scores = np.asarray(objective, dtype=np.float64)
        entered = ~np.isnan(scores)
        self._episode[-1]["rewards"] = np.where(entered, scores - self._scores, 0.0)
        self._genomes = np.where(entered[:, None], np.asarray(solution), self._genomes).astype(self._genomes.dtype)
        self._scores = np.where(entered, scores, self._scores)
        if len(self._episode) == self._settings["horizon"]:
            self._learn()
            self._episode = []

    def _starts(self) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64]]:
        """``(designs, d)`` elites out of the best share of them, each equally likely, and their scores."""
        genomes, scores = draw_elites(self.archive, len(self.archive), self._rng, replace=False)
        count = max(1, round(self._settings["best"] * len(scores)))
        best = np.argsort(-scores, kind="stable")[:count]
        rows = best[self._rng.integers(count, size=len(self._scores))]
        return genomes[rows], scores[rows]

    def _observed(self, genomes: npt.NDArray[Any], left: float) -> npt.NDArray[np.float32]:
        """``(n, inputs)`` the layouts, and the share of edits that is left."""
        share = np.full((len(genomes), 1), left, dtype=np.float32)
        return np.concatenate([self._features(genomes), share], axis=1)

    def _masks(self) -> npt.NDArray[np.bool_]:
        """``(designs, A)`` valid edits; to keep the layout would score it again, so only where there is no other."""
        masks = self._edits.masks(self._genomes, self._workspace.valid)
        masks[:, KEEP] = masks.sum(axis=1) == 1
        return masks

    def _learn(self) -> None:
        """Update the policy with the episodes of all designs."""
        rewards, values = (np.stack([row[name] for row in self._episode]) for name in ("rewards", "values"))
        if self._unit is None:
            changes = np.abs(rewards[rewards != 0])
            self._unit = float(np.median(changes)) if changes.size else None
        advantages = _advantages(
            rewards / (self._unit or 1.0), values, self._settings["discount"], self._settings["trace"]
        )
        names = ("observed", "masks", "ahead", "actions", "chosen")
        batch = {name: np.concatenate([row[name] for row in self._episode]) for name in names}
        batch |= {"advantages": advantages.ravel(), "returns": (advantages + values).ravel()}
        self._learner.update(batch, self._rng)
        self.updates += 1


def _advantages(
    rewards: npt.NDArray[np.float64], values: npt.NDArray[np.float64], discount: float, trace: float
) -> npt.NDArray[np.float64]:
    """``(T, n)`` generalised advantages (Schulman et al., 2016) of episodes that end after ``T`` edits.

    Args:
        rewards: ``(T, n)``.
        values: ``(T, n)`` what each state was thought to be worth; the end is worth nothing.
        discount: Per edit.
        trace: Lambda.
    """
    advantages, ahead, later = np.zeros_like(rewards), np.zeros(rewards.shape[1]), np.zeros(rewards.shape[1])
    for step in range(len(rewards) - 1, -1, -1):
        surprise = rewards[step] + discount * later - values[step]
        ahead = surprise + discount * trace * ahead
        advantages[step], later = ahead, values[step]
    return advantages
