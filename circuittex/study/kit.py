"""A folder to check any other simulator with: circuits of three sizes in several forms, and what they must give."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_array

from circuittex.base.arrays import Floats, Ints
from circuittex.base.atomic import write_text
from circuittex.base.errors import CircuitError
from circuittex.electrical.network.circuit import Circuit, port_nodes, reached_part, reduced_circuit
from circuittex.electrical.network.names import unique_names
from circuittex.electrical.network.nodal import solve_nodal
from circuittex.netlist import Header, deck, pin_names
from circuittex.results.records import Record, Study
from circuittex.study import compare
from circuittex.study.export import circuits_of

FILES = ("deck.cir", "graph.json", "matrix.mtx", "right_hand_side.mtx", "unknowns.txt", "expected.csv")
"""What there is of each circuit."""
PRINTED = 40
"""Values that a deck prints at most; more are in the simulator's raw file."""
MEDIUM = (12, 12)
"""Yarns of the circuit of some hundred resistors."""

_README = """\
A kit to check a simulator with, written by circuittex.

small/   {small} resistors: a reduced network of 2 x 2 yarns, Ry = 2 ohm, Rc = 5 ohm
medium/  {medium} resistors: a reduced network of 12 x 12 yarns, no two neighbours alike
cell/    {cell} resistors: every fibril segment and contact of one state of a textile, as in its netlists

Design of the cell: {design}
State and probe: {state}, {probe}

deck.cir             a SPICE deck: R and V cards, .op, and .print of up to {printed} values
graph.json           the same as node-link data: networkx.node_link_graph(json.load(file), edges="links")
matrix.mtx           conductances between the nodes that no source holds, S (Matrix Market)
right_hand_side.mtx  what the sources feed into these nodes, A: matrix * voltages = right_hand_side
unknowns.txt         the names of these nodes, in the order of the rows
expected.csv         voltage of every node, v(node), V, and current of every source, i(source), A

A current runs from the plus pin of a source through it to the minus pin, as SPICE counts: what it feeds in is negative.
The expected values come from a direct solution with iterative refinement.

    ngspice -b -r answer.raw small/deck.cir
    python compare.py small/expected.csv answer.raw

Gnucap's sources have an inner resistance, and its nodes a conductance to ground, which must be made small; it then
answers to six digits:

    sed "s/numdgt=15/numdgt=15 short=5e-9 gmin=0/" small/deck.cir > gnucap.cir
    gnucap -b gnucap.cir > answer.txt
    python compare.py small/expected.csv answer.txt --tolerance 1e-6

With --partial, values that an answer lacks, such as those that a deck does not print, are no departure.
compare.py needs Python alone; it says where a simulator departs first, and ends with 0 where all values agree.
"""


def write_kit(study: Study, folder: str | Path, state: str | None = None) -> Path:
    """Write the kit of a state, the first one unless it is named, into `folder`; returns the folder.

    Raises `CircuitError` for a state that the study does not have, and where none of its probes drives a current.
    """
    folder = Path(folder)
    record = _record(study, state)
    cell, drive, probe = _cell(study, record)
    head = Header("detailed resistor network", study.design.name, study.design_hash, record.name)
    size = {
        "small": _write(folder / "small", small_circuit(), {"warp1_minus": 1.0, "weft2_plus": 0.0}),
        "medium": _write(folder / "medium", medium_circuit(), {"warp1_minus": 1.0, "weft12_plus": -0.5}),
        "cell": _write(folder / "cell", cell, drive, head),
    }
    write_text(folder / "compare.py", Path(compare.__file__).read_text(encoding="utf-8"))
    texts = {"design": study.design.name, "state": record.name, "probe": probe}
    told = {key: json.dumps(text) for key, text in texts.items()}
    write_text(folder / "README.txt", _README.format(**size, **told, printed=PRINTED), encoding="ascii")
    return folder


def small_circuit() -> Circuit:
    """A circuit that can be solved by hand.

    >>> small_circuit().n_resistors
    16
    """
    return reduced_circuit((2, 2), 2.0, 5.0)


def medium_circuit() -> Circuit:
    """A circuit of some hundred resistors of different sizes, so that no two nodes can be mistaken.

    >>> medium_circuit().n_resistors
    456
    """
    n, m = MEDIUM
    Ry = 0.25 + 0.25 * (np.arange(n + m, dtype=np.float64) % 7)
    Rc = 10.0 + 10.0 * (np.arange(n * m, dtype=np.float64) % 11).reshape(n, m)
    return reduced_circuit(MEDIUM, Ry, Rc)


