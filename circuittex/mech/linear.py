"""What the equilibrium iteration asks of a direct solver: solutions, and "is the tangent positive definite?".

A solver's `factor` takes the pattern and the values of a symmetric matrix and returns a function that
solves with it, or None where a pivot is not positive. The symbolic analysis is kept while the same `Pattern` object
comes back and its values couple no node pair that was not coupled before (`circuittex.mech.coupled`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from circuittex.base.arrays import Floats
from circuittex.mech.pattern import Pattern

Solve = Callable[[Floats], Floats]


class LinearSolver(Protocol):
    """A direct solver: `circuittex.mech.multifrontal` is the one by default."""

    name: str

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve | None:
        """A function that solves with the matrix, or None if it is not positive definite.

        Where `rough`, it may be as rough as single precision makes it, for the sake of time and memory.
        """

    def forget(self) -> None:
        """What comes next is computed as by a new solver, to the last bit."""
