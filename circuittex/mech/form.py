"""The director beam [9, 10, 35] as scikit-fem forms: its readable definition, and the oracle of the compiled kernels.

Nothing here is fast, and nothing is shared with the kernels but the basis, the section rule and Lamé's parameters.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.material import bending_lambda, lame
from circuittex.mech.pattern import DOFS
from circuittex.mech.section import disk_rule
from circuittex.mech.space import ALONG, beam_space, vector_basis


@frozen
class SectionPoint:
    """One point of the section rule in all M elements, each field (M, 1) to go with line points (M, Q)."""

    xi1: Floats
    xi2: Floats
    """coordinates in the section, mm."""
    area: Floats
    """the point's share of the section, mm2."""
    mu: Floats
    lam: Floats
    """Lamé parameters that the point carries, MPa."""


def section_points(mesh: FibrilMesh, degree: int) -> list[SectionPoint]:
    """The disk rule with mu and lambda_b, then the axis with lambda - lambda_b (see `bending_lambda`)."""
    fibril = mesh.element_fibril
    mu, lam = lame(mesh.youngs_modulus, mesh.poisson_ratio)
    lam_b = bending_lambda(mu, mesh.poisson_ratio)
    R, A, mu, lam, lam_b = (x[fibril][:, None] for x in (mesh.section_radius, mesh.area, mu, lam, lam_b))
    points = [
        SectionPoint(xi1=R * x, xi2=R * y, area=A * share, mu=mu, lam=lam_b)
        for (x, y), share in zip(*disk_rule(degree), strict=True)
    ]
    return [*points, SectionPoint(xi1=0 * R, xi2=0 * R, area=A, mu=0 * mu, lam=lam - lam_b)]


def gradient_columns(u: Any, point: SectionPoint) -> Floats:
    """[g1 | g2 | r' + xi1 g1' + xi2 g2'] [10] of a field u of nine unknowns, (3, 3, M, Q)."""
    value, slope = np.asarray(u), np.asarray(u.grad)[:, 0]
    return np.stack([value[3:6], value[6:9], slope[0:3] + point.xi1 * slope[3:6] + point.xi2 * slope[6:9]], axis=1)


def psi(F: Floats, mu: Floats, lam: Floats) -> Floats:
    """mu/2 (tr F^T F - 3) - mu ln J + lambda/2 (ln J)^2 [1], MPa."""
    log_j = np.log(_determinant(F))
    return np.asarray(mu / 2 * (np.einsum("ij...,ij...", F, F) - 3) - mu * log_j + lam / 2 * log_j**2)


def stress(F: Floats, mu: Floats, lam: Floats) -> Floats:
    """P = d psi / dF = mu (F - F^-T) + lambda ln J F^-T, (3, 3, ...) MPa."""
    inverse = _inverse_transposed(F)
    return np.asarray(mu * (F - inverse) + lam * np.log(_determinant(F)) * inverse)


def stress_change(F: Floats, dF: Floats, mu: Floats, lam: Floats) -> Floats:
    """dP = mu dF + (mu - lambda ln J) F^-T dF^T F^-T + lambda (F^-T : dF) F^-T, (3, 3, ...) MPa."""
    inverse = _inverse_transposed(F)
    turned = np.einsum("ik...,lk...,lj...->ij...", inverse, dF, inverse)
    change = mu * dF + (mu - lam * np.log(_determinant(F))) * turned
    return np.asarray(change + lam * np.einsum("ij...,ij...", inverse, dF) * inverse)


class BeamForm:
    """Elastic energy, its gradient and its tangent for all fibrils; arguments as `Beam`.

    With a `natural` configuration X0, F = (dx/dxi) (dX0/dxi)^-1 and volumes are those of X0.
    """

    def __init__(self, mesh: FibrilMesh, *, degree: int = 7, natural: Configuration | None = None) -> None:
        self._basis = vector_basis(mesh)
        self._place = _places(mesh, self._basis)
        self._natural = None if natural is None else self._field(beam_space(mesh).vector(natural))
        self._points = [(p, *self._reference(p)) for p in section_points(mesh, degree)]

    def _reference(self, point: SectionPoint) -> tuple[Floats, Floats]:
        """(dX0/dxi)^-1 (3, 3, M, Q) and the volume of X0 for the point's share of each mm of axis, mm2."""
        if self._natural is None:
            return np.eye(3)[:, :, None, None], point.area
        G = gradient_columns(self._natural, point)
        return _inverse_transposed(G).swapaxes(0, 1), point.area * _determinant(G)

    def _field(self, q: Floats) -> Any:
        """scikit-fem's field of the unknowns q (n_dofs,) at the line points."""
        there = np.empty_like(q)
        there[self._place] = q
        return self._basis.interpolate(there)

    def energy(self, q: Floats) -> float:
        """∫∫ psi dA dxi3, N mm, for q (n_dofs,)."""

        def form(w: Any) -> Any:
            return sum(area * psi(_product(gradient_columns(w.x0, p), G), p.mu, p.lam) for p, G, area in self._points)

        return float(skfem.Functional(form).assemble(self._basis, x0=self._field(q)))

    def residual(self, q: Floats) -> Floats:
        """(n_dofs,) ∫∫ P : dF(v) dA dxi3 for every test function v [35], N."""

        def form(v: Any, w: Any) -> Any:
            total = 0.0
            for p, G, area in self._points:
                F, dF = (_product(gradient_columns(field, p), G) for field in (w.x0, v))
                total = total + area * np.einsum("ij...,ij...", stress(F, p.mu, p.lam), dF)
            return total

        return np.asarray(skfem.LinearForm(form).assemble(self._basis, x0=self._field(q)))[self._place]

    def tangent(self, q: Floats) -> Any:
        """(n_dofs, n_dofs) sparse matrix ∫∫ dP(u) : dF(v) dA dxi3, N/mm."""

        def form(u: Any, v: Any, w: Any) -> Any:
            total = 0.0
            for p, G, area in self._points:
                F, dU, dV = (_product(gradient_columns(field, p), G) for field in (w.x0, u, v))
                total = total + area * np.einsum("ij...,ij...", stress_change(F, dU, p.mu, p.lam), dV)
            return total

        matrix = skfem.BilinearForm(form).assemble(self._basis, x0=self._field(q))
        return matrix.tocsr()[self._place][:, self._place]


def _places(mesh: FibrilMesh, basis: Any) -> Ints:
    """(n_dofs,) where scikit-fem, which numbers the middle nodes of elements last, has each of the unknowns."""
    node = np.empty(mesh.n_nodes, dtype=np.int64)
    node[mesh.elements] = np.asarray(basis.element_dofs)[::DOFS].T[:, ALONG[mesh.order]] // DOFS
    return np.asarray((DOFS * node[:, None] + np.arange(DOFS)).ravel())


def _product(A: Floats, B: Floats) -> Floats:
    return np.asarray(np.einsum("ik...,kj...->ij...", A, B))


def _determinant(F: Floats) -> Floats:
    return np.asarray(np.linalg.det(np.moveaxis(F, (0, 1), (-2, -1))))


def _inverse_transposed(F: Floats) -> Floats:
    inverse = np.linalg.inv(np.moveaxis(F, (0, 1), (-2, -1)))
    return np.asarray(np.moveaxis(inverse, (-1, -2), (0, 1)))
