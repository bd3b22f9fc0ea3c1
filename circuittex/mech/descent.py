"""Cheap iterations before Newton's: a descent by gradients alone, preconditioned with one factor of the tangent.

L-BFGS (Nocedal & Wright, 7.2) keeps the last pairs s = q' - q, y = g' - g and applies to a gradient an approximate
inverse of the tangent that satisfies the secant equation for them; what it starts from is the factor of the tangent
made positive at the last renewal. The longest motion of a node is remembered from step to step, since a step that had
to be shortened is followed by others: that saves a gradient in each iteration. An iteration is a solution, a gradient
or two and a look for collisions, where one of Newton's is an assembly, a pattern and one factor or several; and far
from equilibrium, where contacts come and go, the exact tangent of a place says little of the next.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import PenetrationError
from circuittex.mech.checkpoint import NONE, Checkpoint, Checkpoints
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.pattern import DOFS, Pattern, diagonal
from circuittex.mech.system import System

Pairs = deque[tuple[Floats, Floats, float]]
"""s, y and s.y, the oldest first."""
REMEMBERED = 20
"""Pairs that are kept."""
LASTS = 30
"""Iterations after which the factor is renewed: with 60, 4 x 4 yarns take 206 iterations for 169, 8 x 8 364 for 315."""
SHORT, TIRED = 0.05, 4
"""A factor is renewed early after so many steps in a row that were shorter than this part of what it directed to: it
knows nothing of contacts that have come since. With this and `NEAR`, six steps of 2 and 2.5 % of 4 x 4 yarns take 218
iterations for 398."""
APART = 60
"""Iterations from one place to the next renewal at which all that is remembered of earlier ones is forgotten
(`Checkpoint`). Most of that is out of date by then: with 8 x 8 yarns it costs 2 searches for contacts in 26, 0.3 % of
the time."""
SOFTENING, SHIFT, LESS, LARGEST_SHIFT = 0.3, 0.1, 1 / 4, 1e3
"""Of the factor: as much of the softening counts, with the first shift of 0.1, 0.4, 1.6, ... that makes it positive;
later ones are tried from `LESS` times the one that served last on, since a factor that fails costs nearly as much:
with a sixteenth, 24 of 38 failed for 8 x 8 yarns, with a quarter 14 of 26.
The largest is in parts of the largest stiffness of an unknown over its metric, as Newton's is. In single precision:
what the pairs correct need not be better."""
NEAR = 25.0
"""The shift that is tried first where a path has led near a minimum: smaller ones are refused at most places, and the
tangent itself, if it is positive, directs far through contacts that come on the way."""
ARMIJO, TRIALS = 1e-4, 10
"""A step must achieve this part of the decrease that the slope promises, shortened at most so many times."""
LEAST_CUT = 0.1
"""Part of a step that failed which the next is at least."""
CURVED = 0.1
"""Part of its slope by which a step must have changed it for its pair to be kept."""


def descend(
    system: System,
    solver: LinearSolver,
    q: Floats,
    *,
    stride: float,
    near: bool = False,
    limits: tuple[float, float],
    max_iterations: int,
    report: Callable[[int, float], None] | None = None,
    checkpoints: Checkpoints = NONE,
) -> tuple[Floats, int]:
    """Unknowns (n_dofs,) with a lower potential than those of q, and the iterations that led there.

    The descent ends where each fibril's free force is below what `System.limits` makes of the two tolerances `limits`,
    where no step lowers the potential any more, where one would press fibrils through one another, or after
    `max_iterations`: Newton's method has the last word on all of these. No step moves a node by more than `stride`, mm.
    With `near`, q is where a path led (`predict`).

    Where `checkpoints` tell of a place that was reached, it goes on from there in place of q, and takes the steps that
    it would have taken, to the last bit.
    """
    scales = system.scales
    pairs: Pairs = deque(maxlen=REMEMBERED)
    shift, age, short, most, begun = NEAR / LESS if near else SHIFT, 0, 0, stride, 0
    solve: Solve | None = None
    reached = checkpoints.reached
    if reached is not None:
        if reached.ended:
            return reached.q.copy(), reached.iteration
        q, shift, most, begun = reached.q.copy(), reached.shift, reached.most, reached.iteration
        begin_anew(system, solver)
        pairs.extend(zip(reached.steps, reached.turns, reached.curvatures.tolist(), strict=True))
    for iteration in range(begun, max_iterations):
        if solve is None or age >= LASTS or short >= TIRED:
            if iteration >= begun + APART:
                begun = iteration
                begin_anew(system, solver)
                if checkpoints.keep is not None:
                    checkpoints.keep(_checkpoint(q, pairs, shift, most, iteration, ended=False))
            pattern, energy, gradient = system.assemble(q)
            solve, shift = _factor(system, solver, pattern, max(SHIFT, LESS * shift))
            age, short, allowed = 0, 0, system.limits(q, *limits)
            if solve is None or not np.isfinite(energy):
                return q, iteration
        force = system.free_force(gradient)
        left = scales.forces(force)
        if report is not None:
            report(iteration, scales.newtons * float(left.max()))
        if (left <= allowed).all():
            return q, iteration
        direction = _direction(solve, pairs, force)
        try:
            step, first, lower, steeper = _search(system, q, direction, energy, force, most)
        except PenetrationError:
            return q, iteration
        if step == 0.0:
            if age == 0 and not pairs:
                return q, iteration
            pairs.clear()
            solve, most = None, stride
            continue
        moved = step * _longest(direction)
        short = short + 1 if step < SHORT else 0
        most = min(stride, 2 * max(most, moved)) if step == first else moved
        change, turned = step * direction, system.free_force(steeper - gradient)
        curvature = _dot(change, turned)
        if curvature > -CURVED * step * _dot(force, direction):
            pairs.append((change, turned, curvature))
        q, energy, gradient, age = q + change, lower, steeper, age + 1
    return q, max_iterations


def hand_over(system: System, solver: LinearSolver, q: Floats, iterations: int, checkpoints: Checkpoints) -> None:
    """Make the end of a descent a checkpoint as well, from which Newton's method goes on."""
    begin_anew(system, solver)
    known = checkpoints.reached is not None and checkpoints.reached.ended
    if checkpoints.keep is not None and not known:
        checkpoints.keep(_checkpoint(q, deque(), SHIFT, 0.0, iterations, ended=True))


