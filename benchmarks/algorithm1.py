"""The paper's Algorithm 1 taken literally against the relaxation, to the same residual with the same force terms.

    python benchmarks/algorithm1.py [--yarns 2] [--rows 1 2] [--elements 8] [--dt 5e-5 1e-3 1e-2] [--steps 2000]
    python benchmarks/algorithm1.py --yarns 4 --rows 3 4 3 --elements 20 --dt 5e-5 --steps 40

Algorithm 1 marches the damped motion (48) from rest with backward Euler: fixed steps of dt, each solved by Newton's
method with full steps to a tenth of the tolerance, the tables of contact pairs (with them the pattern and its analysis)
rebuilt every five steps. The paper prints the damping, 0.1, but no time step; its research code takes 100 steps of 0.05
in the units mm, g, N and ms, which is 5e-5 s. That is the literal row; rows with longer steps show what a good choice
would have saved, and where Newton's method fails. A march that is not at rest after --steps has two rows: what it took
so far, which is a lower bound, and what it would take if its residual went on to fall as fast as in the last half of
the march, which is an estimate and no bound.

The relaxation runs before and after; its seconds are the mean.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from measure import Table, arguments, digits, publish, seconds_of
from scipy.sparse.linalg import splu

from circuittex.base.arrays import Floats, Ints
from circuittex.design import Design, plain_weave
from circuittex.geometry.mesh import FibrilMesh
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.dynamics import STEP_TOLERANCE, Inertia, damping_matrix
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import Pattern, build_pattern, diagonal
from circuittex.mech.terms import ForceTerm
from circuittex.relaxation.relax import force_terms, relax

GAMMA = 1e-4
"""The paper's damping, 0.1 N s/m for every mm3, in N s/mm4."""
REBUILD = 5
"""Steps between two rebuilds of the contact tables."""
MOST_NEWTON = 10
"""Newton iterations of a step after which it has failed, as in the paper's code."""
HEAD = ["method", "dt s", "steps", "linear solves", "residual N", "energy N mm", "s", "times the relaxation's"]


@dataclass
class March:
    """A march of Algorithm 1 and what it took so far."""

    mesh: FibrilMesh
    design: Design
    dt: float
    solves: int = 0
    energy: float = np.inf
    failed: str = ""

    def residuals(self) -> Iterator[float]:
        """The largest free static force after each step, without end; ends where a step fails."""
        space, beam, _ = force_terms(self.mesh, self.design)
        q = space.vector(initial_configuration(self.mesh))
        inertia = Inertia(beam.mass, damping_matrix(space, GAMMA), self.dt)
        velocity, solver = np.zeros_like(q), MultifrontalSolver()
        free = np.ones(len(q), dtype=bool)
        free[space.fixed] = False
        while True:
            tables = Tables([beam, force_terms(self.mesh, self.design)[2]], inertia, space.fixed)
            for _ in range(REBUILD):
                inertia.depart(q, velocity)
                found = self.step(tables, q, free, solver)
                if found is None:
                    return
                velocity, q = np.where(free, (found - q) / self.dt, 0.0), found
                self.energy, gradient = tables.static(q)
                yield float(np.abs(gradient[free]).max())

    def step(self, tables: Tables, q: Floats, free: Floats, solver: LinearSolver) -> Floats | None:
        """Where a step from q ends, by Newton's method with full steps; None where it fails."""
        for _ in range(MOST_NEWTON):
            pattern, values, gradient = tables.assemble(q)
            if not np.all(np.isfinite(gradient)):
                break
            if np.abs(gradient[free]).max() <= STEP_TOLERANCE * self.design.numerics.force_tolerance:
                return q
            solve = solver.factor(pattern, values)
            self.solves += 1
            if solve is None:
                solve = any_solver(pattern, values)
            q = q + solve(np.where(free, -gradient, 0.0))
        self.failed = f"no solution in {MOST_NEWTON} Newton iterations"
        return None


def any_solver(pattern: Pattern, values: Floats) -> Solve:
    """Solves where Cholesky's method does not: Newton's method takes no notice of negative pivots."""
    n = pattern.n_dofs
    upper = sp.csr_array((values, pattern.indices, pattern.indptr), shape=(n, n))
    solve: Solve = splu((upper + sp.triu(upper, 1).T).tocsc(), permc_spec="MMD_AT_PLUS_A").solve
    return solve


