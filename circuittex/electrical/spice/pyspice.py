"""A circuit as PySpice objects: sub-circuits of any size, and driven circuits of a designer's size."""

from __future__ import annotations

import os
from collections.abc import Mapping
from ctypes.util import find_library
from typing import Any

from circuittex.base.errors import CircuitError
from circuittex.electrical.network.circuit import Circuit, reached_part
from circuittex.electrical.network.names import unique_names

LARGEST = 2000
"""Resistors of the largest driven circuit that is given to PySpice."""


def to_pyspice(circuit: Circuit, drive: Mapping[str, float], title: str = "circuittex") -> Any:
    """Return a `PySpice.Spice.Netlist.Circuit` with the ports held at the given voltages, ready for `.simulator()`.

    Nodes, elements and signs are those of `netlist.deck`. PySpice looks for a library called 'libngspice.so', which
    only development packages install, so the installed one is named in NGSPICE_LIBRARY_PATH unless that is set.

    Raises `CircuitError` for more than `LARGEST` resistors.
    """
    part = reached_part(circuit, drive)
    if part.n_resistors > LARGEST:
        raise CircuitError(
            f"{part.n_resistors} resistors are too many for PySpice, which simulates them in the same process "
            f"(at most {LARGEST}); write the text with circuittex.netlist.deck"
        )
    _name_library()
    from PySpice.Spice.Netlist import Circuit as PySpiceCircuit

    built = PySpiceCircuit(unique_names([title])[0])
    nodes = _add_resistors(built, part)
    for port, volts in drive.items():
        pin = nodes[int(part.port_node[part.ports.index(port)])]
        built.V(pin, pin, built.gnd, float(volts))
    return built


def to_pyspice_subcircuit(circuit: Circuit, name: str) -> Any:
    """Return a `PySpice.Spice.Netlist.SubCircuit` called `name` whose pins are the ports, in their order.

    A circuit takes it with `.subcircuit(...)` and places it with `.X('1', name, node, node, ...)`.
    """
    _name_library()
    from PySpice.Spice.Netlist import SubCircuit

    nodes = unique_names(circuit.node_names)
    built = SubCircuit(unique_names([name])[0], *(nodes[pin] for pin in circuit.port_node.tolist()))
    _add_resistors(built, circuit)
    return built


def _name_library() -> None:
    library = find_library("ngspice")
    if library:
        os.environ.setdefault("NGSPICE_LIBRARY_PATH", library)


def _add_resistors(built: Any, part: Circuit) -> tuple[str, ...]:
    """Add all resistors; return the words that stand for the nodes."""
    nodes = unique_names(part.node_names)
    for name, (i, j), ohm in zip(
        unique_names(part.resistor_names), part.resistor_nodes.tolist(), part.resistance.tolist(), strict=True
    ):
        built.R(name, nodes[i], nodes[j], ohm)
    return nodes
