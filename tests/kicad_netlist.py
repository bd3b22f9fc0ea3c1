"""SPICE from KiCad's files as KiCad's own exporter makes it, on what kiutils reads.

It knows nothing of what wrote them. After KiCad 7's documentation of its simulator: a symbol's `Sim.Pins` gives the pin
of the model for each number of a pin; nodes stand in the order of the `.subckt` card, then the name, then `Sim.Params`.
Nets join at coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from library_cases import pins_of

SNAP = 1e-3
"""mm: KiCad's own grid of places is finer than that."""
GROUND = {"GND": "0"}


def fields(symbol: Any) -> dict[str, str]:
    """Properties of a symbol or of one placed on a sheet."""
    return {each.key: each.value for each in symbol.properties}


def pins(symbol: Any) -> list[Any]:
    """Pins of all units of a symbol."""
    return [pin for unit in symbol.units for pin in unit.pins]


def card(reference: str, given: Mapping[str, str], nets: Mapping[str, str], folder: Path) -> str:
    """The line of an item whose pin of each number is on the net `nets`; a library's path starts in `folder`."""
    if given.get("Sim.Device") != "SUBCKT":
        source = given.get("Sim.Device") == "V"
        value = _source(given["Sim.Type"], given["Sim.Params"]) if source else given["Value"]
        return f"{reference} {nets['1']} {nets['2']} {value}"
    number = {model: k for k, _, model in (word.partition("=") for word in given["Sim.Pins"].split())}
    nodes = [nets[number[pin]] for pin in pins_of((folder / given["Sim.Library"]).read_text("ascii"))]
    return " ".join([reference, *nodes, given["Sim.Name"], *given.get("Sim.Params", "").split()])


def _source(kind: str, parameters: str) -> str:
    values = dict(word.split("=") for word in parameters.split())
    if kind == "DC":
        return f"DC {values['dc']}"
    return f"SIN( {' '.join(values[key] for key in ('dc', 'ampl', 'f', 'td', 'theta', 'phase'))} )"


def netlist(sheet: Any, folder: Path) -> list[str]:
    """Lines of the netlist of a kiutils `Schematic` in `folder`, with its texts that are directives."""
    drawn = {each.libId: each for each in sheet.libSymbols}
    placed = {}
    names: dict[tuple[float, float], str] = {}
    for item in sheet.schematicSymbols:
        assert item.position.angle in (0, None)
        reference = fields(item)["Reference"]
        for pin in pins(drawn[item.libId]):
            at = (item.position.X + pin.position.X, item.position.Y - pin.position.Y)
            if reference.startswith("#"):
                names[at] = GROUND[fields(item)["Value"]]
            placed[reference, pin.number] = at
    names |= {(each.position.X, each.position.Y): each.text for each in sheet.labels}
    wires = [[(p.X, p.Y) for p in each.points] for each in sheet.graphicalItems]
    nets = {key: _net(at, wires, names) or f"nc_{key[0]}_{key[1]}".lower() for key, at in placed.items()}
    unused = [(each.position.X, each.position.Y) for each in sheet.noConnects]
    for key, at in placed.items():
        assert any(_close(at, other) for other in unused) == nets[key].startswith("nc_"), key
    lines, libraries = [], []
    for item in sheet.schematicSymbols:
        given = fields(item)
        reference = given["Reference"]
        if not reference.startswith("#"):
            own = {number: net for (owner, number), net in nets.items() if owner == reference}
            lines.append(card(reference, given, own, folder))
            libraries += [f".include {(folder / given['Sim.Library']).resolve()}"] if "Sim.Library" in given else []
    return [*libraries, *lines, *(each.text for each in sheet.texts if each.text.startswith("."))]


def _close(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return abs(a[0] - b[0]) < SNAP and abs(a[1] - b[1]) < SNAP


def _on(at: tuple[float, float], wire: list[tuple[float, float]]) -> bool:
    """Whether a point is on an upright or level wire."""
    (x0, y0), (x1, y1) = wire
    return (
        min(x0, x1) - SNAP < at[0] < max(x0, x1) + SNAP
        and min(y0, y1) - SNAP < at[1] < max(y0, y1) + SNAP
        and (abs(x0 - x1) < SNAP or abs(y0 - y1) < SNAP)
    )


def _net(at: tuple[float, float], wires: list[list[tuple[float, float]]], names: dict[tuple[float, float], str]) -> str:
    """Name of what a point is on, directly or through one wire; empty where it is on nothing."""
    reached = [wire for wire in wires if _on(at, wire)]
    found = {name for place, name in names.items() if _close(at, place) or any(_on(place, wire) for wire in reached)}
    assert len(found) < 2, f"{found} are joined"
    return next(iter(found), "")
