"""Terms, pattern and assembled values of a minimisation: what its phases share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.motions import Motions
from circuittex.mech.pattern import DOFS, Pattern, build_pattern, diagonal
from circuittex.mech.scales import Scales
from circuittex.mech.terms import ForceTerm

ROUNDED = 16 * float(np.finfo(float).eps)
"""Part of stiffness times coordinate that is round-off of a force: where nothing else acts, as little is none."""


@dataclass
class System:
    """Pattern, metric and the values assembled in it; renewed when a term's couplings change."""

    terms: Sequence[ForceTerm]
    scales: Scales
    fixed: Ints
    n: int
    pattern: Pattern | None = None
    metric: Floats = field(default_factory=lambda: np.empty(0))
    data: Floats = field(default_factory=lambda: np.empty(0))
    softening: Floats = field(default_factory=lambda: np.empty(0))
    forces: Floats = field(default_factory=lambda: np.empty(0))
    largest_shift: float = 0.0
    motions: Motions | None = None
    free: NDArray[np.bool_] = field(init=False)
    """(n,) whether an unknown is not prescribed."""

    def __post_init__(self) -> None:
        self.free = np.ones(self.n, dtype=bool)
        self.free[self.fixed] = False

    def free_force(self, gradient: Floats) -> Floats:
        """(n,) the gradient over what may move (`Motions`): zero at prescribed unknowns, but for leaders of motions."""
        force = np.where(self.free, gradient, 0.0)
        if self.motions is not None:
            force[self.motions.leader] = self.motions.forces(gradient)
        return force

    def assemble(self, q: Floats) -> tuple[Pattern, float, Floats]:
        changed = [term.prepare(q) for term in self.terms]
        if self.pattern is None or any(changed):
            self._renew(q)
        assert self.pattern is not None
        if not len(self.metric):
            self.metric = self.scales.metric(self.pattern)
        gradient, self.data, self.softening = np.zeros(self.n), np.zeros(self.pattern.nnz), np.zeros(self.pattern.nnz)
        self.forces, energy = np.zeros(len(self.scales.first_node) - 1), 0.0
        for term in self.terms:
            others = gradient.copy()
            energy += term.assemble(q, self.pattern, gradient, self.data, self.softening)
            self.forces = np.maximum(self.forces, self.scales.forces(gradient - others))
        return self.pattern, energy, gradient

    def forget(self) -> None:
        """What comes next is computed as by a new system of new terms, to the last bit."""
        self.pattern = None
        for term in self.terms:
            term.forget()

    def _renew(self, q: Floats) -> None:
        """Pattern and metric anew. The old ones and their values go first: they are most of what there is in memory."""
        self.pattern, self.data, self.softening, self.metric = None, np.empty(0), np.empty(0), np.empty(0)
        pairs = [term.pairs() for term in self.terms]
        full, point = (np.concatenate([p[k] for p in pairs]) for k in (0, 1))
        self.pattern = build_pattern(self.n // DOFS, full, point, q.reshape(-1, DOFS)[:, :3].copy())

    def factor(
        self, solver: LinearSolver, shift: float, softening: float, *, rough: bool = False, last: bool = False
    ) -> Solve | None:
        """The shifted tangent's factor, None where it is not positive definite; `rough` as solvers take it, where no
        motions are eliminated after it, in which digits cancel. The `last` of a place may take the memory of the values
        that were assembled there, which have to be assembled again if they are wanted.

        Its roots would be rounded otherwise at another scale, so what is factorised has no unit (`matrix`).
        """
        assert self.pattern is not None
        matrix = [self.matrix(shift, softening)]
        if last and self.motions is None:
            self.data, self.softening, self.metric = np.empty(0), np.empty(0), np.empty(0)
        # Nobody but the solver has the values, which can let them go.
        solve = solver.factor(self.pattern, matrix.pop(), rough=rough and self.motions is None)
        if solve is not None and self.motions is not None:  # of positions alone: in these units they are what they were
            everything = np.ones(self.n, dtype=bool)
            whole = self._among(everything, shift, softening), self.pattern.indices, self.pattern.indptr
            solve = self.motions.solve(solve, sp.csr_array(whole, shape=(self.n, self.n)), self.free)
        unit, energy = self.scales.binary_unit, self.scales.energy
        return None if solve is None else lambda force: unit * solve(unit * force / energy)

    def matrix(self, shift: float, softening: float) -> Floats:
        """(nnz,) the shifted tangent, without a unit, of the free unknowns; ones for the others."""
        return self._among(self.free, shift, softening)

    def _among(self, free: NDArray[np.bool_], shift: float, softening: float) -> Floats:
        assert self.pattern is not None
        values = np.empty(self.pattern.nnz)
        places = self.pattern.indptr, self.pattern.indices, free, self.scales.binary_unit, self.scales.energy
        _shifted(*places, self.data, softening, self.softening, shift, self.metric, values)
        return values

    def limits(self, q: Floats, tolerance: float, force_tolerance: float) -> Floats:
        """(F,) the free force, N, up to which each fibril is in equilibrium: see `minimise`."""
        if tolerance == 0.0:
            return np.full_like(self.forces, force_tolerance)
        assert self.pattern is not None
        stiffness = self.data[diagonal(self.pattern)].reshape(-1, DOFS)[:, :3].max(axis=1)
        rounded = ROUNDED * stiffness * np.abs(q).reshape(-1, DOFS)[:, :3].max(axis=1)
        own = tolerance * np.minimum(self.forces, self.scales.largest_force)
        return np.maximum(own, np.maximum(self.scales.over_fibrils(rounded), force_tolerance))

    def slope(self, q: Floats) -> tuple[float, Floats]:
        """The potential and its gradient (n_dofs,), without the tangent."""
        gradient, energy = np.zeros(self.n), 0.0
        for term in self.terms:
            energy += term.add_gradient(q, gradient)
        return energy, gradient

    def energy(self, q: Floats) -> float:
        return sum(term.energy(q) for term in self.terms)

    def longest(self, q: Floats, direction: Floats) -> float:
        return min(term.longest(q, direction) for term in self.terms)


@compiled
def _shifted(
    indptr: Any,
    indices: Any,
    free: Any,
    unit: Any,
    energy: float,
    data: Any,
    fraction: float,
    softening: Any,
    shift: float,
    metric: Any,
    values: Any,
) -> None:
    """Fill values (nnz,) with (data + fraction softening + shift metric) unit unit' / energy among what is free.

    Units are powers of two, of which nothing is rounded. What is not free is coupled to nothing and has ones.
    """
    for i in range(free.shape[0]):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if free[i] and free[j]:
                values[k] = (data[k] + fraction * softening[k] + shift * metric[k]) * (unit[i] * unit[j] / energy)
            else:
                values[k] = 1.0 if i == j else 0.0