class Tables:
    """The force terms with the pattern of their tables; renewed only where a node has left their reach."""

    def __init__(self, terms: list[ForceTerm], inertia: Inertia, fixed: Ints) -> None:
        self.terms, self.inertia, self.fixed = terms, inertia, fixed
        self.pattern: Pattern | None = None
        self.held = np.empty(0, dtype=np.int64)

    def _renew(self, q: Floats) -> Pattern:
        changed = [term.prepare(q) for term in self.terms]
        if self.pattern is None or any(changed):
            full, point = (np.concatenate(pairs) for pairs in zip(*(term.pairs() for term in self.terms), strict=True))
            pattern = self.pattern = build_pattern(len(q) // 9, full, point, q.reshape(-1, 9)[:, :3].copy())
            rows = np.repeat(np.arange(len(q)), np.diff(pattern.indptr))
            self.held = np.flatnonzero(np.isin(rows, self.fixed) | np.isin(pattern.indices, self.fixed))
        return self.pattern

    def assemble(self, q: Floats) -> tuple[Pattern, Floats, Floats]:
        """Pattern, tangent and gradient of the incremental potential at q, with the supports held."""
        pattern = self._renew(q)
        gradient, data, softening = np.zeros(len(q)), np.zeros(pattern.nnz), np.zeros(pattern.nnz)
        for term in [*self.terms, self.inertia]:
            term.assemble(q, pattern, gradient, data, softening)
        values = data + softening
        values[self.held] = 0.0
        values[diagonal(pattern)[self.fixed]] = 1.0
        return pattern, values, gradient

    def static(self, q: Floats) -> tuple[float, Floats]:
        """Static potential and gradient at q."""
        pattern = self._renew(q)
        gradient, data = np.zeros(len(q)), np.zeros(pattern.nnz)
        return sum(term.assemble(q, pattern, gradient, data, data) for term in self.terms), gradient


def marched(mesh: FibrilMesh, design: Design, dt: float, steps: int) -> list[tuple[list[object], float, str]]:
    """Rows of the table, each with its seconds and what stands before what is only a bound or an estimate."""
    march, history = March(mesh, design, dt), []

    def go() -> None:
        for residual in march.residuals():
            history.append(residual)
            if residual <= design.numerics.force_tolerance or len(history) == steps:
                return

    seconds = seconds_of(go)
    done, last = len(history), history[-1] if history else np.nan
    state = [last, march.energy]
    if march.failed:
        return [([f"fails: {march.failed}", dt, done, march.solves, *state], np.nan, "")]
    if last <= design.numerics.force_tolerance:
        return [(["Algorithm 1", dt, done, march.solves, *state], seconds, "")]
    rows = [(["Algorithm 1, cut short", dt, f"> {done}", f"> {march.solves}", *state], seconds, "> ")]
    total = steps_needed(np.array(history), design.numerics.force_tolerance)
    if total is not None:
        cells = ["the same, extrapolated", dt, f"~ {total}", f"~ {march.solves * total // done}", "", ""]
        rows.append((cells, seconds * total / done, "~ "))
    return rows


def steps_needed(history: Floats, tolerance: float) -> int | None:
    """Steps until the tolerance at the rate of decay of the last half of the history; None where it rose.

    >>> steps_needed(np.array([1.0, 1e-1, 1e-2, 1e-3]), 1e-6)
    7
    """
    half = max(1, len(history) // 2)
    rate = np.log(history[half - 1] / history[-1]) / max(1, len(history) - half)
    return len(history) + int(np.ceil(np.log(history[-1] / tolerance) / rate)) if rate > 0 else None


def compare(design: Design, dts: list[float], steps: int) -> Table:
    """One row for the relaxation and one for each time step."""
    mesh = build_mesh(design)

    def relaxed() -> None:
        found.append(relax(mesh, design))

    found = []
    relax(*small_cell())  # so that compiled kernels are there
    before = seconds_of(relaxed)
    marches = [row for dt in dts for row in marched(mesh, design, dt, steps)]
    own = (before + seconds_of(relaxed)) / 2
    solves = found[0].iterations
    rows = [["relaxation", "", "", solves, found[0].residual, found[0].energy, own, 1.0]]
    for cells, seconds, sign in marches:
        times = [f"{sign}{digits(each)}" for each in (seconds, seconds / own)] if np.isfinite(seconds) else ["", ""]
        rows.append([*cells, *times])
    title = f"{mesh.n_fibrils} fibrils of {design.numerics.elements} elements, to a residual of "
    title += (
        f"{design.numerics.force_tolerance:.0e} N; the relaxation's linear solves do not count refused factorisations:"
    )
    return Table(title, HEAD, rows)


def small_cell() -> tuple[FibrilMesh, Design]:
    """One crossing of two fibrils."""
    design = plain_weave(yarns=1, rows=(1,))
    design = replace(design, numerics=replace(design.numerics, elements=4, tolerance="1e-5 N"))
    return build_mesh(design), design


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--yarns", type=int, default=2)
    parser.add_argument("--rows", type=int, nargs="+", default=[1, 2], help="fibrils in the rows of a yarn")
    parser.add_argument("--elements", type=int, default=8)
    parser.add_argument("--parameters", default="paper-code", choices=["paper-code", "paper-table"])
    parser.add_argument("--dt", type=float, nargs="+", default=[5e-5, 1e-3, 1e-2], help="time steps, s")
    parser.add_argument("--steps", type=int, default=2000, help="steps after which a march is cut short")
    options = parser.parse_args()
    base = plain_weave(options.parameters, yarns=options.yarns, rows=tuple(options.rows))
    design = replace(base, numerics=replace(base.numerics, elements=options.elements, tolerance="1e-6 N"))
    publish(options, [compare(design, options.dt, options.steps)])


if __name__ == "__main__":
    main()
