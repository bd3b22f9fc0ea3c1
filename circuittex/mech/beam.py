"""The director beam [9, 10] as a force term."""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.geometry.mesh import Floats, Ints
from circuittex.mech.configuration import Configuration
from circuittex.mech.kernels import beam_energy, beam_tangent, section_force
from circuittex.mech.material import bending_lambda, lame
from circuittex.mech.pattern import Pattern, add_elements
from circuittex.mech.section import disk_rule
from circuittex.mech.space import DOFS, BeamSpace


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
        section = len(unit)
        on_axis = np.arange(section) >= len(disk_rule(degree)[1])
        self.space = space
        self.mu = np.where(on_axis, 0.0, mu[fibril, None])
        self.lam = np.where(on_axis, (lam - lam_b)[fibril, None], lam_b[fibril, None])
        points = unit * mesh.radius[fibril, None, None]
        self.area = share * mesh.area[fibril, None, None] * np.ones_like(space.weight)[..., None]
        self.weight = self.area * space.weight[..., None]
        self.L = _strain_matrix(points)[:, None] * np.ones((1, space.weight.shape[1], 1, 1, 1))
        if natural is not None:
            self.L, jacobian = _referred(self.L, space, natural)
            self.area, self.weight = self.area * jacobian, self.weight * jacobian
        elif np.ptp(mesh.radius) == 0:
            self.L = self.L[:1]
        n = space.element_slots.shape[1]
        self._gradient = np.empty((len(fibril), n, DOFS))
        self._tangent = np.empty((len(fibril), n, DOFS, n, DOFS))

    def prepare(self, q: Floats) -> bool:
        """Elements couple the same nodes for ever."""
        return False

    def pairs(self) -> tuple[Ints, Ints]:
        """All node pairs of each element, with all nine unknowns."""
        n = self.space.element_slots.shape[1]
        i, j = np.triu_indices(n, 1)
        full = self.space.element_slots[:, np.stack([i, j], axis=1)].reshape(-1, 2)
        return full, np.empty((0, 2), dtype=np.int64)

    def _arguments(self, q: Floats, weight: Floats, *out: Floats) -> tuple[Any, ...]:
        space = self.space
        x = q.reshape(-1, DOFS)
        return x, space.element_slots, space.shape, space.slope, weight, self.L, self.mu, self.lam, *out

    def energy(self, q: Floats) -> float:
        """Elastic energy, N mm; infinite where a section has turned inside out."""
        return float(beam_energy(*self._arguments(q, self.weight)))

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add gradient and tangent in place, nothing to `softening`; return the energy."""
        element = self._gradient, self._tangent
        energy = beam_tangent(*self._arguments(q, self.weight, *element))
        add_elements(
            self.space.element_slots,
            *element,
            pattern.indptr,
            pattern.neighbour_start,
            pattern.neighbour,
            pattern.point_offset,
            pattern.full_offset,
            gradient,
            data,
        )
        return float(energy)

    def section_force(self, q: Floats) -> Floats:
        """(M, 3) section force ∫ P E3 dA at mid-element, N."""
        force = np.empty((*self.space.weight.shape, 3))
        section_force(*self._arguments(q, self.area, force))
        return np.asarray(force.mean(axis=1))

    def mass(self, pattern: Pattern) -> Floats:
        """(nnz,) consistent mass matrix [34], rotary terms included: g for positions, g mm2 for directors."""
        mesh, fibril = self.space.mesh, self.space.mesh.element_fibril
        n = self.space.element_slots.shape[1]
        line = (mesh.density * mesh.area)[fibril]
        inertia = np.stack([line, line * mesh.radius[fibril] ** 2 / 4, line * mesh.radius[fibril] ** 2 / 4], axis=1)
        tangent = np.zeros((len(fibril), n, DOFS, n, DOFS))
        k = np.arange(DOFS)
        tangent[:, :, k, :, k] = np.moveaxis(self.space.mass_line[..., None] * inertia[:, None, None, k // 3], -1, 0)
        data = np.zeros(pattern.nnz)
        add_elements(
            self.space.element_slots,
            np.zeros((len(fibril), n, DOFS)),
            tangent,
            pattern.indptr,
            pattern.neighbour_start,
            pattern.neighbour,
            pattern.point_offset,
            pattern.full_offset,
            np.zeros(pattern.n_dofs),
            data,
        )
        return data


def _strain_matrix(points: Floats) -> Floats:
    """(M, S, 5, 3) matrices L with F = sum_m u_m (x) L_m for section points (M, S, 2)."""
    L = np.zeros((*points.shape[:2], 5, 3))
    L[..., 0, 0] = L[..., 1, 1] = L[..., 2, 2] = 1.0
    L[..., 3, 2], L[..., 4, 2] = points[..., 0], points[..., 1]
    return L


def _referred(L: Floats, space: BeamSpace, natural: Configuration) -> tuple[Floats, Floats]:
    """L and the volume ratio for a curved stress-free configuration X0: F = dx/dxi (dX0/dxi)^-1."""
    x = space.vector(natural).reshape(-1, 3, 3)[space.element_slots]
    value = np.einsum("qa,eapc->eqpc", space.shape, x)
    slope = np.einsum("eqa,eapc->eqpc", space.slope, x)
    u = np.stack([value[:, :, 1], value[:, :, 2], slope[:, :, 0], slope[:, :, 1], slope[:, :, 2]], axis=2)
    reference = np.einsum("eqmc,eqsmj->eqscj", u, L)
    return L @ np.linalg.inv(reference), np.linalg.det(reference)
