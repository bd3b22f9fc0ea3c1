"""Relaxation of a whole fabric: beams and contact together, to equilibrium; and its clamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, PenetrationError
from circuittex.base.frozen import frozen, same
from circuittex.contact.law import largest_penalty
from circuittex.contact.penalty import PenaltyContact
from circuittex.design import Design
from circuittex.design.restated import restated
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.checkpoint import NONE, Checkpoints
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.linear import LinearSolver
from circuittex.mech.minimise import Minimum, minimise
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.scales import fibril_scales
from circuittex.mech.space import BeamSpace, beam_space
from circuittex.mech.terms import ForceTerm
from circuittex.relaxation.clamps import REST, sliding
from circuittex.relaxation.continuation import continued
from circuittex.relaxation.units import PLAIN, Units, own_units

ROUGHLY = 1e-3
"""Tolerance of a descent with softer contacts than there are, which only leads near a minimum."""

WORTH_A_DESCENT = 15_000
"""Unknowns from which on a relaxation begins with a descent by gradients. With 7,560 of them, 2 x 2 yarns of ten
fibrils, it costs as much as Newton's method alone, with 16,740, 3 x 3 of them, half, and more a fraction
(`benchmarks/size.py`)."""

PATIENT = 100
"""Iterations of Newton's method after which a step of a loading path that is not at rest is tried by gradients."""


@frozen
class Equilibrium:
    """An equilibrium of the fabric with its clamped ends where the configuration has them."""

    configuration: Configuration
    reaction: Floats
    """(N, 3) force of the clamps on each node, N; zero inside and at free ends, up to the residual."""
    section_force: Floats
    """(M, 3) section force ∫ P E3 dA in each element, N."""
    energy: float
    """Stored elastic and contact energy, N mm."""
    residual: float
    """Largest free force, N; moments on directors over half a pitch."""
    iterations: int
    """Linear systems solved: iterations by gradients and of Newton's method, and one for the prediction where there was
    one; of all descents, where softer contacts came first (`continued`)."""
    history: Floats
    """(Newton iterations + 1, 4) residual N, potential N mm, shift (`minimise`), step length, of the last descent."""


def begins_with_gradients(n_dofs: int) -> bool:
    """Whether a relaxation of so many unknowns begins with a descent by gradients."""
    return n_dofs >= WORTH_A_DESCENT


def force_terms(mesh: FibrilMesh, design: Design, free_edges: str = "") -> tuple[BeamSpace, Beam, PenaltyContact]:
    """The space of the fibrils and the two force terms, elasticity and contact, that a design asks for."""
    numerics = design.numerics
    space = beam_space(mesh, free_edges)
    natural = Configuration(mesh.natural) if len(mesh.natural) else None
    beam = Beam(space, degree=numerics.section_degree, natural=natural)
    contact = PenaltyContact(mesh, law=design.contact, per_element=design.resolution.contact_points)
    return space, beam, contact


def relax(
    mesh: FibrilMesh,
    design: Design,
    start: Configuration | None = None,
    *,
    before: Configuration | None = None,
    gradient: Floats = REST,
    free_edges: str = "",
    gripped: str = "",
    solver: LinearSolver | None = None,
    report: Callable[[int, float], None] | None = None,
    checkpoints: Checkpoints = NONE,
) -> Equilibrium:
    """The equilibrium that descent from `start` (by default the initial weave) reaches, ends held as there or under the
    design's clamp forces.

    Where `start` was moved from the equilibrium `before`, the descent starts from what that predicts. The
    ends of yarns along `free_edges`, 'x' or 'y', are not held, those along the axes `gripped` stay in place even if the
    design gives a force for them; the others slide as the average deformation `gradient` (2, 2) of the start directs
    (`sliding`). From the initial weave of the design the descent is made in units of its own fibrils (`own_units`).

    A descent by gradients tells `checkpoints` of the places from which the same call, given one of them, goes on to the
    same equilibrium, bit for bit; they are in the units of the descent. Of several descents (`continued`) it is the
    first, whose penalty is the true one.

    Raises `ConvergenceError` with the history where it is not reached.
    """
    woven, solver = initial_configuration(mesh), solver if solver is not None else MultifrontalSolver()
    start, units = start if start is not None else woven, own_units(mesh, design)
    regular = before is None and same(start, woven) and same(mesh, build_mesh(design))
    ends = gradient, free_edges, "".join(axis for axis in "xy" if axis not in gripped + free_edges)
    if not regular or units == PLAIN:
        return _relaxed(mesh, design, start, before, ends, solver, report, PLAIN, checkpoints)
    own = restated(design, units.length, units.modulus)
    there = build_mesh(own)
    try:
        found = _relaxed(there, own, initial_configuration(there), None, ends, solver, report, units, checkpoints)
    except ConvergenceError as error:
        error.history = units.history(error.history)
        raise
    fixed, moving = beam_space(mesh, free_edges).fixed, sliding(mesh, design, ends[2], gradient)
    if moving is not None:
        fixed = np.setdiff1d(fixed, moving.motions.unknown)
    configuration = units.configuration(found.configuration, woven, fixed)
    return Equilibrium(
        configuration=configuration,
        reaction=found.reaction * units.force,
        section_force=found.section_force * units.force,
        energy=found.energy * units.energy,
        residual=found.residual * units.force,
        iterations=found.iterations,
        history=units.history(found.history),
    )


