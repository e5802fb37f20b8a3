"""An aisle as a value: which goods lie in which bay."""

from dataclasses import dataclass

from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import LayoutKind

BAYS = 6  # on each side
GOODS = {"T": "tape", "B": "boxes", "L": "labels"}


@dataclass(frozen=True)
class Aisle:
    """Two shelves with an aisle between them; the person comes in on the left.

    Args:
        upper: A letter of :data:`GOODS`, or ``.``, for each bay of the upper shelf.
        lower: The same for the lower shelf.

    Raises:
        LayoutError: Another number of bays, or goods that are not there exactly once.
    """

    upper: str
    lower: str

    def __post_init__(self):
        for shelf in (self.upper, self.lower):
            if len(shelf) != BAYS:
                raise LayoutError(f"a shelf has {BAYS} bays, got {len(shelf)}: {shelf!r}", rule="bays")
        found = sorted((self.upper + self.lower).replace(".", ""))
        if found != sorted(GOODS):
            raise LayoutError(f"each of {sorted(GOODS)} must lie in one bay, got {found}", rule="goods")

    def to_text(self):
        """The drawing that :meth:`from_text` reads: the upper shelf, two rows of floor, the lower shelf."""
        return "\n".join(f"|{row}|" for row in (self.upper, " " * BAYS, " " * BAYS, self.lower))

    @classmethod
    def from_text(cls, text):
        """Read a drawing.

        Raises:
            LayoutError: It is not one.
        """
        rows = text.strip().split("\n")
        if len(rows) != 4 or not all(is_row(row) for row in rows):
            raise LayoutError(f"an aisle is four rows between bars, got {text!r}", rule="rows")
        return cls(rows[0][1:-1], rows[3][1:-1])

    __str__ = to_text


def is_row(line):
    """Whether a line may be a row of an aisle."""
    return len(line) > 1 and line[0] == line[-1] == "|"


AISLE = LayoutKind("aisle", Aisle, to_text=Aisle.to_text, from_text=Aisle.from_text)
