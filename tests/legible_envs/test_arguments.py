"""Bad arguments of environments and workspaces are refused by name, with the errors that are documented."""

import inspect
import math

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.vector_env import OvercookedVectorEnv
from legible_envs.tabletop import TabletopWorkspace
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.vector_env import TabletopVectorEnv

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
    (OvercookedEnv, "partner"): {"none"},
    (OvercookedEnv, "predictor"): {"none"},
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
    (TabletopVectorEnv, "max_episode_steps"): {"none"},
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
    (OvercookedWorkspace, "task"): (TaskError, "the task has the unknown key"),
    (OvercookedWorkspace, "start_from"): (LayoutError, "row 0, column 0"),
    (TabletopEnv, "task"): (TaskError, "no task 'a'|the task has the unknown key"),
    (TabletopEnv, "layout"): (LayoutError, "not valid JSON|the layout has the unknown key|genome"),
    (TabletopEnv, "predictor"): (ValueError, "no predictor named 'a'"),
    (TabletopWorkspace, "task"): (TaskError, "no task 'a'|the task has the unknown key"),
    (TabletopWorkspace, "start_from"): (LayoutError, "the layout has the unknown key"),
}
"""Descriptions of a layout, task or predictor that have the right type: the error says what is wrong in them."""

TYPES = {(OvercookedEnv, "partner"), (TabletopEnv, "partner"), (TabletopEnv, "predictor")}
"""Objects without the methods are a TypeError, as documented."""

CONSTRUCTORS = (
    OvercookedEnv,
    OvercookedVectorEnv,
    OvercookedWorkspace,
    TabletopEnv,
    TabletopVectorEnv,
    TabletopWorkspace,
)

