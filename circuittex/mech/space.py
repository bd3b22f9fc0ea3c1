"""The finite element space of the beams: scikit-fem's mesh, basis and quadrature."""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.design.checks import one_of
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration
from circuittex.mech.pattern import DOFS

ALONG = {1: [0, 1], 2: [0, 2, 1]}
"""scikit-fem's numbers of the nodes along an element, for each order: a middle node is its last."""


@frozen
class BeamSpace:
    """What the beam kernels need of scikit-fem's basis; M elements of n nodes, Q line points.

    Unknown k of node i is ``9 * i + k``. Nodes are numbered along their fibrils: an element has successive ones.
    """

    mesh: FibrilMesh
    shape: Floats
    """(Q, n) shape functions at the line points."""
    slope: Floats
    """(M, Q, n) their derivatives with respect to xi3, 1/mm."""
    weight: Floats
    """(M, Q) line weights, mm."""
    mass_line: Floats
    """(M, n, n) integrals of products of shape functions, mm."""
    fixed: Ints
    """prescribed unknowns: r of every fibril end that is held [49]; the directors are free [50, 51]."""

    @property
    def n_dofs(self) -> int:
        return DOFS * self.mesh.n_nodes

    def vector(self, configuration: Configuration) -> Floats:
        """(n_dofs,) unknowns of a configuration."""
        return configuration.x.flatten()

    def configuration(self, vector: Floats) -> Configuration:
        """The configuration that a vector of unknowns describes."""
        return Configuration(vector.reshape(-1, 3, 3))


def line_mesh(mesh: FibrilMesh) -> Any:
    """scikit-fem's mesh of all fibrils, each on its own [0, L]: offset meshes would cost digits."""
    vertices, index = np.unique(mesh.elements[:, [0, -1]], return_inverse=True)
    cells = np.ascontiguousarray(index.reshape(-1, 2).T)
    return skfem.MeshLine1(mesh.xi[vertices][None, :], cells, sort_t=False)


def vector_basis(mesh: FibrilMesh) -> Any:
    """scikit-fem's basis of the nine unknowns: linear elements with one point, quadratic with two.

    Both are the reduced rules that do not lock in bending (see `docs/numerics.md`).
    """
    element = {1: skfem.ElementLineP1, 2: skfem.ElementLineP2}[mesh.order]()
    return skfem.Basis(line_mesh(mesh), skfem.ElementVector(element, DOFS), quadrature=gauss(mesh.order))


def gauss(points: int) -> tuple[Floats, Floats]:
    """Gauss rule on [0, 1] in scikit-fem's form: points (1, Q), weights (Q,)."""
    t, w = np.polynomial.legendre.leggauss(points)
    return (t[None, :] + 1) / 2, w / 2


def beam_space(mesh: FibrilMesh, free_edges: str = "") -> BeamSpace:
    """The space for a mesh, every fibril end held in place but for those of yarns along `free_edges`, 'x' or 'y'."""
    basis = vector_basis(mesh)
    scalar = skfem.Basis(basis.mesh, type(basis.elem.elem)(), quadrature=gauss(mesh.order))
    exact = skfem.Basis(basis.mesh, type(basis.elem.elem)(), quadrature=gauss(mesh.order + 1))

    def tables(of: Any) -> tuple[Floats, Floats]:
        value = np.stack([np.broadcast_to(np.asarray(of.basis[i][0]), of.dx.shape) for i in ALONG[mesh.order]], axis=-1)
        grad = np.stack([of.basis[i][0].grad[0] for i in ALONG[mesh.order]], axis=-1)
        return value, grad

    shape, slope = tables(scalar)
    exact_shape, _ = tables(exact)
    axis = ("x", "y", "").index(one_of(free_edges, "free_edges", ("x", "y", "")))
    held = mesh.yarn_axis[mesh.yarn] != axis
    ends = np.concatenate([mesh.end_nodes(-1)[held], mesh.end_nodes(+1)[held]])
    return BeamSpace(
        mesh=mesh,
        shape=shape[0],
        slope=slope,
        weight=np.asarray(scalar.dx),
        mass_line=np.einsum("mqa,mqb,mq->mab", exact_shape, exact_shape, exact.dx),
        fixed=np.sort((DOFS * ends[:, None] + np.arange(3)).ravel()),
    )
