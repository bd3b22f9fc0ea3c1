"""One increment of a loading path: move the whole body, then relax it; in parts where the whole is too large."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.linear import LinearSolver
from circuittex.relaxation.relax import Equilibrium, move, relax
from circuittex.relaxation.sides import check_sides

SMALLEST = Fraction(1, 64)
"""Smallest part of an increment that is tried before the path is given up."""


@frozen
class Increment:
    """Where an increment led, and what it took."""

    equilibrium: Equilibrium
    """The equilibrium at its end; its `iterations` and `history` are those of the last part."""
    parts: int
    """Parts in which it was made: 1 where it converged as a whole."""
    iterations: int
    """Iterations of all parts and of the tries that did not converge."""


def advance(
    mesh: FibrilMesh,
    design: Design,
    now: Configuration,
    before: Floats,
    after: Floats,
    *,
    free_edges: str = "",
    gripped: str = "",
    solver: LinearSolver | None = None,
    report: Callable[[int, float], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> Increment:
    """The equilibrium at the average deformation gradient `after` (2, 2), from the one `now` at `before`.

    An increment that does not converge within the design's `max_iterations`, or leads fibrils through one another or
    round an end, is made in two halves, these in halves again where they must be, down to `SMALLEST`; `say` is told.
    Between the ends the gradient is F = before + t (after - before): a straight line, which for the small increments
    of a path differs little from any other. The ends of yarns along `free_edges`, 'x' or 'y', are not held, and
    those along the axes `gripped` move as F says even if the design gives a force for them (`relax`); `report` is told
    of every iteration.

    Raises `ConvergenceError`, with the history of the last try, where the smallest part does not converge.
    """
    gradient, done, size, parts, iterations = before, Fraction(0), Fraction(1), 0, 0
    while True:
        target = after if done + size == 1 else before + float(done + size) * (after - before)
        try:
            start = move(now, gradient, target)
            equilibrium = relax(
                mesh,
                design,
                start,
                before=now,
                gradient=target,
                free_edges=free_edges,
                gripped=gripped,
                solver=solver,
                report=report,
            )
            check_sides(mesh, design, equilibrium.configuration.r, target, free_edges, equilibrium.history)
        except ConvergenceError as error:
            iterations += max(0, len(error.history) - 1)
            if size == SMALLEST:
                raise type(error)(_given_up(done, gradient, error), error.history) from error
            if say is not None:
                say(f"{_part(done, size)} did not converge ({error}); trying it in 2 halves")
            size /= 2
            continue
        parts, iterations = parts + 1, iterations + equilibrium.iterations
        done += size
        if done == 1:
            return Increment(equilibrium, parts, iterations)
        now, gradient = equilibrium.configuration, target
        size = Fraction(1, done.denominator)  # the second half, and after it what follows the part that was halved


def _part(done: Fraction, size: Fraction) -> str:
    return "the step" if size == 1 else f"the step from {done} to {done + size} of its length"


def _given_up(done: Fraction, gradient: Floats, error: ConvergenceError) -> str:
    reached = f"F = {np.round(gradient, 6).tolist()}, {done} of the step" if done else "the state before the step"
    return f"the loading path was followed up to {reached}; the next {SMALLEST} of the step did not converge: {error}"
