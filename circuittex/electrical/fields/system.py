"""One scalar field on the fibrils, coupled by the contacts: assembly by scikit-fem, and its solution."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, diags_array, identity
from scipy.sparse.linalg import splu
from skfem import BilinearForm, ElementLineP0, LinearForm
from skfem.helpers import dot, grad

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.electrical.fields.line import FibrilLine

WEAK = 1e-10
"""What holds a fibril this much weaker than a segment keeps six digits in the matrix, which is enough to refine."""
REFINEMENTS = 2
"""Steps of iterative refinement, which win back what short elements lose in the assembled matrix."""


@frozen
class System:
    """One discrete field: stiffness with the contacts, and the values at the feet, as sparse matrices."""

    basis: Any
    coefficient: Any
    """Conduction of the fibrils at the quadrature points."""
    conductance: Floats
    """(C,) of the contacts."""
    conduction: Any
    """(N, N) stiffness of the fibrils alone."""
    foot: Any
    """Two of (C, N): the field at the feet on fibrils a and b."""
    jump: Any
    """(C, N): difference of the two."""
    loss: Any = None
    """(N, N) what leaves to the surroundings; None where nothing does."""

    @property
    def stiffness(self) -> Any:
        """(N, N), contacts included."""
        return self.conduction + _coupling(self.jump, self.conductance)


@BilinearForm  # type: ignore[untyped-decorator]
def _conduction(u: Any, v: Any, w: Any) -> Any:
    """∫ c u' v' dxi."""
    return w.coefficient * dot(grad(u), grad(v))


@BilinearForm  # type: ignore[untyped-decorator]
def _mass(u: Any, v: Any, w: Any) -> Any:
    """∫ g u v dxi."""
    return w.density * u * v


@LinearForm  # type: ignore[untyped-decorator]
def _source(v: Any, w: Any) -> Any:
    """∫ q v dxi."""
    return w.density * v


def build_system(basis: Any, line: FibrilLine, coefficient: Floats, conductance: Floats) -> System:
    """Stiffness of the fibrils plus one rank-one coupling for each contact."""
    foot = [_evaluation(basis, *at) for at in zip(line.foot_segment, line.foot_local, strict=True)]
    jump = foot[0] - foot[1]
    along = basis.with_element(ElementLineP0()).interpolate(coefficient)
    return System(basis, along, conductance, csr_matrix(_conduction.assemble(basis, coefficient=along)), foot, jump)


def stiffest(line: FibrilLine, conduction: Floats) -> Floats:
    """(F,) conductance of the shortest segment of each fibril, `conduction` (S,) over its length."""
    found, length = np.zeros(line.ends.shape[1]), np.diff(line.xi[line.segments], axis=1)[:, 0]
    np.maximum.at(found, line.fibril[line.segments[:, 0]], conduction / length)
    return found


def surface_loss(basis: Any, density: Floats) -> Any:
    """(N, N) loss to the surroundings of `density` (S,) per length of axis."""
    return csr_matrix(_mass.assemble(basis, density=basis.with_element(ElementLineP0()).interpolate(density)))


def _coupling(jump: Any, conductance: Floats) -> Any:
    """(N, N) stiffness of the contacts."""
    return csr_matrix(jump.T @ diags_array(conductance) @ jump)


def _evaluation(basis: Any, segment: Ints, local: Floats) -> Any:
    """(C, N) matrix that takes nodal values to the field at one point of each given element."""
    dofs = basis.element_dofs[:, segment]
    values = np.stack([basis.elem.lbasis(local[None, :], i)[0] for i in range(len(dofs))])
    rows = np.broadcast_to(np.arange(len(segment)), dofs.shape)
    matrix = csr_matrix((values.ravel(), (rows.ravel(), dofs.ravel())), shape=(len(segment), basis.N))
    matrix.eliminate_zeros()
    return matrix


def constant_source(basis: Any, density: Floats) -> Floats:
    """(N,) load of a source that is constant on each element, `density` (S,) per length of axis."""
    load: Floats = _source.assemble(basis, density=basis.with_element(ElementLineP0()).interpolate(density))
    return load


def outflow(system: System, x: Floats) -> Floats:
    """(N,) what leaves each dof: `stiffness` times x, but element by element, and the loss.

    In the assembled matrix a short element's large conductance swamps its small neighbours; summed element by
    element, what enters it is exactly what leaves it.
    """
    basis = system.basis
    dofs, shapes = basis.element_dofs, [np.asarray(shape.grad[0]) for (shape,) in basis.basis]
    # ∫ c x' v' dxi by the same steps as a form of scikit-fem, whose bookkeeping would take most of the time.
    slope = sum(x[dof][:, None] * shape for dof, shape in zip(dofs, shapes, strict=True))
    into = [np.sum(system.coefficient * (slope * shape) * basis.dx, axis=1) for shape in shapes]
    inside = np.bincount(dofs.ravel(), np.concatenate(into), basis.N)
    outside: Floats = system.jump.T @ (system.conductance * (system.jump @ x))
    return inside + outside if system.loss is None else inside + outside + system.loss @ x


def balance(system: System, load: Floats, value: Floats, free_dofs: Ints, anchor: Ints | None = None) -> Floats:
    """Balance `load` (n, N) in the dofs `free_dofs`; elsewhere x is `value` (N,), and 0 where that is nan.

    A fibril that hangs on its contacts alone moves as a whole, and where these are ten decades weaker than its
    segments, nothing of them is left in the assembled matrix; nor is a loss that weak where nothing else holds it.
    `anchor` (N,) names for each dof the one on its fibril from which it is measured, or itself: then the segments' part
    in the anchor's row is zero by construction, not by cancellation.
    """
    x = np.nan_to_num(np.tile(value, (len(load), 1)))
    if not len(free_dofs):
        return x
    move, matrix = measured(system, anchor)
    # Positive definite, so no pivoting: as fast as COLAMD on the paper's cell, three times as fast on a denser one.
    # Panels and relaxed supernodes double the time on the paper's cell and save none on denser ones.
    factor = splu(
        matrix[free_dofs][:, free_dofs].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        panel_size=1,
        relax=1,
        options={"SymmetricMode": True},
    )
    move = move[free_dofs][:, free_dofs]
    for _ in range(1 + REFINEMENTS):
        residual = load - np.stack([outflow(system, row) for row in x])
        x[:, free_dofs] += (move @ factor.solve(move.T @ residual[:, free_dofs].T)).T
    return x


def measured(system: System, anchor: Ints | None) -> tuple[Any, Any]:
    """(N, N) each: what makes values of those above the anchors, and stiffness with contacts and loss in terms of them,
    move^T K move, in which the fibrils' part is exactly zero at anchors."""
    n, loss = system.conduction.shape[0], system.loss
    move, fibrils, jump = identity(n, format="csr"), system.conduction, system.jump
    if anchor is not None:
        every = np.arange(n)
        led = np.flatnonzero(anchor != every)
        rows, columns = np.concatenate([every, led]), np.concatenate([every, anchor[led]])
        move = csr_matrix((np.ones(n + len(led)), (rows, columns)), shape=(n, n))
        own = np.ones(n)
        own[anchor[led]] = 0.0
        fibrils = diags_array(own) @ system.conduction @ diags_array(own)
        jump = csr_matrix(system.jump @ move)
        loss = None if loss is None else move.T @ loss @ move
    if loss is not None:
        fibrils = fibrils + loss
    return move, fibrils + _coupling(jump, system.conductance)


def peak(basis: Any, temperature: Floats) -> float:
    """Largest value of a piecewise quadratic field."""
    start, stop, middle = temperature[basis.element_dofs]
    slope = 4.0 * middle - 3.0 * start - stop
    curvature = 2.0 * (start + stop - 2.0 * middle)  # T(s) = start + slope s + curvature s^2
    inside = (slope > 0.0) & (slope < -2.0 * curvature)
    rise = np.divide(slope**2, -4.0 * curvature, out=np.zeros_like(slope), where=inside)
    return float(np.max(np.where(inside, start + rise, np.maximum(start, stop))))