def _relaxed(
    mesh: FibrilMesh,
    design: Design,
    start: Configuration,
    before: Configuration | None,
    ends: tuple[Floats, str, str],
    solver: LinearSolver,
    report: Callable[[int, float], None] | None,
    units: Units,
    checkpoints: Checkpoints,
) -> Equilibrium:
    """The same in the units that mesh and design are in; `units` is what those are, for messages.

    `ends` are the average gradient, the free edges and the axes along which clamps may slide.
    """
    gradient, free_edges, slack = ends
    space, beam, contact = force_terms(mesh, design, free_edges)
    moving = sliding(mesh, design, slack, gradient)
    terms: list[ForceTerm] = [beam, contact] if moving is None else [beam, contact, moving.load]
    contact.modulus, moved, numerics = units.modulus, before is not None and not same(before, start), design.numerics
    scales = fibril_scales(space, design.weave.least_pitch, largest_penalty(mesh, design.contact))
    scales = replace(scales, newtons=units.force)

    large = begins_with_gradients(space.n_dofs)

    def descend(q: Floats, part: float, may_creep: bool, by_gradients: bool = large) -> Minimum:
        contact.part, true = part, part == 1.0
        first = true and not may_creep  # of `continued`, which comes back to the true penalty with leave to creep
        return minimise(
            terms,
            q,
            scales=scales,
            fixed=space.fixed,
            motions=None if moving is None else moving.motions,
            solver=solver,
            before=space.vector(before) if before is not None and moved else None,
            tolerance=numerics.relative_tolerance if true else ROUGHLY,
            force_tolerance=numerics.force_tolerance if true else 0.0,
            max_iterations=numerics.max_iterations,
            may_creep=may_creep,
            stride=float(mesh.radius.min()) if by_gradients else 0.0,
            report=report,
            checkpoints=checkpoints if first else NONE,
        )

    q = space.vector(start)
    if before is None:
        minimum = continued(descend, q)
    else:
        try:
            minimum = descend(q, 1.0, True)
        except PenetrationError:
            raise
        except ConvergenceError as error:
            if large or len(error.history) <= PATIENT:
                raise
            # Among stiff contacts every step of Newton's method is cut short; gradients get there all the same.
            minimum = descend(q, 1.0, True, by_gradients=True)
            minimum = replace(minimum, iterations=minimum.iterations + len(error.history) - 1)
    found = Equilibrium(
        configuration=space.configuration(minimum.q),
        reaction=space.configuration(minimum.gradient).r,
        section_force=beam.section_force(minimum.q),
        energy=minimum.energy,
        residual=minimum.residual,
        iterations=minimum.iterations,
        history=minimum.history,
    )
    if moving is None:
        return found
    load = moving.load  # of which the minimum's potential has the energy, and the clamps have the force
    reaction = space.configuration(minimum.gradient + load.force).r
    return replace(found, reaction=reaction, energy=found.energy - load.energy(minimum.q))


def move(configuration: Configuration, before: Floats, after: Floats) -> Configuration:
    """The whole body moved in its plane from the average deformation gradient `before` to `after` (2, 2).

    Positions follow the affine increment; directors keep their place and find theirs in the relaxation.
    """
    x = configuration.x.copy()
    x[:, 0, :2] = x[:, 0, :2] @ (after @ np.linalg.inv(before)).T
    return Configuration(x)


def clamp_force(mesh: FibrilMesh, reaction: Floats) -> Floats:
    """(2, 3) total force of the clamps on the plus ends of the yarns along x and along y, N [40, 41].

    Positive along the yarns where the clamps pull.
    """
    ends, axis = mesh.end_nodes(+1), mesh.yarn_axis[mesh.yarn]
    return np.stack([reaction[ends[axis == k]].sum(axis=0) for k in (0, 1)])
