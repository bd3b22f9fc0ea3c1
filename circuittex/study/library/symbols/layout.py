"""Where the pins of a symbol are, and the weave that is drawn between them, on a grid of one unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from circuittex.base.frozen import frozen
from circuittex.study.library.cell import Cell, Pin

LETTER = 0.5
"""Width of a letter of a pin's name in units."""
GAP = 0.25
"""A yarn that passes below another is drawn up to this distance from it."""

Line = tuple[tuple[float, float], tuple[float, float]]


@frozen
class Place:
    """One pin of a symbol."""

    number: int
    """From 1, in the order of the `.subckt` card."""
    pin: Pin
    """Its name and kind."""
    x: int
    """Of the end that wires touch: one unit outside the body, whose lower left corner is the origin."""
    y: int
    """Upwards."""
    side: str
    """'left', 'right', 'top' or 'bottom'."""


@frozen
class Layout:
    """A symbol on the grid; names of pins stand between the edge of the body and the weave."""

    margin: int
    """From an edge to the first yarn."""
    columns: int
    """Weft yarns in the picture."""
    rows: int
    """Warp yarns in the picture."""
    places: tuple[Place, ...]
    """In the order of the `.subckt` card."""

    @property
    def width(self) -> int:
        """Of the body."""
        return 2 * self.margin + self.columns - 1

    @property
    def height(self) -> int:
        """Of the body."""
        return 2 * self.margin + self.rows - 1


def layout(cell: Cell) -> Layout:
    """Warp pins left and right from below, weft pins below and above from the left; those of strain below, apart.

    >>> w, n, s, strain = (Pin("w", "left", "electrical"), Pin("n", "top", "electrical"),
    ...     Pin("s", "bottom", "electrical"), Pin("strain", "bottom", "control"))
    >>> found = layout(Cell("a", "unit", "", (w, n, s, strain), (), "ngspice/a.lib", "ngspice"))
    >>> [(place.x, place.y) for place in found.places], found.width
    ([(-1, 4), (4, 9), (4, -1), (6, -1)], 8)
    """
    yarns = {side: [pin for pin in cell.pins if pin.side == side and pin.kind == "electrical"] for side in SIDES}
    apart = [pin for pin in cell.pins if pin.kind != "electrical"]
    letters = max(len(pin.name) for pin in cell.pins)
    margin = max(math.ceil(LETTER * letters) + 1, len(apart) + 2)
    columns = max(1, len(yarns["top"]), len(yarns["bottom"]))
    rows = max(1, len(yarns["left"]), len(yarns["right"]))
    width, height = 2 * margin + columns - 1, 2 * margin + rows - 1
    spots = {pin: spot for side, pins in yarns.items() for pin, spot in _spots(side, pins, margin, width, height)}
    spots |= {pin: (margin + columns + 1 + k, -1, "bottom") for k, pin in enumerate(apart)}
    places = tuple(Place(k, pin, *spots[pin]) for k, pin in enumerate(cell.pins, 1))
    return Layout(margin, columns, rows, places)


SIDES = ("left", "right", "top", "bottom")


def _spots(
    side: str, pins: Sequence[Pin], margin: int, width: int, height: int
) -> Iterator[tuple[Pin, tuple[int, int, str]]]:
    for k, pin in enumerate(pins, margin):
        x, y = {"left": (-1, k), "right": (width + 1, k), "bottom": (k, -1), "top": (k, height + 1)}[side]
        yield pin, (x, y, side)


def weave(found: Layout) -> Iterator[Line]:
    """The lines of a plain weave: at every other crossing the warp yarn passes below and is interrupted.

    >>> list(weave(Layout(3, 1, 1, ())))
    [((2.5, 3.0), (2.75, 3.0)), ((3.25, 3.0), (3.5, 3.0)), ((3.0, 2.5), (3.0, 3.5))]
    """
    for row in range(found.rows):
        y = float(found.margin + row)
        below = [found.margin + column for column in range(found.columns) if (row + column) % 2 == 0]
        for a, b in _pieces(found.margin, found.columns, below):
            yield (a, y), (b, y)
    for column in range(found.columns):
        x = float(found.margin + column)
        below = [found.margin + row for row in range(found.rows) if (row + column) % 2 == 1]
        for a, b in _pieces(found.margin, found.rows, below):
            yield (x, a), (x, b)


def _pieces(first: int, count: int, below: Sequence[int]) -> Iterator[tuple[float, float]]:
    """A line half a unit longer than its crossings on both sides, with gaps."""
    start = first - 0.5
    for crossing in below:
        yield start, crossing - GAP
        start = crossing + GAP
    yield start, first + count - 0.5
