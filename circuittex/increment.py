"""One increment of a loading path: move the whole body, then relax it."""

from __future__ import annotations

from collections.abc import Callable

from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh, Floats
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation import Equilibrium, move, relax


def advance(
    mesh: FibrilMesh,
    design: Design,
    now: Configuration,
    before: Floats,
    after: Floats,
    *,
    solver: LinearSolver | None = None,
    report: Callable[[int, float], None] | None = None,
) -> Equilibrium:
    """The equilibrium at the average deformation gradient `after` (2, 2), from the one `now` at `before`.

    Raises `ConvergenceError` where it is not reached.
    """
    return relax(mesh, design, move(now, before, after), solver=solver, report=report)
