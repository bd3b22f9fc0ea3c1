"""The discretisation error of a recorded state: the same equilibrium on other meshes and with more contact points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, DesignError
from circuittex.base.frozen import frozen
from circuittex.base.workers import Job
from circuittex.design import Design, Loading
from circuittex.design.clamps import gripped
from circuittex.fit import network_names
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.relaxation.relax import relax
from circuittex.relaxation.transfer import transfer
from circuittex.results.discretisation import ErrorEstimate, QuantityError
from circuittex.results.outcome import Outcome
from circuittex.results.records import Record, Study
from circuittex.study.record import outcome_of

VARIANTS = ("half as many elements", "twice as many elements", "twice as many contact points")
"""How the numerics of a design are varied, in the order of `variants`."""
JUMP = 2 / 3
"""Parts of the smallest radius: where a node lies further than this from its place in the state, fibrils have
rearranged. Discretisation alone was seen to move nodes by half a radius on four quadratic elements a fibril, and by a
quarter on more; a fibril that rolls over another moves by about one."""


@frozen
class _Repeat:
    """What one variant of the numerics says about a state; all nan where it has no equilibrium."""

    values: Floats
    """(n,) clamp forces N, probe currents A, Ry and Rc by kind ohm."""
    moved: float
    """Largest distance of a node from its place in the state, mm."""
    trouble: str
    """Why there is no equilibrium; empty where there is."""


def variants(design: Design) -> tuple[Design, Design, Design]:
    """The design on half and on twice as many elements, and with twice as many contact points.

    Raises `DesignError` where its numerics leave no room for one of them.

    >>> from circuittex.design import plain_weave
    >>> [(d.numerics.elements, d.numerics.contact_points) for d in variants(plain_weave())]
    [(10, 4), (40, 4), (20, 8)]
    """
    elements, points = design.resolution.elements, design.resolution.contact_points
    if elements % 2:
        raise DesignError("numerics.elements", elements, "an error estimate halves it: it must be even")
    coarse, fine = (_varied(design, "elements", n) for n in (elements // 2, 2 * elements))
    return coarse, fine, _varied(design, "contact_points", 2 * points)


def _varied(design: Design, field: str, number: int) -> Design:
    # Snapping is about netlists, which are not written here, and its limit depends on the mesh.
    try:
        return replace(design, numerics=replace(design.numerics, snap_length=0.0, **{field: number}))
    except DesignError as error:
        own = getattr(design.numerics, field)
        reason = f"an error estimate computes the design with {number} as well, which fails: {error.allowed}"
        raise DesignError(f"numerics.{field}", own, reason) from error


def estimate_error(
    design: Design,
    mesh: FibrilMesh,
    record: Record,
    solver: Callable[[], LinearSolver] = MultifrontalSolver,
    say: Callable[[str], None] | None = None,
) -> ErrorEstimate:
    """The discretisation error of clamp forces, probe currents, Ry and Rc (by kind) of a recorded state.

    The equilibrium found is carried over to each variant of the numerics and relaxed from there, so that it stays on
    its branch: several equilibria of a weave lie close together, and a relaxation from the start could find another.
    A variant without equilibrium, or one in which fibrils rearranged, is named in the `warnings`. `solver` makes the
    linear solver of each relaxation; `say` is told what is being done.

    Raises `DesignError` as `variants` does.
    """
    loading = next((loading for loading in design.loading if loading.name == record.loading), None)
    repeats = []
    for words, other in zip(VARIANTS, variants(design), strict=True):
        if say is not None:
            say(f"{record.name}: error estimate, {words}")
        repeats.append(_repeat(other, mesh, record, loading, solver()))
    own = _values(record.outcome)
    rows = zip(_names(design), own, *(repeat.values for repeat in repeats), strict=True)
    elements, points = design.resolution.elements, design.resolution.contact_points
    return ErrorEstimate(
        state=record.name,
        elements=(elements // 2, elements, 2 * elements),
        contact_points=(points, 2 * points),
        moved=np.array([repeat.moved for repeat in repeats]),
        quantities=tuple(QuantityError(*name, *map(float, values)) for name, *values in rows),
        warnings=tuple(_warnings(mesh, repeats)),
    )


def without_estimate(study: Study) -> tuple[Record, ...]:
    """The states that an error estimate is for and that have none yet: the relaxed one and the last of each loading."""
    last = {record.loading: record for record in study.records}  # one each: the relaxed state's loading is empty
    known = {estimate.state for estimate in study.errors}
    return tuple(record for record in last.values() if record.name not in known)


def estimates(study: Study, solver: Callable[[], LinearSolver]) -> list[Job]:
    """The tasks that estimate the errors of each state that `without_estimate` names.

    Raises `DesignError` as `variants` does.
    """
    variants(study.design)
    arguments = study.design, study.mesh
    return [(record.name, estimate_error, (*arguments, record, solver)) for record in without_estimate(study)]


def _repeat(design: Design, mesh: FibrilMesh, record: Record, loading: Loading | None, solver: LinearSolver) -> _Repeat:
    """Relax the state with the numerics of `design`, and measure what comes out."""
    other, state = build_mesh(design), record.configuration
    try:
        found = relax(
            other,
            design,
            transfer(state, mesh, other),
            gradient=record.gradient,
            free_edges=loading.free if loading else "",
            gripped=gripped(loading) if loading else "",
            solver=solver,
        )
        values = _values(outcome_of(design, other, found, record))
    except ConvergenceError as error:
        return _Repeat(np.full(len(_names(design)), nan), nan, str(error))
    back = transfer(found.configuration, other, mesh)
    moved = float(np.linalg.norm(back.r - state.r, axis=1).max())
    return _Repeat(values, moved, "")


def _names(design: Design) -> tuple[tuple[str, str], ...]:
    """Name and unit of each quantity, in the order of `_values`."""
    currents = [(f"I {probe.name}", "A") for probe in design.probes]
    ohms = [(name, "ohm") for names in network_names(design) for name in names]
    return ("Fx warp", "N"), ("Fy weft", "N"), *currents, *ohms


def _values(outcome: Outcome) -> Floats:
    """(n,) the quantities: clamp force of the warp along x and of the weft along y, probe currents, Ry and Rc by
    kind."""
    force = outcome.clamp_force
    return np.array([force[0, 0], force[1, 1], *outcome.currents, *outcome.network])


def _warnings(mesh: FibrilMesh, repeats: Sequence[_Repeat]) -> Iterator[str]:
    limit = JUMP * float(mesh.radius.min())
    for words, repeat in zip(VARIANTS, repeats, strict=True):
        if repeat.trouble:
            yield f"with {words} there is no equilibrium near the state ({repeat.trouble})"
        elif repeat.moved > limit:
            yield (
                f"with {words} fibrils rearrange, by up to {repeat.moved:.2g} mm: that equilibrium is another branch, "
                "and the estimate holds the difference of branches besides that of meshes"
            )
