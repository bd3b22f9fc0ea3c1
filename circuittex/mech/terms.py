"""The protocol by which forces enter the equilibrium: the only place where mechanics and contact meet."""

from __future__ import annotations

from typing import Protocol

from circuittex.base.arrays import Floats, Ints
from circuittex.mech.pattern import Pattern


class ForceTerm(Protocol):
    """A potential of the unknowns q (n_dofs,), with its gradient and exact tangent."""

    def prepare(self, q: Floats) -> bool:
        """Make the term valid around q; True if the node pairs it couples have changed."""

    def forget(self) -> None:
        """What comes next is computed as by a new term, to the last bit."""

    def pairs(self) -> tuple[Ints, Ints]:
        """Coupled nodes: full pairs (P, 2) with all nine unknowns, point pairs (P', 2) with the positions."""

    def energy(self, q: Floats) -> float:
        """The potential, N mm; infinite where q is impossible."""

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        """Add the gradient (N) alone in place; return the potential, infinite where q is impossible."""

    def longest(self, q: Floats, direction: Floats) -> float:
        """The part of `direction` (n_dofs,), at most 1, that can be gone from q without passing through what the
        potential forbids but does not see, as it is the same on the other side; 1 where nothing is in the way.

        Raises `PenetrationError` where the potential cannot keep apart what it should.
        """

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        """Add the gradient (N) and the tangent's upper triangle (N/mm) in place; return the potential.

        The tangent is `data` + `softening`: the latter takes the part that a descent far from equilibrium may
        leave out where it makes the tangent indefinite.
        """
