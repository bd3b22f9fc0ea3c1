"""Dynamic relaxation to the letter of the paper's Algorithm 1: backward Euler in time with damping [34, 48].

A step of backward Euler from (x0, v0) to x, with v = (x - x0) / dt, solves

    M (x - x0 - dt v0) / dt^2 + C (x - x0) / dt + dE/dx = 0

which is where the gradient of an incremental potential vanishes. So the step is a minimisation like that of
the equilibrium, with one `ForceTerm` more, `Inertia`. The equilibrium it comes to rest at is the one that
`minimise` finds with fewer linear solves.

Units: the mass matrix is in g and lengths in mm, and 1 N = 1e6 g mm/s2. gamma is a force density over a
velocity, N s/mm4. The paper states 0.1 "N s/m", which is no density; read as 0.1 N s/m for every mm3 it is
1e-4 N s/mm4, and so it is in the units mm, g, N (time in ms) in which the paper's other numbers are consistent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import count, islice
from math import ceil
from typing import NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import ConvergenceError, DesignError
from circuittex.base.frozen import frozen
from circuittex.mech.beam import Beam
from circuittex.mech.linear import LinearSolver
from circuittex.mech.minimise import minimise
from circuittex.mech.pattern import DOFS, Pattern, multiply
from circuittex.mech.scales import Scales
from circuittex.mech.space import BeamSpace
from circuittex.mech.terms import ForceTerm

NEWTON = 1e-6
"""N in one g mm/s2: turns the mass matrix into N s2/mm."""
STEP_TOLERANCE = 0.1
"""Part of the tolerance on rest to which each step is solved, so that its own error does not count."""

MatrixOf = Callable[[Pattern], Floats]
"""The values of a symmetric matrix in a pattern."""


@frozen
class Instant:
    """The state after one time step."""

    time: float
    """Since the march began, s."""
    q: Floats
    """(n_dofs,) unknowns."""
    velocity: Floats
    """(n_dofs,) their rates, mm/s (positions) and 1/s (directors)."""
    gradient: Floats
    """(n_dofs,) gradient of the static potential, N."""
    energy: float
    """Static potential, N mm."""
    kinetic: float
    """Kinetic energy 1/2 v.M v, N mm."""
    residual: float
    """Largest magnitude of the gradient on the free unknowns, N, moments over the lever: how far from equilibrium."""
    iterations: int
    """Newton iterations of this step."""


@frozen
class Rest:
    """The equilibrium where a dynamic relaxation came to rest."""

    q: Floats
    """(n_dofs,) unknowns."""
    gradient: Floats
    """(n_dofs,) gradient of the static potential, N: on prescribed unknowns the force of the supports."""
    energy: float
    """Static potential, N mm."""
    residual: float
    """Largest free force, N."""
    iterations: int
    """Newton iterations of all steps."""
    history: Floats
    """(steps, 4) time s in its phase, potential N mm, kinetic energy N mm, residual N after each time step."""


def damping_matrix(space: BeamSpace, gamma: float) -> MatrixOf:
    """The matrix C of the damping force density -gamma v [48], N s/mm, for gamma in N s/mm4.

    It is the mass matrix of a material whose density is gamma: the drag acts on every point of a section.
    """
    if not 0.0 <= gamma < np.inf:
        raise DesignError("gamma", gamma, "the damping must be at least 0 N s/mm4")
    mesh = space.mesh
    return Beam(replace(space, mesh=replace(mesh, density=np.full(mesh.n_fibrils, float(gamma))))).mass


class Inertia:
    """The incremental potential 1/2 (x - x1).M (x - x1) / dt^2 + 1/2 (x - x0).C (x - x0) / dt of one time step.

    x1 = x0 + dt v0 is where the step would end without forces. `depart` says where it begins.
    """

    def __init__(self, mass: MatrixOf, damping: MatrixOf, dt: float) -> None:
        self._mass_of, self._damping_of, self._dt = mass, damping, dt
        self._pattern: Pattern | None = None
        self._mass = self._drag = self._from = self._coast = np.empty(0)

    def depart(self, q: Floats, velocity: Floats) -> None:
        """Begin a new step at q (n_dofs,) with `velocity` (n_dofs,)."""
        self._from, self._coast = q, q + self._dt * velocity

    def prepare(self, q: Floats) -> bool:
        """Its couplings never change."""
        return False

    def forget(self) -> None:
        """The matrices are those of the present pattern."""

    def pairs(self) -> tuple[Ints, Ints]:
        """None of its own: mass and damping couple the nodes that the beams couple already."""
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 2), dtype=np.int64)

    def _forces(self, q: Floats) -> tuple[Floats, Floats]:
        """M (q - x1) / dt^2 and C (q - x0) / dt, N."""
        assert self._pattern is not None, "assemble comes first"
        inertia = multiply(self._pattern, self._mass, q - self._coast) / self._dt**2
        return inertia, multiply(self._pattern, self._drag, q - self._from) / self._dt

    def energy(self, q: Floats) -> float:
        """Incremental potential, N mm."""
        inertia, drag = self._forces(q)
        return float(0.5 * ((q - self._coast) @ inertia + (q - self._from) @ drag))

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        """Add the gradient in place; return the incremental potential."""
        gradient += self.gradient(q)
        return self.energy(q)

    def longest(self, q: Floats, direction: Floats) -> float:
        """1: inertia and damping bar no way."""
        return 1.0

    def gradient(self, q: Floats) -> Floats:
        """(n_dofs,) what inertia and damping add to the static gradient, N."""
        inertia, drag = self._forces(q)
        return inertia + drag

    def kinetic(self, velocity: Floats) -> float:
        """Kinetic energy 1/2 v.M v, N mm."""
        assert self._pattern is not None, "assemble comes first"
        return float(0.5 * velocity @ multiply(self._pattern, self._mass, velocity))

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add gradient and tangent in place; return the incremental potential."""
        if pattern is not self._pattern:
            self._pattern = pattern
            self._mass, self._drag = NEWTON * self._mass_of(pattern), self._damping_of(pattern)
        gradient += self.gradient(q)
        data += self._mass / self._dt**2 + self._drag / self._dt
        return self.energy(q)


