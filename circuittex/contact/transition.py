"""What tells a crossing from a long parallel touch: how long the touch is, for its angle and force.

Two straight fibrils under a force F that cross at an angle t touch over a length s that follows from F and the law of
contact. A touch about as long is a crossing, whatever the angle. One that is much shorter runs out because its fibrils
are parallel and end, or bend away; one that is much longer lies along a bent fibril: both are strips.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from circuittex.base.arrays import Floats

SHORTEST = 4.0
"""A touch this many times shorter than that of straight fibrils is a strip altogether."""
LONG, LONGEST = 1.5, 3.0
"""Up to the first of these times as long a touch is a crossing, for fibrils wrap round one another; from the second
on it is a strip."""


class Departure(NamedTuple):
    """How P touches depart from those of straight fibrils."""

    shorter: Floats
    """(P,) times shorter, at least 1."""
    strip: Floats
    """(P,) part of a touch that is a strip: 0 for a crossing, to 1."""


def straight_length(force: Floats, sine: Floats, radii: Floats, penalty: Floats) -> Floats:
    """Length s (P,), mm, over which straight fibrils touch that cross under F (P,) N; radii: R + R' (P,) mm.

    The line load P* (o - x^2 sin^2 / (2 (R + R'))) on s = 2 sqrt(2 (R + R') o) / sin adds up to F = 2/3 P* o s, so that
    s^3 = 12 (R + R') F / (P* sin^2); infinite where they are parallel. Of equal cylinders of radius 1 at a right
    angle, 4/3 E* o^(3/2) presses with P* = E*/2, and s = 4 sqrt(o):

    >>> one = np.ones(1)
    >>> straight_length(4 / 3 * one, one, 2 * one, one / 2).round(12).tolist()
    [4.0]
    """
    with np.errstate(divide="ignore"):
        return np.asarray(radii * np.cbrt(12 * force / (penalty * radii**2) / sine**2))


def departure(length: Floats, spacing: Floats, straight: Floats) -> Departure:
    """How touches of given length (P,) mm depart from those of `straight` length (P,) mm.

    A length is known to one spacing (P,) mm of the contact points. With x times shorter y = log x / log 4, with x times
    longer y = log(x / 1.5) / log 2; y is taken within 0 and 1, and the part of a strip is y^2 (3 - 2 y).

    >>> length = np.array([0.0, 0.25, 0.5, 1.0, 1.5, 4.5**0.5, 3.0])
    >>> departure(length, np.zeros(7), np.ones(7)).strip.round(12).tolist()
    [1.0, 1.0, 0.5, 0.0, 0.0, 0.5, 1.0]
    """
    longer = np.maximum(LONG, (length - spacing) / straight)
    with np.errstate(divide="ignore"):
        shorter = np.maximum(1.0, straight / (length + spacing))
    y = np.maximum(np.log(shorter) / np.log(SHORTEST), np.log(longer / LONG) / np.log(LONGEST / LONG))
    y = np.minimum(y, 1.0)
    return Departure(shorter, y**2 * (3 - 2 * y))
