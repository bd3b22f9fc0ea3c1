"""What the Bézier points tell of each interval of the centre lines without looking at any point of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.compiled import compiled
from circuittex.contact.curve import Curve

QUARTER = np.pi / 2
"""Of a turn: as long as a fibril turns by less, the distance from any of its points grows along it."""


class Hull(NamedTuple):
    """Bounds for each of the I intervals, as compiled functions take them."""

    points: Floats
    """(I, 4, 3) Bézier points, mm."""
    power: Floats
    """(I, 4, 3) coefficients of the powers of the local coordinate, mm: quicker to follow than the nodes' weights."""
    tangent: Floats
    """(N, 3) derivative of the centre line by the position in nodes, at each node, mm."""
    bulge: Floats
    """(I,) how far the interval strays from its chord at most, mm."""
    least_speed: Floats
    """(I,) what the magnitude of the derivative is at least, mm; 0 where nothing is known."""
    bend: Floats
    """(I,) the largest magnitude of the second derivative, mm."""
    turn: Floats
    """(I + 1,) running sum of the angles by which the tangent turns in each interval at most, rad."""


def hulls(curve: Curve) -> Hull:
    """The bounds for the centre lines of a configuration."""
    n = len(curve.window)
    hull = Hull(
        points=np.empty((n, 4, 3)),
        power=np.empty((n, 4, 3)),
        tangent=np.empty_like(curve.r),
        bulge=np.empty(n),
        least_speed=np.empty(n),
        bend=np.empty(n),
        turn=np.zeros(n + 1),
    )
    _bound(curve, hull)
    return hull


@compiled
def _bound(curve: Any, hull: Any) -> None:
    """Fill the bounds.

    The derivative of an interval is a positive combination of its three Bézier points: so its part along the chord is
    at least the smallest of theirs, and its direction turns by no more than the angles between them.
    """
    slope = np.empty((3, 3))
    for i in range(curve.window.shape[0]):
        basis, first, points, power = curve.basis[curve.kind[i]], curve.window[i], hull.points[i], hull.power[i]
        for m in range(4):
            for c in range(3):
                power[m, c] = 0.0
                for a in range(4):
                    power[m, c] += basis[a, m] * curve.r[first + a, c]
        bulge, bend = np.zeros(2), np.zeros(2)
        for c in range(3):
            points[0, c] = power[0, c]
            points[1, c] = power[0, c] + power[1, c] / 3
            points[2, c] = power[0, c] + 2 * power[1, c] / 3 + power[2, c] / 3
            points[3, c] = power[0, c] + power[1, c] + power[2, c] + power[3, c]
            chord = points[3, c] - points[0, c]
            for m in range(3):
                slope[m, c] = 3 * (points[m + 1, c] - points[m, c])
            for m in range(2):
                bulge[m] += (points[m + 1, c] - points[0, c] - (m + 1) / 3 * chord) ** 2
                bend[m] += 4 * (slope[m + 1, c] - slope[m, c]) ** 2
        hull.bulge[i], hull.bend[i] = 0.75 * np.sqrt(bulge.max()), np.sqrt(bend.max())
        _direct(points, slope, i, hull)
        node = first + (0, 1, 2)[curve.kind[i]]
        hull.tangent[node], hull.tangent[node + 1] = slope[0], slope[2]  # the same as the next interval's first


@compiled
def _direct(points: Any, slope: Any, i: int, hull: Any) -> None:
    """The bounds of interval i that depend on directions, from its Bézier points and those of its derivative (3, 3)."""
    length, along = 0.0, np.zeros(3)
    for c in range(3):
        chord = points[3, c] - points[0, c]
        length += chord * chord
        for m in range(3):
            along[m] += slope[m, c] * chord
    hull.least_speed[i] = max(0.0, along.min() / np.sqrt(length)) if length > 0.0 else 0.0
    angle = 0.0
    for m in range(2):
        dot, cross = 0.0, 0.0
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            dot += slope[m, c] * slope[m + 1, c]
            cross += (slope[m, d] * slope[m + 1, e] - slope[m, e] * slope[m + 1, d]) ** 2
        angle += np.arctan2(np.sqrt(cross), dot)
    hull.turn[i + 1] = hull.turn[i] + angle
