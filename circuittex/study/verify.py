"""Three independent routes to every probe current and node voltage, and how far they lie apart."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ParamSpec, TypeVar

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError, NgspiceError, NgspiceUnavailableError
from circuittex.base.frozen import frozen
from circuittex.contact.state import ContactState
from circuittex.design import Probe, Terminal
from circuittex.electrical.fields import Fields, Potential, solve_potentials
from circuittex.electrical.fields.solution import Mesh
from circuittex.electrical.network.circuit import Circuit
from circuittex.electrical.network.nodal import rounding_errors, solve_nodal
from circuittex.electrical.spice.ngspice import run_decks
from circuittex.geometry.refine import refined
from circuittex.netlist import deck, pin_names
from circuittex.results.verification import AGREEMENT, COARSEST, Verification
from circuittex.study.circuits import probe_circuits

NO_CURRENT = 1e-6
"""A probe with less than this fraction of the largest probe current is measured against the largest."""

NOTHING = 1e-12
"""A probe with less than this fraction of an insulated yarn's current carries none: it is measured against that."""

MERGED = 0.01
"""A probe current that merging changes by more than this part is a note."""

P = ParamSpec("P")
T = TypeVar("T")


@frozen
class _Answer:
    """What one route says about one probe."""

    voltage: Floats
    """(K,) at the nodes of the circuit, V per volt of the probe."""
    current: float
    """Into the textile at the source, A."""


def verify(
    contacts: ContactState | Sequence[ContactState],
    simplified: ContactState | Sequence[ContactState],
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    *,
    fields: Sequence[Fields] | None = None,
    circuits: Sequence[Circuit] | None = None,
    simplified_circuits: Sequence[Circuit] | None = None,
    timeout: float = 60.0,
) -> Verification:
    """Compare finite elements, nodal analysis and ngspice for each probe.

    All three solve the `simplified` contacts, each from them alone; finite elements and nodal analysis also
    solve all `contacts`, and the differences are the largest of either. Both are those of all probes, or of each probe
    its own where resistances follow the temperatures that it makes. Every probe has a circuit of its own,
    since it joins only its own two terminals. ngspice answers all of them in one process within `timeout`
    seconds; where it does not, `ngspice_checked` is False and `note` says why. Its double precision is not refined,
    so that the circuit limits what it can confirm (`ngspice_limit`, see `rounding_errors`); the limit never loosens
    the comparison of the other two, which have one of their own where they differ (`native_limit`). `fields` are the
    finite element solutions on all `contacts` with the mesh "feet", `circuits` those of the probes on all `contacts`
    and `simplified_circuits` those on the simplified ones, for whoever has them already.
    """
    if not probes:
        nan = float("nan")
        return Verification((), nan, nan, nan, 0.0, nan, nan, 0.0, 0.0, nan, False, "there are no probes to verify")
    clock = _Clock()
    coarse = clock("fields", _potentials, contacts, terminals, probes, mesh="mechanical")
    full = clock("fields", _potentials, contacts, terminals, probes) if fields is None else fields
    whole = probe_circuits(contacts, terminals, probes) if circuits is None else circuits
    merged = clock("fields", _potentials, simplified, terminals, probes)
    small = probe_circuits(simplified, terminals, probes) if simplified_circuits is None else simplified_circuits
    try:
        full_fields, full_nodal = _native(clock, whole, probes, full)
        answers = _native(clock, small, probes, merged)
    except CircuitError as error:
        return _unresolved(f"nodal analysis says {error}", clock)
    routes = dict(zip(("fields", "nodal"), answers, strict=True))
    yarn = _yarn_currents(contacts, probes)
    native = _difference(full_fields, full_nodal, yarn), _difference(answers[0], answers[1], yarn)
    note, limit, with_ngspice, failed = "", 0.0, [], False
    try:
        routes["ngspice"] = clock("ngspice", _ngspice, small, probes, timeout)
        limit = _rounding(small, probes, routes["nodal"], yarn)
        if limit > COARSEST:
            raise NgspiceError(f"its own rounding, {limit:.1e}, is too coarse for resistances this far apart")
        with_ngspice = [_difference(answer, routes["ngspice"], yarn) for answer in answers]
    except NgspiceError as error:
        note = f"ngspice did not check this state: {error}"
        failed = not isinstance(error, NgspiceUnavailableError) and limit <= COARSEST
        routes.pop("ngspice", None)
        limit = 0.0
    voltage, current = np.max([*native, *with_ngspice], axis=0)
    native_limit = 0.0
    if np.max(native) > AGREEMENT:
        native_limit = max(_rounding(c, probes, a, yarn) for c, a in ((whole, full_nodal), (small, routes["nodal"])))
        if native_limit > COARSEST:
            return _unresolved(f"rounding alone leaves {native_limit:.1e} of the potentials open", clock)
    found = Verification(
        routes=tuple(routes),
        max_voltage_difference=float(voltage),
        max_current_difference=float(current),
        native_difference=float(np.max(native)),
        ngspice_limit=limit,
        merge_error=_relative([a.current for a in routes["fields"]], [a.current for a in full_fields], yarn),
        field_difference=_relative([f.currents[0] for f in coarse], [a.current for a in full_nodal], yarn),
        fields_seconds=clock.seconds["fields"],
        nodal_seconds=clock.seconds["nodal"],
        ngspice_seconds=clock.seconds["ngspice"] if "ngspice" in routes else float("nan"),
        ngspice_checked="ngspice" in routes,
        note=note,
        native_limit=native_limit,
        simulator_failed=failed,
    )
    return replace(found, note=_note(found))


