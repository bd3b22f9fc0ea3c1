"""The frozen contact state: what the electrical and thermal stages, and users, build on."""

from __future__ import annotations

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen
from circuittex.geometry.mesh import FibrilMesh


@frozen
class ContactState:
    """All contact points of one mechanical state, and how the fibrils conduct along their axes.

    Each of the C rows is one contact: a point of fibril a and a place on fibril b, or on fibril a itself, where the
    distance has a minimum. From one point there may be several.
    Contacts are integrated over both fibrils, so a touching pair appears from both sides, each
    with half its quadrature weight.
    """

    mesh: FibrilMesh
    """The fibrils (their table of properties is what later stages read)."""
    fibril_a: Ints
    """(C,) fibril that carries the quadrature point."""
    fibril_b: Ints
    """(C,) fibril that carries the place of the minimum."""
    xi_a: Floats
    """(C,) axis coordinate on fibril a, mm."""
    xi_b: Floats
    """(C,) axis coordinate on fibril b, mm."""
    gap: Floats
    """(C,) |d| - R - R', mm; negative where the fibrils overlap."""
    line_load: Floats
    """(C,) p = P* o [28], N/mm."""
    width: Floats
    """(C,) Hertz half-width a [29], mm."""
    weight: Floats
    """(C,) quadrature weight w, mm of axis (already halved; of minima that belong together each has a part)."""
    conductance: Floats
    """(C,) electrical conductance by the law of the pair, the paper's is sigma_c a w [31], S."""
    heat_conductance: Floats
    """(C,) thermal conductance, h_c over the same area, by the paper's law h_c a w [30], W/K."""
    axial_factor: Floats
    """(M,) conduction of each element along its axis relative to sigma A: 1 for the paper's reference
    law, (A_now / A) / stretch where the material keeps its conductivity in the current frame."""

    @property
    def n_contacts(self) -> int:
        return len(self.gap)
