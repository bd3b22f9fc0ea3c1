"""The netlists of one recorded state: detailed sub-circuit, probe decks, reduced network."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from circuittex.circuit import Circuit, build_circuit, reduced_circuit, yarn_end_terminals
from circuittex.contact.merge import Simplified, simplify
from circuittex.contact.state import ContactState
from circuittex.design import Design, Probe, design_hash
from circuittex.fit import Fit
from circuittex.netlist import Header, deck, subcircuit

JOINED = "every yarn end is one pin that joins its fibrils; the probe decks join those of their two terminals only"


def simplified(design: Design, contacts: ContactState, *, merge_length: float | None = None) -> Simplified:
    """The contacts as a design wants them in netlists; `merge_length` (mm) in place of the design's, 0 keeps all."""
    numerics = design.numerics
    return simplify(
        contacts,
        merge_length=numerics.merge_length if merge_length is None else merge_length,
        snap_length=numerics.snap_length,
        drop_fraction=numerics.drop_fraction,
    )


def detailed_circuit(simple: Simplified) -> Circuit:
    """Fibril segments and contacts, with one port for each yarn end."""
    terminals = yarn_end_terminals(simple.contacts.mesh)
    return build_circuit(simple.contacts, terminals, dropped_contacts=simple.dropped_contacts)


def detailed_netlist(design: Design, state: str, simple: Simplified) -> str:
    """The `.subckt` of `detailed_circuit`."""
    notes = (JOINED, *_counts(simple))
    header = _header(design, state)("detailed resistor network of fibril segments and contacts", notes=notes)
    return subcircuit(detailed_circuit(simple), f"{design.name} {state}", header)


def probe_netlist(design: Design, state: str, simple: Simplified, probe: Probe) -> str:
    """A runnable deck of the detailed network as one probe sees it: all other fibril ends insulated one by one."""
    terminals = [terminal for terminal in design.terminals if terminal.name in (probe.source, probe.sink)]
    circuit = build_circuit(simple.contacts, terminals, dropped_contacts=simple.dropped_contacts)
    header = _header(design, state)(f"detailed resistor network, probe {probe.name}", notes=_counts(simple))
    return deck(circuit, {probe.source: probe.voltage, probe.sink: 0.0}, header)


def reduced_netlist(design: Design, state: str, fit: Fit) -> str:
    """The `.subckt` of the reduced network [43-46], one pin for each yarn end."""
    circuit = reduced_circuit((len(design.weave.warp), len(design.weave.weft)), fit.Ry, fit.Rc)
    notes = (f"Ry = {fit.Ry!r} ohm a yarn segment, Rc = {fit.Rc!r} ohm a crossing", *fit.warnings)
    header = _header(design, state)("reduced network of yarn segments and crossings", notes=notes)
    return subcircuit(circuit, f"{design.name} {state} reduced", header)


def write_netlists(folder: Path, design: Design, state: str, simple: Simplified, fit: Fit | None) -> Path:
    """Write all netlists of a state into `folder`; returns the path of the detailed sub-circuit."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{state}.sub"
    texts = {path: detailed_netlist(design, state, simple)}
    for probe in design.probes:
        texts[folder / f"{state}_{probe.name}.cir"] = probe_netlist(design, state, simple, probe)
    if fit is not None and 0 < fit.Ry < float("inf"):
        texts[folder / f"{state}_reduced.sub"] = reduced_netlist(design, state, fit)
    for file, text in texts.items():
        file.write_text(text, encoding="ascii")
    return path


def _header(design: Design, state: str) -> partial[Header]:
    return partial(Header, design=design.name, design_hash=design_hash(design), state=state)


def _counts(simple: Simplified) -> tuple[str, ...]:
    return (f"contact points added to a neighbour of the same two fibrils: {simple.merged_contacts}",)