def _potentials(
    contacts: ContactState | Sequence[ContactState],
    terminals: Sequence[Terminal],
    probes: Sequence[Probe],
    mesh: Mesh = "feet",
) -> tuple[Potential, ...]:
    """`solve_potentials`, on the same contacts for all probes or on those of each."""
    if isinstance(contacts, ContactState):
        return solve_potentials(contacts, terminals, probes, mesh=mesh)
    pairs = zip(contacts, probes, strict=True)
    return tuple(solve_potentials(each, terminals, [probe], mesh=mesh)[0] for each, probe in pairs)


def _unresolved(reason: str, clock: _Clock) -> Verification:
    """What is left where resistances are too far apart for the digits of nodal analysis: nothing to compare with."""
    nan = float("nan")
    seconds = clock.seconds["fields"], clock.seconds["nodal"], nan
    note = f"no route checks this state: {reason}"
    return Verification(("fields",), nan, nan, nan, 0.0, nan, nan, *seconds, False, note)


def _note(found: Verification) -> str:
    """The note with what the differences add to it."""
    sentences = [found.note] if found.note else []
    if found.ngspice_limit > AGREEMENT:
        sentences.insert(0, f"ngspice's own rounding limits this check to {found.ngspice_limit:.1e}.")
    if found.merge_error > MERGED:
        sentences.append(
            f"merging contacts changes a probe current by {100 * found.merge_error:.2g} %, and so netlists and the "
            "network fitted to them: state a smaller numerics.merge_length or drop_fraction."
        )
    if not found.agrees:
        differences = (
            f"{found.max_voltage_difference:.1e} V per V, currents {found.max_current_difference:.1e} relative"
        )
        sentences.insert(0, f"the routes disagree: {differences}.")
    return " ".join(sentences)


def field_convergence(
    contacts: ContactState, terminals: Sequence[Terminal], probes: Sequence[Probe], fields: Sequence[Potential]
) -> Floats:
    """How the potential on the mechanical mesh converges to the circuit: (3, 2) node distance mm, current error.

    The nodes of the mechanical mesh, then two and four times as many; the error is the largest relative
    difference of a probe current from `fields`, the solutions on the mesh "feet", which equal the circuit.
    """
    exact, yarn = [f.currents[0] for f in fields], _yarn_currents(contacts, probes)
    mesh, rows = contacts.mesh, []
    distance = float((mesh.length / (np.diff(mesh.first_node) - 1)).max())
    for pieces in (1, 2, 4):
        finer = replace(
            contacts, mesh=refined(mesh, pieces), axial_factor=np.repeat(contacts.axial_factor, mesh.order * pieces)
        )
        currents = [f.currents[0] for f in solve_potentials(finer, terminals, probes, mesh="mechanical")]
        rows.append((distance / pieces, _relative(currents, exact, yarn)))
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


