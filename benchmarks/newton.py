"""One Newton iteration on the paper's cell, taken apart, against the factorisation that it cannot do without.

    python benchmarks/newton.py [--elements 20] [--iterations 4] [--repeats 3]

The state: the cell is relaxed on a mesh a quarter as fine until the largest free force is 0.02 N, and from there the
mesh in question runs a few iterations. Force terms and solver go through stopwatches on their
way into `minimise`, so it is the iteration itself that is measured. Then every installed solver factorises the last
matrix in turn with the assembly, which gives the ratios; the analysis is what its first factorisation takes beyond a
later one.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from measure import Table, arguments, paired, publish, ratio
from scipy.sparse.linalg import splu
from watch import BEAM, CLOSEST, CONTACT, ENERGY, FACTOR, PARTS, SOLVE, Stopwatch, descend

from circuittex.base.arrays import Floats
from circuittex.contact.penalty import PenaltyContact
from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pardiso import PardisoSolver
from circuittex.mech.pattern import Pattern
from circuittex.mech.space import BeamSpace
from circuittex.mech.terms import ForceTerm
from circuittex.relaxation.relax import force_terms
from circuittex.relaxation.transfer import transfer

PART_HEAD = ["part", "calls an iteration", "ms a call", "% of the time"]
SOLVER_HEAD = [
    "solver",
    "analysis ms",
    "factorisation ms",
    "solution ms",
    "assembly / factorisation",
    "iteration / (factorisation + solution)",
]
COARSER = 4
"""How many elements of the mesh in question make one of the mesh on which the state is prepared."""
LOOSE = 0.02
"""Largest free force of the coarse state, N."""


def coarse_state(design: Design, solver: LinearSolver) -> Configuration:
    """The loosely relaxed cell on longer elements, carried over to the design's own mesh."""
    coarse = replace(design, numerics=replace(design.numerics, elements=design.numerics.elements // COARSER))
    mesh = build_mesh(coarse)
    terms = force_terms(mesh, coarse)
    start = terms[0].vector(initial_configuration(mesh))
    q, *_ = descend(terms, start, solver, coarse.numerics.max_iterations, LOOSE)
    return transfer(terms[0].configuration(q), mesh, build_mesh(design))


class SuperLU:
    """SciPy's general sparse factorisation of the same matrix, ordered anew each time: what there is without any of
    circuittex's solvers."""

    name = "scipy splu"

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve:
        """A function that solves with the matrix, zeros left out."""
        shape = (pattern.n_dofs, pattern.n_dofs)
        upper = sp.csr_array((data, pattern.indices, pattern.indptr), shape=shape)
        full = (upper + sp.triu(upper, 1).T).tocsc()
        full.eliminate_zeros()
        options = {"SymmetricMode": True, "Equil": False}
        solve: Solve = splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
        return solve

    def forget(self) -> None:
        """Nothing is remembered."""


def installed() -> list[Callable[[], LinearSolver]]:
    """circuittex's own solver, PARDISO where it is installed, and SciPy's as the peer of both."""
    extras = [PardisoSolver] if importlib.util.find_spec("pypardiso") else []
    return [MultifrontalSolver, *extras, SuperLU]


def part_rows(watch: Stopwatch) -> list[list[object]]:
    """One row for each part of the iteration that occurred."""
    total, n = float(watch.per_iteration(*PARTS).sum()), len(watch.iterations)
    timed = [(part, watch.calls(part)) for part in PARTS]
    return [
        [part, len(calls) / n, 1e3 * float(np.median(calls)), 100 * sum(calls) / total]
        for part, calls in timed
        if calls
    ]


def solver_rows(
    terms: tuple[BeamSpace, Beam, PenaltyContact],
    q: Floats,
    matrix: tuple[Pattern, Floats],
    solvers: Sequence[LinearSolver],
    repeats: int,
) -> list[list[object]]:
    """One row for each solver: times of the same matrix, and ratios to what the iteration needs besides."""
    pattern, data = matrix
    _, beam, contact = terms
    beside = q + 1e-9  # elsewhere, so that closest points are not remembered

    def assemble(term: ForceTerm) -> None:
        term.assemble(q, pattern, np.zeros(len(q)), np.zeros(pattern.nnz), np.zeros(pattern.nnz))

    pieces: dict[str, Callable[[], object]] = {
        CLOSEST: lambda: (contact.energy(beside), contact.energy(q)),
        ENERGY: lambda: beam.energy(q),
        BEAM: lambda: assemble(beam),
        CONTACT: lambda: assemble(contact),
    }
    first: dict[str, float] = {}
    for solver in solvers:
        solves: list[Solve] = []
        type(solver)().factor(pattern, data)  # loads what is compiled
        clock = time.perf_counter()
        solver.factor(pattern, data)
        first[solver.name] = time.perf_counter() - clock
        pieces[f"{solver.name} {FACTOR}"] = partial(_factor, solver, pattern, data, solves)
        pieces[f"{solver.name} {SOLVE}"] = partial(_solve, solves, q)
    seconds = paired(pieces, repeats, warm_up=False)
    assembly = seconds[BEAM] + seconds[CONTACT]
    besides = assembly + seconds[CLOSEST] / 2 + seconds[ENERGY]
    rows: list[list[object]] = []
    for solver in solvers:
        factor, solve = (seconds[f"{solver.name} {part}"] for part in (FACTOR, SOLVE))
        once = float(np.median(factor))
        analysis: object = "each time" if isinstance(solver, SuperLU) else 1e3 * (first[solver.name] - once)
        times = [analysis, 1e3 * once, 1e3 * float(np.median(solve))]
        rows.append([solver.name, *times, ratio(assembly, factor), 1 + ratio(besides, factor + solve)])
    return rows


def _factor(solver: LinearSolver, pattern: Pattern, data: Floats, solves: list[Solve]) -> None:
    solve = solver.factor(pattern, data)
    assert solve is not None, f"{solver.name} refuses a matrix that another solver takes"
    solves[:] = [solve]


def _solve(solves: list[Solve], b: Floats) -> None:
    solves[-1](b)


def report(design: Design, iterations: int, repeats: int) -> Iterator[Table]:
    """The tables, as they come."""
    solvers, fastest = [solver() for solver in installed()], installed()[0]()
    mesh = build_mesh(design)
    terms = force_terms(mesh, design)
    start = terms[0].vector(coarse_state(design, fastest))
    q, watch, matrix = descend(terms, start, fastest, iterations)
    contacts = len(terms[2].touching(q).overlap)
    title = (
        f"{iterations} iterations with {fastest.name}, after which the largest free force is {watch.residual:.2g} N, "
    )
    title += f"with {contacts} contact points, {len(q)} unknowns, {matrix[0].nnz} entries of the upper triangle:"
    yield Table(title, PART_HEAD, part_rows(watch))
    title = "The same matrix in every solver, and an iteration with one factorisation of a known pattern:"
    yield Table(title, SOLVER_HEAD, solver_rows(terms, q, matrix, solvers, repeats))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--elements", type=int, default=20, help="quadratic elements of a fibril, a multiple of 4")
    parser.add_argument("--iterations", type=int, default=4, help="iterations that are measured")
    parser.add_argument("--repeats", type=int, default=3, help="factorisations of the same matrix by each solver")
    options = parser.parse_args()
    base = plain_weave()
    design = replace(base, numerics=replace(base.numerics, elements=options.elements))
    publish(options, report(design, options.iterations, options.repeats))


if __name__ == "__main__":
    main()
