"""The flat mesh of all fibrils: nodes, elements, and a table of fibril and yarn properties."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen


@frozen
class FibrilMesh:
    """All fibrils of a fabric as one flat mesh, fibril after fibril, nodes in axis order.

    N nodes, M elements, F fibrils, Y yarns; every fibril has its own straight axis [0, length].
    The nodes of fibril f are ``first_node[f]:first_node[f + 1]``, its elements
    ``first_element[f]:first_element[f + 1]``.
    """

    position: Floats
    """(N, 3) initial centre line r, mm."""
    directors: Floats
    """(N, 2, 3) initial directors g1, g2 (dimensionless, unit length)."""
    xi: Floats
    """(N,) axis coordinate xi3 of each node, mm."""
    elements: Ints
    """(M, order + 1) node numbers of each element in axis order."""
    first_node: Ints
    """(F + 1,) offsets into the nodes."""
    first_element: Ints
    """(F + 1,) offsets into the elements."""
    yarn: Ints
    """(F,) yarn of each fibril."""
    length: Floats
    """(F,) natural length L, mm."""
    radius: Floats
    """(F,) section radius R, mm."""
    youngs_modulus: Floats
    """(F,) E, MPa."""
    poisson_ratio: Floats
    """(F,) nu."""
    density: Floats
    """(F,) rho, g/mm3."""
    electrical_conductivity: Floats
    """(F,) sigma, S/mm; 0 for an insulating fibril."""
    thermal_conductivity: Floats
    """(F,) k, W/(mm K)."""
    yarn_names: tuple[str, ...]
    """(Y,) for example 'warp1'; the warp runs along x, the weft along y."""
    yarn_axis: Ints
    """(Y,) 0 for a yarn along x, 1 along y."""
    material: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """(F,) place of what each fibril touches with in `material_names`; empty where no contact law asks for it."""
    material_names: tuple[str, ...] = ()
    """Names of the materials that touch, shells where there are any, in the order of their first fibrils."""
    natural: Floats = field(default_factory=lambda: np.empty((0, 3, 3)))
    """(N, 3, 3) r, mm, g1 and g2 of the stress-free shapes; empty where every fibril is naturally straight."""
    surface_conductivity: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) sigma of what a fibril touches others with, S/mm; empty where no fibril is coated."""
    bending_radius: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) radius of the homogeneous section of E that bends as the fibril does, mm; empty where none is coated."""

    shell_thickness: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) t of the shells, mm, 0 of fibrils without one; empty where none is coated."""
    core_conductivity: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) sigma within the shells, S/mm, or of the fibril itself; empty where none is coated."""

    @property
    def order(self) -> int:
        """Polynomial order of the elements (1 or 2)."""
        return int(self.elements.shape[1]) - 1

    @property
    def n_nodes(self) -> int:
        return len(self.xi)

    @property
    def n_fibrils(self) -> int:
        return len(self.yarn)

    @property
    def node_fibril(self) -> Ints:
        """(N,) fibril of each node."""
        return np.repeat(np.arange(self.n_fibrils), np.diff(self.first_node))

    @property
    def element_fibril(self) -> Ints:
        """(M,) fibril of each element."""
        return np.repeat(np.arange(self.n_fibrils), np.diff(self.first_element))

    @property
    def area(self) -> Floats:
        """(F,) section area pi R^2, mm2."""
        return np.pi * self.radius**2

    @property
    def surface(self) -> Floats:
        """(F,) sigma of what a fibril touches others with, S/mm: of its shell, or its own."""
        return self.surface_conductivity if len(self.surface_conductivity) else self.electrical_conductivity

    @property
    def section_radius(self) -> Floats:
        """(F,) radius that counts in bending, mm: R, or that of a homogeneous section like the coated one."""
        return self.bending_radius if len(self.bending_radius) else self.radius

    def end_nodes(self, side: int) -> Ints:
        """(F,) node at xi3 = 0 (`side` -1, the minus end) or at xi3 = L (`side` +1, the plus end)."""
        return self.first_node[:-1] if side < 0 else self.first_node[1:] - 1

    @property
    def ends(self) -> Ints:
        """(2F,) nodes of all fibril ends, where the clamps are: the minus ends, then the plus ends."""
        return np.concatenate([self.end_nodes(-1), self.end_nodes(+1)])


def pair_label(mesh: FibrilMesh, first: int, second: int) -> str:
    """Two fibrils in words, counted from 1: 'fibril 2 of warp1 and fibril 1 of weft2', or '... and itself'."""
    labels = []
    for fibril in (first, second):
        number = int(np.count_nonzero(mesh.yarn[: fibril + 1] == mesh.yarn[fibril]))
        labels.append(f"fibril {number} of {mesh.yarn_names[mesh.yarn[fibril]]}")
    return " and ".join([labels[0], labels[1] if first != second else "itself"])
