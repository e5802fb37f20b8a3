"""Drawings of tables: shapes, the same pixels every time, what must be told apart, and what ambiguity is."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.drawing.canvas import rgb
from legible_envs.legibility import posterior
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.game.view import TableView
from legible_envs.tabletop.rendering import (
    draw_configuration,
    draw_panels,
    draw_scene,
    draw_table,
    scene_shape,
)
from legible_envs.tabletop.rendering.ambiguity import ambiguous_reaches, points_along
from legible_envs.tabletop.rendering.frame import Frame
from legible_envs.tabletop.rendering.glyphs import GLYPHS, initial
from legible_envs.tabletop.rendering.palette import NAMED, TABLE, hex_of, ink_on
from legible_envs.tabletop.rendering.panels import stage_of

TASK = TabletopTask.named("columns")
TABLES = TASK.layout
WALLED = TABLES.with_obstacles([VirtualObstacle((0.45, 0.45), 1.2), VirtualObstacle((0.62, 0.28), 0.1)])


def patch(
    image: np.ndarray, layout: TabletopLayout, x: float, y: float, half: float = 0.02, above: int = 0
) -> np.ndarray:
    """The square of a picture round a point of the table."""
    frame = Frame.of(layout.table, image.shape[1])
    column, row = frame.pixel(x, y)
    reach = max(1, round(half * frame.scale))
    row += above
    return image[round(row) - reach : round(row) + reach, round(column) - reach : round(column) + reach]


def has(image: np.ndarray, colour: str, tolerance: int = 12) -> bool:
    """Whether a colour occurs in a picture."""
    return bool((np.abs(image.astype(int) - rgb(colour)).max(axis=-1) <= tolerance).any())


def at(**changes: object) -> TableView:
    return replace(TableView.at_rest(WALLED, TASK), **changes)  # type: ignore[arg-type]


def moved(name: str, status: str, **changes: object) -> TableView:
    i = TABLES.index(name)
    return at(status=tuple(status if k == i else "free" for k in range(8)), **changes)


# -- layouts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [120, 333, 640])
def test_a_table_is_drawn_to_scale(width: int) -> None:
    image = draw_table(WALLED, width=width)
    assert image.shape[1:] == (width, 3)
    frame = Frame.of(WALLED.table, width)
    assert image.shape[0] == frame.height
    (x0, y1), (x1, y0) = frame.pixel(0, 0), frame.pixel(1.2, 0.8)
    assert (x1 - x0) / (y1 - y0) == pytest.approx(1.5, rel=0.01)


@pytest.mark.parametrize("width", [119, 4097, 0, 640.0, True, "640", None])
def test_a_bad_width_is_named(width: object) -> None:
    for draw in (lambda: draw_table(TABLES, width=width), lambda: draw_scene(at(), width=width)):  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="`width` must be an integer from 120 to 4096 pixels"):
            draw()


def test_every_object_shows_its_colour_and_shape_where_it_lies() -> None:
    image = draw_table(TABLES, width=640)
    for thing in TABLES.objects:
        found = patch(image, TABLES, *thing.at)
        assert has(found, hex_of(thing.colour)), thing.name
        assert has(found, ink_on(hex_of(thing.colour))), thing.name


def test_shapes_of_one_colour_differ() -> None:
    shapes = [*GLYPHS, "ring", "bin", "moon", "umbrella"]
    seen = {}
    for shape in shapes:
        layout = TabletopLayout([TableObject("x", (0.45, 0.45), "blue", shape)])
        seen[shape] = patch(draw_table(layout, width=900), layout, 0.45, 0.45).astype(int)
    for i, a in enumerate(shapes):
        for b in shapes[:i]:
            assert np.abs(seen[a] - seen[b]).max() > 60, (a, b)
    assert [initial(shape) for shape in ("circle", "bin", "moon")] == ["", "", "M"]


def test_the_four_colours_of_the_columns_differ_in_grey_and_to_colour_blind_readers() -> None:
    def seen(colour: str) -> np.ndarray:  # deuteranopia, Machado et al. 2009
        light = (np.array(rgb(colour)) / 255) ** 2.2
        matrix = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
        return np.clip(np.array(matrix) @ light, 0, 1) ** (1 / 2.2) * 255

    names = ("red", "green", "blue", "yellow")
    for i, a in enumerate(names):
        for b in names[:i]:
            assert np.abs(seen(NAMED[a]) - seen(NAMED[b])).max() > 55, (a, b)


@pytest.mark.parametrize("colour", ["tomato", "#08f", "#0088ff", "rgb(0, 136, 255)", "hsl(208, 100%, 50%)", " Red "])
def test_any_css_colour_is_drawn(colour: str) -> None:
    layout = TabletopLayout([TableObject("x", (0.45, 0.45), colour, "star")])
    assert has(patch(draw_table(layout), layout, 0.45, 0.45), hex_of(colour))


def test_a_word_that_is_no_colour_names_its_object() -> None:
    layout = TabletopLayout([TableObject("spoon", (0.45, 0.45), "wooden", "star")])
    with pytest.raises(ValueError, match=r"spoon.*'wooden' is no CSS colour"):
        draw_table(layout)


def test_obstacles_are_cyan_with_red_edges_and_can_show_what_they_keep_free() -> None:
    image = draw_table(WALLED, width=720)
    found = patch(image, WALLED, 0.45, 0.45)
    assert has(found, TABLE["obstacle"])
    assert has(found, TABLE["obstacle_edge"], 40)
    assert not has(found, TABLE["grown"], 4)
    assert has(patch(draw_table(WALLED, width=720, grown=True), WALLED, 0.45, 0.45), TABLE["grown"], 4)
    assert not has(patch(draw_table(TABLES, width=720), TABLES, 0.45, 0.45), TABLE["obstacle"])


def test_slots_are_drawn_with_a_task_only() -> None:
    bare, full = draw_table(TABLES), draw_table(TABLES, task=TASK)
    for x, y in TASK.configuration.values():
        assert (patch(bare, TABLES, x, y) != patch(full, TABLES, x, y)).any()
    left = Frame.of(TABLES.table, 640).pixel(0.85, 0)[0]
    np.testing.assert_array_equal(bare[:, : int(left)], full[:, : int(left)])


@settings(max_examples=8, deadline=None)
@given(st.data())
def test_any_layout_is_drawn(data: st.DataObject) -> None:
    number = st.floats(-0.5, 1.7)
    point = st.tuples(number, number)
    size = st.tuples(st.floats(0.001, 0.4), st.floats(0.001, 0.4))
    words = st.sampled_from(["circle", "bin", "ring", "Ω", "star"])
    objects = [
        TableObject(str(i), data.draw(point), "teal", data.draw(words), data.draw(size), data.draw(number))
        for i in range(data.draw(st.integers(1, 3)))
    ]
    walls = [VirtualObstacle(data.draw(point), data.draw(number), data.draw(size)) for _ in range(2)]
    layout = TabletopLayout(objects, walls)
    assert draw_table(layout, width=120, grown=True).dtype == np.uint8


def test_every_call_returns_its_own_array_and_the_same_pixels() -> None:
    for draw in (lambda: draw_table(WALLED, task=TASK), lambda: draw_scene(at())):
        first = draw()
        kept = first.copy()
        first[:] = 0
        np.testing.assert_array_equal(draw(), kept)


def test_paths_labels_and_titles() -> None:
    plain = draw_table(WALLED)
    assert (draw_table(WALLED, paths="home") != plain).any()
    assert (draw_table(WALLED, paths=["home"]) != draw_table(WALLED, paths=True)).any()
    assert (draw_table(WALLED, labels={"red-circle": "mine"}) != plain).any()
    titled = draw_table(WALLED, title="A table")
    np.testing.assert_array_equal(titled[len(titled) - len(plain) :], plain)
    with pytest.raises(ValueError, match="red-square"):
        draw_table(WALLED, labels={"red-square": "?"})


# -- ambiguity ---------------------------------------------------------------------------------------------------------


def test_ambiguity_is_the_probability_that_eq_1_leaves_to_wrong_goals() -> None:
    """Against the definition, stage by stage, with straight lines where nothing is in the way."""
    found = {(r.start, r.goal): r for r in ambiguous_reaches(TABLES, TASK, pieces=7)}
    reach = found["assembly", "green-circle"]
    start, end = np.array(TABLES.place("assembly")), np.array(TABLES.place("green-circle"))
    np.testing.assert_allclose(reach.points, start + np.linspace(0, 1, 8)[:, None] * (end - start), atol=1e-12)
    total, weight = np.zeros(7), 0.0
    for stage in TASK.graph.stages():
        if stage.start != "assembly" or "green-circle" not in stage.goals:
            continue
        weight += stage.weight
        for k in range(7):
            at = start + (k + 0.5) / 7 * (end - start)
            rest = {g: float(np.hypot(*(at - TABLES.place(g)))) for g in stage.goals}
            whole = {g: float(np.hypot(*(start - TABLES.place(g)))) for g in stage.goals}
            total[k] += stage.weight * (1 - posterior(rest, whole, 20.0)["green-circle"])
    np.testing.assert_allclose(reach.ambiguity, total / weight, atol=1e-12)
    assert reach.weight == pytest.approx(weight)


def test_ambiguity_follows_shortest_paths() -> None:
    for reach in ambiguous_reaches(WALLED, TASK, pieces=200):
        length = np.hypot(*np.diff(reach.points, axis=0).T).sum()
        whole = WALLED.paths.lengths([WALLED.place(reach.start)])[0, WALLED.index(reach.goal)]
        assert length == pytest.approx(whole, rel=2e-3)
        assert ((reach.ambiguity >= -1e-12) & (reach.ambiguity <= 1)).all()


def test_points_lie_at_equal_distances_along_a_bent_path() -> None:
    points = points_along(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 3.0]]), 8)
    np.testing.assert_allclose(points[[0, 1, 2, 3, 8]], [[0, 0], [0.5, 0], [1, 0], [1, 0.5], [1, 3]])


def test_ambiguity_needs_a_task_and_adds_a_scale() -> None:
    with pytest.raises(ValueError, match="task="):
        draw_table(TABLES, ambiguity=True)
    with_scale = draw_table(TABLES, task=TASK, ambiguity=True, width=300)
    without = draw_table(TABLES, task=TASK, ambiguity=True, width=300, scale=False)
    np.testing.assert_array_equal(with_scale[: len(without)], without)
    assert len(with_scale) > len(without)
    assert (without != draw_table(TABLES, task=TASK, width=300)).any()


# -- tables in use -----------------------------------------------------------------------------------------------------


def test_the_shape_of_a_scene_does_not_depend_on_what_happens() -> None:
    busy = at(
        robot=np.array([0.5, 0.6]),
        robot_target="blue-circle",
        belief=dict.fromkeys(TABLES.goals, 0.125),
        threshold=0.8,
        time=12345.6,
        crossings=99,
        trail=np.random.default_rng(0).uniform(0, 1, (500, 2)),
    )
    for width in (120, 640):
        shapes = {draw_scene(view, width=width).shape for view in (at(), busy)}
        assert shapes == {scene_shape(busy, width=width)}
    assert draw_scene(at(), hud=False).shape == draw_table(WALLED).shape == scene_shape(at(), hud=False)


@pytest.mark.parametrize(
    "change",
    [
        {"hand": np.array([0.3, 0.4])},
        {"robot": np.array([0.5, 0.6])},
        {"trail": np.array([[0.6, 0.05], [0.4, 0.3]])},
        {"belief": {"red-circle": 0.3}},
        {"goal": "red-circle"},
        {"robot_target": "red-circle", "robot": np.array([0.5, 0.6])},
        {"goals": ("red-circle",)},
        {"angles": np.full(8, 0.5)},
        {"time": 3.0},
        {"crossings": 1},
        {"status": ("placed",) + ("free",) * 7},
    ],
)
def test_everything_a_view_says_is_seen(change: dict[str, object]) -> None:
    assert (draw_scene(at(**change)) != draw_scene(at())).any()


def test_belief_is_a_bar_as_long_as_the_probability_that_changes_at_the_threshold() -> None:
    def drawn(value: float, threshold: float | None = 0.8) -> np.ndarray:
        view = at(belief={"red-circle": value}, threshold=threshold)
        x, y = TABLES.place("red-circle")
        return patch(draw_scene(view, width=1200, hud=False), TABLES, x, y + 0.0405, 0.03)

    def filled(image: np.ndarray, colour: str) -> int:
        return int((np.abs(image.astype(int) - rgb(TABLE[colour])).max(axis=-1) == 0).any(axis=0).sum())

    lengths = [filled(drawn(value), "unsure") for value in (0.1, 0.3, 0.6)]
    assert lengths == pytest.approx([0.1 * 56, 0.3 * 56, 0.6 * 56], abs=2)
    assert filled(drawn(0.85), "sure") > 0
    assert filled(drawn(0.85), "unsure") == 0
    assert filled(drawn(0.85, None), "sure") == 0
    assert (drawn(0.2, 0.8) != drawn(0.2, 0.6)).any(), "the mark of the threshold"


def test_what_is_carried_moves_with_hand_or_gripper() -> None:
    hand, gripper = np.array([0.35, 0.6]), np.array([0.6, 0.65])
    held = moved("red-circle", "hand", holding="red-circle", hand=hand)
    image = draw_scene(held, hud=False)
    assert has(patch(image, TABLES, *hand), NAMED["red"])
    assert not has(patch(image, TABLES, *TABLES.place("red-circle")), NAMED["red"])
    carried = draw_scene(moved("red-circle", "robot", robot=gripper, robot_holding="red-circle"), hud=False)
    assert has(patch(carried, TABLES, *gripper), NAMED["red"])
    assert not has(patch(carried, TABLES, *TABLES.place("red-circle")), NAMED["red"])


def test_a_hand_beyond_the_edge_and_a_belief_in_nothing_are_drawn() -> None:
    def drawn(x: float, y: float, **belief: float) -> np.ndarray:
        return draw_scene(at(hand=np.array([x, y]), belief=belief or None), width=200, hud=False)

    away, further, corner = drawn(-0.3, 0.4), drawn(1.4, 1.0), drawn(0.0, 0.0)
    assert np.array_equal(away, further), "a hand off the picture is not seen"
    assert (away != corner).any(), "half of a hand on the edge is"
    changed = np.argwhere((away != corner).any(axis=-1))
    column, row = Frame.of(TABLES.table, 200).pixel(0, 0)
    assert np.abs(changed - (row, column)).max() < 0.1 * 200, "and nothing else changes"
    for unknown in ({"red-circle": float("nan")}, {"no such object": 0.5}):
        assert np.array_equal(drawn(0.0, 0.0, **unknown), corner), "no bar without an object and a number"
    assert not np.array_equal(drawn(0.0, 0.0, **{"red-circle": 0.5}), corner)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.zeros((7, 2))}, r"\(8, 2\)"),
        ({"status": ("free",) * 7}, "7"),
        ({"status": ("lost",) * 8}, "lost"),
        ({"hand": np.array([np.nan, 0.0])}, "hand"),
        ({"robot": np.array([np.inf, 0.0])}, "robot"),
    ],
)
def test_views_that_do_not_fit_together_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        draw_scene(at(**change))


# -- panels ------------------------------------------------------------------------------------------------------------


def test_panels_show_every_layout_and_the_configuration() -> None:
    one = draw_panels({"Baseline": TABLES}, TASK, width=200, ambiguity=False, captions={"Baseline": "legibility 7"})
    two = draw_panels({"Baseline": TABLES, "Walled": WALLED}, TASK, width=200, ambiguity=False)
    assert two.shape[0] > one.shape[0], "two panels, the configuration and what marks mean make two rows of three"
    with pytest.raises(ValueError, match="captions"):
        draw_panels({"Baseline": TABLES}, TASK, captions={"Base": ""})
    with pytest.raises(ValueError, match="at least one"):
        draw_panels({}, TASK)


def test_captions_are_the_scores_of_the_layouts() -> None:
    from legible_envs.tabletop.scoring.scorer import TabletopScorer

    scores = TabletopScorer(TASK).score_layouts([WALLED])
    legibility = f"legibility {scores.legibility[0]:.2f}".replace("-", "\u2212")
    detour = f"mean detour {scores.mean_detour[0]:.2f} ×, {scores.distance[0]:.2f} m in all"

    def drawn(*lines: str) -> np.ndarray:
        captions = {"Walled": "\n".join(lines)} if lines else None
        return draw_panels({"Walled": WALLED}, TASK, width=200, ambiguity=False, captions=captions)

    assert np.array_equal(drawn(), drawn(legibility, detour))
    assert not np.array_equal(drawn(), drawn(legibility, detour.replace("in all", "at most")))


def test_the_configuration_shows_every_object_in_its_place() -> None:
    image = draw_configuration(TASK, width=640)
    for name, (x, y) in TASK.configuration.items():
        assert has(patch(image, TABLES, x, y), hex_of(TABLES.objects[TABLES.index(name)].colour))
    with pytest.raises(ValueError, match="bins"):
        draw_configuration(TabletopTask.named("bins"))


def test_stages_follow_the_precedence() -> None:
    stages = stage_of(TASK.graph)
    assert {stages[name] for name in TABLES.goals[:4]} == {1}
    assert {stages[name] for name in TABLES.goals[4:]} == {2}
    assert stage_of(TabletopTask.named("tea").graph)["kettle"] == 2


def test_drawing_opens_no_window_and_leaves_the_environment_alone() -> None:
    code = """
        import os
        before = dict(os.environ)
        from legible_envs.tabletop import TabletopTask
        from legible_envs.tabletop.rendering import draw_scene
        from legible_envs.tabletop.game.view import TableView
        task = TabletopTask.named("tea")
        draw_scene(TableView.at_rest(task.layout, task), width=200)
        import pygame
        assert not pygame.display.get_init()
        assert dict(os.environ) == before
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "pygame" not in done.stdout
