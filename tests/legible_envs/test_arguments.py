"""Bad arguments of environments and workspaces are refused by name, with the errors that are documented."""

import inspect
import math

import gymnasium as gym
import numpy as np
import pytest

from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.vector_env import OvercookedVectorEnv
from legible_envs.tabletop import TabletopWorkspace
from legible_envs.tabletop.env import TabletopEnv

BAD = {
    "text": "a",
    "none": None,
    "bool": True,
    "nan": math.nan,
    "inf": math.inf,
    "list": [],
    "dict": {"a": 1},
    "huge": 10**400,
    "unprintable": 10**10_000,
    "array": np.zeros((2, 2, 2)),
    "object": object(),
}

ALLOWED = {
    (OvercookedEnv, "shape"): {"none"},
    (OvercookedEnv, "layout"): {"none"},
    (OvercookedEnv, "layouts"): {"none"},
    (OvercookedEnv, "shaping"): {"bool"},
    (TabletopEnv, "shaping"): {"bool"},
    (OvercookedEnv, "render_mode"): {"none"},
    (OvercookedVectorEnv, "max_episode_steps"): {"none"},
    (OvercookedVectorEnv, "render_mode"): {"none"},
    (OvercookedWorkspace, "rationality"): {"none"},
    (OvercookedWorkspace, "horizon"): {"none"},
    (OvercookedWorkspace, "pots"): {"none"},
    (OvercookedWorkspace, "task"): {"none"},
    (OvercookedWorkspace, "ranked"): {"none"},
    (OvercookedWorkspace, "locked"): {"none"},
    (OvercookedWorkspace, "forbidden"): {"list"},
    (OvercookedWorkspace, "distinct_access"): {"bool"},
    (OvercookedWorkspace, "start_from"): {"none"},
    (OvercookedWorkspace, "cell_costs"): {"none"},
    (TabletopEnv, "layout"): {"none"},
    (TabletopEnv, "partner"): {"none"},
    (TabletopEnv, "predictor"): {"none"},
    (TabletopEnv, "render_mode"): {"none"},
    (TabletopWorkspace, "max_detour"): {"none"},
    (TabletopWorkspace, "obstacles_on_table"): {"bool"},
    (TabletopWorkspace, "obstacles_apart"): {"bool"},
    (TabletopWorkspace, "ranked"): {"none"},
    (TabletopWorkspace, "start_from"): {"none"},
}
"""What of the above an argument may be."""

CONTENTS = {
    (OvercookedEnv, "layout"): (LayoutError, "row 0, column 0|genome"),
    (OvercookedWorkspace, "locked"): (LayoutError, "cannot lock 'a'"),
    (OvercookedWorkspace, "task"): (TaskError, "the task has missing keys"),
    (OvercookedWorkspace, "start_from"): (LayoutError, "row 0, column 0"),
    (TabletopEnv, "task"): (TaskError, "no task 'a'|the task has missing keys"),
    (TabletopEnv, "layout"): (LayoutError, "not valid JSON|a layout with `schema`|genome"),
    (TabletopEnv, "predictor"): (ValueError, "no predictor named 'a'"),
    (TabletopWorkspace, "task"): (TaskError, "no task 'a'|the task has missing keys"),
    (TabletopWorkspace, "start_from"): (LayoutError, "a layout with `schema`"),
}
"""Descriptions of a layout, task or predictor that have the right type: the error says what is wrong in them."""

TYPES = {(TabletopEnv, "partner"), (TabletopEnv, "predictor")}
"""Objects without the methods are a TypeError, as documented."""

ARGUMENTS = [
    pytest.param(made, name, id=f"{made.__name__}-{name}")
    for made in (OvercookedEnv, OvercookedVectorEnv, OvercookedWorkspace, TabletopEnv, TabletopWorkspace)
    for name, parameter in inspect.signature(made).parameters.items()
    if parameter.kind is not inspect.Parameter.VAR_KEYWORD
]


@pytest.mark.parametrize(("made", "name"), ARGUMENTS)
def test_bad_values_of_every_kind_are_refused_by_name(made, name):
    others = {"human": "boltzmann"} if name in ("rationality", "horizon") else {}
    for kind, value in BAD.items():
        if kind in ALLOWED.get((made, name), ()):
            made(**others, **{name: value})
            continue
        documented = (ValueError, TypeError) if (made, name) in TYPES else ValueError
        with pytest.raises(documented) as refusal:
            made(**others, **{name: value})
        if f"`{name}`" not in str(refusal.value):
            assert (made, name) in CONTENTS, f"{kind}: {refusal.value}"
            error, message = CONTENTS[made, name]
            assert isinstance(refusal.value, error), kind
            assert refusal.match(message), kind


RANDOM = {"kind": "random"}

