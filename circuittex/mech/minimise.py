"""Equilibrium as a minimum of the total potential: Newton's method that minimises.

Each iteration solves (K + tau M) dq = -g with the exact tangent K, a stiffness M of the fibrils themselves
(`Scales.metric`) and a shift tau, then searches along dq for a lower potential. Where the factorisation meets a
negative pivot, part of the tangent's softening is left out, and where that does not help tau grows; it shrinks while
full steps succeed. This is dynamic relaxation with a step that adapts: a shift is a step of backward Euler from rest,
with a mass that has nothing to do with the fibrils' own. The iteration knows no physics; forces are `ForceTerm`s, and
what is much or little the `Scales` say: all numbers below are pure ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import ConvergenceError, CreepingError, PenetrationError
from circuittex.base.frozen import frozen
from circuittex.mech.checkpoint import NONE, Checkpoints
from circuittex.mech.descent import descend, hand_over, refined
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.motions import Motions
from circuittex.mech.pattern import Pattern, diagonal, multiply
from circuittex.mech.scales import Scales
from circuittex.mech.system import System
from circuittex.mech.terms import ForceTerm

FIRST_SHIFT, LEAST_SHIFT = 1.0, 1e-3
"""Shifts, in parts of `Scales.metric`. The least keeps the fibrils' free spin about their axes, a true zero mode,
solvable; it is a hundred thousand times softer than the softest bending mode of a span."""
SOFTENING = (1.0, 0.7, 0.3)
"""Fractions of the softening tangent that are tried far from equilibrium, where a descent through sliding contacts
takes fewer iterations with less of it than with a larger shift alone. The search begins one place before the one
that served last, since a factorisation that fails costs nearly as much as one that succeeds."""
SADDLE = 2e-3
"""A largest free force below this part of the largest force of all, with a tangent that needs a shift, is a saddle:
the symmetry of a weave leads there, and Newton's method leaves it slowly."""
ROUGH = 0.02
"""Far from equilibrium the largest free force exceeds this part of the largest force of all. Nearer, only the whole
tangent will do: with less of it the convergence is linear, and may end at a saddle."""
LARGEST_SHIFT = 1e3
"""Largest shift tried, in parts of the largest stiffness of an unknown over its metric: it leaves nothing of the
tangent."""
INVERSE_ITERATIONS = 12
"""Enough for the lowest mode to lead: its curvature and the shift nearly cancel."""
FIRST_ESCAPE = 1e-4
"""First step away from a saddle: largest change of an unknown, in its unit."""
ROUND_OFF = 1e-13
"""Relative change of the potential that is round-off of its sum rather than an increase."""
UNSEEN = 100 * ROUND_OFF
"""A step that promises less than this part of the potential cannot be judged by it. The shift is FIRST_SHIFT then,
still a hundred times softer than the softest bending mode: with less, the round-off of its forces would turn a fibril
that nothing holds, and to second order stretch it."""
SHORT, CREEPING = 1 / 32, 5
"""A descent creeps once it has taken as many steps as short as that, or one where it does not arrive at all. In the
paper's cell no step is below 1/8; cells of mixed moduli were seen to arrive within 25 iterations in spite of three."""
CHEAP = 8
"""Iterations by gradients that may come first for each of Newton's: they cost less by as much."""
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
    """Largest magnitude of the gradient on the free unknowns, N; moments on directors over the lever."""
    iterations: int
    """Linear systems solved: iterations of the descent by gradients and of Newton's method, and one for the prediction
    where there was one."""
    history: Floats
    """(Newton iterations + 1, 4) residual N, potential N mm, shift, step length of each."""


