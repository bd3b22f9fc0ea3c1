"""The way back: a circuit from the SPICE text that `netlist` writes."""

from __future__ import annotations

import json

import numpy as np

from circuittex.base.errors import CircuitError
from circuittex.electrical.network.circuit import KINDS, Circuit


class _Reader:
    """What has been read of one circuit so far."""

    def __init__(self) -> None:
        self.number: dict[str, int] = {}
        self.places: list[tuple[int, float]] = []
        self.pairs: list[tuple[int, int]] = []
        self.ohm: list[float] = []
        self.names: list[str] = []
        self.kind: list[int] = []
        self.pins: list[tuple[str, str]] = []
        self.left_out: list[int] = []
        self.counts = {"nodes": 0, "resistors": 0, "merged feet": 0, "dropped contacts": 0, "fibrils left out": 0}
        self.current_kind = 0
        self.subcircuits = 0

    def comment(self, line: str) -> None:
        """Read '* key: value'; comments with other keys are for people."""
        key, _, value = line[1:].strip().partition(": ")
        if key == "node":
            name, *place = value.split()
            self.number[name] = len(self.number)
            self.places.append((int(place[0]), float(place[1])) if place else (-1, float("nan")))
        elif key == "pin":
            name, text = value.split(" ", 1)
            self.pins.append((name, str(json.loads(text))))
        elif key == "left out":
            self.left_out += map(int, value.split())
        elif key == "kind":
            self.current_kind = KINDS.index(value)
        elif key in self.counts:
            self.counts[key] = int(value)

    def card(self, line: str) -> None:
        """Read a resistor; sources, analyses and continued pin lists say nothing about the circuit."""
        if line[0] in "Rr":
            name, i, j, ohm = line.split()
            self.names.append(name[1:])
            self.pairs.append((self.number[i], self.number[j]))
            self.ohm.append(float(ohm))
            self.kind.append(self.current_kind)
        elif line.lower().startswith(".subckt"):
            self.subcircuits += 1
            if self.subcircuits > 1:
                raise ValueError("a second sub-circuit; parse reads one circuit")

    def circuit(self) -> Circuit:
        """Return what was read, if it is as much as the header promised."""
        found = {"nodes": len(self.places), "resistors": len(self.ohm), "fibrils left out": len(self.left_out)}
        for key, count in found.items():
            if self.counts[key] != count:
                raise CircuitError(f"netlist: the header promises {self.counts[key]} {key}, the text holds {count}")
        return Circuit(
            node_names=tuple(self.number),
            node_fibril=np.array([f for f, _ in self.places], dtype=np.int64),
            node_xi=np.array([xi for _, xi in self.places], dtype=np.float64),
            resistor_nodes=np.array(self.pairs, dtype=np.int64).reshape(-1, 2),
            resistance=np.array(self.ohm, dtype=np.float64),
            resistor_names=tuple(self.names),
            resistor_kind=np.array(self.kind, dtype=np.int64),
            ports=tuple(port for _, port in self.pins),
            port_node=np.array([self.number[pin] for pin, _ in self.pins], dtype=np.int64),
            merged_feet=self.counts["merged feet"],
            dropped_contacts=self.counts["dropped contacts"],
            unreached=np.array(self.left_out, dtype=np.int64),
        )


def parse(text: str) -> Circuit:
    """Return the circuit of a sub-circuit or deck that circuittex wrote; `CircuitError` names the line it cannot read.

    >>> from circuittex.electrical.network.circuit import reduced_circuit
    >>> from circuittex.netlist import subcircuit
    >>> parse(subcircuit(reduced_circuit((2, 2), 1.0, 5.0), "cell")).ports[:2]
    ('warp1_minus', 'warp1_plus')
    """
    if not text.startswith("* circuittex "):
        raise CircuitError("netlist: the first line must be the title '* circuittex <version> netlist: ...'")
    reader = _Reader()
    for number, line in enumerate(text.split("\n"), start=1):
        try:
            if line.startswith("*"):
                reader.comment(line)
            elif line:
                reader.card(line)
        except (ValueError, KeyError, IndexError) as error:
            raise CircuitError(f"netlist, line {number}: {line[:60]!r} cannot be read ({error})") from error
    return reader.circuit()
