"""The design of a workspace as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded

from legible_envs.design_game.edits import KEEP, Edits
from legible_envs.design_game.observations import GenomeFeatures, GridWorkspace, grid_planes, grid_space, standing
from legible_envs.design_game.problem import DesignProblem, as_numbers, read_workspace
from legible_envs.drawing.rendered import Rendered
from legible_envs.errors import LayoutError
from legible_envs.support.per_env import own_entry
from legible_envs.support.plugins import import_target, target_of
from legible_envs.support.specs import JsonSpec, check_options
from legible_envs.support.validation import choice, integer, is_integer, real, shown
from legible_envs.workspace import Workspace

__all__ = ["DesignEnv"]


class DesignEnv(JsonSpec, Rendered, gym.Env[npt.NDArray[np.float32], Any]):
    """A designer edits a layout step by step, and is paid by how much better each edit makes it.

    ## Description

    The other environments here ask how people move in a layout; this one asks which layout. An episode starts in a
    random valid layout of a workspace (a kitchen, a table, or that of another package), and every step is one edit of
    it: a station moves, two swap places, a virtual obstacle appears or goes. The reward is the change of the exact
    objective, by default legibility (Eq. 3 of Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to
    Improve Prediction of Human Motion During Human-Robot Collaboration*, HRI 2024): how early an observer can tell the
    person's goals. After a fixed number of edits the design is finished.

    Layouts are only ever looked at through the contract of :class:`~legible_envs.workspace.Workspace`, so that any
    plug-in works: bounds and type of its genomes give the edits, its `valid` the mask, its `objective` the reward.

    ## Action Space

    With `actions="discrete"` (default) a `Discrete(A)`; the edits in this order:

    | Edits | How many | Effect |
    | ----- | -------- | ------ |
    | 0     | 1        | keep the layout |
    | set   | one per gene and value, or one per gene of two values | give the gene this value (two values: the other one) |
    | swap  | one per two whole-numbered genes of equal bounds and more than two values | swap their values |

    In a 7 x 7 kitchen these are 187: keep; 7 stations times 20 places; 25 cells that are or are not a virtual obstacle;
    21 swaps of two stations. On a table each coordinate is set to one of `levels` values between its bounds.
    `env.unwrapped.edits` holds them as arrays and `env.unwrapped.edits.describe(action)` says one in words.

    `info["action_mask"]` marks the edits that lead to *another valid* layout, and 0, which keeps it: they are exact, and
    found by one call of the workspace's `valid` for all edits (no layout is scored for them, unless there is a
    `max_distance`). `env.unwrapped.action_masks()` gives the same as bool, as `MaskablePPO` of sb3-contrib asks for it.
    An edit that is not marked can be taken all the same: it changes nothing, earns 0, uses up an edit, and
    `info["num_refused"]` counts it. So does an edit to a layout that the objective does not allow (NaN).

    With `actions="continuous"` a `Box(-1, 1, (m,))`: steps of `m` random keys in [0, 1], each of at most `step`. The keys
    are those of the workspace's `continuous()`, in which every vector stands for a valid layout; nothing is refused
    but what the objective does not allow.

    ## Observation Space

    With `obs_type="grid"` (default where the workspace offers `cells`, as kitchens do, and actions are discrete) a `Box`
    of `float32` and shape `(H, W, C + 2)`: for a kitchen a plane each for floor, counter, virtual obstacle and the seven
    stations, so that neighbourhood, which decides paths, is neighbourhood in the array and a small convolution can use
    it; then two planes that are the same on all cells, of the share of edits left and of the objective.

    With `obs_type="vector"` a `Box` of `float32` and shape `(n + 2,)` for small networks: every whole-numbered gene
    one-hot, in the order of the edits (the number of a slot says which, not how much), genes of two values as 0 or 1,
    real ones as a share of their range; with continuous actions the `m` keys instead. Then the two numbers.

    The share of edits left is 1 at first and 0 at the end. The objective is given in tens of standard deviations above
    the mean of random layouts (256 of them, drawn with a fixed seed), clipped to [-1, 1].

    ## Rewards

    The objective after the edit less the objective before it. So the rewards of an episode sum up to what the design has
    gained, `objective(last) - objective(first)`, and an undiscounted return is highest where the last layout is.

    ## Starting State

    The layout of an episode is, first match first: the one in `reset(options={"layout": ...})` or set by
    `env.unwrapped.layout = ...` (from the next reset on), which stays until replaced (by None: until then as if never
    set); the one given as `layout`; a random one, `workspace.sample(1, rng)`. A workspace that starts from an existing
    layout (`start_from`) samples that one first: so does every episode then.

    ## Episode End

    The episode terminates after `edits` edits. The share of edits left is observed, so that this is an end and no cut.

    ## Information

    Every `reset` and `step` returns fresh numbers and arrays of fixed shape:

    | Key           | Content |
    | ------------- | ------- |
    | `action_mask` | `(A,)` int8: edits that lead to another valid layout, and 0; with discrete actions only |
    | `genome`      | `(d,)` the layout as a genome; `env.unwrapped.workspace.decode(genome)` makes it a layout |
    | `objective`   | float: its objective |
    | `best`        | float: the best objective in this episode so far; `env.unwrapped.best_genome` is the layout |
    | `num_done`    | int: edits used up in this episode |
    | `num_refused` | int: those of them that were refused |

    ## Vectors

    `gymnasium.make_vec` makes vectors with `vectorization_mode="sync"` or `"async"`. `reset(options={"layout": ...})`
    takes one layout for all environments, or a list or `(n, d)` array of genomes with one for each; None among them
    keeps the one there is.

    ## Arguments

    Args:
        workspace: The design problem: a name (`"overcooked"`, `"tabletop"`, or that of an installed or registered
            plug-in), `"module:Class"`, a configuration such as `{"workspace": "tabletop", "condition": "both"}`, or a
            `Workspace`. The environment's spec stays JSON.
        objective: What is maximised: `"legibility"`, `"efficiency"`, `"legible-efficient"` or another name that the
            workspace knows; `"module:function"`; or a callable from `(n, d)` genomes to `(n,)` numbers, NaN where a
            layout is not allowed.
        max_distance: Layouts whose expected distance over one task is longer are not allowed; the mask knows. It costs
            a score of every valid edit at every step. None means no cap.
        edits: Edits of an episode; None: as many as there are genes that can change.
        actions: `"discrete"` or `"continuous"`.
        levels: Values that a real-numbered gene can be set to by discrete actions.
        step: Largest step of a key by continuous actions, as a share of its range.
        layout: The layout that episodes start from: one of the workspace, its text, or a genome; None: a random one.
        obs_type: `"grid"` or `"vector"`; None: `"grid"` where there is one.
        render_mode: None, `"human"` (a window), `"rgb_array"` or `"ansi"`.
        **settings: Further settings of a workspace given by name, such as `shape=(7, 7)`.

    Raises:
        LayoutError: A layout that cannot be read, breaks a rule, or has no score; or no random layout has one.
        ValueError: Any other bad argument, options of `reset` or actions.
        ResetNeeded: `step` before the first `reset`.

    ## Version History

    * v0: first version.
    """  # noqa: E501

    metadata = {"render_modes": ["human", "rgb_array", "ansi"], "render_fps": 4}  # noqa: RUF012
    _window_title = "Legible design"

    def __init__(
        self,
        *,
        workspace: str | Mapping[str, Any] | Workspace = "overcooked",
        objective: str | Callable[[npt.NDArray[Any]], npt.NDArray[np.float64]] = "legibility",
        max_distance: float | None = None,
        edits: int | None = None,
        actions: str = "discrete",
        levels: int = 15,
        step: float = 0.1,
        layout: Any = None,
        obs_type: str | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self._set_render_mode(render_mode)
        self.workspace = read_workspace(workspace, settings)
        self.problem = DesignProblem(self.workspace, objective, max_distance)
        is_discrete = choice("actions", actions, ("discrete", "continuous")) == "discrete"
        self.edits = Edits(self.workspace, levels)
        self._step_size = real("step", step, 0, 1, closed="right")
        self._keys = None if is_discrete else self.workspace.continuous()
        self.num_edits = self._budget(edits)
        self.action_space: spaces.Space[Any] = spaces.Discrete(self.edits.size)
        if self._keys is not None:
            self.action_space = spaces.Box(-1.0, 1.0, (self._keys.solution_dim,), dtype=np.float32)
        self._features = GenomeFeatures(self.workspace)
        self.obs_type = self._checked_obs_type(obs_type)
        self.observation_space: spaces.Space[Any] = self._observed_space()
        self._own = None if layout is None else self.problem.read(layout)
        self._chosen: npt.NDArray[Any] | None = None
        self._begun = False
        self._used = self._refused = 0
        self._genome = self._best_genome = np.zeros(self.workspace.genome_size, dtype=self.workspace.genome_dtype)
        self._score = self._best = 0.0
        self._mask = np.ones(0, dtype=np.bool_)
        self._vector = np.zeros(0)

    def _budget(self, edits: int | None) -> int:
        if edits is not None:
            return integer("edits", edits, 1, also="None")
        return max(1, int((np.asarray(self.workspace.upper_bounds) > np.asarray(self.workspace.lower_bounds)).sum()))

    def _checked_obs_type(self, obs_type: str | None) -> str:
        offers_grid = isinstance(self.workspace, GridWorkspace)
        if obs_type is None:
            return "grid" if offers_grid and self._keys is None else "vector"
        if choice("obs_type", obs_type, ("grid", "vector"), also="None") == "grid" and not offers_grid:
            raise ValueError(
                f"`obs_type` 'grid' needs a workspace with `cells`, which {type(self.workspace).__name__} has not; "
                "expected 'vector'"
            )
        return obs_type

    def _observed_space(self) -> spaces.Box:
        if self.obs_type == "grid":
            return grid_space(self.workspace)  # type: ignore[arg-type]
        size = self._features.size if self._keys is None else self._keys.solution_dim
        low = np.zeros(size + 2, dtype=np.float32)
        low[-1] = -1.0
        return spaces.Box(low, np.ones_like(low), dtype=np.float32)

    # -- the Gymnasium interface --------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the environment's generator; None goes on with the one there is.
            options: ``{"layout": …}`` starts from another layout from now on; None as its value returns to the
                environment's own. In a vector, a list or array of layouts holds one per environment.

        Returns:
            ``(observation, info)``.

        Raises:
            LayoutError: A bad layout; the environment goes on as if it had not been asked.
            ValueError: Options that are no mapping, or unknown keys; likewise.
            gymnasium.error.Error: A seed that is no whole number >= 0; likewise.
        """
        asked = check_options(options)
        chosen = self._read(asked["layout"]) if "layout" in asked else self._chosen
        super().reset(seed=seed)
        self._chosen = chosen
        start = self._chosen if self._chosen is not None else self._own
        if start is None:
            self._genome, self._score = self.problem.start(self.np_random)
        else:
            self._genome, self._score = start, float(self.problem.scores(start[None])[0])
        if self._keys is not None:
            self._vector = np.array(self._keys.encode(self._genome))
        self._best_genome, self._best = self._genome, self._score
        self._used = self._refused = 0
        self._begun = True
        self._look()
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._info()

    def step(self, action: Any) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Make one edit.

        Args:
            action: The number of an edit; with continuous actions ``(m,)`` numbers, those beyond -1 and 1 counting as
                the nearer of them.

        Returns:
            ``(observation, reward, terminated, truncated, info)``. After the end of an episode nothing is edited any
            more, and the reward is 0.

        Raises:
            ResetNeeded: Before the first reset.
            ValueError: The action is none.
        """
        if not self._begun:
            raise ResetNeeded("Cannot call env.step() before calling env.reset()")
        before = self._score
        if self._keys is None:
            self._edit(self._read_edit(action))
        else:
            self._move(self._read_step(action))
        self._used = min(self._used + 1, self.num_edits)
        if self._score > self._best:
            self._best_genome, self._best = self._genome, self._score
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._score - before, self._used >= self.num_edits, False, self._info()

    def _edit(self, action: int) -> None:
        """Take a discrete edit, unless the rules, the budget or the objective forbid it."""
        if self._used >= self.num_edits or action == KEEP:
            return
        if not self._mask[action] or not self._enter(self.edits.apply(self._genome[None], np.array([action]))):
            self._refused += 1
            return
        self._look()

    def _move(self, change: npt.NDArray[np.float64]) -> None:
        """Take a step in keys, unless the budget or the objective forbid it."""
        assert self._keys is not None
        if self._used >= self.num_edits:
            return
        keys = np.clip(self._vector + self._step_size * change, 0.0, 1.0)
        if not self._enter(self._keys.decode(keys[None])):
            self._refused += 1
            return
        self._vector = keys

    def _enter(self, genomes: npt.NDArray[Any]) -> bool:
        """Make ``(1, d)`` the layout, if it has a score."""
        score = float(self.problem.scores(genomes)[0])
        if np.isnan(score):
            return False
        self._genome, self._score = genomes[0], score
        return True

    def _look(self) -> None:
        """Find the edits that may be made now."""
        if self._keys is None:
            self._mask = self.edits.masks(self._genome[None], self.problem.allowed)[0]

    def _read_edit(self, action: Any) -> int:
        if isinstance(action, np.ndarray) and action.ndim == 0:
            action = action[()]
        if not is_integer(action) or not 0 <= action < self.edits.size:
            raise ValueError(f"an action must be an integer from 0 to {self.edits.size - 1}, got {shown(action)}")
        return int(action)

    def _read_step(self, action: Any) -> npt.NDArray[np.float64]:
        numbers, shape = as_numbers(action), self.action_space.shape
        if numbers is None or numbers.shape != shape or not np.isfinite(numbers).all():
            raise ValueError(f"an action must be finite numbers of shape {shape}, got {shown(action)}")
        return np.clip(numbers.astype(np.float64), -1.0, 1.0)

    def _observe(self) -> npt.NDArray[np.float32]:
        stands = standing(1.0 - self._used / self.num_edits, self._score, self.problem.scale)
        if self.obs_type == "grid":
            return grid_planes(self.workspace, self._genome, stands)  # type: ignore[arg-type]
        layout = self._features(self._genome[None])[0] if self._keys is None else self._vector.astype(np.float32)
        return np.concatenate([layout, stands])

    def _info(self) -> dict[str, Any]:
        return {
            **({"action_mask": self._mask.astype(np.int8)} if self._keys is None else {}),
            "genome": self._genome.copy(),
            "objective": self._score,
            "best": self._best,
            "num_done": self._used,
            "num_refused": self._refused,
        }

    @property
    def action_masks(self) -> Callable[[], npt.NDArray[np.bool_]]:
        """A function without arguments: ``(A,)`` edits that lead to another valid layout, and the one that keeps it.

        The name is the one that ``MaskablePPO`` of sb3-contrib calls; ``info["action_mask"]`` says the same as int8.

        Raises:
            AttributeError: Actions are continuous: no mask.
        """
        if self._keys is not None:
            raise AttributeError("continuous actions have no masks")
        return self._action_masks

    def _action_masks(self) -> npt.NDArray[np.bool_]:
        if not self._begun:
            raise ResetNeeded("Cannot call env.action_masks() before calling env.reset()")
        return self._mask.copy()

    # -- layouts -------------------------------------------------------------------------------------------------------

    @property
    def layout(self) -> Any:
        """The layout set for the next reset, else the one that is edited; None where there is neither yet."""
        if self._chosen is not None:
            return self.workspace.decode(self._chosen)
        if self._begun:
            return self.workspace.decode(self._genome)
        return None if self._own is None else self.workspace.decode(self._own)

    @layout.setter
    def layout(self, value: Any) -> None:
        self._chosen = self._read(value)

    @property
    def best_genome(self) -> npt.NDArray[Any]:
        """``(d,)`` the best layout of this episode so far, its first one included."""
        return self._best_genome.copy()

    def _read(self, value: Any) -> npt.NDArray[Any] | None:
        """The genome that is asked for; None for the environment's own."""
        entries = self.problem.entries(value)
        if entries is not None:
            value = own_entry("layout", entries, self, partial(LayoutError, rule="count"))
            if value is None:
                return self._chosen
        return None if value is None else self.problem.read(value)

    # -- pictures and the spec -----------------------------------------------------------------------------------------

    def _status(self) -> str:
        return f"edit {self._used} of {self.num_edits}, {self.problem.objective_name} {self._score:.2f}"

    def _picture(self) -> npt.NDArray[np.uint8]:
        from legible_envs.drawing.sheets import banner

        return banner(self.workspace.draw(self._genome), self._status(), 36)

    def render(self) -> Any:
        """See :meth:`.Rendered.render`; with ``"ansi"``, the layout as text."""
        if self.render_mode == "ansi":
            return f"{self.workspace.text(self._genome)}\n{self._status()}"
        return super().render()

    @property
    def spec(self) -> EnvSpec | None:
        """How the environment was made, as ``gymnasium.make`` can repeat it: layouts as genomes, functions by name."""
        return self._spec

    @spec.setter
    def spec(self, value: EnvSpec | None) -> None:
        JsonSpec.spec.fset(self, value)  # type: ignore[attr-defined]
        if self._spec is None:
            return
        if self._own is not None:
            self._spec.kwargs["layout"] = self._own.tolist()
        objective = self._spec.kwargs.get("objective")
        if objective is not None and not isinstance(objective, str):
            self._spec.kwargs["objective"] = _named(objective)


def _named(function: Any) -> Any:
    """A function as ``"module:function"`` where that imports it, else itself."""
    target = target_of(function)
    try:
        return target if import_target(target) is function else function
    except (ImportError, AttributeError, ValueError):
        return function
