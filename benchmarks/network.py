"""The nodal solution against ngspice on the same woven circuits.

    python benchmarks/network.py [--repeats 5]

ngspice's time is that of its process, from the deck's text to voltages in memory; the deck is written beforehand.
The last column is the largest difference of the two answers' port currents over the current fed in.
"""

from __future__ import annotations

import numpy as np
from measure import Table, arguments, fail, paired, publish, ratio
from woven import woven_circuit

from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.electrical.spice.ngspice import find_ngspice, run_deck
from circuittex.netlist import deck, pin_names

HEAD = ["resistors", "nodes", "nodal ms", "ngspice ms", "ngspice / nodal", "relative difference"]
CELLS = (2, 1.0), (3, 1.0), (4, 1.0), (4, 0.25)
"""Yarns each way and merge length (mm): about 500, 1200, 2000 and 4500 resistors."""


def compare(circuit: Circuit, repeats: int) -> list[object]:
    """One row of the table: 1 V between the ends of the first warp yarn, the other yarn ends open."""
    drive = {"warp1_minus": 1.0, "warp1_plus": 0.0}
    text = deck(circuit, drive)
    seconds = paired({"nodal": lambda: solve_nodal(circuit, drive), "ngspice": lambda: run_deck(text)}, repeats)
    pins = dict(zip(circuit.ports, pin_names(circuit), strict=True))
    (plot,) = run_deck(text).plots
    currents = dict(zip(circuit.ports, solve_nodal(circuit, drive).port_current.tolist(), strict=True))
    apart = max(abs(currents[port] + float(plot.current(f"V{pins[port]}")[0])) for port in drive)
    times = [1e3 * float(np.median(seconds[name])) for name in ("nodal", "ngspice")]
    quotient = ratio(seconds["ngspice"], seconds["nodal"])
    return [circuit.n_resistors, circuit.n_nodes, *times, quotient, apart / max(map(abs, currents.values()))]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    if find_ngspice() is None:
        fail("ngspice was not found; it is what this script compares with")
    rows = [compare(woven_circuit(*cell), options.repeats) for cell in CELLS]
    publish(options, [Table("One drive of one circuit, ms (median):", HEAD, rows)])


if __name__ == "__main__":
    main()
