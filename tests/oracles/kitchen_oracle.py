"""The game again, in plain Python with sets and dictionaries: slow, obvious, and written apart from the kernels."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.overcooked import PAPER_SOUPS, OvercookedLayout
from legible_envs.overcooked.game.dynamics import start
from legible_envs.overcooked.game.rules import GameRules, pack_kitchen, pack_rules
from legible_envs.overcooked.game.snapshot import make_view
from legible_envs.overcooked.game.vectors import STATE_SIZE

MOVES = ((-1, 0), (1, 0), (0, 1), (0, -1))
STATIONS = {"T": "tomato", "O": "onion", "C": "cabbage", "F": "fish", "D": "dish"}
INGREDIENTS = ("tomato", "onion", "cabbage", "fish")


class Pot:
    def __init__(self):
        self.contents, self.ticks, self.order = Counter(), 0, None


class OracleGame:
    """Items are ``"onion"``, ``"dish"`` or ``("soup", order)``."""

    def __init__(self, layout: OvercookedLayout, recipes=PAPER_SOUPS, cook_time=20, soft=False, players=1):
        self.rows = [[" " if s.isdigit() else s for s in line] for line in layout.to_ascii().split("\n")]
        self.recipes = [Counter(recipe) for recipe in recipes]
        self.cook_time, self.soft = cook_time, soft
        self.cells, self.facing, self.held = list(layout.starts[:players]), [0] * players, [None] * players
        self.counters, self.claimed, self.delivered = {}, set(), set()
        self.pots = {cell: Pot() for cell, symbol in self.all_cells() if symbol == "P"}
        self.crossings = 0

    def all_cells(self):
        return [((r, c), symbol) for r, line in enumerate(self.rows) for c, symbol in enumerate(line)]

    def symbol(self, cell):
        inside = 0 <= cell[0] < len(self.rows) and 0 <= cell[1] < len(self.rows[0])
        return self.rows[cell[0]][cell[1]] if inside else "outside"

    def free(self, cell):
        return self.symbol(cell) == " " or (self.soft and self.symbol(cell) == "V")

    def accepts(self, pot, item):
        """Whether pots and orders could still be paired if the item were in the pot: every pairing is tried."""
        if pot.order is not None:
            return False
        contents = [pot.contents + Counter([item])]
        contents += [p.contents for p in self.pots.values() if p is not pot and p.order is None and p.contents]
        orders = [i for i in range(len(self.recipes)) if i not in self.claimed | self.delivered]
        return any(
            all(c <= self.recipes[i] for c, i in zip(contents, chosen, strict=True))
            for chosen in itertools.permutations(orders, len(contents))
        )

    def interact(self, player):
        (row, col), (dr, dc) = self.cells[player], MOVES[self.facing[player]]
        cell, held = (row + dr, col + dc), self.held[player]
        symbol = self.symbol(cell)
        if symbol == "X":
            item = self.counters.get(cell)
            if held is None and item is not None:
                self.held[player] = self.counters.pop(cell)
            elif held is not None and item is None:
                self.counters[cell], self.held[player] = held, None
        elif symbol in STATIONS:
            if held is None:
                self.held[player] = STATIONS[symbol]
            elif held == STATIONS[symbol]:
                self.held[player] = None
        elif symbol == "P":
            pot = self.pots[cell]
            if held in INGREDIENTS and self.accepts(pot, held):
                pot.contents[held] += 1
                self.held[player] = None
                whole = [
                    i
                    for i, recipe in enumerate(self.recipes)
                    if recipe == pot.contents and i not in self.claimed | self.delivered
                ]
                if whole:
                    pot.order = whole[0]
                    self.claimed.add(whole[0])
            elif held == "dish" and pot.order is not None and pot.ticks >= self.cook_time:
                self.held[player] = ("soup", pot.order)
                self.pots[cell] = Pot()
        elif symbol == "S" and isinstance(held, tuple):
            self.held[player] = None
            self.claimed.remove(held[1])
            self.delivered.add(held[1])
            return 20.0
        return 0.0

    def step(self, actions):
        reward = sum(self.interact(player) for player, action in enumerate(actions) if action == 5)
        targets = []
        for player, action in enumerate(actions):
            target = self.cells[player]
            if action < 4:
                self.facing[player] = action
                ahead = (target[0] + MOVES[action][0], target[1] + MOVES[action][1])
                target = ahead if self.free(ahead) else target
            targets.append(target)
        while True:
            clashes = [
                (a, b)
                for a, b in itertools.combinations(range(len(targets)), 2)
                if targets[a] == targets[b] or (targets[a] == self.cells[b] and targets[b] == self.cells[a])
            ]
            stuck = {player for pair in clashes for player in pair if targets[player] != self.cells[player]}
            if not stuck:
                break
            for player in stuck:
                targets[player] = self.cells[player]
        for player, target in enumerate(targets):
            self.crossings += target != self.cells[player] and self.symbol(target) == "V"
        self.cells = targets
        for pot in self.pots.values():
            if pot.order is not None:
                pot.ticks = min(pot.ticks + 1, self.cook_time)
        return reward

    @property
    def over(self):
        return len(self.delivered) == len(self.recipes)

    def reachable(self, player=0):
        """Every cell beside one the player can walk to."""
        seen, queue = {self.cells[player]}, [self.cells[player]]
        beside = set()
        while queue:
            row, col = queue.pop()
            for dr, dc in MOVES:
                cell = (row + dr, col + dc)
                beside.add(cell)
                if self.free(cell) and cell not in seen:
                    seen.add(cell)
                    queue.append(cell)
        return {cell for cell in beside if self.symbol(cell) != "outside"}

    def goals(self, player=0):
        """Cells where an interaction brings the game forward, from the words of the documentation."""
        if self.over:
            return set()
        near, held = self.reachable(player), self.held[player]
        in_use = set().union(*(self.reachable(other) for other in range(len(self.cells))))
        pots = [pot for cell, pot in self.pots.items() if cell in in_use]  # what one cannot bring, another is handed
        stations = {cell: STATIONS[s] for cell, s in self.all_cells() if s in STATIONS}
        if held is None:
            wanted = {item for item in INGREDIENTS if any(self.accepts(pot, item) for pot in pots)}
            dishes_held_elsewhere = sum(h == "dish" for other, h in enumerate(self.held) if other != player)
            if sum(pot.order is not None for pot in pots) > dishes_held_elsewhere:
                wanted.add("dish")
            found = {cell for cell, item in stations.items() if item in wanted}
            found |= {cell for cell, item in self.counters.items() if item in wanted or isinstance(item, tuple)}
        elif isinstance(held, tuple):
            found = {cell for cell, symbol in self.all_cells() if symbol == "S"}
        else:
            found = {
                cell
                for cell, pot in self.pots.items()
                if (pot.order is not None if held == "dish" else self.accepts(pot, held))
            } & near
            if not found:
                found = {cell for cell, item in stations.items() if item == held}
                found |= {cell for cell, symbol in self.all_cells() if symbol == "X" and cell not in self.counters}
        return found & near

    def facts(self):
        """Everything that changes, comparable with :func:`facts_of`."""
        return {
            "players": list(zip(self.cells, self.facing, [self.named(held) for held in self.held], strict=True)),
            "counters": {cell: self.named(item) for cell, item in self.counters.items()},
            "pots": {
                cell: (tuple(sorted(pot.contents.elements())), pot.ticks, pot.order is not None)
                for cell, pot in self.pots.items()
            },
            "delivered": sorted(tuple(sorted(self.recipes[i].elements())) for i in self.delivered),
            "crossings": self.crossings,
        }

    def named(self, item):
        return ("soup", tuple(sorted(self.recipes[item[1]].elements()))) if isinstance(item, tuple) else item


class KernelGame:
    """The same game played by the kernels, without any environment around them."""

    def __init__(self, layout, recipes=PAPER_SOUPS, cook_time=20, soft=False, players=1):
        self.layout = layout
        self.game = GameRules(recipes=recipes, cook_time=cook_time, soft_obstacles=soft)
        self.rules = pack_rules(self.game, layout.shape, players, len(layout.named("pot")))
        self.kitchen = pack_kitchen(layout, self.rules)
        self.state = np.zeros(int(self.rules[STATE_SIZE]), dtype=np.int32)
        start(self.state, self.kitchen, self.rules)

    def facts(self):
        view = make_view(self.layout, self.state, self.rules, self.game)

        def named(item):
            if item is None:
                return None
            return ("soup", tuple(sorted(item.contents))) if item.kind == "soup" else item.kind

        return {
            "players": [(p.cell, p.facing, named(p.held)) for p in view.players],
            "counters": {cell: named(item) for cell, item in view.counters.items()},
            "pots": {
                cell: (tuple(sorted(pot.contents)), pot.ticks, pot.is_cooking or pot.is_ready)
                for cell, pot in view.pots.items()
            },
            "delivered": sorted(tuple(sorted(recipe)) for recipe in view.delivered),
            "crossings": view.crossings,
        }


def any_kitchen(rng: np.random.Generator, players: int = 1, kinds: str = "TOCFDPS", soft: bool = False):
    """A random kitchen that no design rule restrains: floor on the border, repeated stations, stations inside.

    All stations named in ``kinds`` can be reached from the first player's start.
    """
    while True:
        shape = tuple(int(side) for side in rng.integers(4, 9, size=2))
        rows = rng.choice(list(" " * 12 + "XXXV"), size=shape)
        border = np.ones(shape, dtype=bool)
        border[1:-1, 1:-1] = False
        rows[border] = rng.choice(list("XXXXX "), size=int(border.sum()))
        spots = rng.permutation(rows.size)
        for spot, kind in zip(spots, kinds + "".join(rng.choice(list(kinds), size=3)), strict=False):
            rows.flat[spot] = kind
        floor = np.flatnonzero(rows == " ")
        if len(floor) < players:
            continue
        for number, cell in enumerate(rng.choice(floor, size=players, replace=False), 1):
            rows.flat[cell] = str(number)
        try:
            layout = OvercookedLayout.from_rows(rows.tolist())
        except LayoutError:
            continue
        game = OracleGame(layout, players=players, soft=soft)
        if set(kinds) <= {game.symbol(cell) for cell in game.reachable()}:
            return layout


__all__ = ["KernelGame", "OracleGame", "any_kitchen"]
