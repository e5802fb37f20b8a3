"""Policies for kitchens, called with ``(observation, info)``: a scripted player, and simulated participants at play."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.players import MAX_PLAYERS
from legible_envs.overcooked.game.vectors import (
    AT_PLAYERS,
    HEIGHT,
    INTERACT,
    NUM_PLAYERS,
    SOFT,
    STAY,
    WIDTH,
    Kitchen,
    Vector,
)
from legible_envs.overcooked.grid_kernels import costs_to, neighbour, steps_from
from legible_envs.overcooked.humans.kernels import GoalField, choose_action, choose_step, look_around
from legible_envs.overcooked.layout import FLOOR, OBSTACLE
from legible_envs.support.validation import integer

if TYPE_CHECKING:
    from legible_envs.overcooked.humans.walker import Walker

__all__ = ["ScriptedPlayer", "WalkingPlayer"]

Flags = npt.NDArray[np.bool_]


class ScriptedPlayer:
    """Walks to a valid goal drawn uniformly, by a shortest path, uses it, and draws the next.

    At every cell each step along a shortest path is equally likely. Soft virtual obstacles are avoided where another
    path leads to the goal (see ``avoid_obstacles``). Reads the game from the environment, so it plays with every
    ``obs_type``, under wrappers, and in vector environments.

    In a game of several players it gives way: who cannot step on a cell because somebody else is there, or wants to be,
    goes away from them for a few steps every other time, and who has no goal strolls about. Two who walk by shortest
    paths would else block each other for ever.

    Args:
        env: An environment made by ``gymnasium.make("LegibleOvercooked-v0")``, or a vector environment of such.
        rng: Source of all randomness.
        avoid_obstacles: Whether to walk round soft virtual obstacles.
        player: Which player of a game of several it is; the answer is this player's action alone.
        gives_way: Whether to give way to other players.

    Example:
        >>> import gymnasium as gym, legible_envs, numpy as np
        >>> env = gym.make("LegibleOvercooked-v0")
        >>> player = ScriptedPlayer(env, np.random.default_rng(0))
        >>> obs, info = env.reset(seed=0)
        >>> over = False
        >>> while not over:
        ...     obs, reward, terminated, truncated, info = env.step(player(obs, info))
        ...     over = terminated or truncated
        >>> info["deliveries"]
        3
    """

    def __init__(
        self,
        env: Any,
        rng: np.random.Generator,
        *,
        avoid_obstacles: bool = True,
        player: int = 0,
        gives_way: bool = True,
    ) -> None:
        self.env = env
        self.rng = rng
        self.avoid_obstacles = avoid_obstacles
        self.player = integer("player", player, 0, MAX_PLAYERS - 1)
        self.gives_way = gives_way
        self.num_envs: int | None = getattr(env.unwrapped, "num_envs", None)
        count = self.num_envs or 1
        self._height = self._width = 1
        self._goals = [-1] * count
        self._layout_ids = [-1] * count
        self._floors: list[tuple[Flags, Flags] | None] = [None] * count
        self._steps: list[npt.NDArray[np.int32] | None] = [None] * count
        self._last: list[tuple[int, int]] = [(-1, STAY)] * count
        self._retreat = [0] * count

    def __call__(self, obs: Any, info: dict[str, Any]) -> Any:
        """The next action, an integer; for a vector environment ``(N,)`` integers.

        Args:
            obs: The observation; not needed, taken so that every policy is called alike.
            info: The info returned with it.

        Raises:
            ValueError: An info of kitchens of another shape.
        """
        if self.num_envs is None:
            goals, actions = self._own(info["goal_mask"], 2), self._own(info["action_mask"], 1)
            return self._act(0, self.env.unwrapped.arrays(), goals, actions, info["layout_id"])
        arrays = self.env.call("arrays")
        keys = ("goal_mask", "action_mask", "layout_id")
        masks = [[info[key][i] for key in keys] for i in range(self.num_envs)]
        return np.array(
            [self._act(i, arrays[i], self._own(g, 2), self._own(a, 1), n) for i, (g, a, n) in enumerate(masks)]
        )

    def _own(self, mask: npt.NDArray[Any], dimensions: int) -> npt.NDArray[Any]:
        """This player's mask, of one of several players or the only one."""
        if np.ndim(mask) <= dimensions:
            return mask
        if self.player >= len(mask):
            raise ValueError(f"`info` is of {len(mask)} players; there is no player {self.player}")
        return mask[self.player]  # type: ignore[no-any-return]

    def goal(self, index: int = 0) -> tuple[int, int] | None:
        """``(row, col)`` of the goal that the player walks to in a game, None between goals."""
        return None if self._goals[index] < 0 else divmod(self._goals[index], self._width)

    def _has_goal(self, index: int, goal_mask: npt.NDArray[np.bool_], layout_id: int) -> bool:
        """Whether there is a goal to walk to; if the last one is no longer valid, another is drawn."""
        if layout_id != self._layout_ids[index]:
            self._layout_ids[index] = layout_id
            self._floors[index] = None
            self._goals[index] = -1
        marked = goal_mask.ravel()
        if self._goals[index] >= 0 and marked[self._goals[index]]:
            return True
        choices = np.flatnonzero(marked)
        if not len(choices):
            return False
        self._goals[index] = int(self.rng.choice(choices))
        self._forget_path(index)
        return True

    def _forget_path(self, index: int) -> None:
        """The goal of a game is a new one."""
        self._steps[index] = None

    def _act(
        self,
        index: int,
        arrays: tuple[Vector, Kitchen, Vector],
        goal_mask: npt.NDArray[np.bool_],
        action_mask: npt.NDArray[np.int8],
        layout_id: int,
    ) -> int:
        shape = int(arrays[2][HEIGHT]), int(arrays[2][WIDTH])
        if np.shape(goal_mask) != shape:
            raise ValueError(
                f"`info` is of another environment: its goal_mask has shape {np.shape(goal_mask)}, the kitchen {shape}"
            )
        if self.player >= int(arrays[2][NUM_PLAYERS]):
            raise ValueError(f"there is no player {self.player} in a game of {int(arrays[2][NUM_PLAYERS])}")
        has_goal = self._has_goal(index, goal_mask, layout_id)
        action = -1
        if int(arrays[2][NUM_PLAYERS]) > 1 and self.gives_way:
            action = self._go_away(index, arrays, idle=not has_goal)
        if action < 0 and not has_goal:
            return STAY
        if action < 0:
            action = self._approach(index, arrays, bool(action_mask[INTERACT]))
        if action == INTERACT:
            self._goals[index] = -1
        self._last[index] = self._place(arrays)[0], action
        return action

    def _place(self, arrays: tuple[Vector, Kitchen, Vector]) -> tuple[int, int]:
        """The cell this player stands on, and the facing."""
        at = AT_PLAYERS + 3 * self.player
        return int(arrays[0][at]), int(arrays[0][at + 1])

    def _go_away(self, index: int, arrays: tuple[Vector, Kitchen, Vector], idle: bool) -> int:
        """A step away from the other players, where one is due; else -1.

        It is due every other time to a player who was kept from the last step. One who has no goal strolls about, so as
        not to stand for good where somebody else has to be.
        """
        state, kitchen, rules = arrays
        cell = self._place(arrays)[0]
        floor = self._find_floors(index, kitchen, rules)[1]
        others = np.delete(state[AT_PLAYERS : AT_PLAYERS + 3 * rules[NUM_PLAYERS] : 3].astype(np.int64), self.player)
        beside = [int(neighbour(cell, direction, self._height, self._width)) for direction in range(4)]
        before, action = self._last[index]
        kept = before == cell and action < STAY and beside[action] >= 0 and bool(floor[beside[action]])
        if self._retreat[index] == 0 and kept and self.rng.random() < 0.5:
            self._retreat[index] = int(self.rng.integers(1, self._height + self._width))
        strolls = idle and self._retreat[index] == 0 and self.rng.random() < 0.5
        if self._retreat[index] == 0 and not strolls:
            return -1
        free = [d for d, after in enumerate(beside) if after >= 0 and floor[after] and after not in others]
        if not strolls:
            self._retreat[index] -= 1
            away = np.empty(len(floor), dtype=np.int32)
            steps_from(others, floor, self._height, self._width, away)
            most = max((int(away[beside[d]]) for d in free), default=-1)
            free = [d for d in free if away[beside[d]] == most]
        return int(self.rng.choice(free)) if free else STAY

    def _approach(self, index: int, arrays: tuple[Vector, Kitchen, Vector], can_interact: bool) -> int:
        """The next action on the path to a game's goal; INTERACT uses it."""
        _, kitchen, rules = arrays
        cell, facing = self._place(arrays)
        goal, steps = self._goals[index], self._steps[index]
        if steps is None or steps[cell] < 0:
            steps = self._steps[index] = self._find_steps(index, cell, kitchen, rules)
        return int(choose_action(cell, facing, goal, steps, self._height, self._width, can_interact, self.rng.random()))

    def _find_steps(self, index: int, cell: int, kitchen: Kitchen, rules: Vector) -> npt.NDArray[np.int32]:
        """``(H*W,)`` fewest moves from the goal's cell, over obstacles only where no other path leads."""
        floors = self._find_floors(index, kitchen, rules)
        goal, steps = np.array([self._goals[index]]), np.empty(self._height * self._width, dtype=np.int32)
        for floor in floors if self.avoid_obstacles else floors[1:]:
            steps_from(goal, floor, self._height, self._width, steps)
            if steps[cell] >= 0:
                break
        return steps

    def _find_floors(self, index: int, kitchen: Kitchen, rules: Vector) -> tuple[Flags, Flags]:
        """``(H*W,)`` where the player can stand off virtual obstacles, and where at all."""
        found = self._floors[index]
        if found is None:
            self._height, self._width = int(rules[HEIGHT]), int(rules[WIDTH])
            codes = kitchen[: self._height * self._width]
            clear = codes == FLOOR
            found = self._floors[index] = clear, (clear | (codes == OBSTACLE)) if rules[SOFT] else clear
        return found


