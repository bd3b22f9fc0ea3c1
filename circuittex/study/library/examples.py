"""Decks that run as they stand and use the library: a resistance, strain as a parameter, strain as a pin, probes."""

from __future__ import annotations

from collections.abc import Sequence

from circuittex.design import Design, Probe
from circuittex.design.statement import NONLINEAR
from circuittex.electrical.network.circuit import Circuit, yarn_end_name
from circuittex.netlist import Header, deck
from circuittex.study.export import COLD
from circuittex.study.library.cell import Cell
from circuittex.study.library.dialect import DIALECTS
from circuittex.study.library.instance import instance

OHMMETER = "1 V between {} and {}, all others open; what flows in is minus the current of the source"
SINE = {"ltspice": "SINE"}
"""How the source is called where it is not SIN."""


def example_deck(
    cell: Cell, ends: tuple[str, str], ranges: Sequence[tuple[float, float]], floating: Sequence[str] = ()
) -> str:
    """A deck that measures between two pins, `ends`, to stand in a folder beside that of the cell's file.

    `ranges`: smallest and largest sampled strain of each input; they do not matter where strain is none.
    `floating` pins, of parts that nothing joins to these, have a large resistor to ground.
    """
    if cell.parameters:
        return _parameter(cell, ends, ranges, floating)
    pin = any(pin.kind == "control" for pin in cell.pins)
    return _pin(cell, ends, ranges, floating) if pin else _resistance(cell, ends, floating)


def _resistance(cell: Cell, ends: tuple[str, str], floating: Sequence[str]) -> str:
    # A sweep of one point: gnucap and LTspice print and measure nothing of an operating point.
    lines = ["V1 in 0 1", _call(cell, ends), *_grounded(ends, floating), ".print dc v(in) i(V1)", ".dc V1 1 1 1"]
    return _deck(cell, OHMMETER.format(*ends), lines)


def _parameter(
    cell: Cell, ends: tuple[str, str], ranges: Sequence[tuple[float, float]], floating: Sequence[str]
) -> str:
    flagged = any(pin.kind == "flag" for pin in cell.pins)
    strained = "at the lowest strain, amid the range, and beyond it, where the flag is up"
    where = strained if flagged else "at the low end, as stated, and beyond the high end, as at it"
    what = f"{OHMMETER.format(*ends)}; {where}"
    lines = []
    places = [(low, (low + high) / 2, 2 * high - low) for low, high in ranges]
    for number, strains in enumerate(zip(*places, strict=True), 1):
        values = " ".join(f"{name}={e!r}" for (name, _), e in zip(cell.parameters, strains, strict=False))
        given = f" {DIALECTS[cell.dialect].parameters}{values}"
        lines += [f"V{number} in_{number} 0 1", _call(cell, ends, f"_{number}") + given]
        lines += _grounded(ends, floating, f"_{number}")
    flags = " v(out_of_range_1) v(out_of_range_3)" if flagged else ""
    show = f"i(V1) i(V2) i(V3){flags}"
    return _deck(cell, what, [*lines, f".print dc {show}", ".dc V1 1 1 1"])


def _pin(cell: Cell, ends: tuple[str, str], ranges: Sequence[tuple[float, float]], floating: Sequence[str]) -> str:
    inputs = [pin.name for pin in cell.pins if pin.kind == "control"]
    lines = ["V1 in 0 1"]
    for name, (low, high) in zip(inputs, ranges, strict=True):
        sine = f"{SINE.get(cell.dialect, 'SIN')}({(low + high) / 2!r} {(high - low) / 2!r} 100 0 0 -90)"
        lines.append(f"V{name} {name} 0 {sine}")
    lines += [_call(cell, ends), *_grounded(ends, floating)]
    lines.append(f".print tran {' '.join(f'v({name})' for name in inputs)} i(V1) v(out_of_range)")
    if cell.dialect != "xyce":
        lines.append(".meas tran i_stretched FIND i(V1) AT=5m")
    return _deck(
        cell, f"{OHMMETER.format(*ends)}; strain breathes once through its range in 10 ms", [*lines, ".tran 20u 10m"]
    )


def _deck(cell: Cell, what: str, lines: list[str]) -> str:
    return "\n".join([f"* {cell.name}: {what}", f".include ../{cell.file}", *lines, ".end", ""])


def _call(cell: Cell, ends: tuple[str, str], end: str = "") -> str:
    """The card of an instance; its nodes are called like the pins, the first of `ends` 'in', the second is ground."""
    return instance(cell, f"X1{end}", {pin.name: _node(ends, pin.name, end) for pin in cell.pins})


def _node(ends: tuple[str, str], pin: str, end: str) -> str:
    """The node of a deck at a pin."""
    return {ends[0]: f"in{end}", ends[1]: "0"}.get(pin, f"{pin}{end}")


def _grounded(ends: tuple[str, str], floating: Sequence[str], end: str = "") -> list[str]:
    """Resistors that keep what floats near ground."""
    return [f"R{pin}{end} {_node(ends, pin, end)} 0 1e9" for pin in floating]


def crimped_probe(design: Design, circuit: Circuit, probe: Probe, state: str) -> str:
    """A probe's deck on the circuit that has a port for each yarn end: the answer of the sub-circuits."""
    ends = {terminal.name: [yarn_end_name(yarn, side) for yarn, side in terminal.ends] for terminal in design.terminals}
    drive = dict.fromkeys(ends[probe.source], probe.voltage) | dict.fromkeys(ends[probe.sink], 0.0)
    title = f"detailed resistor network, probe {probe.name}, the fibrils of every yarn end joined"
    notes = (COLD,) if design.electrical.heating == NONLINEAR else ()
    return deck(circuit, drive, Header(title, design.name, state=state, notes=notes))
