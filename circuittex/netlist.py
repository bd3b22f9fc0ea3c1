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

from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen
from circuittex.base.version import __version__
from circuittex.electrical.network.circuit import KINDS, Circuit, reached_part
from circuittex.electrical.network.names import safe_name, unique_names
from circuittex.electrical.spice.foreign import Deck, read_deck
from circuittex.electrical.spice.pyspice import to_pyspice, to_pyspice_subcircuit
from circuittex.electrical.spice.reader import parse

__all__ = [
    "Deck",
    "Header",
    "deck",
    "parse",
    "pin_names",
    "read_deck",
    "subcircuit",
    "to_pyspice",
    "to_pyspice_subcircuit",
]

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

    >>> from circuittex.electrical.network.circuit import reduced_circuit
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

    >>> from circuittex.electrical.network.circuit import reduced_circuit
    >>> print(deck(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0, "warp1_plus": 0.0}).splitlines()[-4])
    Vwarp1_minus warp1_minus 0 1.0
    """
    part = reached_part(circuit, drive)
    words = unique_names(part.node_names)
    pins = dict(zip(part.ports, _pins(part, words), strict=True))
    lines = _head(part, words, header or Header()) + _cards(part, words) + ["* sources"]
    lines += [f"V{pins[port]} {pins[port]} 0 {_volts(port, volts)}" for port, volts in drive.items()]
    return "\n".join([*lines, ".op", ".end"]) + "\n"


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
