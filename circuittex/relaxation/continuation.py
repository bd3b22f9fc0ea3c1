"""A descent among stiff contacts, begun with softer ones.

Where contacts are stiff beside what bends the fibrils, as in yarns of slender fibrils, a step presses fibrils that did
not touch into one another, by a part of R where contact forces ask for a thousandth of it. The potential rises, and
only a hundredth of the step is taken: the descent creeps. With a softer penalty the overlaps are as large as the
steps, the fibrils find their places, and the true penalty finds them near its own minimum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from circuittex.base.arrays import Floats
from circuittex.base.errors import ConvergenceError, CreepingError
from circuittex.mech.minimise import Minimum

SOFTER = 1 / 64
"""Part of the penalty with which a descent that creeps is begun again."""
SOFTEST = SOFTER**3
"""Part of it below which nothing is gained: overlaps go with its power 2/3, so they would be thousands of times larger.
"""


def continued(descend: Callable[[Floats, float, bool], Minimum], q: Floats, part: float = 1.0) -> Minimum:
    """The minimum with `part` of the penalty to which q leads; where that creeps, by way of a softer penalty's.

    `descend` takes unknowns, a part of the penalty and whether it may creep. The `iterations` are those of all
    descents, the `history` is that of the last.

    Raises `ConvergenceError` where the descent with `part` of the penalty does not arrive from there either.
    """
    try:
        return descend(q, part, part <= SOFTEST)
    except CreepingError as error:
        spent, reached = len(error.history) - 1, error.q
    try:
        softer = continued(descend, q, part * SOFTER)
        reached, spent = softer.q, spent + softer.iterations
    except ConvergenceError as error:  # too soft to keep the fibrils apart: this penalty has to do, and creep on
        spent += max(0, len(error.history) - 1)
    found = descend(reached, part, True)
    return replace(found, iterations=spent + found.iterations)
