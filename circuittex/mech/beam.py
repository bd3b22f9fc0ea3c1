"""The director beam [9, 10] as a force term."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import cores, side_by_side
from circuittex.mech.configuration import Configuration
from circuittex.mech.kernels import N_STRAINS, Elements, beam_energy, section_force
from circuittex.mech.material import bending_lambda, lame
from circuittex.mech.pattern import DOFS, Pattern
from circuittex.mech.scales import line_matrix
from circuittex.mech.section import disk_rule
from circuittex.mech.space import BeamSpace
from circuittex.mech.tangent import Sums, add_gradient, add_tangent

WORTH_A_THREAD = 200
"""Elements whose assembly takes several times as long as it takes to start a thread."""


class Beam:
    """Elastic energy of all fibrils; holds the tables its compiled kernels read, and nothing that changes.

    `natural` is the stress-free configuration; by default every fibril is naturally straight. `degree` is
    that of the section's rule (`disk_rule`).
    """

    def __init__(self, space: BeamSpace, *, degree: int = 7, natural: Configuration | None = None) -> None:
        mesh, fibril = space.mesh, space.mesh.element_fibril
        mu, lam = lame(mesh.youngs_modulus, mesh.poisson_ratio)
        lam_b = bending_lambda(mu, mesh.poisson_ratio)
        unit, share = disk_rule(degree)
        if np.any(lam > lam_b):  # one more point, on the axis, for the rest of lambda
            unit, share = np.vstack([unit, [0.0, 0.0]]), np.append(share, 1.0)
        on_axis = np.arange(len(unit)) >= len(disk_rule(degree)[1])
        points = np.swapaxes(unit * mesh.section_radius[fibril, None, None], 1, 2).copy()
        area = share * mesh.area[fibril, None, None] * np.ones_like(space.weight)[..., None]
        strains, metric = _straight(space)
        if natural is not None:
            strains, metric = _curved(_strains(space, space.vector(natural)), points)
            area = area * np.asarray(np.sqrt(np.linalg.det(metric)), dtype=np.float64)
        self.space = space
        self.elements = Elements(
            nodes=mesh.elements,
            shape=space.shape,
            slope=space.slope,
            weight=area * space.weight[..., None],
            points=points,
            natural=strains,
            metric=metric,
            mu=np.where(on_axis, 0.0, mu[fibril, None]),
            lam=np.where(on_axis, (lam - lam_b)[fibril, None], lam_b[fibril, None]),
        )
        self.by_area = self.elements._replace(weight=area)
        self.quadratic = self._quadratic()
        self.stiffness = self._stiffness()

    def _quadratic(self) -> Floats:
        """(M, Q, 5, 5) mu/2 tr F^T F dA = 1/2 u.C u: the matrices C, N."""
        area, metric = self.by_area.weight, self.elements.metric
        straight = metric.shape[2] == 0
        inverse = np.eye(3) * np.ones((*area.shape, 1, 1)) if straight else np.linalg.inv(metric)
        x, y = self.elements.points[:, 0], self.elements.points[:, 1]
        to_columns = np.zeros((*x.shape, 3, N_STRAINS))  # F = u^T to_columns^T
        to_columns[..., [0, 1, 2], [0, 1, 2]] = 1.0
        to_columns[..., 2, 3], to_columns[..., 2, 4] = x, y
        tables = area, self.elements.mu, to_columns, inverse, to_columns
        return np.asarray(np.einsum("eqs,es,esim,eqsij,esjn->eqmn", *tables, optimize=True))

    def _stiffness(self) -> Floats:
        """(M, 3 n, 3 n) the same integrated along each element for its nodal vectors r, g1, g2, N/mm."""
        M, Q, n = self.elements.slope.shape
        to_strains = np.zeros((M, Q, n, 3, N_STRAINS))
        to_strains[..., 1, 0] = to_strains[..., 2, 1] = self.elements.shape
        to_strains[..., 0, 2] = to_strains[..., 1, 3] = to_strains[..., 2, 4] = self.elements.slope
        B = to_strains.reshape(M, Q, 3 * n, N_STRAINS)
        return np.asarray(np.einsum("eq,eqkm,eqmp,eqlp->ekl", self.space.weight, B, self.quadratic, B, optimize=True))

    def prepare(self, q: Floats) -> bool:
        """Elements couple the same nodes for ever."""
        return False

    def forget(self) -> None:
        """There is nothing that changes."""

    def pairs(self) -> tuple[Ints, Ints]:
        """All node pairs of each element, with all nine unknowns."""
        nodes = self.elements.nodes
        i, j = np.triu_indices(nodes.shape[1], 1)
        full = nodes[:, np.stack([i, j], axis=1)].reshape(-1, 2)
        return full, np.empty((0, 2), dtype=np.int64)

    def _by_fibrils(self, kernel: Callable[..., object], *arguments: Any) -> None:
        """Call a kernel for the elements of all fibrils, in as many pieces as there are cores for them.

        Fibrils share no node: each piece has entries of its own, and no bit of the result depends on their number.
        """
        first = self.space.mesh.first_element
        pieces = min(cores(), 1 + int(first[-1]) // WORTH_A_THREAD)
        edges = np.unique(first[np.linspace(0, len(first) - 1, pieces + 1).astype(int)]).tolist()
        side_by_side(kernel, edges, *arguments)

    def energy(self, q: Floats) -> float:
        """Elastic energy, N mm; infinite where a section has turned inside out."""
        energy = np.empty(len(self.stiffness))
        self._by_fibrils(beam_energy, q.reshape(-1, DOFS), self.elements, energy)
        return float(energy.sum())

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        """Add the gradient in place; return the energy."""
        energy = np.empty(len(self.stiffness))
        self._by_fibrils(add_gradient, q.reshape(-1, DOFS), self.elements, self.stiffness, energy, gradient)
        return float(energy.sum())

    def longest(self, q: Floats, direction: Floats) -> float:
        """1: what a fibril alone can do to itself, its energy sees."""
        return 1.0

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add gradient and tangent in place, nothing to `softening`; return the energy."""
        energy = np.empty(len(self.stiffness))
        sums = Sums(pattern.indptr, gradient, data)
        self._by_fibrils(add_tangent, q.reshape(-1, DOFS), self.elements, self.stiffness, energy, sums)
        return float(energy.sum())

    def section_force(self, q: Floats) -> Floats:
        """(M, 3) section force ∫ P E3 dA at mid-element, N."""
        force = np.empty((*self.space.weight.shape, 3))
        self._by_fibrils(section_force, q.reshape(-1, DOFS), self.by_area, self.quadratic, force)
        return np.asarray(force.mean(axis=1))

    def mass(self, pattern: Pattern) -> Floats:
        """(nnz,) consistent mass matrix [34], rotary terms included: g for positions, g mm2 for directors."""
        mesh = self.space.mesh
        line = mesh.density * mesh.area
        return line_matrix(self.space, pattern, line, line * mesh.radius**2 / 4)


