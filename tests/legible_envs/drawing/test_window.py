"""Windows: as large as the screen allows, and none where nobody would see it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from legible_envs.drawing import window as module
from legible_envs.drawing.window import Window, open_screen, scale_to_fit
from legible_envs.overcooked.human_play import tile_for
from legible_envs.overcooked.rendering import draw_game, hud_height


def test_pictures_grow_by_whole_numbers_and_shrink_by_any() -> None:
    rng = np.random.default_rng(0)
    for size, room in zip(
        rng.integers(20, 3000, (500, 2)).tolist(), rng.integers(300, 3000, (500, 2)).tolist(), strict=True
    ):
        scale = scale_to_fit(size, room)
        assert scale * size[0] <= room[0] + 1e-9
        assert scale * size[1] <= room[1] + 1e-9
        if scale >= 1:
            assert isinstance(scale, int)
            assert (scale + 1) * size[0] > room[0] or (scale + 1) * size[1] > room[1]
        else:
            assert scale == pytest.approx(min(room[0] / size[0], room[1] / size[1]))


@pytest.mark.usefixtures("no_screen")
@pytest.mark.parametrize(
    ("desktop", "size"), [((1920, 1080), (720, 849)), ((500, 400), (240, 283)), ((240, 283), (204, 241))]
)
def test_a_window_fills_its_screen(
    desktop: tuple[int, int], size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    pygame = open_screen()
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [desktop])
    picture = np.random.default_rng(0).integers(0, 255, (283, 240, 3), dtype=np.uint8)
    window = Window("test", fps=1000)
    window.show(picture)
    surface = pygame.display.get_surface()
    assert surface.get_size() == pytest.approx(size, abs=1)
    if size[0] > 240:  # every pixel became a square
        scale = size[0] // 240
        shown = np.transpose(pygame.surfarray.array3d(surface), (1, 0, 2))
        np.testing.assert_array_equal(shown, picture.repeat(scale, 0).repeat(scale, 1))
    window.show(picture)  # the same window
    assert pygame.display.get_surface() is surface
    window.close()
    assert not pygame.display.get_init()


@pytest.mark.usefixtures("no_screen")
def test_another_size_of_picture_gets_another_window(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = open_screen()
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [(1000, 1000)])
    window = Window("test", fps=1000)
    for height, width in ((100, 200), (100, 400), (100, 200)):
        window.show(np.zeros((height, width, 3), np.uint8))
        scale = scale_to_fit((width, height), (850, 850))
        assert pygame.display.get_surface().get_size() == (scale * width, scale * height)
    window.close()


def test_without_a_screen_no_window_opens(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(module.sys, "platform", "linux")
    with pytest.raises(RuntimeError, match="cannot open a window: there is no screen here"):
        Window("test", 1).show(np.zeros((10, 10, 3), np.uint8))


@pytest.mark.usefixtures("no_screen")
def test_a_driver_that_nobody_asked_for_is_no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """As SDL falls back to drawing off screen where a display is named but not there."""
    pygame = open_screen()  # the one of the test, which goes on being used
    monkeypatch.delenv("SDL_VIDEODRIVER")
    monkeypatch.setenv("DISPLAY", ":99")
    with pytest.raises(RuntimeError, match="no screen"):
        open_screen()
    assert not pygame.display.get_init()


def test_cells_are_as_large_as_fits() -> None:
    for shape, room in itertools.product(
        ((3, 3), (5, 5), (5, 9), (7, 7), (20, 20), (33, 33)), ((1632, 918), (1088, 652), (400, 300))
    ):
        tile = tile_for(shape, room)
        assert tile % 8 == 0
        assert 8 <= tile <= 160

        def fits(side: int, shape: tuple[int, int] = shape, room: tuple[int, int] = room) -> bool:
            return shape[1] * side <= room[0] and shape[0] * side + hud_height(side) <= room[1]

        assert fits(tile) or tile == 8
        assert tile == 160 or not fits(tile + 8)
    assert tile_for((64, 64), (100, 100)) == 8


def test_a_game_is_drawn_in_the_size_that_was_reckoned_with() -> None:
    import gymnasium as gym

    soups = [("onion", "onion", "onion")]
    env = gym.make("legible_envs:LegibleOvercooked-v0", shape=(3, 3), layout="XPX\nO1S\nXDX", recipes=soups)
    env.reset(seed=0)
    tile = tile_for((3, 3), (600, 500))
    assert draw_game(env.get_wrapper_attr("view")(), tile=tile).shape == (3 * tile + hud_height(tile), 3 * tile, 3)
