"""How far the fibrils of a weave start from their regular places: random, smooth, and repeatable by a seed."""

from __future__ import annotations

from circuittex.base.frozen import frozen
from circuittex.design.checks import real, store, whole

MOST_SEED = 2**63 - 1
"""The largest whole number of TOML and HDF5."""


@frozen
class Packing:
    """Standard deviations of the random departures from the regular packing; all zero: the regular packing itself.

    Every number is drawn from the normal distribution with mean zero, and stays the same, in units of its standard
    deviation, as long as the seed does: amplitudes and meshes can be changed for the same random packing. The ends
    of the fibrils, where the clamps hold them, depart like the rest: the cell is a piece of a larger fabric.

    >>> Packing().regular, Packing(seed=3, lateral=0.01).regular
    (True, False)
    """

    seed: int = 0
    """Which of the random packings."""
    lateral: float = 0.0
    """Of the place of each fibril across its yarn, in the plane of the fabric, at any point along it, mm."""
    vertical: float = 0.0
    """The same, normal to the fabric, mm."""
    twist: float = 0.0
    """Of the twist of each yarn about its axis, turns per mm; constant along the yarn and none at its middle."""
    phase: float = 0.0
    """Of the shift of each yarn's wave along the yarn, mm."""

    def __post_init__(self) -> None:
        store(
            self,
            seed=whole(self.seed, "packing.seed", 0, MOST_SEED),
            lateral=real(self.lateral, "packing.lateral", "mm", at_least=0),
            vertical=real(self.vertical, "packing.vertical", "mm", at_least=0),
            twist=real(self.twist, "packing.twist", "turns/mm", at_least=0),
            phase=real(self.phase, "packing.phase", "mm", at_least=0),
        )

    @property
    def regular(self) -> bool:
        """Whether nothing departs from the regular packing."""
        return not (self.lateral or self.vertical or self.twist or self.phase)
