"""A small KiCad project that uses a symbol of the library: a divider of a resistor and a piece of fabric."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator, Sequence

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.study.library.cell import Cell
from circuittex.study.library.instance import instance
from circuittex.study.library.network import Network, farthest
from circuittex.study.library.symbols.expression import Text, write
from circuittex.study.library.symbols.kicad import (
    PITCH,
    Expression,
    field,
    fields_of,
    line,
    pin,
    position,
    symbol,
)
from circuittex.study.library.symbols.layout import layout

NAME = "fabric_example"
"""Of the project and its files."""
VERSION = 20230121
"""Of the format of schematics: that of KiCad 7."""
LIBRARY = "../../"
"""The library's folder, seen from the project's."""
SUPPLY = "3.3"
DIRECTIVES = {True: ".tran 1m 100m", False: ".op"}
"""What is simulated where strain is a pin, and where it is no input."""
LEFT, TOP = 16, 30
"""Where the sources and the resistor are, in units of the grid of the sheet."""

Point = tuple[float, float]


@frozen
class Item:
    """A symbol on the sheet."""

    name: str
    """Of its symbol, with that of its library: 'Device:R'."""
    reference: str
    """As in the netlist."""
    at: Point
    """On the sheet, mm, y downwards."""
    fields: dict[str, str]
    """All others."""
    pins: int
    """How many."""


@frozen
class Divider:
    """What the project shows: a supply, a resistor, and the fabric from its first pin to another."""

    ends: tuple[str, str]
    """The pins of the fabric at the resistor and at ground."""
    ohm: str
    """The resistor."""
    low: float
    """The smallest strain."""
    high: float
    """The largest."""


def divider(network: Network) -> Divider:
    """The fabric between two pins far apart, and a resistor like it.

    >>> network = Network(("a", "b", "c"), ("a_b", "b_c"), (("a", "b"), ("b", "c")), np.zeros(1), np.full((1, 2), 0.1))
    >>> divider(network)
    Divider(ends=('a', 'c'), ohm='20', low=0.0, high=0.0)
    """
    ends, ohm = farthest(network)
    value = np.format_float_positional(float(f"{ohm:.1g}"), trim="-")
    return Divider(ends, value, float(network.strain[0]), float(network.strain[-1]))


def example_project(cell: Cell, design: str, symbols: str, shown: Divider) -> dict[str, str]:
    """Texts of the project by the names of files; `symbols` is the name of the `.kicad_sym` in the folder above.

    Strain goes through its range and back where it is a pin. The `.cir` is the netlist of the sheet, for ngspice alone.

    >>> from circuittex.study.library.cell import Pin
    >>> pins = (Pin("a", "left", "electrical"), Pin("b", "right", "electrical"))
    >>> piece = Cell("piece", "ports", "a piece", pins, (), "ngspice/piece.lib", "ngspice")
    >>> sorted(example_project(piece, "weave", "fabric.kicad_sym", Divider(("a", "b"), "100", 0.0, 0.0)))
    ['fabric_example.cir', 'fabric_example.kicad_pro', 'fabric_example.kicad_sch', 'sym-lib-table']
    """
    project = {"meta": {"filename": f"{NAME}.kicad_pro", "version": 1}, "sheets": [[_id("sheet"), ""]]}
    nickname = symbols.rpartition(".")[0]
    uri = Text(f"${{KIPRJMOD}}/../{symbols}")
    row = ["lib", ["name", Text(nickname)], ["type", Text("KiCad")], ["uri", uri]]
    table = ["sym_lib_table", ["version", 7], [*row, ["options", Text("")], ["descr", Text("circuittex")]]]
    return {
        f"{NAME}.kicad_pro": json.dumps(project, indent=2) + "\n",
        f"{NAME}.kicad_sch": write(_sheet(cell, design, nickname, shown)) + "\n",
        f"{NAME}.cir": _netlist(cell, shown),
        "sym-lib-table": write(table) + "\n",
    }


def _strained(cell: Cell) -> bool:
    return any(each.kind == "control" for each in cell.pins)


def _netlist(cell: Cell, shown: Divider) -> str:
    """The sheet as a netlist, by the rules of KiCad: reference, nodes in the order of the file, name, parameters."""
    nets = dict(zip(shown.ends, ("sense", "0"), strict=True))
    nets |= {pin.name: pin.name for pin in cell.pins if pin.kind != "electrical"}
    lines = [f"* {NAME}: the netlist of {NAME}.kicad_sch", f".include {LIBRARY}{cell.file}", instance(cell, "X1", nets)]
    lines += [f"V1 supply 0 DC {SUPPLY}", f"R1 supply sense {shown.ohm}"]
    if _strained(cell):
        dc, amplitude = _sine(shown)
        lines.append(f"V2 strain 0 SIN( {dc!r} {amplitude!r} 10 0 0 -90 )")
        lines.append(".print tran v(strain) v(sense) v(out_of_range)")
    return "\n".join([*lines, DIRECTIVES[_strained(cell)], ".end", ""])


def _sine(shown: Divider) -> tuple[float, float]:
    """Middle and amplitude of the strain."""
    return (shown.low + shown.high) / 2, (shown.high - shown.low) / 2


def _sheet(cell: Cell, design: str, nickname: str, shown: Divider) -> Expression:
    strained = _strained(cell)
    fabric = Item(f"{nickname}:{cell.name}", "X1", _place(cell), fields_of(cell, design, LIBRARY), len(cell.pins))
    items = [
        fabric,
        _source("V1", _grid(LEFT, TOP), "DC", f"dc={SUPPLY}"),
        Item("Device:R", "R1", _grid(LEFT + 6, TOP - 0.5), {"Reference": "R", "Value": shown.ohm}, 2),
    ]
    if strained:
        dc, amplitude = _sine(shown)
        sine = f"dc={dc!r} ampl={amplitude!r} f=10 td=0 theta=0 phase=-90"
        items.append(_source("V2", _grid(LEFT, TOP + 12), "SIN", sine))
    marks = list(_marks(cell, shown.ends))
    grounds = [at for name, at in marks if name == "0"]
    items += [
        Item("power:GND", f"#PWR0{k}", at, {"Reference": "#PWR", "Value": "GND"}, 1) for k, at in enumerate(grounds, 1)
    ]
    drawn = [symbol(cell, design, fabric.name), *_own(strained)]
    title = ["title_block", ["title", Text(f"{design}: a piece of fabric in a divider")]]
    head = [
        "kicad_sch",
        ["version", VERSION],
        ["generator", "circuittex"],
        ["uuid", _id("sheet")],
        ["paper", Text("A3")],
    ]
    return [
        *head,
        title,
        ["lib_symbols", *drawn],
        *(_mark(name, at) for name, at in marks if name != "0"),
        *_wires(),
        ["text", Text(DIRECTIVES[strained]), ["at", *_grid(LEFT, TOP - 8), 0], _font(), ["uuid", _id("directive")]],
        *(_placed(item) for item in items),
        ["sheet_instances", ["path", Text("/"), ["page", Text("1")]]],
    ]


def _marks(cell: Cell, ends: tuple[str, str]) -> Iterator[tuple[str, Point]]:
    """Nets by name and place: '0' is ground and '' no connection."""
    found = layout(cell)
    nets = dict(zip(ends, ("sense", "0"), strict=True))
    for place in found.places:
        x, y = position(found, place.x, place.y)
        at = _place(cell)
        net = nets.get(place.pin.name, "" if place.pin.kind == "electrical" else place.pin.name)
        yield net, (round(at[0] + x, 4), round(at[1] - y, 4))
    yield "supply", _grid(LEFT + 3, TOP - 2)
    yield "sense", _grid(LEFT + 10, TOP + 1)
    yield "0", _grid(LEFT, TOP + 2)
    if _strained(cell):
        yield "strain", _grid(LEFT, TOP + 10)
        yield "0", _grid(LEFT, TOP + 14)


def _place(cell: Cell) -> Point:
    """Of the fabric: on the right of all else, however wide it is."""
    found = layout(cell)
    return _grid(LEFT + 16 + found.width // 2, TOP + found.height // 2)


def _mark(name: str, at: Point) -> Expression:
    key = ["uuid", _id(f"mark {name} {at}")]
    return ["label", Text(name), ["at", *at, 0], _font(), key] if name else ["no_connect", ["at", *at], key]


def _wires() -> Iterator[Expression]:
    """From the supply to the resistor, and from there to the label of what is measured."""
    for start, end in (((LEFT, TOP - 2), (LEFT + 6, TOP - 2)), ((LEFT + 6, TOP + 1), (LEFT + 10, TOP + 1))):
        points = ["pts", ["xy", *_grid(*start)], ["xy", *_grid(*end)]]
        stroke = ["stroke", ["width", 0], ["type", "default"]]
        yield ["wire", points, stroke, ["uuid", _id(f"wire {start}")]]


def _placed(item: Item) -> Expression:
    x, y = item.at
    texts = {**item.fields, "Reference": item.reference}
    fields = [
        field(key, text, x + 2 * PITCH, y - PITCH * (key == "Reference"), key not in ("Reference", "Value"))
        for key, text in texts.items()
        if not key.startswith("ki_")
    ]
    path = ["path", Text(f"/{_id('sheet')}"), ["reference", Text(item.reference)], ["unit", 1]]
    return [
        *["symbol", ["lib_id", Text(item.name)], ["at", x, y, 0], ["unit", 1]],
        *[["in_bom", "yes"], ["on_board", "yes"], ["dnp", "no"], ["uuid", _id(item.reference)]],
        *fields,
        *(["pin", Text(str(k)), ["uuid", _id(f"{item.reference} {k}")]] for k in range(1, item.pins + 1)),
        ["instances", ["project", Text(NAME), path]],
    ]


def _source(reference: str, at: Point, kind: str, parameters: str) -> Item:
    fields = {"Reference": "V", "Value": "strain" if kind == "SIN" else SUPPLY}
    fields |= {"Sim.Device": "V", "Sim.Type": kind, "Sim.Pins": "1=+ 2=-", "Sim.Params": parameters}
    return Item(f"Simulation_SPICE:V{kind}", reference, at, fields, 2)


def _own(strained: bool) -> Iterator[Expression]:
    """Symbols with the names and places of pins of those that come with KiCad, which need not be installed."""
    box = [(-1.016, 2.54), (1.016, 2.54), (1.016, -2.54), (-1.016, -2.54), (-1.016, 2.54)]
    yield _two_pins("Device:R", "R", ("~", "~"), 3.81, box)
    circle = [(0.0, 2.54), (1.8, 1.8), (2.54, 0.0), (1.8, -1.8), (0.0, -2.54)]
    circle += [(-x, -y) for x, y in circle[1:]]
    for kind in ("DC", "SIN") if strained else ("DC",):
        yield _two_pins(f"Simulation_SPICE:V{kind}", "V", ("+", "-"), 5.08, circle)
    down: list[Point] = [(0, 0), (0, -1.27), (1.27, -1.27), (0, -2.54), (-1.27, -1.27), (0, -1.27)]
    ground = pin("power_in", (0, 0), 270, 0, "GND", 1)
    ground.insert(5, "hide")
    fields = [field("Reference", "#PWR", 0, -6.35, True), field("Value", "GND", 0, -3.81, False)]
    body, pins = ["symbol", Text("GND_0_1"), line(down)], ["symbol", Text("GND_1_1"), ground]
    yield ["symbol", Text("power:GND"), ["power"], ["in_bom", "yes"], ["on_board", "yes"], *fields, body, pins]


def _two_pins(name: str, letter: str, names: tuple[str, str], reach: float, drawn: Sequence[Point]) -> Expression:
    word = name.partition(":")[2]
    fields = [field("Reference", letter, 2.54, 1.27, False), field("Value", word, 2.54, -1.27, False)]
    plus = pin("passive", (0, reach), 270, reach - 2.54, names[0], 1)
    minus = pin("passive", (0, -reach), 90, reach - 2.54, names[1], 2)
    body, pins = ["symbol", Text(f"{word}_0_1"), line(drawn)], ["symbol", Text(f"{word}_1_1"), plus, minus]
    return ["symbol", Text(name), ["in_bom", "yes"], ["on_board", "yes"], *fields, body, pins]


def _grid(x: float, y: float) -> Point:
    return round(x * PITCH, 4), round(y * PITCH, 4)


def _font() -> Expression:
    return ["effects", ["font", ["size", 1.27, 1.27]], ["justify", "left", "bottom"]]


def _id(what: str) -> str:
    """The same for every export: a folder that is written again does not differ."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"circuittex {NAME} {what}"))
