"""Symbols for Qucs-S: a `.sym` in a folder that is called like the file of the sub-circuit."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from circuittex.study.library.cell import Cell
from circuittex.study.library.symbols.layout import Layout, layout, weave

UNIT = 20
"""Its pixels in a unit of the grid; pins must be on multiples of 10."""
PEN = "#000080 2 1"
"""Colour, width and style of lines: those of its own symbols."""


def sym(cell: Cell) -> str:
    """The text of a symbol, which Qucs-S 24.3 and later find by themselves: of a SPICE library device with the file
    ``fabric_ports.lib`` and the sub-circuit ``fabric_ports`` that is ``fabric_ports/fabric_ports.sym`` beside it.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
    >>> print(*sym(Cell("piece", "ports", "a piece", pins, (), "ngspice/piece.lib", "ngspice")).splitlines()[-4:])
    <.PortSym -60 0 1 0 a> <.PortSym 60 0 2 180 b> <.ID -40 50 X> </Symbol>
    """
    return "\n".join(["<Qucs Schematic 24.3.0>", "<Symbol>", *_lines(layout(cell)), "</Symbol>", ""])


def _lines(found: Layout) -> Iterator[str]:
    def at(x: float, y: float) -> tuple[int, int]:
        """Its y goes down."""
        return round((x - found.width // 2) * UNIT), round((found.height // 2 - y) * UNIT)

    def line(start: tuple[float, float], end: tuple[float, float]) -> str:
        (x, y), (u, v) = at(*start), at(*end)
        return f"<Line {x} {y} {u - x} {v - y} {PEN}>"

    corners = [(0, 0), (found.width, 0), (found.width, found.height), (0, found.height), (0, 0)]
    yield from (line(*pair) for pair in pairwise(corners))
    yield from (line(*pair) for pair in weave(found))
    inwards = {"left": (1, 0), "right": (-1, 0), "bottom": (0, 1), "top": (0, -1)}
    for place in found.places:
        dx, dy = inwards[place.side]
        yield line((place.x, place.y), (place.x + dx, place.y + dy))
    for place in found.places:
        x, y = at(place.x, place.y)
        yield f"<.PortSym {x} {y} {place.number} {180 if place.side == 'right' else 0} {place.pin.name}>"
    x, y = at(0, 0)
    yield f"<.ID {x} {y + UNIT // 2} X>"