def refined(system: System, solve: Solve, q: Floats, energy: float, gradient: Floats) -> tuple[Floats, float, Floats]:
    """Unknowns, potential and gradient after one step of Newton's method more from the end q of a descent, where that
    leaves less force: a descent ends just below its limits, and the factor that shows q to be a minimum is at hand."""
    force = system.free_force(gradient)
    direction = -solve(force)
    if system.longest(q, direction) < 1.0:
        return q, energy, gradient
    lower, less = system.slope(q + direction)
    if system.scales.forces(system.free_force(less)).max() >= system.scales.forces(force).max():
        return q, energy, gradient
    return q + direction, lower, less


def begin_anew(system: System, solver: LinearSolver) -> None:
    """Forget whatever depends on where the descent came from."""
    system.forget()
    solver.forget()


def _checkpoint(q: Floats, pairs: Pairs, shift: float, most: float, iteration: int, *, ended: bool) -> Checkpoint:
    steps, turns = (np.array([pair[k] for pair in pairs]).reshape(-1, len(q)) for k in (0, 1))
    for rows in (steps, turns):
        rows.setflags(write=False)  # or they would be copied, twenty vectors each
    curvatures = np.array([pair[2] for pair in pairs])
    return Checkpoint(q, steps, turns, curvatures, shift, most, iteration, ended)


def _factor(system: System, solver: LinearSolver, pattern: Pattern, shift: float) -> tuple[Solve | None, float]:
    """The factor with the first of `shift`, 4 `shift`, ... that makes it positive, None if none does; and that one."""
    stiffness, metric = (values[diagonal(pattern)] for values in (system.data, system.metric))
    largest = LARGEST_SHIFT * float((stiffness / metric)[system.free].max())
    while shift <= largest:
        solve = system.factor(solver, shift, SOFTENING, rough=True)
        if solve is not None:
            return solve, shift
        shift *= 4
    return None, SHIFT


def _direction(solve: Solve, pairs: Pairs, force: Floats) -> Floats:
    """-H g by the two loops of L-BFGS, H the inverse that `solve` and the pairs make."""
    rest, parts = force.copy(), []
    for s, y, curvature in reversed(pairs):
        part = _dot(s, rest) / curvature
        rest -= part * y
        parts.append(part)
    direction = solve(rest)
    for (s, y, curvature), part in zip(pairs, reversed(parts), strict=True):
        direction += (part - _dot(y, direction) / curvature) * s
    return -direction


def _search(
    system: System, q: Floats, direction: Floats, energy: float, force: Floats, stride: float
) -> tuple[float, float, float, Floats]:
    """A safe step that lowers the potential enough, the first one tried, and potential and gradient there; the step is
    0 if there is none."""
    slope = _dot(force, direction)
    if not slope < 0.0:
        return 0.0, 0.0, energy, force
    step = first = min(1.0, stride / _longest(direction))
    longest = step * system.longest(q, step * direction)
    for _ in range(TRIALS):
        if step <= longest:
            lower, steeper = system.slope(q + step * direction)
            if lower <= energy + ARMIJO * step * slope:
                return step, first, lower, steeper
            if np.isfinite(lower):  # the lowest point of the parabola through what is known
                step *= max(LEAST_CUT, -0.5 * step * slope / (lower - energy - step * slope))
                continue
        step /= 2
    return 0.0, first, energy, force


def _longest(direction: Floats) -> float:
    """The largest motion of a node, mm."""
    return float(np.sqrt((direction.reshape(-1, DOFS)[:, :3] ** 2).sum(axis=1).max()))


def _dot(a: Floats, b: Floats) -> float:
    """a.b, summed in an order that no number of threads changes, which that of BLAS may."""
    return float(np.einsum("i,i->", a, b))
