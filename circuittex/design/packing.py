"""How far the fibrils of a weave start from their regular places: random, smooth, and repeatable by a seed."""

from __future__ import annotations

from dataclasses import field

from circuittex.base.frozen import frozen
from circuittex.design.declaration import check, count, number

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

    seed: int = field(
        default=0, metadata=count("which of the random packings, a whole number", 0, MOST_SEED, shown="0")
    )
    """Which of the random packings."""
    lateral: float = field(
        default=0.0,
        metadata=number("mm", "of each fibril across its yarn, varying smoothly along it", shown="0 mm", at_least=0),
    )
    """Of the place of each fibril across its yarn, in the plane of the fabric, at any point along it, mm."""
    vertical: float = field(
        default=0.0, metadata=number("mm", "the same, normal to the fabric", shown="0 mm", at_least=0)
    )
    """The same, normal to the fabric, mm."""
    twist: float = field(
        default=0.0, metadata=number("1/mm", "turns per length of each yarn about its axis", shown="0 1/m", at_least=0)
    )
    """Of the twist of each yarn about its axis, turns in 1/mm; constant along the yarn and none at its middle."""
    phase: float = field(
        default=0.0, metadata=number("mm", "shift of each yarn's wave along the yarn", shown="0 mm", at_least=0)
    )
    """Of the shift of each yarn's wave along the yarn, mm."""

    def __post_init__(self) -> None:
        check(self, "packing")

    @property
    def regular(self) -> bool:
        """Whether nothing departs from the regular packing."""
        return not (self.lateral or self.vertical or self.twist or self.phase)
