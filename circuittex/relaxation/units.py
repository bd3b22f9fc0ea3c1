"""The units in which the first equilibrium of a weave is sought: those of its own fibrils.

A weave starts symmetric, and which of its mirror images a descent reaches is decided by the last bits of its numbers.
Multiplied by a hundredth or by seven they are rounded otherwise; in units of the fibrils' radius and penalty they are
not, so that a design and the same one at another scale take the same steps to the last bit, whatever the factor.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.contact.law import largest_penalty
from circuittex.design import Design
from circuittex.geometry.mesh import FibrilMesh
from circuittex.mech.configuration import Configuration

RADIUS, PENALTY = 0.15, 5.0
"""mm and N/mm2: the thinnest fibrils and the hardest contacts have these in units of their own. Any pair would do; with
those of the paper its cells are computed in the units that they are printed in."""


@frozen
class Units:
    """Units of length and modulus, and what follows from them.

    >>> Units(0.5, 8.0).force
    2.0
    """

    length: float
    """mm."""
    modulus: float
    """N/mm2."""

    @property
    def force(self) -> float:
        """N."""
        return self.modulus * (self.length * self.length)

    @property
    def energy(self) -> float:
        """N mm."""
        return self.force * self.length

    def history(self, rows: Any) -> Floats:
        """Rows (n, 4) of a descent (`Minimum.history`) in N and N mm."""
        return np.asarray(rows, dtype=np.float64).reshape(-1, 4) * [self.force, self.energy, 1.0, 1.0]

    def configuration(self, found: Configuration, start: Configuration, fixed: Ints) -> Configuration:
        """What was found in these units in mm; the unknowns `fixed` are those of the start in mm, to the last bit."""
        x = found.x * [[self.length], [1.0], [1.0]]
        x.reshape(-1)[fixed] = start.x.reshape(-1)[fixed]
        return Configuration(x)


PLAIN = Units(1.0, 1.0)
"""mm and N/mm2."""


def own_units(mesh: FibrilMesh, design: Design) -> Units:
    """The units in which the smallest radius is `RADIUS` and the largest penalty is `PENALTY`.

    >>> from circuittex.design import plain_weave
    >>> from circuittex.geometry.weave import build_mesh
    >>> design = plain_weave()
    >>> own_units(build_mesh(design), design)
    Units(length=1.0, modulus=1.0)
    """
    penalty = float(largest_penalty(mesh, design.contact).max())
    return Units(float(mesh.radius.min()) / RADIUS, penalty / PENALTY)