INSIDE = {
    "a side": lambda bad: (OvercookedEnv, {"shape": (7, bad)}, "shape"),
    "a side of a workspace": lambda bad: (OvercookedWorkspace, {"shape": (bad, 7)}, "shape"),
    "a recipe": lambda bad: (OvercookedEnv, {"recipes": [bad]}, "recipes"),
    "an ingredient": lambda bad: (OvercookedEnv, {"recipes": [[bad]]}, "recipes"),
    "a reward": lambda bad: (OvercookedEnv, {"shaping": {"dish": bad}}, "shaping"),
    "a weight": lambda bad: (TabletopEnv, {"shaping": {"taking": bad}}, "shaping"),
    "a fraction": lambda bad: (OvercookedWorkspace, {"prefix": (0.5, bad)}, "prefix"),
    "a fraction on a table": lambda bad: (TabletopWorkspace, {"prefix": [bad]}, "prefix"),
    "a cell": lambda bad: (OvercookedWorkspace, {"forbidden": [bad]}, "forbidden"),
    "a row": lambda bad: (OvercookedWorkspace, {"forbidden": [(bad, 1)]}, "forbidden"),
    "a locked cell": lambda bad: (OvercookedWorkspace, {"locked": {"pot": bad}}, "locked"),
    "a locked column": lambda bad: (OvercookedWorkspace, {"locked": {"pot": (0, bad)}}, "locked"),
    "a station": lambda bad: (OvercookedWorkspace, {"stations": ["pot", bad]}, "stations"),
    "a ranked station": lambda bad: (OvercookedWorkspace, {"ranked": [bad]}, "ranked"),
    "a ranked object": lambda bad: (TabletopWorkspace, {"ranked": [bad]}, "ranked"),
    "a cost": lambda bad: (OvercookedWorkspace, {"cell_costs": [[bad]]}, "cell_costs"),
    "a length": lambda bad: (TabletopWorkspace, {"obstacle_size": (0.3, bad)}, "obstacle_size"),
    "a threshold": lambda bad: (TabletopEnv, {"partner": {"threshold": bad}}, "threshold"),
    "a rate": lambda bad: (TabletopEnv, {"partner": {"rate": bad}}, "rate"),
    "an obstacle rate": lambda bad: (
        OvercookedEnv,
        {"layouts": {"kind": "random", "obstacle_rate": bad}},
        "obstacle_rate",
    ),
    "a test fraction": lambda bad: (
        OvercookedEnv,
        {"layouts": RANDOM | {"test_fraction": bad}},
        "test_fraction",
    ),
    "a split": lambda bad: (OvercookedEnv, {"layouts": RANDOM | {"split": bad}}, "split"),
    "a seed": lambda bad: (OvercookedEnv, {"layouts": RANDOM | {"layout_seed": bad}}, "layout_seed"),
    "a distribution's shape": lambda bad: (OvercookedEnv, {"layouts": RANDOM | {"shape": bad}}, "shape"),
    "a key": lambda bad: (OvercookedEnv, {"layouts": RANDOM | {str(bad): 1}}, "layouts"),
}


@pytest.mark.parametrize("case", INSIDE.values(), ids=INSIDE)
@pytest.mark.parametrize("bad", ["a", None, True, math.nan, math.inf, [], {"a": 1}, 10**400 + 1], ids=repr)
def test_bad_values_inside_an_argument_name_it(case, bad):
    made, arguments, name = case(bad)
    if name == "layout_seed" and bad == 10**400 + 1:
        assert made(**arguments).settings.distribution.layout_seed == bad
        return
    with pytest.raises(ValueError, match=f"`{name}`"):
        made(**arguments)


@pytest.mark.parametrize(
    "arguments", [{"shape": 7}, {"recipes": None}, {"recipes": 5}, {"crossing_cost": "a"}], ids=str
)
def test_the_same_through_gymnasium(arguments):
    (name,) = arguments
    with pytest.raises(ValueError, match=f"`{name}`"):
        gym.make("LegibleOvercooked-v0", **arguments)


def test_numbers_of_numpy_mean_the_same():
    kitchen = OvercookedEnv(shape=np.array([7, 7]), cook_time=np.int16(5), crossing_cost=np.float32(0.5))
    assert kitchen.settings.shape == (7, 7)
    assert type(kitchen.settings.rules.cook_time) is int
    assert OvercookedEnv(shape=(7.0, 7), cook_time=20.0).settings.rules.cook_time == 20
    table = TabletopWorkspace(max_obstacles=np.int64(2), beta=np.float64(10), step_sd=np.float32(0.5))
    assert table.to_config() == TabletopWorkspace(max_obstacles=2, beta=10, step_sd=0.5).to_config()
    assert repr(table.to_config()) == repr(TabletopWorkspace(max_obstacles=2, beta=10, step_sd=0.5).to_config())
    workspace = OvercookedWorkspace(np.array([6, 7]), pots=np.int8(1), c=np.int32(2), relocation_cost=np.float64(1))
    assert repr(workspace.to_config()) == repr(OvercookedWorkspace((6, 7), pots=1, c=2, relocation_cost=1).to_config())
