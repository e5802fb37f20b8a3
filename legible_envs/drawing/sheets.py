"""Pictures put together: titles, captions, boards side by side, and writing them to disk."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.canvas import Image, Sprite, drawable, paste, rgb, text_sprite
from legible_envs.drawing.palette import PAGE
from legible_envs.support.files import write_atomically
from legible_envs.support.validation import integer

__all__ = ["banner", "check_tile", "draw_side_by_side", "draw_text", "fit_text", "overlay", "save_png"]


def check_tile(tile: int) -> int:
    """The tile size as given, if it can be drawn."""
    return integer("tile", tile, 8, 256, unit="pixels")


def fit_text(text: str, size: int, colour: str, width: int) -> Sprite:
    """A line of text no wider than ``width`` pixels: smaller, then cut off, where it would be."""
    text, smallest = drawable(text), max(8, size * 2 // 3)
    for smaller in range(size, smallest - 1, -1):
        sprite = text_sprite(text, smaller, colour)
        if sprite.colour.shape[1] <= width:
            return sprite
    for end in range(len(text) - 1, 0, -1):
        sprite = text_sprite(text[:end].rstrip() + "…", smallest, colour)
        if sprite.colour.shape[1] <= width:
            return sprite
    return text_sprite("…", smallest, colour)


def draw_text(text: str, *, size: int = 28, rows: int = 40, columns: int = 100) -> Image:
    """A text as a picture, every character in a cell of its own, so that drawings in characters keep their shape.

    Args:
        text: Any number of lines.
        size: Pixels of a line.
        rows: Lines that are drawn at most.
        columns: Characters of a line that are drawn at most.

    Returns:
        ``(height, width, 3)`` uint8; a new array each time.
    """
    lines = [line[:columns] for line in text.split("\n")[:rows]]
    wide = max(8, size * 2 // 3)
    image = np.empty((size * (len(lines) + 1), wide * (max(map(len, lines)) + 2), 3), np.uint8)
    image[:] = rgb(PAGE["page"])
    for row, line in enumerate(lines):
        for column, character in enumerate(line):
            if not character.isspace():
                sprite = fit_text(character, size, PAGE["ink"], wide)
                middle = (wide - sprite.colour.shape[1]) // 2
                paste(image, sprite, size // 2 + row * size, wide * (column + 1) + middle)
    return image


def banner(image: Image, title: str, tile: int) -> Image:
    """The image with a title above it."""
    size = max(14, min(30, round(tile * 0.5)))
    words = fit_text(title, size, PAGE["ink"], image.shape[1] - 4)
    above = round(size * 1.35)
    framed = np.empty((image.shape[0] + above, *image.shape[1:]), np.uint8)
    framed[:above] = rgb(PAGE["page"])
    framed[above:] = image
    paste(framed, words, (above - words.colour.shape[0]) // 2 + 1, (image.shape[1] - words.colour.shape[1]) // 2)
    return framed


def overlay(image: Image, lines: Sequence[str], tile: int) -> Image:
    """A dimmed copy of the image with lines of text on a card in its middle, the first one larger."""
    dimmed = (image.astype(np.uint16) * 2 // 5).astype(np.uint8)
    size = max(14, min(34, round(tile * 0.6)))
    room = image.shape[1] - size
    words = [
        fit_text(line, size if number == 0 else round(size * 0.72), PAGE["ink" if number == 0 else "ink_soft"], room)
        for number, line in enumerate(lines)
    ]
    tall = sum(len(line.colour) for line in words) + size
    top = max(0, (image.shape[0] - tall) // 2)
    left = max(0, (room - max(line.colour.shape[1] for line in words)) // 2)
    dimmed[top : top + tall, left : image.shape[1] - left] = rgb(PAGE["page"])
    row = top + size // 2
    for line in words:
        paste(dimmed, line, row, (image.shape[1] - line.colour.shape[1]) // 2)
        row += len(line.colour)
    return dimmed


def draw_side_by_side(
    images: Sequence[npt.NDArray[np.uint8]],
    titles: Sequence[str] | None = None,
    captions: Sequence[str] | None = None,
    *,
    columns: int | None = None,
    gap: int = 24,
    text: int = 24,
) -> Image:
    """Set pictures beside one another, each with a title above and a caption below.

    Args:
        images: ``(h, w, 3)`` uint8 arrays, of any sizes.
        titles: One line for each image, or None.
        captions: Text below each image, lines separated by a newline, or None.
        columns: How many to a row; None puts all in one.
        gap: Pixels between and around them, at most 1024.
        text: Height of a title in pixels, 4 to 256; captions are a little smaller.

    Returns:
        ``(h, w, 3)`` uint8.

    Raises:
        ValueError: No image, an array that is none, not as many titles or captions as images, or a size out of range.
    """
    for number, image in enumerate(images):
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise ValueError(f"image {number} must be (h, w, 3) uint8, got {image.shape} {image.dtype}")
    for name, words in (("titles", titles), ("captions", captions)):
        if words is not None and len(words) != len(images):
            raise ValueError(f"expected {len(images)} {name}, one for each image, got {len(words)}")
    if not images or (columns is not None and columns < 1):
        raise ValueError("expected at least one image and at least one column")
    gap, text = integer("gap", gap, 0, 1024, unit="pixels"), integer("text", text, 4, 256, unit="pixels")
    small = max(10, round(text * 0.8))
    cards = [
        _card(
            image,
            [text_sprite(titles[i], text, PAGE["ink"])] if titles else [],
            [text_sprite(line, small, PAGE["ink_soft"]) for line in captions[i].split("\n")] if captions else [],
            gap // 3,
        )
        for i, image in enumerate(images)
    ]
    return _grid(cards, columns or len(cards), gap)


def _card(image: Image, above: Sequence[Sprite], below: Sequence[Sprite], space: int) -> Image:
    """An image with lines of text centred above and below it."""
    head = sum(len(line.colour) for line in above) + (space if above else 0)
    foot = sum(len(line.colour) for line in below) + (space if below else 0)
    wide = max([image.shape[1], *(line.colour.shape[1] for line in (*above, *below))])
    card = np.empty((head + image.shape[0] + foot, wide, 3), np.uint8)
    card[...] = rgb(PAGE["page"])
    left = (wide - image.shape[1]) // 2
    card[head : head + image.shape[0], left : left + image.shape[1]] = image
    for row, lines in ((0, above), (head + image.shape[0] + space, below)):
        for line in lines:
            paste(card, line, row, (wide - line.colour.shape[1]) // 2)
            row += len(line.colour)
    return card


def _grid(cards: Sequence[Image], columns: int, gap: int) -> Image:
    rows = [cards[i : i + columns] for i in range(0, len(cards), columns)]
    heights = [max(card.shape[0] for card in row) for row in rows]
    widths = [max(row[c].shape[1] for row in rows if c < len(row)) for c in range(len(rows[0]))]
    page = np.empty((sum(heights) + gap * (len(rows) + 1), sum(widths) + gap * (len(widths) + 1), 3), np.uint8)
    page[...] = rgb(PAGE["page"])
    top = gap
    for row, height in zip(rows, heights, strict=True):
        left = gap
        for card, width in zip(row, widths, strict=False):
            at = left + (width - card.shape[1]) // 2
            page[top : top + card.shape[0], at : at + card.shape[1]] = card
            left += width + gap
        top += height + gap
    return page


def save_png(path: str | os.PathLike[str], image: npt.NDArray[np.uint8]) -> Path:
    """Write an image as PNG, whole or not at all: a file that was there stays until the new one is complete.

    Args:
        path: Where to; missing folders are made.
        image: ``(h, w, 3)`` uint8.

    Returns:
        The path written.

    Raises:
        ValueError: The array is not an image.
        OSError: The disk is full or the place cannot be written to.
    """
    from PIL import Image as Pillow

    image = np.asarray(image)
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise ValueError(f"expected an (h, w, 3) uint8 image, got {image.shape} {image.dtype}")
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    picture = Pillow.fromarray(np.ascontiguousarray(image))
    write_atomically(target, lambda stream: picture.save(stream, format="PNG", optimize=True))
    return target
