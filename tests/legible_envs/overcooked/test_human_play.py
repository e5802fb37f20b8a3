"""Playing by hand, without hands: keys are posted to a window that nobody sees."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legible_envs.errors import LayoutError
from legible_envs.overcooked import PAPER_SOUPS, OvercookedLayout
from legible_envs.overcooked.human_play import Played, load_played, play, recipes_for

# Facing west at the start: onion, pot and hatch are one turn away.
TINY = "XPX\nO1S\nXDX"
UP, DOWN, RIGHT, LEFT, SPACE, ESCAPE = 1073741906, 1073741905, 1073741903, 1073741904, 32, 27


@pytest.fixture
def keyboard(monkeypatch, no_screen):  # type: ignore[no-untyped-def]
    """Replace the event queue by a script: each poll hands over the next entry; at its end the window is closed."""
    from legible_envs.overcooked.rendering import load_pygame

    pygame = load_pygame()
    script: list[object] = []

    def get() -> list[object]:
        if not script:
            return [pygame.event.Event(pygame.QUIT)]
        entry = script.pop(0)
        if isinstance(entry, BaseException):
            raise entry
        return [pygame.event.Event(kind, key=key) for kind, key in entry]  # type: ignore[attr-defined]

    monkeypatch.setattr(pygame.event, "get", get)

    class Keyboard:
        def wait(self, polls: int = 1) -> None:
            script.extend([] for _ in range(polls))

        def down(self, *keys: int) -> None:
            script.append([(pygame.KEYDOWN, key) for key in keys])

        def up(self, *keys: int) -> None:
            script.append([(pygame.KEYUP, key) for key in keys])

        def tap(self, key: int) -> None:
            script.append([(pygame.KEYDOWN, key), (pygame.KEYUP, key)])

        def interrupt(self) -> None:
            script.append(KeyboardInterrupt())

    return Keyboard()


def test_a_soup_is_cooked_recorded_and_replayed(keyboard, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    keyboard.tap(SPACE)  # the first key only starts the game
    for _ in range(3):
        for key in (LEFT, SPACE, UP, SPACE):
            keyboard.tap(key)
    keyboard.wait(20)
    for key in (DOWN, SPACE, UP, SPACE, RIGHT, SPACE):
        keyboard.tap(key)
    path = tmp_path / "new" / "mine.npz"
    played = play(TINY, fps=60, record=path, seed=3)
    assert played.recipes == (("onion",) * 3,)
    assert played.actions.tolist() == [3, 5, 0, 5] * 3 + [4] * 20 + [1, 5, 0, 5, 2, 5]
    assert played.rewards.sum() == 20
    assert set(played.episodes) == {0}

    again = load_played(path)
    assert (again.layout, again.recipes, again.seed) == (played.layout, played.recipes, 3)
    env = again.make_env()
    env.reset(seed=again.seed)
    rewards = [env.step(int(action))[1] for action in again.actions]
    np.testing.assert_array_equal(rewards, again.rewards)
    np.testing.assert_array_equal(again.actions, played.actions)


def test_a_held_key_repeats_walking_but_not_interacting(keyboard) -> None:  # type: ignore[no-untyped-def]
    keyboard.tap(SPACE)
    keyboard.down(LEFT)
    keyboard.wait(2)
    keyboard.up(LEFT)
    keyboard.down(SPACE)
    keyboard.wait(2)
    keyboard.up(SPACE)
    keyboard.wait(1)
    assert play(TINY, fps=60).actions.tolist() == [3, 3, 3, 4, 5, 4, 4, 4, 4]


def test_a_tap_between_two_steps_counts_and_the_latest_held_key_wins(keyboard) -> None:  # type: ignore[no-untyped-def]
    keyboard.tap(SPACE)
    keyboard.wait(3)
    keyboard.tap(UP)  # down and up within one step of 6 polls
    keyboard.wait(2)
    keyboard.down(LEFT)
    keyboard.down(DOWN)
    keyboard.wait(16)
    keyboard.up(DOWN)
    keyboard.wait(5)
    assert play(TINY, fps=10).actions.tolist() == [0, 3, 1, 1, 3]


def test_games_follow_one_another_until_escape(keyboard, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    import gymnasium as gym

    make = Played.make_env
    monkeypatch.setattr(
        Played, "make_env", lambda self, mode=None: gym.wrappers.TimeLimit(make(self, mode).unwrapped, 2)
    )
    keyboard.tap(SPACE)
    keyboard.tap(LEFT)
    keyboard.tap(SPACE)
    keyboard.wait(3)  # the message after the game stays until a key
    keyboard.tap(DOWN)
    keyboard.tap(UP)
    keyboard.tap(ESCAPE)
    played = play(TINY, fps=60)
    assert played.actions.tolist() == [3, 5, 0]
    assert played.episodes.tolist() == [0, 0, 1]


def test_an_interrupted_game_is_kept(keyboard, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    keyboard.tap(SPACE)
    keyboard.tap(LEFT)
    keyboard.interrupt()
    play(TINY, fps=60, record=tmp_path / "mine.npz")
    assert load_played(tmp_path / "mine.npz").actions.tolist() == [3]


def test_nothing_played_replaces_no_recording(keyboard, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "mine.npz"
    path.write_bytes(b"an earlier one")
    assert play(TINY, record=path).actions.shape == (0,)
    assert path.read_bytes() == b"an earlier one"


def test_bad_arguments_fail_before_a_window_opens(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="`fps` must be a finite number from 1 to 60 steps per second"):
        play(TINY, fps=0)
    with pytest.raises(IsADirectoryError, match="name a file"):
        play(TINY, record=tmp_path)
    with pytest.raises(LayoutError):
        play(TINY, recipes=[("fish",)])
    with pytest.raises(LayoutError, match="ragged"):
        play("XXX\nX X X\nXXX")


def test_without_a_screen_the_error_says_so(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setenv("SDL_VIDEODRIVER", "no-such-driver")
    from legible_envs.overcooked.rendering import load_pygame

    load_pygame().display.quit()
    with pytest.raises(RuntimeError, match="cannot open a window: no-such-driver"):
        play(TINY)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        load_played(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("hello")
    with pytest.raises(ValueError, match="no recorded play"):
        load_played(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    with pytest.raises(ValueError, match="no recorded play"):
        load_played(tmp_path / "other.npz")
    game = Played(OvercookedLayout.from_ascii(TINY), (("onion",),), actions=np.int8([0, 5]), episodes=np.int32([0, 0]))
    replace(game, rewards=np.zeros(2)).save(tmp_path / "mine.npz")
    with np.load(tmp_path / "mine.npz") as file:
        arrays = dict(file)
    for changes, message in (
        ({"actions": np.array([0, 6])}, "`actions` must be numbers from 0 to 5"),
        ({"episodes": np.array([0, 7])}, "`episodes` must count the games from 0"),
        ({"rewards": np.zeros(3)}, r"`rewards` must be floats of shape \(2\), got float64 of shape \(3,\)"),
        (
            {"about": np.array(str(arrays["about"]).replace('"onion"', '"cake"'))},
            r"`about`: `recipes\[0\]\[0\]` must be one of",
        ),
        ({"about": np.array("[1]")}, "`about` must be a mapping, got"),
    ):
        np.savez(tmp_path / "mine.npz", **{**arrays, **changes})
        with pytest.raises(ValueError, match=rf"mine\.npz is no recorded play: {message}"):
            load_played(tmp_path / "mine.npz")


def test_soups_fit_the_kitchen() -> None:
    assert recipes_for(OvercookedLayout.from_ascii("XTXCX\nXP  F\nX   X\nXDSXX")) == (("fish",) * 3,)
    everything = OvercookedLayout.from_ascii("XTXOXCX\nX     F\nX     X\nXPXDXSX")
    assert recipes_for(everything) == PAPER_SOUPS
    assert recipes_for(OvercookedLayout.from_ascii(TINY)) == (("onion",) * 3,)