def _native(
    clock: _Clock, circuits: Sequence[Circuit], probes: Sequence[Probe], fields: Sequence[Potential]
) -> tuple[list[_Answer], list[_Answer]]:
    """What finite elements, solved already, and nodal analysis say about the circuit of each probe."""
    return (
        [_from_fields(c, f) for c, f in zip(circuits, fields, strict=True)],
        [clock("nodal", _nodal, c, p) for c, p in zip(circuits, probes, strict=True)],
    )


def _drive(probe: Probe) -> dict[str, float]:
    return {probe.source: probe.voltage, probe.sink: 0.0}


def _nodal(circuit: Circuit, probe: Probe) -> _Answer:
    solution = solve_nodal(circuit, _drive(probe))
    return _Answer(solution.voltage / probe.voltage, float(solution.port_current[circuit.ports.index(probe.source)]))


def _from_fields(circuit: Circuit, fields: Potential) -> _Answer:
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


def _rounding(circuits: Sequence[Circuit], probes: Sequence[Probe], known: Sequence[_Answer], yarn: Floats) -> float:
    """What rounding may change in a voltage (V per V) or relative current of any probe."""
    errors = [rounding_errors(c, {p.source: 1.0, p.sink: 0.0}) for c, p in zip(circuits, probes, strict=True)]
    current = np.array([error[0] for _, error in errors]) * np.abs([probe.voltage for probe in probes])
    scale = _scale([answer.current for answer in known], yarn)
    relative = np.divide(current, scale, out=np.zeros(len(probes)), where=scale > 0.0)
    return float(np.max([*(voltage for voltage, _ in errors), *relative], initial=0.0))


def _difference(a: Sequence[_Answer], b: Sequence[_Answer], yarn: Floats) -> tuple[float, float]:
    """Largest difference of two routes in node voltage and in relative current, over all probes."""
    voltage = [np.max(np.abs(x.voltage - y.voltage), initial=0.0) for x, y in zip(a, b, strict=True)]
    return float(np.max(voltage, initial=0.0)), _relative([x.current for x in a], [y.current for y in b], yarn)


def _yarn_currents(contacts: ContactState | Sequence[ContactState], probes: Sequence[Probe]) -> Floats:
    """What the best of the yarns would carry alone at the voltage of each probe, and at 27 C, A."""
    mesh = contacts.mesh if isinstance(contacts, ContactState) else contacts[0].mesh
    conductance = np.bincount(mesh.yarn, mesh.electrical_conductivity * mesh.area / mesh.length)
    currents: Floats = conductance.max(initial=0.0) * np.abs(np.array([probe.voltage for probe in probes]))
    return currents


def _relative(values: Sequence[float], reference: Sequence[float], yarn: Floats) -> float:
    """Largest difference relative to each reference or, for those that are nothing beside others, to those.

    What one of the two says is nothing may be rounding in the other, and is no reference then.
    """
    least: list[float] = np.minimum(np.abs(values), np.abs(reference)).tolist()
    scale = np.where(np.array(least) > NOTHING * yarn, _scale(reference, yarn), _scale(least, yarn))
    difference = np.abs(np.asarray(values) - np.asarray(reference))
    relative = np.divide(difference, scale, out=np.where(difference > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(np.max(relative, initial=0.0))


def _scale(currents: Sequence[float], yarn: Floats) -> Floats:
    """What the difference of each current is measured against."""
    size = np.abs(np.asarray(currents, dtype=np.float64))
    largest = size.max(initial=0.0)
    usual = np.where(size > NO_CURRENT * largest, size, largest)
    scale: Floats = np.where(usual > NOTHING * yarn, usual, yarn)
    return scale
