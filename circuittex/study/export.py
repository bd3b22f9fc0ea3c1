"""The netlists of one recorded state: detailed sub-circuit, probe decks, reduced network."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from circuittex.base.atomic import write_text
from circuittex.contact.merge import Simplified, simplify
from circuittex.contact.state import ContactState
from circuittex.design import Design, Probe, design_hash
from circuittex.design.statement import NONLINEAR
from circuittex.electrical.fields import Fields, at_temperatures
from circuittex.electrical.network.circuit import with_ports
from circuittex.fit import Fit
from circuittex.netlist import Header, deck, subcircuit
from circuittex.study.circuits import StateCircuits, state_circuits

JOINED = "every yarn end is one pin that joins its fibrils; the probe decks join those of their two terminals only"
COLD = "resistances are those at 27 C; those at the temperatures that a probe makes are in its own deck"
WARM = "resistances are those at the temperatures that the probe makes; at another voltage they are others"


def simplified(design: Design, contacts: ContactState, *, merge_length: float | None = None) -> Simplified:
    """The contacts as a design wants them in netlists; `merge_length` (mm) in place of the design's, 0 keeps all."""
    numerics = design.numerics
    return simplify(
        contacts,
        merge_length=design.merge_length if merge_length is None else merge_length,
        snap_length=design.snap_length,
        drop_fraction=numerics.drop_fraction,
    )


def circuits_of(
    design: Design, contacts: ContactState, fields: Sequence[Fields], *, merge_length: float | None = None
) -> StateCircuits:
    """The circuits of a state with these `fields` of the design's probes: between yarn ends at 27 C, those of probes
    with the resistances that they have at the temperatures of the fields. `merge_length` as for `simplified`."""
    simple = simplified(design, contacts, merge_length=merge_length)
    warm = warm_contacts(contacts, fields)
    seen = () if isinstance(warm, ContactState) else [simplified(design, w, merge_length=merge_length) for w in warm]
    return state_circuits(simple, design.terminals, design.probes, seen)


def warm_contacts(contacts: ContactState, fields: Sequence[Fields]) -> ContactState | list[ContactState]:
    """The contacts as each of the probes has them; once for all where nothing follows their temperatures."""
    if not any(len(field.resistivity) for field in fields):
        return contacts
    return [at_temperatures(contacts, field) for field in fields]


def fewer(design: Design, contacts: ContactState | Sequence[ContactState]) -> ContactState | list[ContactState]:
    """The contacts of `simplified`, of one state or of each."""
    if isinstance(contacts, ContactState):
        return simplified(design, contacts).contacts
    return [simplified(design, each).contacts for each in contacts]


def detailed_netlist(design: Design, state: str, circuits: StateCircuits, *, merge_length: float | None = None) -> str:
    """The `.subckt` with a pin for each yarn end; `merge_length` as it was given to `simplified`, for the header."""
    cold = (COLD,) if design.electrical.heating == NONLINEAR else ()
    notes = (JOINED, *cold, *_simplification(design, circuits.simple, merge_length))
    header = _header(design, state)("detailed resistor network of fibril segments and contacts", notes=notes)
    return subcircuit(circuits.yarn_ends, f"{state_word(state)} {design.name}", header)


def probe_netlist(
    design: Design, state: str, circuits: StateCircuits, probe: Probe, *, merge_length: float | None = None
) -> str:
    """A runnable deck of the detailed network as one probe sees it: all other fibril ends insulated one by one.

    `probe` is driven by a voltage (`Record.driven`), and so is the deck; where the `design` states something else, the
    header says what. `merge_length` as it was given to `simplified`, for the header.
    """
    pins = [terminal.name for terminal in design.terminals if terminal.name in (probe.source, probe.sink)]
    circuit = with_ports(circuits.of(probe), pins)
    warm = (WARM,) if design.electrical.heating == NONLINEAR else ()
    notes = (*_drive(design, probe), *warm, *_simplification(design, circuits.seen_by(probe), merge_length))
    header = _header(design, state)(f"detailed resistor network, probe {probe.name}", notes=notes)
    return deck(circuit, {probe.source: probe.voltage, probe.sink: 0.0}, header)