class WalkingPlayer(ScriptedPlayer):
    """Walks to a valid goal drawn uniformly as the walker does, uses it, and draws the next.

    Idles and looks around as often as the walker does. Soft virtual obstacles are avoided where another path leads to
    the goal.

    Args:
        env: An environment made by ``gymnasium.make("LegibleOvercooked-v0")``, or a vector environment of such.
        walker: How the person walks.
        rng: Source of all randomness.
        player: Which player of a game of several it is.
        gives_way: Whether to give way to other players.

    Example:
        >>> import gymnasium as gym, legible_envs, numpy as np
        >>> from legible_envs.overcooked.humans import BoltzmannWalker
        >>> env = gym.make("LegibleOvercooked-v0", max_episode_steps=5000)
        >>> player = WalkingPlayer(env, BoltzmannWalker(rationality=1.3), np.random.default_rng(0))
        >>> obs, info = env.reset(seed=0)
        >>> over = False
        >>> while not over:
        ...     obs, reward, terminated, truncated, info = env.step(player(obs, info))
        ...     over = terminated or truncated
        >>> info["deliveries"]
        3
    """

    def __init__(
        self, env: Any, walker: Walker, rng: np.random.Generator, *, player: int = 0, gives_way: bool = True
    ) -> None:
        super().__init__(env, rng, player=player, gives_way=gives_way)
        self.walker = walker
        self._paths: list[_Path | None] = [None] * len(self._goals)

    def _forget_path(self, index: int) -> None:
        self._paths[index] = None

    def _approach(self, index: int, arrays: tuple[Vector, Kitchen, Vector], can_interact: bool) -> int:
        _, kitchen, rules = arrays
        cell, facing = self._place(arrays)
        path = self._paths[index]
        if path is None or not path.leads_from(cell):
            floors = self._find_floors(index, kitchen, rules)
            path = self._paths[index] = _Path(
                self.walker, cell, self._goals[index], floors, (self._height, self._width)
            )
        u = self.rng.random()
        if u < self.walker.idle:
            return STAY
        if u < self.walker.idle + self.walker.turn:
            towards = path.look_around(cell, self.rng.random())
            return STAY if towards < 0 else towards
        direction = path.next_direction(cell, self.walker, self.rng)
        if neighbour(cell, direction, self._height, self._width) != self._goals[index] or facing != direction:
            return direction
        return INTERACT if can_interact else STAY