def minimise(
    terms: Sequence[ForceTerm],
    q: Floats,
    *,
    scales: Scales,
    fixed: Ints,
    motions: Motions | None = None,
    solver: LinearSolver,
    before: Floats | None = None,
    tolerance: float = 2e-5,
    force_tolerance: float = 0.0,
    max_iterations: int = 200,
    may_creep: bool = True,
    stride: float = 0.0,
    report: Callable[[int, float], None] | None = None,
    checkpoints: Checkpoints = NONE,
) -> Minimum:
    """The minimum of the terms' total potential that a descent from q (n_dofs,) reaches.

    `fixed` are the prescribed unknowns, kept as they are in q but for what `motions` do to them; where q was moved from
    the minimum `before`, the descent starts from what that predicts (`predict`); `report` is told of every iteration
    and its largest free force, N.

    On each fibril `tolerance` bounds the largest free force, in parts of the largest force with which one of the terms
    acts on a node of it, or round-off does; `force_tolerance` (N) does so where that allows more, or alone where the
    other is 0.

    Where `stride` (mm) is not zero, a descent by gradients alone comes first (`descend`), none of whose steps moves a
    node by more: many iterations, each a fraction of one of Newton's. It goes on from what `checkpoints` tell of, and
    tells them of the places, its end among them, from which another one can go on with the same result.

    Raises `ConvergenceError`, with the history, where that is not met at a minimum in `max_iterations`: an
    unconverged state is never returned. `CreepingError` where its steps are short and it may not creep,
    `PenetrationError` where a term cannot keep apart what it should.
    """
    system = System(terms, scales, fixed, len(q), motions=motions)
    if before is not None:
        q = predict(system, solver, before, q, rough=stride > 0.0)
    shift, place, refused, step, history = FIRST_SHIFT, 0, False, 1.0, []
    cheap = 0
    if stride > 0.0:
        bounds = tolerance, force_tolerance
        q, cheap = descend(
            system,
            solver,
            q,
            stride=stride,
            near=before is not None,
            limits=bounds,
            max_iterations=CHEAP * max_iterations,
            report=report,
            checkpoints=checkpoints,
        )
        if before is None:
            hand_over(system, solver, q, cheap, checkpoints)
    for iteration in range(max_iterations + 1):
        pattern, energy, gradient = system.assemble(q)
        if iteration == 0:
            stiffness, metric = (values[diagonal(pattern)][system.free] for values in (system.data, system.metric))
            system.largest_shift = LARGEST_SHIFT * float((stiffness / metric).max())
        force = system.free_force(gradient)
        left, largest = scales.forces(force), float(scales.forces(gradient).max())
        residual, limits = float(left.max()), system.limits(q, tolerance, force_tolerance)
        history.append((residual, energy, shift, step))
        if report is not None:
            report(cheap + iteration, scales.newtons * residual)
        if not np.isfinite(energy):
            raise ConvergenceError("the potential is infinite: a fibril's section is inside out", np.array(history))
        balanced = bool((left <= limits).all())
        solution = system.factor(solver, FIRST_SHIFT, 1.0, last=True) if balanced else None
        if solution is not None:
            solves = cheap + iteration + (before is not None)
            if cheap > 0 and iteration == 0:
                q, energy, gradient = refined(system, solution, q, energy, gradient)
                residual = float(scales.forces(system.free_force(gradient)).max())
            return Minimum(q, gradient, energy, residual, solves, np.array(history))
        short, last = sum(row[3] <= SHORT for row in history), iteration == max_iterations
        if not may_creep and short >= (1 if last else CREEPING):
            raise CreepingError("the steps have become short", np.array(history), q)
        if last:
            break
        if balanced:
            system.assemble(q)
        rough = residual > ROUGH * largest
        fractions = SOFTENING[place if refused or place == 0 else place - 1 :] if rough else SOFTENING[:1]
        shift, place, solve = _positive(system, solver, shift, fractions, history)
        refused = SOFTENING[place] != fractions[0]
        if shift > FIRST_SHIFT and residual < SADDLE * largest:
            lower = _escape(system, pattern, solve, q, energy)
            if lower is not None:
                q, step, shift = lower, 1.0, FIRST_SHIFT
                continue
        direction = solve(-force)
        slope = float(force @ direction)
        try:
            step = _search(system, q, direction, energy, slope)
        except PenetrationError as error:
            raise PenetrationError(str(error), np.array(history)) from error
        if step == 0.0:
            shift = 16 * max(shift, FIRST_SHIFT)
            if shift > system.largest_shift:
                break
            continue
        q = q + step * direction
        shift = max(LEAST_SHIFT, shift / 4) if step == 1.0 else (shift if step >= 0.25 else 4 * shift)
        if -slope < UNSEEN * abs(energy):
            shift = max(shift, FIRST_SHIFT)
    trouble = "the forces balance, but the tangent is not positive definite: a saddle, not a minimum"
    if not balanced:
        worst = int(np.argmax(left - limits))
        left, limits = scales.newtons * left, scales.newtons * limits
        trouble = f"a free force of {left[worst]:.3g} N is left, above the limit of {limits[worst]:.3g} N"
    raise ConvergenceError(f"no equilibrium after {len(history) - 1} iterations: {trouble}", np.array(history))


def predict(system: System, solver: LinearSolver, q: Floats, moved: Floats, *, rough: bool = False) -> Floats:
    """Where a minimum q (n_dofs,) goes to first order when its prescribed unknowns move to those of `moved`; `rough` as
    solvers take it.

    With the tangent K at q and the free unknowns f, the minimum moves by dq with (K dq)_f = 0; this is solved for the
    difference to `moved`, a first guess. `moved` itself is returned where its potential is the lower one, where the
    tangent is not positive definite, or where the way to the prediction is barred (`ForceTerm.longest`).

    Raises `PenetrationError` where the way to `moved` is barred too.
    """
    if system.longest(q, moved - q) < 1.0:
        raise PenetrationError("the motion of the clamps would carry fibrils through one another")
    pattern, _, _ = system.assemble(q)
    force = system.free_force(multiply(pattern, system.data + system.softening, moved - q))
    solve = system.factor(solver, FIRST_SHIFT, 1.0, rough=rough)
    if solve is None:
        return moved
    predicted = moved - solve(force)
    lower = system.energy(predicted) < system.energy(moved)
    return predicted if lower and system.longest(q, predicted - q) == 1.0 else moved


def _positive(
    system: System,
    solver: LinearSolver,
    shift: float,
    fractions: Sequence[float],
    history: list[tuple[float, float, float, float]],
) -> tuple[float, int, Solve]:
    """The tangent made positive definite with less of its softening or else a larger shift.

    Returns the shift, the place in `SOFTENING` of the fraction that served, and the factor. Of `fractions`, the first
    that serves is taken.
    """
    while shift <= system.largest_shift:
        for fraction in fractions:
            solve = system.factor(solver, shift, fraction)
            if solve is not None:
                return shift, SOFTENING.index(fraction), solve
        shift = max(4 * shift, FIRST_SHIFT)
    raise ConvergenceError("the tangent stays indefinite under any shift", np.array(history))


def _escape(system: System, pattern: Pattern, solve: Solve, q: Floats, energy: float) -> Floats | None:
    """A lower point along the mode of the lowest curvature, found by inverse iteration with the shifted factor; None
    where there is none within sight.

    Of the two senses the one that leads lower is taken; the step doubles for as long as that pays.
    """
    unit = system.scales.unit
    mode = np.where(system.free, unit * np.random.default_rng(0).standard_normal(len(q)), 0.0)
    for _ in range(INVERSE_ITERATIONS):
        mode = solve(system.free_force(multiply(pattern, system.metric, mode)))
        mode /= np.abs(mode / unit).max()
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
