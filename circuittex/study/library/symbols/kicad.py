"""Symbols for KiCad 7 and later: one `.kicad_sym` for all sub-circuits in the dialect of ngspice, which KiCad runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from circuittex.study.library.cell import Cell
from circuittex.study.library.symbols.expression import Text, write
from circuittex.study.library.symbols.layout import Layout, Place, layout, weave

VERSION = 20220914
"""Of the format of symbols: that of KiCad 7, which later ones read."""
PITCH = 2.54
"""mm in a unit of the grid, on which KiCad expects pins."""
DATASHEET = "datasheet.html"
TYPES = {"electrical": "passive", "control": "input", "flag": "output"}
"""KiCad's types of pins, by kind."""
ANGLES = {"left": 0, "bottom": 90, "right": 180, "top": 270}
"""Where a pin points, from its free end to the body."""

Expression = list[object]


def symbol_library(cells: Sequence[Cell], design: str) -> str:
    """The text of a `.kicad_sym` with a symbol for each cell; paths are relative to the library's folder.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
    >>> text = symbol_library([Cell("piece", "ports", "a piece", pins, (), "ngspice/piece.lib", "ngspice")], "weave")
    >>> '(property "Sim.Pins" "1=a 2=b"' in text
    True
    """
    symbols = [symbol(cell, design) for cell in cells]
    return write(["kicad_symbol_lib", ["version", VERSION], ["generator", "circuittex"], *symbols]) + "\n"


def symbol(cell: Cell, design: str, name: str = "") -> Expression:
    """One symbol; `name` is its full name where it is embedded in a schematic."""
    found = layout(cell)
    top = (found.height - found.height // 2 + 2) * PITCH
    fields = [
        field(key, text, 0, top + 2 * PITCH * (key == "Reference"), key not in ("Reference", "Value"))
        for key, text in fields_of(cell, design).items()
    ]
    head = ["symbol", Text(name or cell.name), ["pin_names", ["offset", 0.508]], ["in_bom", "yes"], ["on_board", "yes"]]
    body = ["symbol", Text(f"{cell.name}_0_1"), *_body(found)]
    pins = ["symbol", Text(f"{cell.name}_1_1"), *(_pin(found, place) for place in found.places)]
    return [*head, *fields, body, pins]


def fields_of(cell: Cell, design: str, base: str = "") -> dict[str, str]:
    """Fields of a symbol by name; `base` stands before paths that are relative to the library's folder."""
    fields = {
        "Reference": "X",
        "Value": cell.name,
        "Footprint": "",
        "Datasheet": base + DATASHEET,
        "Sim.Device": "SUBCKT",
        "Sim.Library": base + cell.file,
        "Sim.Name": cell.name,
        "Sim.Pins": " ".join(f"{k}={pin.name}" for k, pin in enumerate(cell.pins, 1)),
    }
    if cell.parameters:
        fields["Sim.Params"] = " ".join(f"{name}={value}" for name, value in cell.parameters)
    return {**fields, "ki_keywords": "fabric e-textile", "ki_description": f"{cell.title}; design: {design}"}


def field(key: str, text: str, x: float, y: float, hidden: bool) -> Expression:
    """One property of a symbol."""
    font: Expression = ["effects", ["font", ["size", 1.27, 1.27]], *(["hide"] if hidden else [])]
    return ["property", Text(key), Text(text), ["at", x, y, 0], font]


def position(found: Layout, x: float, y: float) -> tuple[float, float]:
    """Of a point of the grid in mm, from the origin of the symbol; y upwards."""
    return round((x - found.width // 2) * PITCH, 4), round((y - found.height // 2) * PITCH, 4)


def line(points: Sequence[tuple[float, float]], width: float = 0.254) -> Expression:
    """A line in a symbol."""
    stroke = ["stroke", ["width", width], ["type", "default"]]
    return ["polyline", ["pts", *(["xy", *point] for point in points)], stroke, ["fill", ["type", "none"]]]


def pin(kind: str, at: tuple[float, float], angle: int, length: float, name: str, number: int) -> Expression:
    """A pin whose free end is `at`."""
    font = ["effects", ["font", ["size", 1.27, 1.27]]]
    ends = [["at", *at, angle], ["length", length], ["name", Text(name), font], ["number", Text(str(number)), font]]
    return ["pin", kind, "line", *ends]


def _body(found: Layout) -> Iterator[Expression]:
    start, end = position(found, 0, found.height), position(found, found.width, 0)
    stroke = ["stroke", ["width", 0.254], ["type", "default"]]
    yield ["rectangle", ["start", *start], ["end", *end], stroke, ["fill", ["type", "background"]]]
    for (x0, y0), (x1, y1) in weave(found):
        yield line([position(found, x0, y0), position(found, x1, y1)], 0.508)


def _pin(found: Layout, place: Place) -> Expression:
    at = position(found, place.x, place.y)
    return pin(TYPES[place.pin.kind], at, ANGLES[place.side], PITCH, place.pin.name, place.number)
