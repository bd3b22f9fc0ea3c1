"""From one state of a study to the next, and from an equilibrium to everything that is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from circuittex.base.errors import ConvergenceError, DesignError, PenetrationError
from circuittex.base.frozen import frozen
from circuittex.contact.extract import contacts_of
from circuittex.contact.state import ContactState
from circuittex.design import Design
from circuittex.design.statement import NONLINEAR
from circuittex.electrical.fields import Fields, Potential, cooling_of, solve_potentials, solve_probes
from circuittex.electrical.network.circuit import Circuit, build_circuit
from circuittex.electrical.network.ports import port_matrix
from circuittex.fit import fit_network
from circuittex.geometry.levels import levels
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.checkpoint import NONE, Checkpoints
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.increment import Increment, advance
from circuittex.relaxation.relax import Equilibrium, clamp_force, relax
from circuittex.results.heating import fabric_area
from circuittex.results.outcome import Outcome, outcome
from circuittex.results.records import Record, Study
from circuittex.results.verification import Verification
from circuittex.study.circuits import StateCircuits, conducting_ends, probe_circuits
from circuittex.study.drive import at_voltages, steady_fields, told_currents
from circuittex.study.export import circuits_of, detailed_file, simplified, warm_contacts
from circuittex.study.plan import Step
from circuittex.study.soundness import check_sound
from circuittex.study.verify import field_convergence, verify
from circuittex.study.verify_reduced import verify_reduced


def reach(
    study: Study,
    step: Step,
    start: Configuration,
    solver: Callable[[], LinearSolver],
    say: Callable[[str], None],
    checkpoints: Checkpoints = NONE,
) -> Increment:
    """The equilibrium of a state, from the configuration `start` of the one before it and from nothing else.

    The solver is made anew, so that the result cannot depend on what was computed before: a study that goes on from
    stored states finds what an uninterrupted one does. `say` is told of the progress, with a line break at the end of
    what should stay on the screen; `checkpoints` are those of the relaxed state (`relax`).

    Raises `ConvergenceError`, naming the state and what to change.
    """
    mesh, design = study.mesh, study.design

    def report(iteration: int, residual: float) -> None:
        say(f"{step.name}: iteration {iteration}, largest free force {residual:.1e} N")

    try:
        if not step.previous:
            relaxed = relax(mesh, design, start, solver=solver(), report=report, checkpoints=checkpoints)
            return Increment(relaxed, 1, relaxed.iterations)
        return advance(
            mesh,
            design,
            start,
            step.before,
            step.after,
            free_edges=step.free_edges,
            gripped=step.gripped,
            solver=solver(),
            report=report,
            say=lambda text: say(f"{step.name}: {text}\n"),
        )
    except ConvergenceError as error:
        raise type(error)(f"{step.name}: {error}{_way_out(design, error)}", error.history) from error


def _way_out(design: Design, error: ConvergenceError) -> str:
    """What to change where no route leads to an equilibrium; nothing where the error says why there is none."""
    if isinstance(error, PenetrationError):
        return ""
    if len(error.history) > design.numerics.max_iterations:
        return f"; raise numerics.max_iterations above {design.numerics.max_iterations} or load in smaller steps"
    other = f"another number of numerics.elements than {design.resolution.elements}"
    return f"; try {other}, a larger numerics.tolerance or smaller steps"


@frozen
class Recorded:
    """A recorded state, and the circuits that were built on the way."""

    record: Record
    """What is kept of it."""
    circuits: StateCircuits
    """What its netlists are written from."""


def record_state(study: Study, step: Step, reached: Increment, say: Callable[[str], None]) -> Recorded:
    """Contacts, fields, circuits, verification and fit of one equilibrium.

    Raises `PenetrationError`, naming the state, where fibrils passed through one another or overlap too deeply.
    """
    say(f"{step.name}: fields, netlists and verification")
    mesh, equilibrium = study.mesh, reached.equilibrium
    contacts = contacts_of(study.design, mesh, equilibrium.configuration)
    check_sound(study, step, equilibrium.configuration.r, contacts)
    area = fabric_area(mesh, equilibrium.configuration)
    design = at_voltages(study.design, contacts, area)
    cold, fields = _fields(study.design, design, contacts, area, step.name)
    circuits = circuits_of(design, contacts, fields)
    whole = probe_circuits(contacts, design.terminals, design.probes)
    ports = port_matrix(circuits.conducting)
    fit = fit_network(told_currents(cold, whole, design), design, ports)
    convergence = np.empty((0, 2))
    if not step.loading:
        convergence = field_convergence(contacts, design.terminals, design.probes, cold)
    verification = _verified(design, contacts, fields, whole, circuits)
    record = Record(
        name=step.name,
        loading=step.loading,
        strain=step.strain,
        gradient=step.after,
        configuration=equilibrium.configuration,
        residual=equilibrium.residual,
        iterations=reached.iterations,
        parts=reached.parts,
        history=equilibrium.history,
        clamp_force=clamp_force(mesh, equilibrium.reaction),
        end_force=equilibrium.reaction[mesh.ends],
        energy=equilibrium.energy,
        section_force=np.linalg.norm(equilibrium.section_force, axis=1),
        contacts=contacts,
        fields=fields,
        fit=fit,
        reduced_difference=verify_reduced(design, fit),
        verification=verification,
        field_convergence=convergence,
        levels=levels(mesh, equilibrium.configuration.r, *centre_crossing(design)),
        netlist=f"netlists/{detailed_file(step.name)}",
        ports=ports,
    )
    return Recorded(record, circuits)


def _verified(
    design: Design,
    contacts: ContactState,
    fields: Sequence[Fields],
    whole: Sequence[Circuit],
    circuits: StateCircuits,
) -> Verification:
    """The comparison of the routes: on the same contacts for all probes or, where resistances follow the temperatures,
    on those of each, at the voltages of the fields. `whole`: the circuits of the former."""
    warm, few = warm_contacts(contacts, fields), [each.contacts for each in circuits.seen]
    probes = tuple(probe.at(field.voltage) for probe, field in zip(design.probes, fields, strict=True))
    one = isinstance(warm, ContactState)
    return verify(
        warm,
        circuits.simple.contacts if one else few,
        design.terminals,
        design.probes if one else probes,
        fields=fields,
        circuits=whole if one else probe_circuits(warm, design.terminals, probes),
        simplified_circuits=circuits.probes,
    )


def _fields(
    stated: Design, design: Design, contacts: ContactState, area: float, state: str
) -> tuple[Sequence[Potential], tuple[Fields, ...]]:
    """The potentials of the probes at 27 C, as the fit wants them, and the fields: the same where these are linear.

    `stated` and `design`: the probes as they are stated, and driven by the voltages that do so at 27 C.
    """
    electrical = design.electrical
    if electrical.heating == NONLINEAR:
        cold = solve_potentials(contacts, design.terminals, design.probes)
        try:
            return cold, steady_fields(stated, design, contacts, cold, area)
        except DesignError as error:
            raise DesignError(error.field, error.value, f"in the state {state!r} {error.allowed}") from error
    fields = solve_probes(
        contacts,
        design.terminals,
        design.probes,
        contact_heat=electrical.contact_heat,
        cooling=cooling_of(design, contacts.mesh),
    )
    return fields, fields


def outcome_of(design: Design, mesh: FibrilMesh, equilibrium: Equilibrium, record: Record) -> Outcome:
    """The numbers of another equilibrium of the state of `record`, and nothing else: currents at the voltages that the
    probes have there.

    Where resistances follow the temperatures these are those that a probe makes as it is stated: what a current warms
    may have another steady state at its voltage, or none.

    Raises `ConvergenceError` where there is no steady state.
    """
    contacts, driven = contacts_of(design, mesh, equilibrium.configuration), record.driven(design)
    cold = solve_potentials(contacts, driven.terminals, driven.probes)
    currents = tuple(float(field.currents[0]) for field in cold)
    if design.electrical.heating == NONLINEAR:
        currents = _warm_currents(design, contacts, fabric_area(mesh, equilibrium.configuration), record)
    merged = simplified(design, contacts).contacts
    told = told_currents(cold, probe_circuits(contacts, driven.terminals, driven.probes), driven)
    fit = fit_network(told, driven, port_matrix(build_circuit(merged, conducting_ends(mesh))))
    return outcome(clamp_force(mesh, equilibrium.reaction), currents, fit, equilibrium.energy)


def _warm_currents(design: Design, contacts: ContactState, area: float, record: Record) -> tuple[float, ...]:
    """The currents, A, at the voltages of a record through the resistances at the temperatures of the probes."""
    cold = at_voltages(design, contacts, area)
    potentials = solve_potentials(contacts, cold.terminals, cold.probes)
    try:
        fields = steady_fields(design, cold, contacts, potentials, area)
    except DesignError as error:
        raise ConvergenceError(str(error)) from error
    pairs = zip(fields, record.fields, strict=True)
    return tuple(float(field.currents[0]) * (there.voltage / field.voltage) for field, there in pairs)


def centre_crossing(design: Design) -> tuple[int, float]:
    """The warp yarn nearest the centre, and where along it (mm) it crosses the weft yarn nearest the centre."""
    warp, weft = design.weave.directions
    middle = (len(weft.yarns) - 1) // 2
    return (len(warp.yarns) - 1) // 2, (middle - (len(weft.yarns) - 1) / 2) * weft.pitch
