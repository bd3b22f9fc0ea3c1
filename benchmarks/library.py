"""The levels of an exported library: what they err, and what a transient with each of them costs in ngspice.

    python benchmarks/library.py RESULTS [--states N] [--contacts]

RESULTS is the folder of a study. Errors are those over all pairs of pins and all states, and those of the interpolation
at each inner state where it is found from all others. The largest difference of `ports` from `detailed` in ngspice is
that over all pairs of pins in the first N states (default: all). A transient has 10 ms; strain is a pin where a name
ends in _v. With --contacts the errors of the cell are found again with contacts 100 to 1e5 times as conductive (takes
minutes).
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measure import Table, arguments, publish

from circuittex.base.arrays import Floats
from circuittex.electrical.network.circuit import reduced_circuit
from circuittex.electrical.network.matching import groups, match_pairs, spread
from circuittex.electrical.network.ports import port_matrix
from circuittex.electrical.spice.ngspice import find_ngspice
from circuittex.results.records import Study
from circuittex.results.store import load_study
from circuittex.study.library.accuracy import Errors, compared
from circuittex.study.library.cell import Cell
from circuittex.study.library.export import export_library
from circuittex.study.library.facts import facts_of
from circuittex.study.library.levels import CRIMPED, detailed, levels
from circuittex.study.library.network import Network, circuit_network, ports_network
from circuittex.study.library.parts import pins
from circuittex.study.library.subcircuit import library_text

CONTACTS = (1e2, 1e3, 1e4, 1e5)
"""How many times as conductive."""
HEAD = ["level", "resistance, worst", "median", "change, worst", "median"]
TIMED = ("fabric_detailed", "fabric_ports", "fabric_ports_thin", "fabric_cell")


def errors(study: Study) -> Table:
    """Errors of the cell, and of the interpolation at states that it does not know."""
    known = facts_of(study, CRIMPED, 0.0, 10.0, ())
    rows = [_row(level, found) for level, found in known.errors.items()]
    rows += [_row(f"interpolation of {word}", found) for word, found in known.left_out.items()]
    return Table(f"Errors (%), all pairs of {len(known.levels.pins)} pins, {len(study.records)} states:", HEAD, rows)


def contacts(study: Study) -> Table:
    """Errors of the cell where all contacts conduct better."""
    names = levels(study, CRIMPED).pins
    grouping, shape = groups(study.design, each_crossing=True), np.shape(study.design.weave.draft)
    rows = []
    for factor in CONTACTS:
        exact, found = [], []
        for record in study.records:
            state = replace(record.contacts, conductance=factor * record.contacts.conductance)
            circuit = detailed(study.design, replace(record, contacts=state), CRIMPED)
            exact.append(port_matrix(circuit, names))
            match = match_pairs(study.design, grouping, exact[-1])
            found.append(port_matrix(reduced_circuit((shape[0], shape[1]), *spread(grouping, match.found)), names))
        rows.append(_row(f"cell, contacts times {factor:.0e}", compared(exact, found)))
    return Table("Errors (%) of the cell with better contacts:", HEAD, rows)


def difference(study: Study, states: int) -> Table:
    """Resistances of `ports` and `detailed` in ngspice over all pairs of pins."""
    known = levels(study, CRIMPED)
    rows = []
    for record, matrix in list(zip(study.records, known.ports, strict=True))[:states]:
        whole = circuit_network([detailed(study.design, record, CRIMPED)], np.zeros(1), known.pins)
        found, wanted = (_in_ngspice(study, each) for each in (ports_network([matrix], np.zeros(1)), whole))
        rows.append([record.name, float(np.abs(found / wanted - 1.0).max())])
    return Table("Largest relative difference of ports from detailed in ngspice:", ["state", "difference"], rows)


def transients(study: Study) -> Table:
    """Seconds of ngspice for 10 ms in steps of at most 10 us, and how many times faster than the detailed network."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        cells = export_library(study, name, dialects=("ngspice",), thin=0.001)
        driven = [cell for cell in cells if cell.name in TIMED or cell.name.endswith("_v")]
        for cell in sorted(driven, key=lambda cell: cell.level != "detailed"):
            seconds = _seconds(Path(name), cell)
            rows.append([cell.name, seconds, (rows[0][1] if rows else seconds) / seconds])
    return Table("A transient of 10 ms in ngspice:", ["sub-circuit", "s", "detailed / it"], rows)


def _seconds(folder: Path, cell: Cell) -> float:
    first, second = [pin.name for pin in cell.pins if pin.kind == "electrical"][:2]
    nodes = " ".join({first: "in", second: "0"}.get(pin.name, pin.name) for pin in cell.pins)
    lines = [f"* {cell.name}", f".include {cell.file}", f"X1 {nodes} {cell.name}", "V1 in 0 SIN(1 0.1 1k)"]
    if any(pin.kind == "control" for pin in cell.pins):
        lines.append("V2 strain 0 SIN(0.1 0.1 100)")
    (folder / "t.cir").write_text("\n".join([*lines, ".tran 10u 10m", ".end", ""]), encoding="ascii")
    start = time.perf_counter()
    command = [str(find_ngspice()), "-n", "-b", "-r", "t.raw", "t.cir"]
    subprocess.run(command, cwd=folder, capture_output=True, check=True)
    return time.perf_counter() - start


def _in_ngspice(study: Study, network: Network) -> Floats:
    """(pairs,) resistances by ngspice: 1 A into each pin in turn, the first one grounded."""
    cell = Cell("part", "ports", "", pins(study.design, network), (), "part.lib", "ngspice")
    ground, *others = network.pins
    nodes = " ".join("0" if name == ground else name for name in network.pins)
    lines = ["* resistances", ".include part.lib", f"X1 {nodes} part", *(f"I{name} 0 {name} 0" for name in others)]
    lines += [".control", "set numdgt=16", "set wr_singlescale"]
    for name in others:
        shown = " ".join(f"v({other})" for other in others)
        lines += [f"alter i{name} = 1", "op", f"wrdata {name} {shown}", f"alter i{name} = 0"]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "part.lib").write_text(library_text(cell, network, []), encoding="ascii")
        (Path(folder) / "all.cir").write_text("\n".join([*lines, "quit", ".endc", ".end", ""]), encoding="ascii")
        subprocess.run([str(find_ngspice()), "-n", "-b", "all.cir"], cwd=folder, capture_output=True, check=False)
        rows = [[float(x) for x in (Path(folder) / name).read_text().split()[1:]] for name in others]
    volts = np.pad(np.array(rows), ((1, 0), (1, 0)))
    own = volts.diagonal()
    return np.asarray((own[:, None] + own - volts - volts.T)[np.triu_indices(len(own), 1)])


def _row(name: str, found: Errors) -> list[object]:
    """In %."""
    (R, c), (Rm, cm) = found.worst, found.median
    return [name, *(100.0 * each for each in (R, Rm, c, cm))]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--states", type=int, default=10**6)
    parser.add_argument("--contacts", action="store_true")
    options = parser.parse_args()
    study = load_study(options.results)
    measured = [errors, *([contacts] if options.contacts else []), lambda s: difference(s, options.states), transients]
    publish(options, (each(study) for each in measured))


if __name__ == "__main__":
    main()