class Body(NamedTuple):
    """What moves."""

    terms: Sequence[ForceTerm]
    """The forces on it."""
    scales: Scales
    """What is small for it."""
    mass: MatrixOf
    """The mass matrix in g."""
    damping: MatrixOf
    """The damping matrix in N s/mm."""
    fixed: Ints
    """The prescribed unknowns."""


def march(
    body: Body,
    q: Floats,
    velocity: Floats,
    *,
    solver: LinearSolver,
    dt: float,
    tolerance: float,
    max_iterations: int = 100,
) -> Iterator[Instant]:
    """Endless steps of backward Euler of `dt` seconds from q (n_dofs,) and `velocity` (n_dofs,), one by one.

    The body's fixed unknowns keep their initial velocity; each step is solved until no free force exceeds
    `tolerance` (N), by what its scales call small.

    Raises `ConvergenceError` where a step is not solved in `max_iterations`.
    """
    _check_positive(dt=dt)
    scales, fixed = body.scales, body.fixed
    inertia = Inertia(body.mass, body.damping, dt)
    free_dofs = np.ones(len(q), dtype=bool)
    free_dofs[fixed] = False
    driven = bool(np.any(velocity[fixed]))
    for step in count(1):
        inertia.depart(q, velocity)
        found = minimise(
            [*body.terms, inertia],
            # Where supports move the body goes along; else a start at q is sure to lower the potential.
            q + dt * velocity if driven else q,
            scales=scales,
            fixed=fixed,
            solver=solver,
            tolerance=0.0,
            force_tolerance=tolerance,
            max_iterations=max_iterations,
        )
        velocity, q = np.where(free_dofs, (found.q - q) / dt, velocity), found.q
        gradient = found.gradient - inertia.gradient(q)
        yield Instant(
            time=step * dt,
            q=q,
            velocity=velocity,
            gradient=gradient,
            energy=found.energy - inertia.energy(q),
            kinetic=inertia.kinetic(velocity),
            residual=float(scales.forces(np.where(free_dofs, gradient, 0.0)).max()),
            iterations=found.iterations,
        )


def affine_velocity(space: BeamSpace, q: Floats, rate: Floats) -> Floats:
    """(n_dofs,) velocity of the whole body at the in-plane velocity gradient `rate` (2, 2), 1/s.

    Positions follow it, directors stand still: the initial velocity field of Algorithm 1.
    """
    velocity = np.zeros((space.mesh.n_nodes, DOFS))
    velocity[:, :2] = q.reshape(-1, DOFS)[:, :2] @ np.asarray(rate).T
    return velocity.ravel()


def relax_dynamically(
    body: Body,
    q: Floats,
    *,
    solver: LinearSolver,
    dt: float,
    t_relax: float,
    t_step: float = 0.0,
    velocity: Floats | None = None,
    tolerance: float,
    max_iterations: int = 100,
) -> Rest:
    """Step 1 of Algorithm 1: move for `t_step`, stop, and relax with damping until at rest.

    `velocity` (n_dofs,) is that of `affine_velocity`, needed where `t_step` > 0: for that time it drives the
    fixed unknowns, the others start with it, and nothing damps them. Then all velocities are set to zero,
    the fixed unknowns are held, and damped motion follows until no free static force exceeds `tolerance` (N).

    Raises `ConvergenceError`, with the history, where that takes longer than `t_relax` seconds or where a
    step is not solved in `max_iterations`.
    """
    _check_positive(dt=dt, t_relax=t_relax)
    if (velocity is None) != (t_step == 0.0) or not 0.0 <= t_step < np.inf:
        raise DesignError("t_step", t_step, "it must be positive with a velocity, 0 s without")
    motion = partial(march, solver=solver, tolerance=STEP_TOLERANCE * tolerance, max_iterations=max_iterations)
    past: list[Instant] = []
    if velocity is not None:
        steps = ceil(t_step / dt)
        past += islice(motion(body._replace(damping=_undamped), q, velocity, dt=t_step / steps), steps)
        q = past[-1].q
    for instant in islice(motion(body, q, np.zeros_like(q), dt=dt), ceil(t_relax / dt)):
        past.append(instant)
        if instant.residual <= tolerance:
            return Rest(
                q=instant.q,
                gradient=instant.gradient,
                energy=instant.energy,
                residual=instant.residual,
                iterations=sum(each.iterations for each in past),
                history=_history(past),
            )
    message = f"not at rest after {t_relax:.3g} s of damped motion: the largest free force is"
    raise ConvergenceError(f"{message} {past[-1].residual:.3g} N, {tolerance:.3g} N was asked for", _history(past))


def _check_positive(**times: float) -> None:
    for name, time in times.items():
        if not 0.0 < time < np.inf:
            raise DesignError(name, time, "it must be a positive number of seconds")


def _undamped(pattern: Pattern) -> Floats:
    return np.zeros(pattern.nnz)


def _history(past: Sequence[Instant]) -> Floats:
    return np.array([(each.time, each.energy, each.kinetic, each.residual) for each in past])
