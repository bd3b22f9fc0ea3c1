"""Three independent routes to every probe current and node voltage, and how far they lie apart."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import ParamSpec, TypeVar

import numpy as np

from circuittex.circuit import Circuit, build_circuit
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.errors import NgspiceError
from circuittex.fields import Fields, solve_probes
from circuittex.frozen import frozen
from circuittex.geometry.mesh import Floats
from circuittex.geometry.refine import refined
from circuittex.netlist import deck, pin_names
from circuittex.ngspice import run_decks
from circuittex.nodal import solve_nodal

AGREEMENT = 1e-9
"""Routes on the same discretisation that differ by more than this (relative current, V per V) do not agree."""

NO_CURRENT = 1e-6
"""A probe with less than this fraction of the largest probe current is measured against the largest."""

P = ParamSpec("P")
T = TypeVar("T")


@frozen
class Verification:
    """Largest differences between the routes over all probes of one contact state."""

    routes: tuple[str, ...]
    """The routes that answered, of 'fields', 'nodal', 'ngspice'."""
    max_voltage_difference: float
    """Largest difference of two routes in one node voltage, V per volt of the probe."""
    max_current_difference: float
    """Largest difference of two routes in one terminal current, relative to the current of that probe."""
    merge_error: float
    """Largest relative change of a probe current by the simplification of the contacts."""
    field_difference: float
    """Largest relative difference of a probe current between the mechanical mesh and the circuit, both at full
    resolution: the discretisation error of the former."""
    fields_seconds: float
    """Time spent in finite elements, s."""
    nodal_seconds: float
    """Time spent in nodal solutions, s."""
    ngspice_seconds: float
    """Time spent in ngspice, s; nan where it did not check."""
    ngspice_checked: bool
    """Whether ngspice answered every probe and its answers were compared."""
    note: str
    """What a reader must know, such as why ngspice did not check or that routes disagree; empty if all is well."""


@frozen
class _Answer:
    """What one route says about one probe."""

    voltage: Floats
    """(K,) at the nodes of the circuit, V per volt of the probe."""
    current: float
    """Into the textile at the source, A."""


def verify(
    contacts: ContactState,
    simplified: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    fields: Sequence[Fields] | None = None,
    timeout: float = 60.0,
) -> Verification:
    """Compare finite elements, nodal analysis and ngspice for each probe.

    All three solve the `simplified` contacts, each from them alone; finite elements and nodal analysis also
    solve all `contacts`, and the differences are the largest of either. Every probe has a circuit of its own,
    since it joins only its own two terminals. ngspice answers all of them in one process within `timeout`
    seconds; where it does not, `ngspice_checked` is False and `note` says why. `fields` are the finite element
    solutions on all `contacts` with the mesh "feet", for whoever has them already.
    """
    if not probes:
        nan = float("nan")
        return Verification((), nan, nan, nan, nan, 0.0, 0.0, nan, False, "there are no probes to verify")
    clock = _Clock()
    coarse = clock("fields", solve_probes, contacts, terminals, probes, mesh="mechanical")
    _, full_fields, full_nodal = _native(clock, contacts, terminals, probes, fields)
    circuits, *answers = _native(clock, simplified, terminals, probes, None)
    routes = dict(zip(("fields", "nodal"), answers, strict=True))
    note = ""
    try:
        routes["ngspice"] = clock("ngspice", _ngspice, circuits, probes, timeout)
    except NgspiceError as error:
        note = f"ngspice did not check this state: {error}"
    compared = [(full_fields, full_nodal), *combinations(routes.values(), 2)]
    voltage, current = np.max([_difference(a, b) for a, b in compared], axis=0)
    if not (voltage <= AGREEMENT and current <= AGREEMENT):
        note = f"the routes disagree: {voltage:.1e} V per V, currents {current:.1e} relative. {note}".strip()
    return Verification(
        routes=tuple(routes),
        max_voltage_difference=float(voltage),
        max_current_difference=float(current),
        merge_error=_relative([a.current for a in routes["fields"]], [a.current for a in full_fields]),
        field_difference=_relative([f.currents[0] for f in coarse], [a.current for a in full_nodal]),
        fields_seconds=clock.seconds["fields"],
        nodal_seconds=clock.seconds["nodal"],
        ngspice_seconds=clock.seconds["ngspice"] if "ngspice" in routes else float("nan"),
        ngspice_checked="ngspice" in routes,
        note=note,
    )


def field_convergence(
    contacts: ContactState, terminals: Sequence[Terminal], probes: Sequence[Probe], fields: Sequence[Fields]
) -> Floats:
    """How the potential on the mechanical mesh converges to the circuit: (3, 2) node distance mm, current error.

    The nodes of the mechanical mesh, then two and four times as many; the error is the largest relative
    difference of a probe current from `fields`, the solutions on the mesh "feet", which equal the circuit.
    """
    exact = [f.currents[0] for f in fields]
    mesh, rows = contacts.mesh, []
    distance = float((mesh.length / (np.diff(mesh.first_node) - 1)).max())
    for pieces in (1, 2, 4):
        finer = replace(
            contacts, mesh=refined(mesh, pieces), axial_factor=np.repeat(contacts.axial_factor, mesh.order * pieces)
        )
        currents = [f.currents[0] for f in solve_probes(finer, terminals, probes, mesh="mechanical")]
        rows.append((distance / pieces, _relative(currents, exact)))
    return np.array(rows)


class _Clock:
    """Calls functions and adds up the time of each route."""

    def __init__(self) -> None:
        self.seconds = {"fields": 0.0, "nodal": 0.0, "ngspice": 0.0}

    def __call__(self, route: str, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        start = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            self.seconds[route] += time.perf_counter() - start


def _pair(terminals: Sequence[Terminal], probe: Probe) -> list[Terminal]:
    """Source and sink of a probe."""
    return [t for name in (probe.source, probe.sink) for t in terminals if t.name == name]


def _native(
    clock: _Clock,
    contacts: ContactState,
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    fields: Sequence[Fields] | None,
) -> tuple[list[Circuit], list[_Answer], list[_Answer]]:
    """The circuit of each probe, and what finite elements (unless given) and nodal analysis say about it."""
    circuits = [build_circuit(contacts, _pair(terminals, probe)) for probe in probes]
    solved = clock("fields", solve_probes, contacts, terminals, probes) if fields is None else fields
    return (
        circuits,
        [_from_fields(c, f) for c, f in zip(circuits, solved, strict=True)],
        [clock("nodal", _nodal, c, p) for c, p in zip(circuits, probes, strict=True)],
    )


def _drive(probe: Probe) -> dict[str, float]:
    return {probe.source: probe.voltage, probe.sink: 0.0}


def _nodal(circuit: Circuit, probe: Probe) -> _Answer:
    solution = solve_nodal(circuit, _drive(probe))
    return _Answer(solution.voltage / probe.voltage, float(solution.port_current[circuit.ports.index(probe.source)]))


def _from_fields(circuit: Circuit, fields: Fields) -> _Answer:
    """The finite element solution at the nodes of the circuit; between its own nodes it is linear."""
    inner, known = circuit.node_fibril >= 0, np.isfinite(fields.potential)
    voltage = np.zeros(circuit.n_nodes)
    voltage[circuit.port_node[circuit.ports.index(fields.terminals[0])]] = 1.0
    if inner.any():
        # Fibril f covers the keys f to f + 1/2, so that one interpolation serves all fibrils.
        shrink = 0.5 / fields.xi.max()
        at, nodes = (f + shrink * xi for f, xi in ((circuit.node_fibril, circuit.node_xi), (fields.fibril, fields.xi)))
        voltage[inner] = np.interp(at[inner], nodes[known], fields.potential[known] / fields.voltage)
    return _Answer(voltage, float(fields.currents[0]))


def _ngspice(circuits: Sequence[Circuit], probes: Sequence[Probe], timeout: float) -> list[_Answer]:
    """The answers of one ngspice process to one deck for each probe."""
    decks = [deck(c, _drive(p)) for c, p in zip(circuits, probes, strict=True)]
    answers = []
    for circuit, probe, data in zip(circuits, probes, run_decks(decks, timeout), strict=True):
        plot = data.plots[0]
        pin = pin_names(circuit)[circuit.ports.index(probe.source)]
        voltage = plot.voltage(circuit.node_names)[0] / probe.voltage
        answers.append(_Answer(voltage, -float(plot.current(f"v{pin}")[0])))
    return answers


def _difference(a: Sequence[_Answer], b: Sequence[_Answer]) -> tuple[float, float]:
    """Largest difference of two routes in node voltage and in relative current, over all probes."""
    voltage = [np.max(np.abs(x.voltage - y.voltage), initial=0.0) for x, y in zip(a, b, strict=True)]
    return float(np.max(voltage, initial=0.0)), _relative([x.current for x in a], [y.current for y in b])


def _relative(values: Sequence[float], reference: Sequence[float]) -> float:
    """Largest difference relative to each reference or, for those that are nothing beside it, to the largest."""
    scale = np.abs(np.asarray(reference, dtype=np.float64))
    largest = scale.max(initial=0.0)
    scale = np.where(scale > NO_CURRENT * largest, scale, largest)
    difference = np.abs(np.asarray(values) - np.asarray(reference))
    relative = np.divide(difference, scale, out=np.where(difference > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(np.max(relative, initial=0.0))
