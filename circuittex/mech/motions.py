"""Unknowns that move together: the columns of T in q = T p + b that are no unit vectors.

Equilibria are minima over p. A free unknown is one of p; a prescribed one stands in b alone; and what a clamp on a rail
carries moves by one number more, a *motion*. The gradient over p is T^T g, the tangent T^T K T.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.mech.linear import Solve


@frozen
class Motions:
    """K motions of S of the prescribed unknowns; an unknown may take part in several.

    A vector over p has the length of q: what belongs to a motion stands at its leader, zeros at all other prescribed
    unknowns. So products of forces and directions are those over p.

    >>> apart = Motions(np.array([0, 9]), np.array([0, 0]), np.array([1.0, -1.0]), np.array([0]))
    >>> gradient = np.arange(1.0, 19.0)
    >>> apart.forces(gradient), apart.matrix(18).toarray()[[0, 9], 0]
    (array([-9.]), array([ 1., -1.]))
    """

    unknown: Ints
    """(S,) prescribed unknowns that move."""
    motion: Ints
    """(S,) the motion by which they do."""
    part: Floats
    """(S,) how far, in parts of the motion: entries of T."""
    leader: Ints
    """(K,) an unknown of each motion whose part in it is 1, and that is in no other."""

    def matrix(self, n_dofs: int) -> sp.csr_array:
        """(n_dofs, K) the columns of T."""
        shape = n_dofs, len(self.leader)
        return sp.csr_array((self.part, (self.unknown, self.motion)), shape=shape)

    def forces(self, gradient: Floats) -> Floats:
        """(K,) T^T g."""
        each = self.part * gradient[self.unknown]
        return np.bincount(self.motion, weights=each, minlength=len(self.leader)).astype(np.float64)

    def solve(self, solve: Solve, upper: sp.csr_array, free: NDArray[np.bool_]) -> Solve | None:
        """A function that solves with T^T K T, forces over p to directions of q; None if that is not positive definite.

        `solve` does so with the rows and columns of the `free` unknowns alone, `upper` is the upper triangle of K.
        Block elimination: K is positive definite on p if it is on the free unknowns, and its Schur complement
        S = t^T K t - B^T K_ff^-1 B, B = (K t)_f, is on the motions t.

        >>> upper, free = sp.csr_array(np.array([[4.0, -1.0], [0.0, 2.0]])), np.array([True, False])
        >>> one = Motions(np.array([1]), np.array([0]), np.array([1.0]), np.array([1]))
        >>> one.solve(lambda force: force / [4.0, 1.0], upper, free)(np.array([0.0, 7.0]))
        array([1., 4.])
        """
        moved = self.matrix(len(free))
        turned = upper @ moved + upper.T @ moved - sp.diags_array(upper.diagonal()) @ moved
        border = sp.csr_array(sp.diags_array(free.astype(np.float64)) @ turned)
        follow = np.stack([solve(column) for column in border.T.toarray()], axis=1)
        stiffness = (moved.T @ turned).toarray() - border.T @ follow
        try:
            factor = cho_factor(stiffness)
        except LinAlgError:
            return None

        def solved(force: Floats) -> Floats:
            rest = force.copy()
            rest[self.leader] = 0.0
            alone = solve(rest)
            motion = cho_solve(factor, force[self.leader] - border.T @ alone)
            together: Floats = alone + moved @ motion - np.einsum("nk,k->n", follow, motion)
            return together

        return solved