def reduced_netlist(design: Design, state: str, fit: Fit) -> str:
    """The `.subckt` of the reduced network [43-46], one pin for each yarn end."""
    circuit = fit.circuit()
    cold = (COLD,) if design.electrical.heating == NONLINEAR else ()
    notes = (*_values(fit), *cold, *fit.warnings)
    header = _header(design, state)("reduced network of yarn segments and crossings", notes=notes)
    return subcircuit(circuit, f"{state_word(state)} reduced {design.name}", header)


def state_word(state: str) -> str:
    """The state as it begins the names of its sub-circuits, where a long title of the design cannot cut it off.

    SPICE ignores case and signs are no letters, so that a minus before a number is spelt out.

    >>> state_word("stretch-0.05"), state_word("stretch--0.05")
    ('stretch_0_05', 'stretch_minus_0_05')
    """
    return re.sub("[^a-z0-9]+", "_", state.lower().replace("--", "-minus-"))


def detailed_file(state: str) -> str:
    """Name of the file of a state's detailed sub-circuit."""
    return f"{state}.sub"


def _values(fit: Fit) -> list[str]:
    """What a reduced network's resistances are, and how far it is from the cell, one line each."""
    lines = [
        f"Ry = {ohm!r} ohm a segment: {kind}" for kind, ohm in zip(fit.kinds, fit.kind_resistance.tolist(), strict=True)
    ]
    lines += [
        f"Rc = {ohm!r} ohm a crossing: {pair}"
        for pair, ohm in zip(fit.pairs, fit.pair_resistance.tolist(), strict=True)
    ]
    worst, median = fit.pair_errors
    if np.isfinite(worst):
        lines.append(f"resistances between yarn ends are off by up to {worst:.2%}, {median:.2%} in the median")
    return lines


def netlist_files(design: Design, state: str, fit: Fit | None) -> tuple[str, ...]:
    """Names of the files of all netlists of a state: the detailed one, a deck for each probe, the reduced one."""
    decks = (f"{state}_{probe.name}.cir" for probe in design.probes)
    reduced = (f"{state}_reduced.sub",) if fit is not None and fit.known else ()
    return (detailed_file(state), *decks, *reduced)


def write_netlists(
    folder: Path, design: Design, state: str, circuits: StateCircuits, fit: Fit | None, probes: Sequence[Probe]
) -> Path:
    """Write all netlists of a state into `folder`, those of the `probes` as they are driven in it (`Record.driven`);
    returns the path of the detailed sub-circuit."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = [detailed_netlist(design, state, circuits)]
    texts += [probe_netlist(design, state, circuits, probe) for probe in probes]
    files = netlist_files(design, state, fit)
    if fit is not None and len(files) > len(texts):
        texts.append(reduced_netlist(design, state, fit))
    for name, text in zip(files, texts, strict=True):
        write_text(folder / name, text, encoding="ascii")
    return folder / files[0]


def _header(design: Design, state: str) -> partial[Header]:
    return partial(Header, design=design.name, design_hash=design_hash(design), state=state)


def _drive(design: Design, probe: Probe) -> tuple[str, ...]:
    """What the voltage of a probe is for, where the design states something else."""
    stated = next((each for each in design.probes if each.name == probe.name), probe)
    return (
        () if stated.voltage else (f"the source is the voltage that drives the probe in this state by {stated.drive}",)
    )


def _simplification(design: Design, simple: Simplified, merge_length: float | None) -> tuple[str, ...]:
    """What was done to the contacts, and how often."""
    numerics = design.numerics
    length = design.merge_length if merge_length is None else merge_length
    merged = (
        f"contact points of two fibrils in the same bin of {length!r} mm are one: {simple.merged_contacts} were added "
        "to another"
        if length
        else "contact points are not merged"
    )
    snapped = (
        f"feet on a fibril closer than {design.snap_length!r} mm share a node: {simple.merged_feet} were moved onto "
        "another"
        if design.snap_length
        else "feet are not snapped"
    )
    dropped = (
        f"contacts below {numerics.drop_fraction!r} of the largest conductance are left out: "
        f"{simple.dropped_contacts} were"
    )
    return merged, snapped, dropped