ARGUMENTS = [
    pytest.param(made, name, id=f"{made.__name__}-{name}")
    for made in CONSTRUCTORS
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


# -- step and reset of every environment, single and batched -----------------------------------------------------------

MASKED = np.ma.array([1, 2, 3], mask=[True, False, False])


class Unreadable:
    """What numpy cannot make an array of."""

    def __array__(self, dtype=None, copy=None):
        raise TypeError("no array")

    def __repr__(self):
        raise RuntimeError("no text")


STRANGE = {
    **BAD,
    "empty text": "",
    "bytes": b"ab",
    "complex": 1 + 2j,
    "negative": -1,
    "too large": 6,
    "fraction": 0.5,
    "masked": MASKED,
    "masked scalar": np.ma.masked,
    "masked numbers": np.ma.array([0.1, 0.2], mask=[True, False]),
    "ragged": [[1], [2, 3]],
    "nested": [[1, 2], [3, 4]],
    "huge numbers": [10**400, 0.0],
    "nans": [math.nan, 0.0],
    "texts": ["1", "2"],
    "digits": "12",
    "objects": np.array([None, object()]),
    "dates": np.array(["2024-01-01", "2024-01-02"], dtype="datetime64[D]"),
    "set": {1, 2},
    "generator": (each for each in ()),
    "class": int,
    "function": len,
    "layout of nothing": np.zeros((0, 0)),
    "structured": np.zeros(2, dtype=[("a", float), ("b", float)]),
    "unreadable": Unreadable(),
}
"""Values of every kind that somebody may hand over by mistake."""

KITCHEN, TABLE = "LegibleOvercooked-v0", "LegibleTabletop-v0"


def single(name):
    return gym.make(name, disable_env_checker=True).unwrapped


MADE = {
    "kitchen": lambda: single(KITCHEN),
    "table": lambda: single(TABLE),
    "kitchens": lambda: gym.make_vec(KITCHEN, num_envs=3),
    "tables": lambda: gym.make_vec(TABLE, num_envs=3),
}
STILL = {"kitchen": 4, "table": np.zeros(2), "kitchens": np.full(3, 4), "tables": np.zeros((3, 2))}


@pytest.fixture(params=MADE)
def played(request):
    """An environment in mid-episode, a twin of it, and an action that does nothing."""
    envs = [MADE[request.param]() for _ in range(2)]
    for each in envs:
        each.reset(seed=0)
        each.step(STILL[request.param])
    return *envs, STILL[request.param]


def assert_same_game(env, twin, still):
    """What was refused has changed nothing: the episode, and all later ones, go on alike."""
    for results in ((env.step(still), twin.step(still)), (env.reset(), twin.reset())):
        assert data_equivalence(*results, exact=True)
    assert data_equivalence(env.step(still), twin.step(still), exact=True)
    rngs = [each.np_random if isinstance(each.np_random, tuple) else (each.np_random,) for each in (env, twin)]
    assert [rng.random() for rng in rngs[0]] == [rng.random() for rng in rngs[1]]


@pytest.mark.filterwarnings("error")
def test_strange_actions_are_refused_by_name(played):
    env, twin, still = played
    for kind, value in STRANGE.items():
        for action in (value, [value] * 3):
            with pytest.raises(ValueError, match="action") as refusal:
                env.step(action)
            assert len(str(refusal.value)) < 400, kind
    assert_same_game(env, twin, still)


@pytest.mark.parametrize("key", ["layout", "start", "goal", "reset_mask", "colour", 5, None])
def test_strange_options_are_refused_by_name(played, key):
    env, twin, still = played
    for kind, value in STRANGE.items():
        if value is None and key in ("layout", "start", "goal"):
            continue  # the environment's own
        # What is wrong in a layout of which form is told by the tests of layouts.
        error, message = (LayoutError, r".") if key == "layout" else (ValueError, rf"{key}|expected")
        with pytest.raises(error, match=message) as refusal:
            env.reset(seed=3, options={key: value})
        assert len(str(refusal.value)) < 500, kind
    assert_same_game(env, twin, still)


def test_options_that_are_no_mapping_are_refused(played):
    env, twin, still = played
    for value in STRANGE.values():
        if value is not None:
            with pytest.raises(ValueError, match=r"`options` must be None or a mapping|unknown reset options"):
                env.reset(options=value)
    assert_same_game(env, twin, still)


def test_strange_seeds_are_refused_as_gymnasium_does(played):
    env, twin, still = played
    for kind, value in STRANGE.items():
        if value is None or (isinstance(value, int) and value >= 0):
            continue  # also True, 6 and 10**400: Gymnasium takes them
        with pytest.raises((ValueError, gym.error.Error), match=r"[Ss]eed|integer"):
            env.reset(seed=value)
        assert kind
    assert_same_game(env, twin, still)


def test_layouts_set_between_episodes_are_checked_too(played):
    env, twin, still = played
    is_batch = hasattr(env, "num_envs")
    for value in STRANGE.values():
        if value is not None:
            with pytest.raises((LayoutError, ValueError)):
                env.set_attr("layout", value) if is_batch else setattr(env, "layout", value)
    assert_same_game(env, twin, still)


@pytest.mark.parametrize("name", MADE)
def test_nothing_is_done_before_the_first_reset(name):
    env = MADE[name]()
    for call in (lambda: env.step(STILL[name]), *([env.action_masks] if hasattr(env, "action_masks") else [])):
        with pytest.raises(gym.error.ResetNeeded, match=r"before calling envs?\.reset\(\)"):
            call()
    env.reset(seed=0)
    env.step(STILL[name])


def test_actions_in_every_honest_form_mean_the_same():
    kitchen, table = single(KITCHEN), single(TABLE)
    kitchen.reset(seed=0)
    table.reset(seed=0)
    for action in (2, np.int8(2), np.uint64(2), 2.0, np.float32(2), np.array(2), np.array([2]), np.array(2.0)):
        kitchen.reset()
        assert np.array_equal(kitchen.step(action)[0], (kitchen.reset(), kitchen.step(2))[1][0])
    for action in (
        [0.5, 0],
        (0.5, 0.0),
        np.array([0.5, 0]),
        np.array([0.5, 0], dtype=np.float16),
        [np.float32(0.5), 0],
    ):
        table.reset()
        assert np.array_equal(table.step(action)[0], (table.reset(), table.step(np.array([0.5, 0.0])))[1][0])
