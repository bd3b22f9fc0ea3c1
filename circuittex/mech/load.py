"""Forces that keep their size and direction, as those of weights over pulleys."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.mech.pattern import Pattern


class DeadLoad:
    """A `ForceTerm`: the potential -f . (q - q0) of given forces.

    >>> load = DeadLoad(np.array([2.0, 0.0]), np.array([1.0, 1.0]))
    >>> load.energy(np.array([1.5, 7.0]))
    -1.0
    """

    def __init__(self, force: Floats, origin: Floats) -> None:
        """`force` f (n_dofs,), N, and `origin` q0 (n_dofs,), where the potential is zero."""
        self.force, self.origin = force, origin

    def prepare(self, q: Floats) -> bool:
        return False

    def forget(self) -> None:
        pass

    def pairs(self) -> tuple[Ints, Ints]:
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 2), dtype=np.int64)

    def energy(self, q: Floats) -> float:
        return -float(np.einsum("i,i->", self.force, q - self.origin))

    def add_gradient(self, q: Floats, gradient: Floats) -> float:
        gradient -= self.force
        return self.energy(q)

    def longest(self, q: Floats, direction: Floats) -> float:
        return 1.0

    def assemble(self, q: Floats, pattern: Pattern, gradient: Floats, data: Floats, softening: Floats) -> float:
        return self.add_gradient(q, gradient)