def node_link(circuit: Circuit, drive: Mapping[str, float]) -> dict[str, Any]:
    """Return a circuit as networkx's node-link data with "links", nodes and sources named as in its deck.

    >>> data = node_link(small_circuit(), {"warp1_minus": 1.0})
    >>> data["links"][0]["resistance"], data["nodes"][0]
    (1.0, {'id': 'warp1_minus', 'volts': 1.0})
    """
    words = unique_names(circuit.node_names)
    nodes: list[dict[str, Any]] = [{"id": word} for word in words]
    for node, volts in zip(port_nodes(circuit, drive).tolist(), drive.values(), strict=True):
        nodes[node]["volts"] = float(volts)
    names = unique_names(circuit.resistor_names)
    links = [
        {"source": words[i], "target": words[j], "key": name, "resistance": ohm}
        for name, (i, j), ohm in zip(names, circuit.resistor_nodes.tolist(), circuit.resistance.tolist(), strict=True)
    ]
    return {"directed": False, "multigraph": True, "graph": {}, "nodes": nodes, "links": links}


def grounded_system(circuit: Circuit, drive: Mapping[str, float]) -> tuple[coo_array, Floats, Ints]:
    """Return the conductances (n, n) between the nodes that no source holds, what feeds them (n,), and the nodes (n,).

    >>> system, right, nodes = grounded_system(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0})
    >>> system.shape, right.tolist(), nodes.tolist()
    ((5, 5), [0.0, 0.0, 0.0, 1.0, 0.0], [1, 2, 3, 4, 5])
    """
    held = port_nodes(circuit, drive)
    free = np.setdiff1d(np.arange(circuit.n_nodes), held)
    i, j = circuit.resistor_nodes.T
    siemens = 1.0 / circuit.resistance
    shape = (circuit.n_nodes, circuit.n_nodes)
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    whole = coo_array((np.concatenate([siemens, siemens, -siemens, -siemens]), (rows, columns)), shape=shape).tocsr()
    right = -whole[free][:, held] @ np.array(list(drive.values()), dtype=np.float64) + 0.0  # no -0.0
    return whole[free][:, free].tocoo(), right, free


def expected_values(circuit: Circuit, drive: Mapping[str, float]) -> dict[str, float]:
    """Return the voltage of every node and the current of every source, named and signed as SPICE does.

    >>> expected_values(reduced_circuit((1, 1), 2.0, 5.0), {"warp1_minus": 1.0, "warp1_plus": 0.0})["i(vwarp1_minus)"]
    -0.5
    """
    solution = solve_nodal(circuit, drive)
    pins = dict(zip(circuit.ports, pin_names(circuit), strict=True))
    current = dict(zip(circuit.ports, solution.port_current.tolist(), strict=True))
    voltages = zip(unique_names(circuit.node_names), solution.voltage.tolist(), strict=True)
    return {f"v({node})": volts for node, volts in voltages} | {f"i(v{pins[port]})": -current[port] for port in drive}


def _record(study: Study, state: str | None) -> Record:
    names = [record.name for record in study.records]
    if not names or (state is not None and state not in names):
        raise CircuitError(f"state {state!r} does not exist; the study has {', '.join(names) or 'none'}")
    return study.records[names.index(state) if state is not None else 0]


def _cell(study: Study, record: Record) -> tuple[Circuit, dict[str, float], str]:
    """The circuit of the first probe that drives a current, its drive, and the probe's name."""
    design = record.driven(study.design)
    circuits = circuits_of(design, record.contacts, record.fields)
    for probe in design.probes:
        circuit = circuits.of(probe)
        if circuit.n_resistors:
            return circuit, {probe.source: probe.voltage, probe.sink: 0.0}, probe.name
    raise CircuitError(f"state {record.name!r}: none of its probes drives a current")


def _write(folder: Path, whole: Circuit, drive: Mapping[str, float], header: Header | None = None) -> int:
    """Write all files of one circuit; returns how many resistors it has."""
    circuit = reached_part(whole, drive)
    words = unique_names(circuit.node_names)
    values = expected_values(circuit, drive)
    system, right, free = grounded_system(circuit, drive)
    texts = (
        _printing(deck(circuit, drive, header), list(values)),
        json.dumps(node_link(circuit, drive), indent=1) + "\n",
        _matrix_market(system),
        _matrix_market(right[:, None]),
        "".join(f"{words[node]}\n" for node in free.tolist()),
        "name,value\n" + "".join(f"{name},{value!r}\n" for name, value in values.items()),
    )
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in zip(FILES, texts, strict=True):
        write_text(folder / name, text, encoding="ascii")
    return circuit.n_resistors


def _printing(text: str, names: list[str]) -> str:
    """A deck that prints the last of these values, those of its sources among them, with all digits in gnucap."""
    asked = ["* what is printed", ".options numdgt=15", ".print op", *(f"+ {name}" for name in names[-PRINTED:])]
    return text.replace("\n.op\n", "\n" + "\n".join([*asked, ".op", ""]))


def _matrix_market(matrix: coo_array | Floats) -> str:
    stream = io.BytesIO()
    mmwrite(stream, matrix, precision=17)
    return stream.getvalue().decode("ascii")
