"""Equilibrium as a minimum of the total potential: Newton's method that minimises.

Each iteration solves (K + tau M) dq = -g with the exact tangent K, the mass matrix M and a shift tau, then
searches along dq for a lower potential. Where the factorisation meets a negative pivot, part of the tangent's
softening is left out, and where that does not help tau grows; it shrinks while full steps succeed. This is
dynamic relaxation with a step that adapts: a shift tau is a step of backward Euler with dt = tau^(-1/2) from
rest. The iteration knows no physics; forces are `ForceTerm`s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import ConvergenceError, PenetrationError
from circuittex.base.frozen import frozen
from circuittex.mech.terms import ForceTerm
from circuittex.solvers.linear import LinearSolver, Solve
from circuittex.solvers.pattern import Pattern, build_pattern, diagonal, multiply

FIRST_SHIFT, LEAST_SHIFT = 1e-2, 1e-5
"""Shifts, N/mm per g. The least keeps the fibrils' free spin about their axes, a true zero mode, solvable; it is a
thousand times softer than the softest bending mode of the paper's fibrils."""
SOFTENING = (1.0, 0.7, 0.3)
"""Parts of the softening tangent that are tried far from equilibrium, where a descent through sliding contacts
takes fewer iterations with less of it than with a larger shift alone. The search begins one place before the part
that served last, since a factorisation that fails costs nearly as much as one that succeeds."""
SADDLE = 2e-3
"""A largest free force below this part of the largest force of all, with a tangent that needs a shift, is a saddle:
the symmetry of a weave leads there, and Newton's method leaves it slowly."""
ROUGH = 0.02
"""Far from equilibrium the largest free force exceeds this part of the largest force of all. Nearer, only the whole
tangent will do: with less of it the convergence is linear, and may end at a saddle."""
LARGEST_SHIFT = 1e3
"""Largest shift tried, in parts of the largest stiffness over mass of an unknown: it leaves nothing of the tangent."""
INVERSE_ITERATIONS = 12
"""Enough for the lowest mode to lead: its curvature and the shift nearly cancel."""
FIRST_ESCAPE = 1e-4
"""First step away from a saddle: largest change of an unknown, mm or one."""
ROUND_OFF = 1e-13
"""Relative change of the potential that is round-off of its sum rather than an increase."""
ARMIJO = 1e-4
"""A step must achieve this part of the decrease that the slope promises (Nocedal & Wright, 3.1)."""


@frozen
class Minimum:
    """A minimum: the gradient vanishes on the free unknowns, and the tangent with the shift FIRST_SHIFT is positive
    definite."""

    q: Floats
    """(n_dofs,) unknowns."""
    gradient: Floats
    """(n_dofs,) gradient of the potential, N: on prescribed unknowns the force of the supports."""
    energy: float
    """Potential, N mm."""
    residual: float
    """Largest magnitude of the gradient on the free unknowns, N."""
    iterations: int
    """Linear systems solved: Newton iterations, and one for the prediction where there was one."""
    history: Floats
    """(Newton iterations + 1, 4) residual N, potential N mm, shift, step length of each."""


