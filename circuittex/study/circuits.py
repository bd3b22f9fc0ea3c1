"""The circuits of one state: built once, by whoever records it, and handed to all who use them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from circuittex.base.frozen import frozen
from circuittex.contact.merge import Simplified
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.network.circuit import Circuit, build_circuits, reached_part, yarn_end_terminals
from circuittex.geometry.mesh import FibrilMesh


@frozen
class StateCircuits:
    """The circuits of a state's simplified contacts."""

    simple: Simplified
    """The contacts."""
    yarn_ends: Circuit
    """Fibril segments and contacts, with one port for each yarn end."""
    probes: tuple[Circuit, ...]
    """That of each probe, its source the first port and its sink the second."""

    @property
    def conducting(self) -> Circuit:
        """`yarn_ends` with the ends of yarns that conduct alone."""
        return reached_part(self.yarn_ends, [terminal.name for terminal in conducting_ends(self.simple.contacts.mesh)])

    def of(self, probe: Probe) -> Circuit:
        """The circuit of a probe."""
        return next(circuit for circuit in self.probes if circuit.ports == (probe.source, probe.sink))


def state_circuits(
    simple: Simplified, terminals: Sequence[Terminal] = (), probes: Sequence[Probe] = ()
) -> StateCircuits:
    """The circuits of a state for these probes between `terminals`."""
    choices = [yarn_end_terminals(simple.contacts.mesh), *_pairs(terminals, probes)]
    yarn_ends, *others = build_circuits(simple.contacts, choices, dropped_contacts=simple.dropped_contacts)
    return StateCircuits(simple, yarn_ends, tuple(others))


def probe_circuits(contacts: ContactState, terminals: Sequence[Terminal], probes: Sequence[Probe]) -> list[Circuit]:
    """The circuit of each probe: its two terminals are joined, all other fibril ends insulated."""
    return build_circuits(contacts, _pairs(terminals, probes))


def conducting_ends(mesh: FibrilMesh) -> tuple[Terminal, ...]:
    """A terminal for each end of a yarn that conducts."""
    conducts = np.bincount(mesh.yarn, mesh.electrical_conductivity, len(mesh.yarn_names)) > 0.0
    named = dict(zip(mesh.yarn_names, conducts, strict=True))
    return tuple(terminal for terminal in yarn_end_terminals(mesh) if named[terminal.ends[0][0]])


def _pairs(terminals: Sequence[Terminal], probes: Sequence[Probe]) -> list[list[Terminal]]:
    """Source and sink of each probe."""
    return [[t for name in (probe.source, probe.sink) for t in terminals if t.name == name] for probe in probes]
