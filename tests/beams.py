"""Single beams under dead loads and prescribed directors, and closed forms of the elastica."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import asin, pi, sin, sqrt

import numpy as np
import scipy.sparse as sp
from fabrics import fibrils_through, straight
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from circuittex.base.arrays import Floats, Ints
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.beam import Beam
from circuittex.mech.configuration import Configuration, initial_configuration
from circuittex.mech.load import DeadLoad
from circuittex.mech.minimise import Minimum, minimise
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import DOFS, Pattern, build_pattern
from circuittex.mech.scales import fibril_scales
from circuittex.mech.space import BeamSpace, beam_space
from circuittex.mech.terms import ForceTerm

MODULUS = 10.0
"""E in MPa, that of the paper's fibrils."""
SLENDER = 5e-3
"""R/L of the beams that stand for inextensible and unshearable ones. What is left of stretch, shear and finite strain
moves a tip by a few (R/L)^2, that is 1e-4 of the length."""


def rod(
    length: float, elements: int, order: int, *, radius: float, modulus: float = MODULUS, poisson: float = 0.0
) -> FibrilMesh:
    """A straight fibril along x from the origin, with g1 = y and g2 = z."""
    line = straight((0, 0, 0), (length, 0, 0), elements, order)
    mesh = fibrils_through([line], order=order, radius=radius, modulus=modulus, poisson=poisson)
    return replace(mesh, directors=np.tile(np.eye(3)[1:], (mesh.n_nodes, 1, 1)))


def arc(xi: Floats, curvature: float) -> Configuration:
    """A circular arc in the x-y plane that starts at the origin along x, directors turned with it."""
    t = curvature * xi
    zero = np.zeros_like(t)
    r = np.stack([xi * np.sinc(t / pi), xi * np.sin(t / 2) * np.sinc(t / (2 * pi)), zero], axis=1)
    g1 = np.stack([-np.sin(t), np.cos(t), zero], axis=1)
    return Configuration(np.stack([r, g1, np.tile([0.0, 0.0, 1.0], (len(xi), 1))], axis=1))


def bending_stiffness(radius: float, modulus: float = MODULUS) -> float:
    """E I of a circular section, N mm2."""
    return modulus * pi * radius**4 / 4


def turned(angle: float, axis: int) -> Floats:
    """Rotation matrix about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return R


def dofs(space: BeamSpace, node: int, rows: Sequence[int] = (0, 1, 2)) -> Ints:
    """The unknowns of a node: all components of `rows`, 0 for r, 1 for g1, 2 for g2."""
    return np.concatenate([DOFS * np.arange(space.mesh.n_nodes)[node] + 3 * row + np.arange(3) for row in rows])


def tip_load(space: BeamSpace, force: ArrayLike) -> DeadLoad:
    """A dead load on the last node."""
    f = np.zeros(space.n_dofs)
    f[dofs(space, -1, [0])] = force
    return DeadLoad(f, np.zeros(space.n_dofs))


def rest(
    beam: Beam, start: Configuration, fixed: Ints, *terms: ForceTerm, tolerance: float, max_iterations: int = 300
) -> tuple[Configuration, Minimum]:
    """Equilibrium of a beam with the `fixed` unknowns held as in `start`."""
    found = minimise(
        [beam, *terms],
        beam.space.vector(start),
        scales=fibril_scales(beam.space, span=float(beam.space.mesh.length.max())),
        fixed=fixed,
        solver=MultifrontalSolver(),
        tolerance=0.0,
        force_tolerance=tolerance,
        max_iterations=max_iterations,
    )
    return beam.space.configuration(found.q), found


def moment(space: BeamSpace, found: Minimum, node: int) -> Floats:
    """(3,) moment of the director forces that hold a node's directors: sum g_a x dE/dg_a."""
    x, f = (space.configuration(v).x[node] for v in (found.q, found.gradient))
    return np.asarray(np.cross(x[1:], f[1:]).sum(axis=0))


def assembled(beam: Beam, q: Floats) -> tuple[float, Floats, Pattern, Floats]:
    """Energy, gradient (n_dofs,), pattern and tangent values of the beam term alone."""
    pattern = build_pattern(beam.space.mesh.n_nodes, *beam.pairs())
    gradient, data = np.zeros(len(q)), np.zeros(pattern.nnz)
    return beam.assemble(q, pattern, gradient, data, np.zeros(pattern.nnz)), gradient, pattern, data


def dense(pattern: Pattern, data: Floats) -> Floats:
    """The symmetric matrix (n_dofs, n_dofs) whose upper triangle is given."""
    shape = (pattern.n_dofs, pattern.n_dofs)
    upper = sp.csr_array((data, pattern.indices, pattern.indptr), shape=shape).toarray()
    return np.asarray(upper + np.triu(upper, 1).T)


def stiffness(mesh: FibrilMesh, natural: Configuration | None = None) -> tuple[BeamSpace, Floats]:
    """Space and dense stiffness of the stress-free beam."""
    space = beam_space(mesh)
    beam = Beam(space, natural=natural)
    _, _, pattern, data = assembled(beam, space.vector(natural or initial_configuration(mesh)))
    return space, dense(pattern, data)


def elastica_cantilever(alpha: float) -> tuple[float, float, float]:
    """Tip angle, deflection and shortening of the cantilever of length 1 with P L^2 / (E I) = alpha.

    With modulus p, p^2 = (1 + sin tip) / 2, and sin f = 1 / (p sqrt 2): sqrt alpha = K(p) - F(f, p),
    deflection = 1 - 2 (E(p) - E(f, p)) / sqrt alpha, projected length = sqrt(2 sin tip / alpha).
    """

    def integrals(tip: float) -> tuple[float, float]:
        m = (1 + sin(tip)) / 2
        f = asin(1 / sqrt(2 * m))
        return float(ellipk(m) - ellipkinc(f, m)), float(ellipe(m) - ellipeinc(f, m))

    tip = brentq(lambda t: integrals(t)[0] ** 2 - alpha, 1e-6, pi / 2 - 1e-6, xtol=1e-14, rtol=1e-14)
    deflection = 1 - 2 * integrals(tip)[1] / sqrt(alpha)
    return tip, deflection, 1 - sqrt(2 * sin(tip) / alpha)


def elastica_column(tip: float) -> tuple[float, float, float]:
    """Load over critical load and tip position (along, across) of the column of length 1 for a tip angle (rad).

    With modulus k = sin(tip / 2): P L^2 / (E I) = K^2, along = 2 E / K - 1, across = 2 k / K.
    """
    k = sin(tip / 2)
    K, E = float(ellipk(k**2)), float(ellipe(k**2))
    return (2 * K / pi) ** 2, 2 * E / K - 1, 2 * k / K


def observed_order(values: Sequence[float]) -> float:
    """Order of convergence of values on three meshes that halve, whatever they converge to."""
    coarse, middle, fine = values
    return float(np.log2(abs((coarse - middle) / (middle - fine))))
