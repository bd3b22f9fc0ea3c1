"""Decks that run as they stand and use the library: a resistance, strain as a parameter, strain as a pin, probes."""

from __future__ import annotations

from collections.abc import Sequence

from circuittex.design import Design, Probe
from circuittex.electrical.network.circuit import Circuit, yarn_end_name
from circuittex.netlist import Header, deck
from circuittex.study.library.cell import Cell
from circuittex.study.library.dialect import DIALECTS

OHMMETER = "1 V between the first two pins, all others open; what flows in is minus the current of the source"
SINE = {"ltspice": "SINE"}
"""How the source is called where it is not SIN."""


def example_deck(cell: Cell, ranges: Sequence[tuple[float, float]], floating: Sequence[str] = ()) -> str:
    """A deck that measures between the first two pins, to stand in a folder beside that of the cell's file.

    `ranges`: smallest and largest sampled strain of each input; they do not matter where strain is none.
    `floating` pins, of parts that nothing joins to the second pin, have a large resistor to ground.
    """
    if cell.parameters:
        return _parameter(cell, ranges, floating)
    pin = any(pin.kind == "control" for pin in cell.pins)
    return _pin(cell, ranges, floating) if pin else _resistance(cell, floating)


def _resistance(cell: Cell, floating: Sequence[str]) -> str:
    # A sweep of one point: gnucap and LTspice print and measure nothing of an operating point.
    lines = ["V1 in 0 1", _call(cell), *_grounded(cell, floating), ".print dc v(in) i(V1)", ".dc V1 1 1 1"]
    return _deck(cell, OHMMETER, lines)


def _parameter(cell: Cell, ranges: Sequence[tuple[float, float]], floating: Sequence[str]) -> str:
    what = f"{OHMMETER}; at the lowest strain, amid the range, and beyond it, where the flag is up"
    lines = []
    places = [(low, (low + high) / 2, 2 * high - low) for low, high in ranges]
    for number, strains in enumerate(zip(*places, strict=True), 1):
        values = " ".join(f"{name}={e!r}" for (name, _), e in zip(cell.parameters, strains, strict=False))
        given = f" {DIALECTS[cell.dialect].parameters}{values}"
        lines += [f"V{number} in_{number} 0 1", _call(cell, f"_{number}") + given]
        lines += _grounded(cell, floating, f"_{number}")
    show = "i(V1) i(V2) i(V3) v(out_of_range_1) v(out_of_range_3)"
    return _deck(cell, what, [*lines, f".print dc {show}", ".dc V1 1 1 1"])


def _pin(cell: Cell, ranges: Sequence[tuple[float, float]], floating: Sequence[str]) -> str:
    inputs = [pin.name for pin in cell.pins if pin.kind == "control"]
    lines = ["V1 in 0 1"]
    for name, (low, high) in zip(inputs, ranges, strict=True):
        sine = f"{SINE.get(cell.dialect, 'SIN')}({(low + high) / 2!r} {(high - low) / 2!r} 100 0 0 -90)"
        lines.append(f"V{name} {name} 0 {sine}")
    lines += [_call(cell), *_grounded(cell, floating)]
    lines.append(f".print tran {' '.join(f'v({name})' for name in inputs)} i(V1) v(out_of_range)")
    if cell.dialect != "xyce":
        lines.append(".meas tran i_stretched FIND i(V1) AT=5m")
    return _deck(cell, f"{OHMMETER}; strain breathes once through its range in 10 ms", [*lines, ".tran 20u 10m"])


def _deck(cell: Cell, what: str, lines: list[str]) -> str:
    return "\n".join([f"* {cell.name}: {what}", f".include ../{cell.file}", *lines, ".end", ""])


def _call(cell: Cell, end: str = "") -> str:
    """The card of an instance; its nodes are called like the pins, the first one 'in', the second is ground."""
    return f"X1{end} {' '.join(_node(cell, pin.name, end) for pin in cell.pins)} {cell.name}"


def _node(cell: Cell, pin: str, end: str) -> str:
    """The node of a deck at a pin."""
    first, second = [pin.name for pin in cell.pins if pin.kind == "electrical"][:2]
    return {first: f"in{end}", second: "0"}.get(pin, f"{pin}{end}")


def _grounded(cell: Cell, floating: Sequence[str], end: str = "") -> list[str]:
    """Resistors that keep what floats near ground."""
    return [f"R{pin}{end} {_node(cell, pin, end)} 0 1e9" for pin in floating]


def crimped_probe(design: Design, circuit: Circuit, probe: Probe, state: str) -> str:
    """A probe's deck on the circuit that has a port for each yarn end: the answer of the sub-circuits."""
    ends = {terminal.name: [yarn_end_name(yarn, side) for yarn, side in terminal.ends] for terminal in design.terminals}
    drive = dict.fromkeys(ends[probe.source], probe.voltage) | dict.fromkeys(ends[probe.sink], 0.0)
    title = f"detailed resistor network, probe {probe.name}, the fibrils of every yarn end joined"
    return deck(circuit, drive, Header(title, design.name, state=state))
