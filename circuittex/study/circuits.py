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
    names: tuple[str, ...]
    """(n,) names of the probes."""
    probes: tuple[Circuit, ...]
    """(n,) that of each probe, its source the first port and its sink the second."""
    seen: tuple[Simplified, ...]
    """(n,) the contacts of these: `simple`, unless resistances follow the temperatures that the probe makes."""

    @property
    def conducting(self) -> Circuit:
        """`yarn_ends` with the ends of yarns that conduct alone."""
        return reached_part(self.yarn_ends, [terminal.name for terminal in conducting_ends(self.simple.contacts.mesh)])

    def of(self, probe: Probe) -> Circuit:
        """The circuit of a probe."""
        return self.probes[self.names.index(probe.name)]

    def seen_by(self, probe: Probe) -> Simplified:
        """The contacts of a probe's circuit."""
        return self.seen[self.names.index(probe.name)]


def state_circuits(
    simple: Simplified,
    terminals: Sequence[Terminal] = (),
    probes: Sequence[Probe] = (),
    seen: Sequence[Simplified] = (),
) -> StateCircuits:
    """The circuits of a state for these probes between `terminals`; `seen`: the contacts as each probe has them, where
    these are not `simple`."""
    pairs, names = _pairs(terminals, probes), tuple(probe.name for probe in probes)
    choices = [yarn_end_terminals(simple.contacts.mesh), *(() if seen else pairs)]
    yarn_ends, *others = build_circuits(simple.contacts, choices, dropped_contacts=simple.dropped_contacts)
    for each, pair in zip(seen, pairs, strict=True) if seen else ():
        others += build_circuits(each.contacts, [pair], dropped_contacts=each.dropped_contacts)
    return StateCircuits(simple, yarn_ends, names, tuple(others), tuple(seen) or (simple,) * len(names))


def probe_circuits(
    contacts: ContactState | Sequence[ContactState], terminals: Sequence[Terminal], probes: Sequence[Probe]
) -> list[Circuit]:
    """The circuit of each probe: its two terminals are joined, all other fibril ends insulated.

    `contacts`: of all probes, or of each its own."""
    pairs = _pairs(terminals, probes)
    if isinstance(contacts, ContactState):
        return build_circuits(contacts, pairs)
    return [build_circuits(each, [pair])[0] for each, pair in zip(contacts, pairs, strict=True)]


def conducting_ends(mesh: FibrilMesh) -> tuple[Terminal, ...]:
    """A terminal for each end of a yarn that conducts."""
    conducts = np.bincount(mesh.yarn, mesh.electrical_conductivity, len(mesh.yarn_names)) > 0.0
    named = dict(zip(mesh.yarn_names, conducts, strict=True))
    return tuple(terminal for terminal in yarn_end_terminals(mesh) if named[terminal.ends[0][0]])


def _pairs(terminals: Sequence[Terminal], probes: Sequence[Probe]) -> list[list[Terminal]]:
    """Source and sink of each probe."""
    return [[t for name in (probe.source, probe.sink) for t in terminals if t.name == name] for probe in probes]