class _Path:
    """One person's path to one goal in a running game, and the last decision on it."""

    def __init__(
        self, walker: Walker, cell: int, goal: int, floors: tuple[Flags, Flags], shape: tuple[int, int]
    ) -> None:
        height, width = shape
        self._open = floors[1]
        self._memory = np.zeros(height * width)
        self._weights = np.empty(4)
        self._heading = -1
        self._decided: tuple[int, int] | None = None
        costs = walker.costs(shape).ravel()
        cost_to_go = np.empty(height * width)
        for floor in floors:
            costs_to(goal, floor, costs, height, width, cost_to_go)
            self.field = GoalField(height, width, floor, costs, goal, cost_to_go)
            # Standing on an obstacle, or shut in by them, the only path leads across.
            if self.leads_from(cell):
                break

    def leads_from(self, cell: int) -> bool:
        return bool(self.field.cost_to_go[cell] < np.inf)

    def look_around(self, cell: int, u: float) -> int:
        return int(look_around(cell, self.field.height, self.field.width, self._open, u))

    def next_direction(self, cell: int, walker: Walker, rng: np.random.Generator) -> int:
        """Decide once at each cell: a person who turns to the goal uses it without another decision."""
        if self._decided is None or self._decided[0] != cell:
            if self._decided is not None:
                self._heading = self._decided[1]
            if not self.leads_from(cell):
                return STAY
            direction = choose_step(
                walker.kind, walker.params, cell, self._heading, self.field, self._memory, rng.random(), self._weights
            )
            self._decided = cell, int(direction)
        return self._decided[1]
