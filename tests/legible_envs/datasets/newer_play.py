"""Random play by the rules of 2020 (or of 2019), written down as Overcooked-AI has published it since 2020.

The game is simulated on the published notation itself, apart from the package's arrays and rules.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

STEPS = ([0, -1], [0, 1], [1, 0], [-1, 0])
ROOM = ["XXPXX", "O   O", "X   X", "XDXSX"]
DINER = ["XXPXPXX", "T     O", "X X X X", "O     T", "XDXSXDX"]
NOOK = ["XPOX", "D  S", "T  X", "XXXX"]
TIMES = {"onion": 4, "tomato": 3}


def play(grid: Sequence[str], ticks: int, seed: int, *, by_hand: bool = True) -> list[dict[str, Any]]:
    """``ticks`` states with the joint action and the reward of each."""
    rng = np.random.default_rng(seed)
    floor = [[x, y] for y, row in enumerate(grid) for x, cell in enumerate(row) if cell == " "]
    spots = rng.permutation(len(floor))[:2]
    state: dict[str, Any] = {
        "players": [{"position": floor[i], "orientation": [0, -1], "held_object": None} for i in spots],
        "objects": [],
        "bonus_orders": [],
        "all_orders": [{"ingredients": ["onion"] * 3}],
        "timestep": 0,
    }
    found = []
    for _ in range(ticks):
        actions = [
            "interact" if rng.random() < 0.45 else list((*STEPS, [0, 0])[int(rng.integers(5))]) for _ in range(2)
        ]
        after, reward = step(grid, state, actions, by_hand)
        found.append({"state": state, "joint_action": actions, "reward": reward})
        state = after
    return found


def step(
    grid: Sequence[str], state: dict[str, Any], actions: Sequence[Any], by_hand: bool
) -> tuple[dict[str, Any], int]:
    """The state that follows, and the reward."""
    state, reward = copy.deepcopy(state), 0
    for player, action in zip(state["players"], actions, strict=True):
        if action == "interact":
            reward += interact(grid, state, player, by_hand)
    old = [player["position"] for player in state["players"]]
    new = []
    for player, action in zip(state["players"], actions, strict=True):
        x, y = player["position"]
        if action != "interact" and action != [0, 0]:
            player["orientation"] = action
            x, y = x + action[0], y + action[1]
            x, y = (x, y) if grid[y][x] == " " else player["position"]
        new.append([x, y])
    if new[0] == new[1] or (new[0] == old[1] and new[1] == old[0]):
        new = old
    for player, position in zip(state["players"], new, strict=True):
        player["position"] = position
        if player["held_object"]:
            place(player["held_object"], position)
    for soup in state["objects"]:
        if soup["name"] == "soup" and grid[soup["position"][1]][soup["position"][0]] == "P":
            if not by_hand and soup["is_idle"] and len(soup["_ingredients"]) == 3:
                begin(soup)
            if soup["is_cooking"]:
                set_tick(soup, soup["_cooking_tick"] + 1)
    state["timestep"] += 1
    return state, reward


def interact(grid: Sequence[str], state: dict[str, Any], player: dict[str, Any], by_hand: bool) -> int:
    target = [a + b for a, b in zip(player["position"], player["orientation"], strict=True)]
    kind, held = grid[target[1]][target[0]], player["held_object"]
    there = next((each for each in state["objects"] if each["position"] == target), None)
    if kind == "X":
        if held and there is None:
            state["objects"].append(place(held, target))
            player["held_object"] = None
        elif not held and there is not None:
            state["objects"].remove(there)
            player["held_object"] = place(there, player["position"])
    elif kind in "OTD" and not held:
        player["held_object"] = {
            "name": {"O": "onion", "T": "tomato", "D": "dish"}[kind],
            "position": player["position"],
        }
    elif kind == "P" and not held:
        if by_hand and there is not None and there["is_idle"]:
            begin(there)
    elif kind == "P" and held["name"] == "dish":
        if there is not None and there["is_ready"]:
            state["objects"].remove(there)
            player["held_object"] = place(there, player["position"])
    elif kind == "P" and held["name"] in TIMES:
        if there is None:
            there = {"name": "soup", "position": target, "_ingredients": []}
            set_tick(there, -1)
            state["objects"].append(there)
        if there["is_idle"] and len(there["_ingredients"]) < 3:
            there["_ingredients"].append(place(held, target))
            player["held_object"] = None
    elif kind == "S" and held and held["name"] == "soup":
        player["held_object"] = None
        return 20
    return 0


def place(item: dict[str, Any], position: list[int]) -> dict[str, Any]:
    item["position"] = list(position)
    for part in item.get("_ingredients", ()):
        part["position"] = list(position)
    return item


def begin(soup: dict[str, Any]) -> None:
    soup["cook_time"] = sum(TIMES[part["name"]] for part in soup["_ingredients"])
    set_tick(soup, 0)


def set_tick(soup: dict[str, Any], tick: int) -> None:
    time = soup.setdefault("cook_time", -1)
    is_ready = tick >= 0 and tick >= time
    soup.update(
        _cooking_tick=tick,
        cooking_tick=tick,
        is_idle=tick < 0,
        is_ready=is_ready,
        is_cooking=tick >= 0 and not is_ready,
    )


def table(games: Sequence[tuple[str, str, Sequence[str], list[dict[str, Any]]]]) -> dict[str, list[Any]]:
    """Columns of games ``(name of the kitchen, trial, grid, ticks)`` as published."""
    columns: dict[str, list[Any]] = {}
    for name, trial, grid, ticks in games:
        score = 0
        for number, tick in enumerate(ticks):
            score += tick["reward"]
            row = {
                "state": json.dumps(tick["state"]),
                "joint_action": json.dumps(tick["joint_action"]),
                "reward": tick["reward"],
                "time_left": 60.0 - 0.15 * number,
                "score": score,
                "time_elapsed": 0.15 * number,
                "cur_gameloop": number + 1,
                "layout": json.dumps([list(row) for row in grid]),
                "layout_name": name,
                "trial_id": trial,
                "player_0_id": f"a{trial}",
                "player_1_id": f"b{trial}",
                "player_0_is_human": True,
                "player_1_is_human": True,
            }
            for key, value in row.items():
                columns.setdefault(key, []).append(value)
    return columns


def episodes(games: Sequence[tuple[str, str, Sequence[str], list[dict[str, Any]]]]) -> dict[str, Any]:
    """The same games as a trajectory file."""
    return {
        "ep_states": [[tick["state"] for tick in ticks] for *_, ticks in games],
        "ep_actions": [[tick["joint_action"] for tick in ticks] for *_, ticks in games],
        "ep_rewards": [[tick["reward"] for tick in ticks] for *_, ticks in games],
        "ep_dones": [[False] * len(ticks) for *_, ticks in games],
        "mdp_params": [{"layout_name": name, "terrain": [list(row) for row in grid]} for name, _, grid, _ in games],
    }