@dataclass
class System:
    """Pattern, mass and the values assembled in it; renewed when a term's couplings change."""

    terms: Sequence[ForceTerm]
    mass_of: Callable[[Pattern], Floats]
    fixed: Ints
    n: int
    pattern: Pattern | None = None
    mass: Floats = field(default_factory=lambda: np.empty(0))
    data: Floats = field(default_factory=lambda: np.empty(0))
    softening: Floats = field(default_factory=lambda: np.empty(0))
    largest_shift: float = 0.0
    held: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def assemble(self, q: Floats) -> tuple[Pattern, float, Floats]:
        changed = [term.prepare(q) for term in self.terms]
        if self.pattern is None or any(changed):
            pairs = [term.pairs() for term in self.terms]
            full, point = (np.concatenate([p[k] for p in pairs]) for k in (0, 1))
            self.pattern = build_pattern(self.n // 9, full, point, q.reshape(-1, 9)[:, :3].copy())
            self.mass = self.mass_of(self.pattern)
            rows = np.repeat(np.arange(self.n), np.diff(self.pattern.indptr))
            is_fixed = np.zeros(self.n, dtype=bool)
            is_fixed[self.fixed] = True
            self.held = np.flatnonzero(is_fixed[rows] | is_fixed[self.pattern.indices])
        gradient, self.data, self.softening = np.zeros(self.n), np.zeros(self.pattern.nnz), np.zeros(self.pattern.nnz)
        tangent = self.data, self.softening
        energy = sum(term.assemble(q, self.pattern, gradient, *tangent) for term in self.terms)
        return self.pattern, energy, gradient

    def factor(self, solver: LinearSolver, shift: float, softening: float) -> Solve | None:
        assert self.pattern is not None
        values = self.data + softening * self.softening + shift * self.mass
        values[self.held] = 0.0
        values[diagonal(self.pattern)[self.fixed]] = 1.0
        return solver.factor(self.pattern, values)

    def energy(self, q: Floats) -> float:
        return sum(term.energy(q) for term in self.terms)

    def longest(self, q: Floats, direction: Floats) -> float:
        return min(term.longest(q, direction) for term in self.terms)


def minimise(
    terms: Sequence[ForceTerm],
    q: Floats,
    *,
    mass: Callable[[Pattern], Floats],
    fixed: Ints,
    solver: LinearSolver,
    before: Floats | None = None,
    tolerance: float = 1e-6,
    max_iterations: int = 200,
    report: Callable[[int, float], None] | None = None,
) -> Minimum:
    """The minimum of the terms' total potential that a descent from q (n_dofs,) reaches.

    `mass` gives the mass matrix in a pattern; `fixed` are the prescribed unknowns, kept as they are in q; where q was
    moved from the minimum `before`, the descent starts from what that predicts (`predict`); `tolerance` (N) bounds the
    largest free force; `report` is told of every iteration.

    Raises `ConvergenceError`, with the history, where the tolerance is not met in `max_iterations`: an
    unconverged state is never returned. `PenetrationError` where a term cannot keep apart what it should.
    """
    system = System(terms, mass, fixed, len(q))
    if before is not None:
        q = predict(system, solver, before, q)
    shift, part, refused, step, history = FIRST_SHIFT, 0, False, 1.0, []
    free = np.ones(len(q), dtype=bool)
    free[fixed] = False
    for iteration in range(max_iterations + 1):
        pattern, energy, gradient = system.assemble(q)
        if iteration == 0:
            stiffness, inertia = (values[diagonal(pattern)][free] for values in (system.data, system.mass))
            system.largest_shift = LARGEST_SHIFT * float((stiffness / inertia).max())
        residual = float(np.abs(gradient[free]).max())
        history.append((residual, energy, shift, step))
        if report is not None:
            report(iteration, residual)
        if not np.isfinite(energy):
            raise ConvergenceError("the potential is infinite: a fibril's section is inside out", np.array(history))
        if residual <= tolerance and system.factor(solver, FIRST_SHIFT, 1.0) is not None:
            solves = iteration + (before is not None)
            return Minimum(q, gradient, energy, residual, solves, np.array(history))
        if iteration == max_iterations:
            break
        rough = residual > ROUGH * np.abs(gradient).max()
        parts = SOFTENING[part if refused or part == 0 else part - 1 :] if rough else SOFTENING[:1]
        shift, part, solve = _positive(system, solver, shift, parts, history)
        refused = SOFTENING[part] != parts[0]
        if shift > FIRST_SHIFT and residual < SADDLE * np.abs(gradient).max():
            lower = _escape(system, pattern, solve, q, energy, free)
            if lower is not None:
                q, step, shift = lower, 1.0, FIRST_SHIFT
                continue
        force = np.where(free, gradient, 0.0)
        direction = solve(-force)
        try:
            step = _search(system, q, direction, energy, float(force @ direction))
        except PenetrationError as error:
            raise PenetrationError(str(error), np.array(history)) from error
        if step == 0.0:
            shift = 16 * max(shift, FIRST_SHIFT)
            if shift > system.largest_shift:
                break
            continue
        q = q + step * direction
        shift = max(LEAST_SHIFT, shift / 4) if step == 1.0 else (shift if step >= 0.25 else 4 * shift)
    message = f"no equilibrium after {len(history) - 1} iterations: the largest free force is {residual:.3g} N"
    raise ConvergenceError(f"{message}, {tolerance:.3g} N was asked for", np.array(history))


def predict(system: System, solver: LinearSolver, q: Floats, moved: Floats) -> Floats:
    """Where a minimum q (n_dofs,) goes to first order when its prescribed unknowns move to those of `moved`.

    With the tangent K at q and the free unknowns f, the minimum moves by dq with (K dq)_f = 0; this is solved for the
    difference to `moved`, a first guess. `moved` itself is returned where its potential is the lower one, or where the
    way to the prediction is barred (`ForceTerm.longest`).

    Raises `PenetrationError` where the way to `moved` is barred too.
    """
    if system.longest(q, moved - q) < 1.0:
        raise PenetrationError("the motion of the clamps would carry fibrils through one another")
    pattern, _, _ = system.assemble(q)
    force = multiply(pattern, system.data + system.softening, moved - q)
    force[system.fixed] = 0.0
    solve = system.factor(solver, FIRST_SHIFT, 1.0)
    if solve is None:
        return moved
    predicted = moved - solve(force)
    lower = system.energy(predicted) < system.energy(moved)
    return predicted if lower and system.longest(q, predicted - q) == 1.0 else moved


def _positive(
    system: System,
    solver: LinearSolver,
    shift: float,
    parts: Sequence[float],
    history: list[tuple[float, float, float, float]],
) -> tuple[float, int, Solve]:
    """The tangent made positive definite with less of its softening or else a larger shift.

    Returns the shift, the place in `SOFTENING` of the part that served, and the factor. Of `parts`, the first
    that serves is taken.
    """
    while shift <= system.largest_shift:
        for part in parts:
            solve = system.factor(solver, shift, part)
            if solve is not None:
                return shift, SOFTENING.index(part), solve
        shift = max(4 * shift, FIRST_SHIFT)
    raise ConvergenceError("the tangent stays indefinite under any shift", np.array(history))


def _escape(
    system: System, pattern: Pattern, solve: Solve, q: Floats, energy: float, free: NDArray[np.bool_]
) -> Floats | None:
    """A lower point along the mode of the lowest curvature, found by inverse iteration with the shifted factor; None
    where there is none within sight.

    Of the two senses the one that leads lower is taken; the step doubles for as long as that pays.
    """
    mode = np.where(free, np.random.default_rng(0).standard_normal(len(q)), 0.0)
    for _ in range(INVERSE_ITERATIONS):
        mode = np.where(free, solve(np.where(free, multiply(pattern, system.mass, mode), 0.0)), 0.0)
        mode /= np.abs(mode).max()
    best, lowest = None, energy
    for sense in (-1.0, 1.0):
        step = FIRST_ESCAPE
        while (trial := system.energy(q + sense * step * mode)) < lowest:
            if system.longest(q, sense * step * mode) < 1.0:
                break
            best, lowest = q + sense * step * mode, trial
            step *= 2
    return best


def _search(system: System, q: Floats, direction: Floats, energy: float, slope: float) -> float:
    """Step length in {1, 1/2, 1/4, ...} that is safe and lowers the potential enough; 0 if none does."""
    step, longest = 1.0, system.longest(q, direction)
    for _ in range(12):
        if step <= longest:
            trial = system.energy(q + step * direction)
            if trial <= energy + ARMIJO * step * slope + ROUND_OFF * abs(energy):
                return step
        step /= 2
    return 0.0
