"""Tables and people that the tests of simulated participants share."""

from __future__ import annotations

import numpy as np

from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle

COLUMNS = TabletopTask.named("columns")
HOME = COLUMNS.layout.table.starts["home"]


def random_tables(count: int, seed: int = 0, obstacles: int = 4) -> list[TabletopLayout]:
    """Valid tables with a few objects and obstacles anywhere."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        objects = [TableObject(name, (rng.uniform(0.1, 0.8), rng.uniform(0.2, 0.7))) for name in ("a", "b", "c", "d")]
        walls = [
            VirtualObstacle((rng.uniform(0.1, 1.1), rng.uniform(0.1, 0.7)), rng.uniform(0, np.pi))
            for _ in range(obstacles)
        ]
        layout = TabletopLayout(objects, walls)
        if layout.is_valid():
            found.append(layout)
    return found


def detour() -> TabletopLayout:
    """One object behind one wall, which is passed at one corner, twice where it is passed on both sides."""
    return TabletopLayout([TableObject("cup", (0.6, 0.5))], [VirtualObstacle((0.62, 0.3))])
