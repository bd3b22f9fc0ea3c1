"""Symbols for LTspice: an `.asy` beside each file in its dialect."""

from __future__ import annotations

from collections.abc import Iterator

from circuittex.study.library.cell import Cell
from circuittex.study.library.symbols.expression import one_line
from circuittex.study.library.symbols.layout import Layout, layout, weave

UNIT = 32
"""LTspice's units in a unit of the grid; pins must be on multiples of 16."""
LABEL = {"left": "LEFT", "right": "RIGHT", "bottom": "VLEFT", "top": "VRIGHT"}
"""Justification of a pin's name, by side: names of pins below and above are upright."""


def asy(cell: Cell) -> str:
    """The text of a symbol that names its sub-circuit and the file in the same folder that LTspice includes for it.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
    >>> text = asy(Cell("piece", "ports", "a piece", pins, (("strain", "0"),), "ltspice/piece.lib", "ltspice"))
    >>> print(*text.splitlines()[-11:], sep="; ")  # doctest: +NORMALIZE_WHITESPACE
    SYMATTR Prefix X; SYMATTR SpiceModel piece; SYMATTR ModelFile piece.lib; SYMATTR SpiceLine strain=0;
    SYMATTR Description a piece;
    PIN -96 0 LEFT 36; PINATTR PinName a; PINATTR SpiceOrder 1;
    PIN 96 0 RIGHT 36; PINATTR PinName b; PINATTR SpiceOrder 2
    """
    return "\n".join(_lines(cell, layout(cell))) + "\n"


def _lines(cell: Cell, found: Layout) -> Iterator[str]:
    def at(x: float, y: float) -> str:
        """LTspice's y goes down."""
        return f"{round((x - found.width // 2) * UNIT)} {round((found.height // 2 - y) * UNIT)}"

    yield from ("Version 4", "SymbolType CELL")
    yield f"RECTANGLE Normal {at(0, found.height)} {at(found.width, 0)}"
    for start, end in weave(found):
        yield f"LINE Normal {at(*start)} {at(*end)}"
    yield from (
        f"LINE Normal {at(place.x, place.y)} {at(*_foot(place.x, place.y, place.side))}" for place in found.places
    )
    for window, height in ((0, 4), (38, 3), (39, 2)):  # the instance's name, that of the sub-circuit, parameters
        yield f"WINDOW {window} {at(0, found.height + height)} Left 2"
    yield from ("SYMATTR Prefix X", f"SYMATTR SpiceModel {cell.name}")
    yield f"SYMATTR ModelFile {cell.file.rpartition('/')[2]}"
    if cell.parameters:
        yield "SYMATTR SpiceLine " + " ".join(f"{name}={value}" for name, value in cell.parameters)
    yield f"SYMATTR Description {one_line(cell.title).encode('ascii', 'replace').decode('ascii')}"
    for place in found.places:
        yield f"PIN {at(place.x, place.y)} {LABEL[place.side]} {UNIT + 4}"
        yield f"PINATTR PinName {place.pin.name}"
        yield f"PINATTR SpiceOrder {place.number}"


def _foot(x: int, y: int, side: str) -> tuple[int, int]:
    """Where a pin meets the body."""
    dx, dy = {"left": (1, 0), "right": (-1, 0), "bottom": (0, 1), "top": (0, -1)}[side]
    return x + dx, y + dy
