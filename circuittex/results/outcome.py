"""The numbers by which two equilibria of one state are told apart."""

from __future__ import annotations

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen


@frozen
class Outcome:
    """What an equilibrium comes to."""

    clamp_force: Floats
    """(2, 3) total force of the clamps on the +x ends of the warp and the +y ends of the weft, N."""
    currents: tuple[float, ...]
    """Current of each probe into its source terminal, A."""
    Ry: float
    """Resistance of a yarn segment of the reduced network, ohm."""
    Rc: float
    """Resistance of a crossing of the reduced network, ohm."""
    energy: float
    """Stored elastic and contact energy, N mm."""
