"""A place where a descent by gradients begins anew: what it takes along, so that another process can go on from there.

Force terms and solver remember earlier places: candidates for contact, node pairs that were coupled, an order of
elimination. No result depends on that but for its rounding, which is enough for another equilibrium. At a checkpoint
all of it is forgotten, whether or not somebody keeps the checkpoint: what follows is a function of these arrays alone.
"""

from __future__ import annotations

from collections.abc import Callable

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen


@frozen
class Checkpoint:
    """Where a descent has come to, in the units in which it is made."""

    q: Floats
    """(n_dofs,) unknowns."""
    steps: Floats
    """(m, n_dofs) s of the pairs that are remembered, the oldest first."""
    turns: Floats
    """(m, n_dofs) y, by which each of them changed the gradient, N."""
    curvatures: Floats
    """(m,) s.y, N mm."""
    shift: float
    """Shift of the last factor."""
    most: float
    """The longest motion of a node that a step may try, mm."""
    iteration: int
    """Iterations that led here."""
    ended: bool
    """Whether the descent is over and Newton's method goes on."""


@frozen
class Checkpoints:
    """What a descent goes on from, and what is told of the places where it begins anew.

    >>> kept = []
    >>> Checkpoints(keep=kept.append).reached is None
    True
    """

    reached: Checkpoint | None = None
    """Where an earlier one, of the same problem, had come to; None for a descent from the start."""
    keep: Callable[[Checkpoint], None] | None = None
    """Called at each place; what it raises ends the descent."""


NONE = Checkpoints()
"""From the start, and nothing is kept."""
