"""How the minima of the distance from one contact point share out its weight.

The energy counts every minimum and takes off the maxima between them. In circuits, where nothing can be taken off, each
minimum has a part of the point's weight: so that the overlaps times these parts add up to the same, every part lies
between 0 and 1, and where a minimum appears or vanishes its part is 0.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.contact.curve import CurveTable

if TYPE_CHECKING:
    from circuittex.contact.penalty import Touching


def shares(found: Touching, table: CurveTable) -> Floats:
    """(C,) the part of the point's weight for each place of `found`; 0 at maxima of the distance."""
    part = np.where(found.sign > 0, 1.0, 0.0)
    fibril = table.fibril[found.interval_a]
    behind = found.position_b > found.interval_a - table.first_interval[fibril] + found.t_a
    behind &= fibril == found.fibril_b  # on its own fibril the point itself parts what lies on either side
    other = np.zeros(max(0, len(part) - 1), dtype=np.bool_)
    for column in (found.interval_a, found.t_a, found.fibril_b, behind):
        other |= column[1:] != column[:-1]
    start = np.concatenate([[0], np.flatnonzero(other) + 1, [len(part)]])
    has_maxima = np.add.reduceat(found.sign < 0, start[:-1]) > 0 if len(part) else np.empty(0, dtype=np.bool_)
    for (first, last), concerned in zip(pairwise(start.tolist()), has_maxima.tolist(), strict=False):
        if concerned:
            part[first:last] = share(found.overlap[first:last], found.sign[first:last])
    return part


def share(overlap: Floats, sign: Floats) -> Floats:
    """(n,) the parts of the places of one contact point on one fibril, in the order of their positions.

    From the highest overlap o_s of a maximum of the distance (`sign` < 0) to the lowest, what lies on either side of it
    is joined, and o_s taken off both: from one side in proportion to how far the other side's largest overlap exceeds
    o_s, and within a side from all in proportion to what they have. A maximum with a minimum on one side only lies next
    to the contact point itself, of which no overlap is taken off.

    >>> share(np.array([0.06, 0.02, 0.04]), np.array([1.0, -1.0, 1.0])).round(3).tolist()
    [0.889, 0.0, 0.667]
    """
    carried, top = np.where(sign > 0, overlap, 0.0), overlap.copy()
    pool = np.where(sign > 0, np.arange(len(sign)), -1)
    for s in sorted(np.flatnonzero(sign < 0).tolist(), key=lambda s: -overlap[s]):
        sides = [pool == pool[k] for k in (s - 1, s + 1) if 0 <= k < len(sign) and sign[k] > 0]
        rises = [float(top[side].max() - overlap[s]) for side in sides]
        others = rises[::-1] if len(sides) == 2 else [np.inf]
        for side, rise, other in zip(sides, rises, others, strict=True):
            carried[side] *= 1 - _part_of(rise, other) * overlap[s] / carried[side].sum()
        joined = np.logical_or.reduce(sides)
        pool[joined], top[joined] = s, overlap[s] + max(*rises, *others)
    return np.asarray(carried / overlap)


def _part_of(rise: float, other: float) -> float:
    """What is taken off a side that exceeds a maximum by `rise`, where the other side does by `other`."""
    if np.isinf(rise) or np.isinf(other):
        return 0.0 if np.isinf(rise) else 1.0
    return other / (rise + other) if rise + other > 0.0 else 0.5
