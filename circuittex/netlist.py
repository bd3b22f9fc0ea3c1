"""A circuit as SPICE text, and back: sub-circuits, runnable decks, and PySpice objects.

Every text is plain R and V cards with numbers by `repr`, so that no suffix can be misread, and words that are unique
whatever the case. What a card cannot say stands in comments, as JSON where it is free text, which therefore cannot
become a card.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from circuittex import __version__
from circuittex.circuit import KINDS, Circuit, islands, port_nodes, reached_part
from circuittex.errors import CircuitError
from circuittex.frozen import frozen
from circuittex.netlist_reader import parse
from circuittex.pyspice_export import to_pyspice
from circuittex.spice_names import safe_name, unique_names

__all__ = [
    "OPEN_OHM",
    "Header",
    "circuits_deck",
    "deck",
    "drives_deck",
    "parse",
    "pin_names",
    "subcircuit",
    "to_pyspice",
]

OPEN_OHM = 1e15
"""Series resistance that stands for an open port in `drives_deck`: what it lets pass is below rounding."""

_LINE = 100


@frozen
class Header:
    """What the comment at the head of a netlist says besides the counts."""

    title: str = "resistor network"
    """What the netlist is."""
    design: str = ""
    """Name of the design."""
    design_hash: str = ""
    """Hash of the design."""
    state: str = ""
    """Name of the mechanical state."""
    notes: tuple[str, ...] = ()
    """Anything else a reader must know, one line each."""


def pin_names(circuit: Circuit) -> tuple[str, ...]:
    """Return the word that stands for each port in a netlist, which is the word of its node.

    >>> from circuittex.circuit import reduced_circuit
    >>> pin_names(reduced_circuit((1, 1), 1.0, 1.0))
    ('warp1_minus', 'warp1_plus', 'weft1_minus', 'weft1_plus')
    """
    return _pins(circuit, unique_names(circuit.node_names))


def _pins(circuit: Circuit, words: Sequence[str]) -> tuple[str, ...]:
    return tuple(words[node] for node in circuit.port_node.tolist())


def subcircuit(circuit: Circuit, name: str, header: Header | None = None) -> str:
    """Return a `.subckt` with one pin for each port, in the order of the ports."""
    words = unique_names(circuit.node_names)
    lines = _head(circuit, words, header or Header())
    lines += _wrapped([".subckt", safe_name(name), *_pins(circuit, words)])
    lines += _cards(circuit, words)
    lines.append(f".ends {safe_name(name)}")
    return "\n".join(lines) + "\n"


def deck(circuit: Circuit, drive: Mapping[str, float], header: Header | None = None) -> str:
    """Return a runnable deck that holds ports at the given voltages: R, V and `.op` only, for any SPICE.

    The source at a pin is called V and the pin: the current into the circuit there is minus the current of the source.
    What no driven port reaches is left out.

    >>> from circuittex.circuit import reduced_circuit
    >>> print(deck(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0, "warp1_plus": 0.0}).splitlines()[-4])
    Vwarp1_minus warp1_minus 0 1.0
    """
    part = reached_part(circuit, drive)
    words = unique_names(part.node_names)
    pins = dict(zip(part.ports, _pins(part, words), strict=True))
    lines = _head(part, words, header or Header()) + _cards(part, words) + ["* sources"]
    lines += [f"V{pins[port]} {pins[port]} 0 {_volts(port, volts)}" for port, volts in drive.items()]
    return "\n".join([*lines, ".op", ".end"]) + "\n"


def drives_deck(circuit: Circuit, drives: Sequence[Mapping[str, float]], header: Header | None = None) -> str:
    """Return an ngspice deck that solves several drives of one circuit in one sweep, point k for drive k.

    The swept quantity is the number of the drive, from 1, and the sources are tables of it: unlike `alter` and `op`
    in a control section, a sweep keeps the ordering of the matrix, which is what costs ngspice its time. A port that
    some drives leave open has `OPEN_OHM` in series then; an island that a drive does not touch is held at 0 V, so that
    it carries no current. As in `deck`, the current into the circuit is minus the current of V and the pin.

    Raises `CircuitError` where there is no drive, or one that drives nothing.
    """
    if not drives or not all(drives):
        raise CircuitError("drives: at least one drive is needed, and each must hold a port at a voltage")
    part = reached_part(circuit, [port for drive in drives for port in drive])
    words = unique_names(part.node_names)
    pins = dict(zip(part.ports, _pins(part, words), strict=True))
    settings = [_settings(part, drive) for drive in drives]
    used = [port for port in part.ports if any(setting[port] is not None for setting in settings)]
    number, *behind = unique_names([*words, "drive_number", *(f"{pins[port]}_source" for port in used)])[len(words) :]
    lines = _head(part, words, header or Header()) + _cards(part, words)
    lines += ["* sources", f"Vdrive_number {number} 0 1.0"]
    for port, node in zip(used, behind, strict=True):
        held = [setting[port] for setting in settings]
        if len(set(held)) == 1:
            lines.append(f"V{pins[port]} {pins[port]} 0 {_volts(port, held[0] or 0.0)}")
            continue
        volts = _table(number, [_volts(port, volt or 0.0) for volt in held])
        if None in held:
            ohm = _table(number, [repr(OPEN_OHM if volt is None else 0.0) for volt in held])
            volts += f" + {ohm} * i(V{pins[port]})"
        lines += [f"V{pins[port]} {pins[port]} {node} 0.0", f"B{pins[port]} {node} 0 V = {volts}"]
    return "\n".join([*lines, f".dc Vdrive_number 1.0 {float(len(drives))!r} 1.0", ".end"]) + "\n"


def _table(node: str, values: Sequence[str]) -> str:
    """Return the function of the drive number with these values at 1, 2, ...; ngspice wants two knots or more."""
    knots = ", ".join(f"{k}, {value}" for k, value in enumerate([*values, values[-1]], start=1))
    return f"pwl(v({node}), {knots})"


def circuits_deck(cases: Sequence[tuple[Circuit, Mapping[str, float]]], header: Header | None = None) -> str:
    """Return a runnable deck of several driven circuits side by side: R, V, X and `.op` only, for any SPICE.

    Case k, from 1, is the instance Xk; its pin p is the net 'case<k>_<p>', driven by the source 'Vcase<k>_<p>'.
    """
    parts = [reached_part(circuit, drive) for circuit, drive in cases]
    head = header or Header()
    lines = [_title(head), *_texts(head)]
    for k, (part, (_, drive)) in enumerate(zip(parts, cases, strict=True), start=1):
        words = unique_names(part.node_names)
        pins = _pins(part, words)
        nets = {port: f"case{k}_{pin}" for port, pin in zip(part.ports, pins, strict=True)}
        lines += _body(part, words) + _wrapped([".subckt", f"circuit{k}", *pins])
        lines += [*_cards(part, words), f".ends circuit{k}"]
        lines += _wrapped([f"X{k}", *nets.values(), f"circuit{k}"])
        lines += [f"V{nets[port]} {nets[port]} 0 {_volts(port, volts)}" for port, volts in drive.items()]
    return "\n".join([*lines, ".op", ".end"]) + "\n"


def _settings(part: Circuit, drive: Mapping[str, float]) -> dict[str, float | None]:
    """Return what each port is held at, None where it is open; islands without a driven port have all ports at 0 V."""
    island = islands(part)
    touched = set(island[port_nodes(part, drive)].tolist())
    return {
        port: drive.get(port, None if island[node] in touched else 0.0)
        for port, node in zip(part.ports, part.port_node.tolist(), strict=True)
    }


def _volts(port: str, volts: float) -> str:
    if not np.isfinite(volts):
        raise CircuitError(f"port {port!r}: {volts!r} V is not a finite voltage")
    return repr(float(volts))


def _title(header: Header) -> str:
    return f"* circuittex {__version__} netlist: {json.dumps(header.title)}"


def _texts(header: Header) -> list[str]:
    named = {"design": header.design, "design hash": header.design_hash, "state": header.state}
    lines = [f"* {key}: {json.dumps(text)}" for key, text in named.items() if text]
    lines += [f"* note: {json.dumps(note)}" for note in header.notes]
    return [*lines, "* units: ohm, V, A; places of nodes in mm along the fibril"]


def _head(circuit: Circuit, words: Sequence[str], header: Header) -> list[str]:
    return [_title(header), *_texts(header), *_body(circuit, words)]


def _body(circuit: Circuit, words: Sequence[str]) -> list[str]:
    """Return the comments about one circuit: counts, pins, and the fibril and place of each node."""
    if len(set(circuit.port_node.tolist())) < len(circuit.port_node):
        raise CircuitError("two ports are the same node; a netlist needs one pin for each")
    left_out = circuit.unreached.tolist()
    lines = [
        f"* nodes: {circuit.n_nodes}",
        f"* resistors: {circuit.n_resistors}",
        f"* merged feet: {circuit.merged_feet}",
        f"* dropped contacts: {circuit.dropped_contacts}",
        f"* fibrils left out: {len(left_out)}",
    ]
    lines += [f"* left out: {' '.join(map(str, left_out[k : k + 16]))}" for k in range(0, len(left_out), 16)]
    lines += [
        f"* pin: {pin} {json.dumps(port)}" for pin, port in zip(_pins(circuit, words), circuit.ports, strict=True)
    ]
    lines += [
        f"* node: {name} {fibril} {xi!r}" if fibril >= 0 else f"* node: {name}"
        for name, fibril, xi in zip(words, circuit.node_fibril.tolist(), circuit.node_xi.tolist(), strict=True)
    ]
    return lines


def _cards(circuit: Circuit, words: Sequence[str]) -> list[str]:
    """Return one R card for each resistor, with a comment wherever their kind changes."""
    bad = ~(np.isfinite(circuit.resistance) & (circuit.resistance > 0.0))
    if bad.any():
        k = int(np.argmax(bad))
        raise CircuitError(
            f"resistor {circuit.resistor_names[k]!r}: {float(circuit.resistance[k])!r} ohm must be positive and finite"
        )
    cards = [
        f"R{name} {words[i]} {words[j]} {ohm!r}"
        for name, (i, j), ohm in zip(
            unique_names(circuit.resistor_names),
            circuit.resistor_nodes.tolist(),
            circuit.resistance.tolist(),
            strict=True,
        )
    ]
    kind = circuit.resistor_kind
    starts = np.flatnonzero(np.diff(kind, prepend=-1)).tolist()
    lines: list[str] = []
    for start, stop in pairwise([*starts, len(cards)]):
        lines.append(f"* kind: {KINDS[kind[start]]}")
        lines += cards[start:stop]
    return lines


def _wrapped(words: Sequence[str]) -> list[str]:
    """Return one card, continued by lines that begin with '+' where it grows long."""
    lines = [words[0]]
    for word in words[1:]:
        if len(lines[-1]) + 1 + len(word) > _LINE:
            lines.append("+")
        lines[-1] += f" {word}"
    return lines
