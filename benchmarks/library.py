"""The levels of an exported library: what they err, and what a transient with each of them costs in ngspice.

    python benchmarks/library.py RESULTS [--states N] [--contacts]

RESULTS is the folder of a study. Errors are those over all pairs of pins and all states, and those of the interpolation
at each inner state where it is found from all others. The largest difference of `ports` from `detailed` in ngspice is
that over all pairs of pins in the first N states (default: all). A transient has 10 ms; strain is a parameter where a
name ends in _s and a pin where it ends in _v. With --contacts the errors of all levels are found with a sigma_c that is
1 to 1e5 times the study's, in the same mechanical states; `detailed` is then solved by a sparse LU (takes minutes).
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from measure import Table, arguments, publish
from scipy.sparse.linalg import splu

from circuittex.base.arrays import Floats
from circuittex.contact.extract import contacts_of
from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.network.ports import PortMatrix, port_matrix
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

CONTACTS = (1.0, 1e2, 1e3, 1e4, 1e5)
"""How many times the study's sigma_c."""
THIN = 0.001
"""Error of the thinned ports."""
HEAD = ["level", "resistance, worst", "median", "change, worst", "median"]
TIMED = ("fabric_detailed", "fabric_ports", "fabric_ports_thin", "fabric_cell")


def errors(study: Study) -> Table:
    """Errors of the cell, and of the interpolation at states that it does not know."""
    known = facts_of(study, CRIMPED, 0.0, 10.0, ())
    rows = [_row(level, found) for level, found in known.errors.items()]
    rows += [_row(f"interpolation of {word}", found) for word, found in known.left_out.items()]
    return Table(f"Errors (%), all pairs of {len(known.levels.pins)} pins, {len(study.records)} states:", HEAD, rows)


def contacts(study: Study) -> Table:
    """Errors of every level against the detailed network where only sigma_c differs, and which one is recommended."""
    rows = []
    for factor in CONTACTS:
        other = with_sigma_c(study, factor)
        known = facts_of(other, CRIMPED, THIN, 10.0, ())
        whole = [lu_reduction(detailed(other.design, record, CRIMPED), known.levels.pins) for record in other.records]
        found = {"ports": known.levels.ports, "ports_thin": known.reductions[1].ports}
        if not known.levels.reason:
            found["cell"] = [port_matrix(circuit, known.levels.pins) for circuit in known.levels.cells]
        for level, matrices in found.items():
            chosen = "recommended" if level == known.recommended else ""
            rows.append([f"{factor:.0e}", *_row(level, compared(whole, matrices)), chosen])
    return Table("Errors (%) of the levels where sigma_c is that many times the study's:", ["times", *HEAD, ""], rows)


def with_sigma_c(study: Study, factor: float) -> Study:
    """The study with another contact conductivity in the same mechanical states, which do not know it."""
    law = replace(study.design.contact, conductivity=factor * study.design.contact.conductivity)
    design = replace(study.design, contact=law)
    records = [
        replace(record, contacts=contacts_of(design, study.mesh, record.configuration), ports=PortMatrix())
        for record in study.records
    ]
    return replace(study, design=design, records=tuple(records))


def lu_reduction(circuit: Circuit, pins: Sequence[str]) -> PortMatrix:
    """The port matrix from resistances between pins by a sparse LU of the nodal matrix, the first pin grounded."""
    a, b = circuit.resistor_nodes.T
    K = len(circuit.node_names)
    g = np.tile(1.0 / circuit.resistance, 2)
    W = sp.csc_matrix((g, (np.append(a, b), np.append(b, a))), shape=(K, K))
    place = dict(zip(circuit.ports, circuit.port_node.tolist(), strict=True))
    nodes = [place[name] for name in pins]
    others = np.delete(np.arange(K), nodes[0])
    nodal = (sp.diags(np.asarray(W.sum(axis=1)).ravel()) - W).tocsc()[others][:, others]
    row = np.searchsorted(others, nodes[1:])
    amperes = np.zeros((K - 1, len(row)))
    amperes[row, np.arange(len(row))] = 1.0
    inner = np.linalg.inv(splu(nodal.tocsc()).solve(amperes)[row])
    G = np.block([[inner.sum(keepdims=True), -inner.sum(axis=0, keepdims=True)], [-inner.sum(axis=1)[:, None], inner]])
    return PortMatrix(tuple(pins), (G + G.T) / 2.0)


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
        cells = export_library(study, name, dialects=("ngspice",), thin=THIN)
        driven = [cell for cell in cells if cell.name in TIMED or cell.name.endswith(("_v", "_s"))]
        for cell in sorted(driven, key=lambda cell: cell.level != "detailed"):
            seconds = _seconds(Path(name), cell)
            rows.append([cell.name, seconds, (rows[0][1] if rows else seconds) / seconds])
    return Table("A transient of 10 ms in ngspice:", ["sub-circuit", "s", "detailed / it"], rows)


def _seconds(folder: Path, cell: Cell) -> float:
    first, second = [pin.name for pin in cell.pins if pin.kind == "electrical"][:2]
    nodes = " ".join({first: "in", second: "0"}.get(pin.name, pin.name) for pin in cell.pins)
    lines = [f"* {cell.name}", f".include {cell.file}", f"X1 {nodes} {cell.name}", "V1 in 0 SIN(1 0.1 1k)"]
    for k, pin in enumerate(pin for pin in cell.pins if pin.kind == "control"):
        lines.append(f"Vstrain{k} {pin.name} 0 SIN(0.1 0.1 100)")
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
