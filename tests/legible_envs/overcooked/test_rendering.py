"""Drawings: shapes, the same pixels every time, what must be told apart, and no screen needed."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.view import GameView, Item, PlayerView, PotView
from legible_envs.overcooked.layout import STATION_TYPES, SYMBOLS
from legible_envs.overcooked.rendering import (
    HEAT,
    PALETTE,
    draw_ambiguity,
    draw_game,
    draw_layout,
    draw_side_by_side,
    hud_height,
    save_png,
)
from legible_envs.overcooked.rendering.hud import tickets_of

KITCHEN = OvercookedLayout.from_ascii("XPXXTXX\nO     X\nX VV  D\nX  V  X\nC   V X\nX1    X\nXSXFXXX")
POT = (0, 1)
SOUP = Item("soup", ("tomato", "tomato", "onion"))


def cell(image: np.ndarray, row: int, col: int, tile: int = 48, above: int = 0) -> np.ndarray:
    return image[above + row * tile : above + (row + 1) * tile, col * tile : (col + 1) * tile]


def alone(symbol: str) -> OvercookedLayout:
    """A room with one cell to look at, in the middle of its upper wall."""
    return OvercookedLayout.from_rows(["XX" + symbol + "XX", "X   X", "X  1X", "XXXXX"])


def game(**changes: object) -> GameView:
    start = GameView(
        KITCHEN,
        players=(PlayerView((3, 1), 1),),
        pots={POT: PotView()},
        orders=(("tomato", "tomato", "onion"), ("fish", "fish", "fish")),
    )
    return dataclasses.replace(start, **changes)  # type: ignore[arg-type]


# -- shapes, and fresh arrays ----------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_any_kitchen_of_any_size_is_drawn(data: st.DataObject) -> None:
    height, width = data.draw(st.tuples(st.integers(3, 12), st.integers(3, 12)))
    cells = data.draw(st.lists(st.integers(0, 9), min_size=height * width, max_size=height * width))
    grid = np.array(cells).reshape(height, width)
    grid[height // 2, width // 2] = 0
    tile = data.draw(st.sampled_from([8, 13, 24]))
    layout = OvercookedLayout(grid)
    assert draw_layout(layout, tile=tile).shape == (height * tile, width * tile, 3)
    view = GameView(layout, players=(PlayerView(layout.starts[0], 0, SOUP),))
    assert draw_game(view, tile=tile).shape == (height * tile + hud_height(tile), width * tile, 3)


def test_the_largest_and_the_smallest_kitchen() -> None:
    large = np.ones((64, 64), dtype=int)
    large[1:-1, 1:-1] = 0
    assert draw_layout(OvercookedLayout(large), tile=8).shape == (512, 512, 3)
    small = OvercookedLayout.from_rows(["XXX", "X X", "XXX"])
    for tile in (8, 48, 256):
        assert draw_game(GameView(small, steps=1199, crossings=12), tile=tile).shape[1] == 3 * tile


@pytest.mark.parametrize("tile", [7, 257, 0, -3, 24.0, True, "48", None])
def test_a_bad_tile_size_is_named(tile: object) -> None:
    with pytest.raises(ValueError, match="`tile` must be an integer from 8 to 256 pixels"):
        draw_layout(KITCHEN, tile=tile)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="`tile` must be an integer from 8 to 256 pixels"):
        draw_game(game(), tile=tile)  # type: ignore[arg-type]


@pytest.mark.parametrize("draw", [lambda: draw_layout(KITCHEN), lambda: draw_game(game(), hud=False)])
def test_every_call_returns_its_own_writable_array(draw) -> None:  # type: ignore[no-untyped-def]
    first = draw()
    kept = first.copy()
    assert first.dtype == np.uint8
    assert first.flags.writeable
    first[:] = 0
    np.testing.assert_array_equal(draw(), kept)


def test_the_cache_does_not_mix_kitchens_or_sizes() -> None:
    other = KITCHEN.with_cells({(1, 3): "V", (6, 5): "onion"})
    fresh = {}
    for layout in (KITCHEN, other):
        for tile in (20, 32):
            fresh[layout, tile] = draw_layout(layout, tile=tile)
    for (layout, tile), image in fresh.items():
        np.testing.assert_array_equal(draw_layout(layout, tile=tile), image)
    changed = np.argwhere((fresh[KITCHEN, 32] != fresh[other, 32]).any(axis=2)) // 32
    assert {(1, 3), (6, 5)} <= {tuple(int(i) for i in at) for at in np.unique(changed, axis=0)}


def test_a_full_cache_still_draws_the_right_kitchen() -> None:
    from legible_envs.overcooked.rendering.board import _Backgrounds

    small = _Backgrounds(room=1)  # holds one picture at a time
    other = KITCHEN.with_cells({(1, 3): "V"})
    expected = {layout: _Backgrounds(2**30)(layout, 16) for layout in (KITCHEN, other)}
    for layout in (KITCHEN, other, other, KITCHEN):
        np.testing.assert_array_equal(small(layout, 16), expected[layout])


def _run(code: str, **environ: str) -> str:
    command = [sys.executable, "-c", textwrap.dedent(code)]
    env = {k: v for k, v in os.environ.items() if not k.startswith(("PYGAME", "SDL"))} | environ
    return subprocess.run(command, env=env, capture_output=True, text=True, check=True, timeout=120).stdout


def test_no_screen_no_greeting_no_trace_and_the_same_pixels_in_another_process() -> None:
    code = f"""
        import hashlib, os, sys
        from legible_envs.overcooked import OvercookedLayout
        from legible_envs.overcooked.rendering import draw_layout
        os.environ.pop("PYGAME_HIDE_SUPPORT_PROMPT", None)  # Gymnasium sets it
        before = dict(os.environ)
        assert "pygame" not in sys.modules
        image = draw_layout(OvercookedLayout.from_ascii({KITCHEN.to_ascii()!r}), tile=31, title="Kitchen")
        import pygame
        assert not pygame.display.get_init() and not pygame.get_init()
        assert dict(os.environ) == before, set(os.environ) ^ set(before)
        print(hashlib.sha256(image.tobytes()).hexdigest())
        """
    import hashlib

    here = hashlib.sha256(draw_layout(KITCHEN, tile=31, title="Kitchen").tobytes()).hexdigest()
    assert _run(code) == here + "\n"
    assert _run(code, PYTHONHASHSEED="7") == here + "\n"


# -- what must be seen -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tile", [20, 24, 48])
def test_all_kinds_of_cells_look_different(tile: int) -> None:
    looks = {
        symbol: cell(draw_layout(alone(symbol), tile=tile, starts=False), 0, 2, tile).astype(int) for symbol in SYMBOLS
    }
    for first in SYMBOLS:
        for second in SYMBOLS:
            if first < second:
                different = (np.abs(looks[first] - looks[second]).max(axis=2) > 24).mean()
                assert different > 0.08, f"{first!r} and {second!r} differ in {different:.0%} of the pixels"


def test_obstacles_are_cyan_with_red_edges_round_the_whole_group() -> None:
    image = draw_layout(KITCHEN, starts=False).astype(int)
    middle = cell(image, 4, 4)[12:-12, 12:-12]
    assert (middle[..., 2] > middle[..., 0] + 60).all()
    assert (middle[..., 1] > middle[..., 0] + 60).all()

    def is_red(patch: np.ndarray) -> bool:
        return bool((patch[..., 0] > 200).all() and (patch[..., 1:] < 90).all())

    lone = cell(image, 4, 4)
    assert is_red(lone[:2]) and is_red(lone[-2:]) and is_red(lone[:, :2]) and is_red(lone[:, -2:])  # noqa: PT018
    left, right = cell(image, 2, 2), cell(image, 2, 3)
    assert is_red(left[:2]) and is_red(left[:, :2])  # noqa: PT018
    assert not (left[8:-8, -3:, 0] > 200).any(), "no edge between two obstacles"
    assert not (right[-3:, 8:-8, 0] > 200).any(), "no edge between two obstacles"
    assert is_red(right[-2:, :2]), "the inner corner of the group is closed"


def test_starts_labels_and_titles() -> None:
    bare = draw_layout(KITCHEN, starts=False)
    changed = np.unique(np.argwhere((bare != draw_layout(KITCHEN)).any(axis=2)) // 48, axis=0)
    assert changed.tolist() == [[5, 1]]
    labelled = draw_layout(KITCHEN, starts=False, labels={(1, 3): "7"})
    changed = np.unique(np.argwhere((bare != labelled).any(axis=2)) // 48, axis=0)
    assert changed.tolist() == [[1, 3]]
    titled = draw_layout(KITCHEN, starts=False, title="A kitchen with far too long a name for its width, really")
    np.testing.assert_array_equal(titled[-bare.shape[0] :], bare)
    with pytest.raises(ValueError, match="row 7, column 0 is outside"):
        draw_layout(KITCHEN, labels={(7, 0): "x"})


def test_a_serving_hatch_points_out_of_the_room() -> None:
    north = OvercookedLayout.from_rows(["XXSXX", "X   X", "XXXXX"])
    west = OvercookedLayout.from_rows(["XXXXX", "S   X", "XXXXX"])
    east = OvercookedLayout.from_rows(["XXXXX", "X   S", "XXXXX"])
    at = [cell(draw_layout(kitchen), *kitchen.stations["serving"]) for kitchen in (north, west, east)]
    assert (at[1] != at[2]).any()
    assert (at[0][:36] != at[1][:36]).any()


ITEMS = [None, *(Item(kind) for kind in STATION_TYPES[:5]), SOUP, Item("soup", ("fish", "fish", "fish"))]


@pytest.mark.parametrize("facing", range(4))
@pytest.mark.parametrize("tile", [24, 48])
def test_what_is_held_is_seen_from_every_side(facing: int, tile: int) -> None:
    pictures = [draw_game(game(players=(PlayerView((3, 1), facing, item),)), tile=tile).tobytes() for item in ITEMS]
    assert len(set(pictures)) == len(ITEMS)


def test_facing_and_players_are_told_apart() -> None:
    looks = [draw_game(game(players=(PlayerView((3, 1), facing),))).tobytes() for facing in range(4)]
    assert len(set(looks)) == 4
    one, two = PlayerView((3, 1), 1), PlayerView((3, 2), 1)
    assert (draw_game(game(players=(one, two))) != draw_game(game(players=(two, one)))).any()
    with pytest.raises(ValueError, match="facing must be 0 N"):
        draw_game(game(players=(PlayerView((3, 1), 4),)))


def test_a_nearer_player_stands_in_front() -> None:
    near, far = PlayerView((4, 1), 1), PlayerView((3, 1), 1)
    alone_near = draw_game(game(players=(near,)), hud=False)
    both = draw_game(game(players=(near, far)), hud=False)
    np.testing.assert_array_equal(cell(both, 4, 1)[:40, 16:32], cell(alone_near, 4, 1)[:40, 16:32])


def test_counters_show_what_lies_on_them() -> None:
    empty = draw_game(game(), hud=False)
    looks = set()
    for item in ITEMS[1:]:
        assert item is not None
        full = draw_game(game(counters={(0, 3): item}), hud=False)
        changed = np.unique(np.argwhere((full != empty).any(axis=2)) // 48, axis=0)
        assert changed.tolist() == [[0, 3]]
        looks.add(full.tobytes())
    assert len(looks) == len(ITEMS) - 1
    with pytest.raises(ValueError, match="cannot draw an item of kind 'hat'"):
        draw_game(game(counters={(0, 3): Item("hat")}))


def test_pots_show_contents_progress_and_readiness() -> None:
    soup = ("tomato", "tomato", "onion")
    pots = [
        PotView(),
        PotView(("tomato",)),
        PotView(("onion",)),
        PotView(("tomato", "onion")),
        PotView(soup, 2, 20, True),
        PotView(soup, 10, 20, True),
        PotView(soup, 18, 20, True),
        PotView(soup, 20, 20, False, True),
        PotView(("onion",) * 9, 20, 20, False, True),
    ]
    looks = [draw_game(game(pots={POT: pot}), tile=24, hud=False) for pot in pots]
    assert len({look.tobytes() for look in looks}) == len(pots)
    still_ready = draw_game(game(pots={POT: PotView(soup, 57, 20, True, True)}), tile=24, hud=False)
    np.testing.assert_array_equal(still_ready, looks[7])
    np.testing.assert_array_equal(looks[0], draw_game(game(pots={}), tile=24, hud=False))
    filled = [np.abs(look.astype(int) - np.array([0xF5, 0xA5, 0x24])).max(axis=2) < 8 for look in looks[4:7]]
    assert filled[0].sum() < filled[1].sum() < filled[2].sum()


def test_the_strip_shows_orders_steps_and_crossings_in_a_constant_size() -> None:
    start = draw_game(game())
    later = draw_game(game(steps=1200))
    crossed = draw_game(game(steps=1200, crossings=4))
    done = draw_game(game(delivered=(("fish", "fish", "fish"),), orders=(("tomato", "tomato", "onion"),)))
    above = hud_height(48)
    assert len({image[:above].tobytes() for image in (start, later, crossed, done)}) == 4
    for image in (later, crossed, done):
        np.testing.assert_array_equal(image[above:], start[above:])
    np.testing.assert_array_equal(draw_game(game(), hud=False), start[above:])


def test_tickets_stay_in_place_while_the_game_goes_on() -> None:
    tomato, fish = ("tomato", "tomato", "onion"), ("fish", "fish", "fish")
    before = tickets_of(game(orders=(fish, tomato, fish)))
    after = tickets_of(game(orders=(tomato, fish), delivered=(fish,)))
    assert before == [(tomato, False), (fish, False), (fish, False)]
    assert after == [(tomato, False), (fish, True), (fish, False)]


def test_hundreds_of_deliveries_fit_the_strip() -> None:
    onion = ("onion",) * 3
    image = draw_game(game(delivered=(onion,) * 300, orders=(onion,)), tile=20)
    assert image.shape == (7 * 20 + hud_height(20), 140, 3)
    assert (image != draw_game(game(delivered=(onion,) * 301, orders=(onion,)), tile=20)).any()


# -- heat, sheets, files --------------------------------------------------------------------------------------------


def test_heat_colours_only_the_cells_that_have_a_value_and_gets_darker() -> None:
    heat = np.full(KITCHEN.shape, np.nan)
    heat[1, 1], heat[1, 2], heat[1, 3] = 0.0, 0.5, 1.0
    kept = heat.copy()
    image = draw_ambiguity(KITCHEN, heat)
    np.testing.assert_array_equal(heat, kept)
    assert image.shape[1] == 7 * 48
    assert image.shape[0] > 7 * 48
    bare = draw_layout(KITCHEN, starts=False)
    changed = np.unique(np.argwhere((image[: 7 * 48] != bare).any(axis=2)) // 48, axis=0)
    assert changed.tolist() == [[1, 1], [1, 2], [1, 3]]
    light = [cell(image, 1, col)[24, 24].astype(int).sum() for col in (1, 2, 3)]
    assert light[0] > light[1] > light[2]
    assert (draw_ambiguity(KITCHEN, heat, values=True)[: 7 * 48] != image[: 7 * 48]).any()


def test_the_heat_ramp_gets_steadily_darker() -> None:
    def lightness(colour: str) -> float:
        red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2

    steps = np.diff([lightness(colour) ** (1 / 3) for colour in HEAT])
    assert (steps < -0.05).all()


def test_paths_are_drawn_and_checked() -> None:
    heat = np.full(KITCHEN.shape, np.nan)
    walk = [(5, 1), (4, 1), (4, 1), (3, 1), (2, 1), (1, 1), (0, 1)]
    plain = draw_ambiguity(KITCHEN, heat, tile=24)
    drawn = draw_ambiguity(KITCHEN, heat, tile=24, paths=[walk])
    changed = np.unique(np.argwhere((plain != drawn).any(axis=2)) // 24, axis=0)
    assert {tuple(at) for at in changed.tolist()} == set(walk)
    named = draw_ambiguity(KITCHEN, heat, tile=24, paths={"to the pot": walk, "to the onions": walk[:4]})
    assert named.shape[0] > drawn.shape[0]
    with pytest.raises(ValueError, match="jumps from row 5, column 1 to row 3, column 1"):
        draw_ambiguity(KITCHEN, heat, paths=[[(5, 1), (3, 1)]])
    with pytest.raises(ValueError, match="leaves the kitchen"):
        draw_ambiguity(KITCHEN, heat, paths=[[(6, 1), (7, 1)]])


def test_bad_heat_is_named() -> None:
    with pytest.raises(ValueError, match=r"shape \(7, 7\), got \(7, 6\)"):
        draw_ambiguity(KITCHEN, np.zeros((7, 6)))
    heat = np.zeros((7, 7))
    heat[2, 3] = 1.5
    with pytest.raises(ValueError, match=r"row 2, column 3 is 1\.5"):
        draw_ambiguity(KITCHEN, heat)


def test_boards_side_by_side_are_whole() -> None:
    boards = [draw_layout(KITCHEN, tile=16), draw_layout(alone("T"), tile=24), draw_layout(KITCHEN, tile=8)]
    sheet = draw_side_by_side(boards, ["legible", "efficient", "random"], ["score 1\nsteps 2", "", "x"], gap=10)
    wide = sum(board.shape[1] for board in boards) + 4 * 10
    assert sheet.shape[1] >= wide
    for board in boards:
        windows = np.lib.stride_tricks.sliding_window_view(sheet, board.shape[:2], axis=(0, 1))
        rows, cols = np.nonzero((windows[:, :, :, 0, 0] == board[0, 0]).all(axis=2))
        found = [
            np.array_equal(sheet[r : r + len(board), c : c + board.shape[1]], board)
            for r, c in zip(rows, cols, strict=True)
        ]
        assert any(found)
    folded = draw_side_by_side(boards, columns=2)
    assert folded.shape[0] > sheet.shape[0]
    with pytest.raises(ValueError, match="expected 3 titles"):
        draw_side_by_side(boards, ["one"])
    with pytest.raises(ValueError, match="at least one image"):
        draw_side_by_side([])
    with pytest.raises(ValueError, match="image 1 must be"):
        draw_side_by_side([boards[0], boards[1].astype(float)])  # type: ignore[list-item]


def test_png_round_trip_and_a_failed_write_keeps_the_old_file(tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    image = draw_layout(KITCHEN, tile=12)
    path = save_png(tmp_path / "new" / "best.png", image)
    np.testing.assert_array_equal(np.asarray(Image.open(path)), image)
    before = path.read_bytes()

    def full(self, target, **_) -> None:  # type: ignore[no-untyped-def]
        target.write(b"half a picture")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(OSError, match="No space left"):
        save_png(path, image)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["best.png"]
    with pytest.raises(ValueError, match="expected an"):
        save_png(path, image[..., 0])


def test_every_colour_is_six_digits() -> None:
    for name, colour in PALETTE.items():
        assert len(colour) == 7, name
        assert int(colour[1:], 16) >= 0, name
    assert set(STATION_TYPES) <= set(PALETTE)
