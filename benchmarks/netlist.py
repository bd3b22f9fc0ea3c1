"""Writing and reading netlists, in microseconds per resistor, against PySpice and against joining ready words.

    python benchmarks/netlist.py [--repeats 5]

The circuits are woven ones with the long names that real netlists have. 'Joining ready words' writes nothing but
one card for each resistor from words and numbers that are strings already: no writer of the text in Python can be
faster. PySpice builds its objects and then its text, for circuits of up to 2000 resistors.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from measure import Table, arguments, paired, publish, ratio
from woven import woven_circuit

from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.spice.pyspice import LARGEST
from circuittex.netlist import deck, parse, subcircuit, to_pyspice

HEAD = ["resistors", "subcircuit", "deck", "parse", "PySpice", "ready words", "deck / words", "PySpice / deck"]
CELLS = (3, 0.5), (4, 0.1), (4, 0.0)
"""Yarns each way and merge length (mm) of the circuits."""


def compare(circuit: Circuit, repeats: int) -> list[object]:
    """One row of the table, µs per resistor, medians."""
    drive = {circuit.ports[0]: 1.0, circuit.ports[-1]: 0.0}
    text = deck(circuit, drive)
    pieces: dict[str, Callable[[], object]] = {
        "subcircuit": lambda: subcircuit(circuit, "cell"),
        "deck": lambda: deck(circuit, drive),
        "parse": lambda: parse(text),
        "words": ready_words(circuit),
    }
    if circuit.n_resistors <= LARGEST:
        pieces["PySpice"] = lambda: str(to_pyspice(circuit, drive))
    seconds = paired(pieces, repeats)

    def each(name: str) -> object:
        return 1e6 * float(np.median(seconds[name])) / circuit.n_resistors if name in seconds else "-"

    times = [each(name) for name in ("subcircuit", "deck", "parse", "PySpice", "words")]
    against = ratio(seconds["PySpice"], seconds["deck"]) if "PySpice" in seconds else "-"
    return [circuit.n_resistors, *times, ratio(seconds["deck"], seconds["words"]), against]


def ready_words(circuit: Circuit) -> Callable[[], str]:
    """A function that joins one card for each resistor from ready words: the lower bound."""
    ends = [[circuit.node_names[k] for k in side] for side in circuit.resistor_nodes.T.tolist()]
    cards = list(zip(circuit.resistor_names, *ends, map(repr, circuit.resistance.tolist()), strict=True))
    return lambda: "\n".join([f"R{name} {i} {j} {ohm}" for name, i, j, ohm in cards])


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    rows = [compare(woven_circuit(*cell), options.repeats) for cell in CELLS]
    publish(options, [Table("Microseconds per resistor (median):", HEAD, rows)])


if __name__ == "__main__":
    main()