def _strains(space: BeamSpace, q: Floats) -> Floats:
    """(M, Q, 5, 3) g1, g2, r', g1', g2' at the line points."""
    x = q.reshape(-1, 3, 3)[space.mesh.elements]
    value, slope = np.einsum("qa,eapc->eqpc", space.shape, x), np.einsum("eqa,eapc->eqpc", space.slope, x)
    return np.concatenate([value[:, :, 1:], slope], axis=2)


def _straight(space: BeamSpace) -> tuple[Floats, Floats]:
    """Products of the natural strains (1, Q, 5, 5) of straight fibrils, and no metric: theirs is the unit matrix."""
    lines = space.weight.shape[1]
    natural = np.zeros((1, lines, N_STRAINS, N_STRAINS))
    natural[..., [0, 1, 2], [0, 1, 2]] = 1.0
    return natural, np.empty((1, lines, 0, 3, 3))


def _curved(u: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Products (M, Q, 5, 5) of the natural strains u (M, Q, 5, 3), and the natural metric (M, Q, S, 3, 3)."""
    x, y = points[:, None, 0, :, None], points[:, None, 1, :, None]
    u1, u2, u3, u4, u5 = (u[:, :, None, m] for m in range(N_STRAINS))
    columns = np.stack(np.broadcast_arrays(u1, u2, u3 + x * u4 + y * u5), axis=-1)
    return np.einsum("eqmc,eqnc->eqmn", u, u), np.einsum("eqsci,eqscj->eqsij", columns, columns)
