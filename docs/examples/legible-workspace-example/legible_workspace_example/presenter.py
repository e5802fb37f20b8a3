"""Aisles on the command line and in reports."""

from importlib.resources import files

import numpy as np

from benchmarks.presenters import Presenter, ReportTexts

from .layout import BAYS, GOODS, is_row

COLOURS = {"T": (194, 87, 26), "B": (122, 90, 60), "L": (11, 114, 133), ".": (205, 196, 182)}
FLOOR = (240, 233, 221)
TILE = 32


class AislePresenter(Presenter):
    """Presents the workspace ``"aisle"``: what it leaves out keeps its plain default."""

    name = "aisle"
    noun = "aisle"
    texts = ReportTexts(
        archive="with that many goods on the upper shelf (up), spread over that many bays (across)",
        distance="expected steps of picking one of each",
        distance_unit="steps",
        distance_digits=1,
        made="over all shortest paths, prefixes and orders of picking",
        measured="the expected number of steps of picking one of each",
    )

    def recognises(self, text, source):
        return all(is_row(line) for line in text.strip().split("\n"))

    def draw(self, layout, workspace):
        rows = [[COLOURS[letter] for letter in shelf] for shelf in (layout.upper, layout.lower)]
        floor = [[FLOOR] * BAYS] * 2
        tiles = np.array([rows[0], *floor, rows[1]], dtype=np.uint8)
        return tiles.repeat(TILE, axis=0).repeat(TILE, axis=1)

    # -- the page of a report ------------------------------------------------------------------------------------------

    def place(self, workspace):
        colours = {letter: "#{:02x}{:02x}{:02x}".format(*colour) for letter, colour in COLOURS.items()}
        return {"bays": BAYS, "goods": GOODS, "colours": colours}

    def script(self):
        return (files(__package__) / "aisle.js").read_text(encoding="utf-8")
