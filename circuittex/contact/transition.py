"""What tells a crossing from a long parallel touch: how long the touch is, for its angle and force.

Two straight fibrils under a force F that cross at an angle t touch over the length s that follows from F and the law of
contact. A touch about as long is a crossing, whatever the angle; one that is much shorter runs out because the
fibrils are parallel and end or bend away, one that is much longer lies along a bent fibril: both are strips.
"""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats

CROSSING, STRIP = 1.5, 3.0
"""Up to the first of these factors between the lengths a touch is a crossing, from the second on a strip."""


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


def strip_part(length: Floats, spacing: Floats, straight: Floats) -> Floats:
    """Part (P,) of a touch that is a strip, from 0 (a crossing) to 1.

    length (P,) mm is known to one spacing (P,) mm of the contact points. With x = length / straight, or the inverse
    where that is larger, the part is 0 up to x = 1.5, 1 from x = 3 on, and y^2 (3 - 2 y) between, y = log2(x / 1.5).

    >>> strip_part(np.array([1.0, 1.5, 4.5**0.5, 3.0, 0.25, 0.0]), np.zeros(6), np.ones(6)).round(12).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0, 1.0]
    """
    longer = np.maximum(length - spacing, 0.0) / straight
    with np.errstate(divide="ignore"):
        shorter = straight / (length + spacing)
    x = np.maximum(1.0, np.maximum(longer, shorter))
    y = np.clip(np.log(x / CROSSING) / np.log(STRIP / CROSSING), 0.0, 1.0)
    return np.asarray(y**2 * (3 - 2 * y))
