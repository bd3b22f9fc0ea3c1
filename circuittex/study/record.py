"""From one state of a study to the next, and from an equilibrium to everything that is kept of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from circuittex.base.errors import ConvergenceError
from circuittex.contact.extract import contacts_of
from circuittex.design import Design
from circuittex.electrical.fields import solve_probes
from circuittex.fit import fit_network
from circuittex.geometry.levels import levels
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.increment import Increment, advance
from circuittex.relaxation.relax import Equilibrium, clamp_force, relax
from circuittex.results.outcome import Outcome
from circuittex.results.records import Record, Study
from circuittex.study.export import detailed_file, simplified
from circuittex.study.plan import Step
from circuittex.study.verify import field_convergence, verify
from circuittex.study.verify_reduced import verify_reduced


def reach(
    study: Study,
    step: Step,
    start: Configuration,
    solver: Callable[[], LinearSolver],
    say: Callable[[str], None],
) -> Increment:
    """The equilibrium of a state, from the configuration `start` of the one before it and from nothing else.

    The solver is made anew, so that the result cannot depend on what was computed before: a study that goes on from
    stored states finds what an uninterrupted one does. `say` is told of the progress, with a line break at the end of
    what should stay on the screen.

    Raises `ConvergenceError`, naming the state.
    """
    mesh, design = study.mesh, study.design

    def report(iteration: int, residual: float) -> None:
        say(f"{step.name}: iteration {iteration}, largest free force {residual:.1e} N")

    try:
        if not step.previous:
            relaxed = relax(mesh, design, start, solver=solver(), report=report)
            return Increment(relaxed, 1, relaxed.iterations)
        return advance(
            mesh,
            design,
            start,
            step.before,
            step.after,
            free=step.free,
            solver=solver(),
            report=report,
            say=lambda text: say(f"{step.name}: {text}\n"),
        )
    except ConvergenceError as error:
        raise ConvergenceError(f"{step.name}: {error}", error.history) from error


def record_state(study: Study, step: Step, reached: Increment, say: Callable[[str], None]) -> Record:
    """Contacts, fields, circuit, verification and fit of one equilibrium."""
    say(f"{step.name}: fields, netlists and verification")
    design, mesh, equilibrium = study.design, study.mesh, reached.equilibrium
    contacts = contacts_of(design, mesh, equilibrium.configuration)
    fields = solve_probes(contacts, design.terminals, design.probes, contact_heat=design.electrical.contact_heat)
    fit = fit_network([f.currents[0] for f in fields], design)
    merged = simplified(design, contacts).contacts
    convergence = np.empty((0, 2))
    if not step.loading:
        convergence = field_convergence(contacts, design.terminals, design.probes, fields)
    return Record(
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
        verification=verify(contacts, merged, design.terminals, design.probes, fields=fields),
        field_convergence=convergence,
        levels=levels(mesh, equilibrium.configuration.r, *centre_crossing(design)),
        netlist=f"netlists/{detailed_file(step.name)}",
    )


def outcome_of(design: Design, mesh: FibrilMesh, equilibrium: Equilibrium) -> Outcome:
    """The numbers of an equilibrium and nothing else, for one that is not recorded."""
    contacts = contacts_of(design, mesh, equilibrium.configuration)
    fields = solve_probes(contacts, design.terminals, design.probes, contact_heat=design.electrical.contact_heat)
    currents = tuple(float(field.currents[0]) for field in fields)
    fit = fit_network(currents, design)
    return Outcome(clamp_force(mesh, equilibrium.reaction), currents, fit.Ry, fit.Rc, equilibrium.energy)


def centre_crossing(design: Design) -> tuple[int, float]:
    """The warp yarn nearest the centre, and where along it (mm) it crosses the weft yarn nearest the centre."""
    weave = design.weave
    weft = (len(weave.weft) - 1) // 2
    return (len(weave.warp) - 1) // 2, (weft - (len(weave.weft) - 1) / 2) * weave.pitch
