"""A configuration of all fibrils: where the centre lines and directors are."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh


@frozen
class Configuration:
    """Nodal values of r, g1 and g2 [9] for every node of a `FibrilMesh`."""

    x: Floats
    """(N, 3, 3): node, (r, g1, g2) [mm, 1, 1], (x, y, z)."""

    @property
    def r(self) -> Floats:
        """(N, 3) centre line, mm."""
        return self.x[:, 0]

    @property
    def g1(self) -> Floats:
        """(N, 3) first director."""
        return self.x[:, 1]

    @property
    def g2(self) -> Floats:
        """(N, 3) second director."""
        return self.x[:, 2]


def initial_configuration(mesh: FibrilMesh) -> Configuration:
    """The configuration in which the mesh was laid out."""
    return Configuration(np.concatenate([mesh.position[:, None], mesh.directors], axis=1))
