"""What the Bézier points tell of each interval of the centre lines without looking at any point of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.contact.curve import CurveTable, bezier

QUARTER = np.pi / 2
"""Of a turn: as long as a fibril turns by less, the distance from any of its points grows along it."""


class Hull(NamedTuple):
    """Bounds for each of the I intervals, as compiled functions take them."""

    points: Floats
    """(I, 4, 3) Bézier points, mm."""
    tangent: Floats
    """(N, 3) derivative of the centre line by position in nodes at each node, mm."""
    bulge: Floats
    """(I,) how far the interval strays from its chord at most, mm."""
    least_speed: Floats
    """(I,) what the magnitude of the derivative is at least, mm; 0 where nothing is known."""
    bend: Floats
    """(I,) the largest magnitude of the second derivative, mm."""
    turn: Floats
    """(I + 1,) running sum of the angles by which the tangent turns in each interval at most, rad."""


def hulls(table: CurveTable, r: Floats) -> Hull:
    """The bounds for centre lines through nodes r (N, 3)."""
    points = bezier(table, r)
    chord = points[:, 3] - points[:, 0]
    thirds = points[:, :1] + np.array([[1.0], [2.0]]) / 3 * chord[:, None]
    derivative = 3 * np.diff(points, axis=1)
    tangent = np.empty_like(r)
    start = np.arange(len(points)) + table.fibril  # a fibril has one node more than intervals
    tangent[start + 1] = derivative[:, 2]  # of a fibril's last node; of the others the next interval's is the same
    tangent[start] = derivative[:, 0]
    along = (derivative * chord[:, None]).sum(axis=2).min(axis=1)
    length = np.sqrt((chord**2).sum(axis=1))
    second = 2 * np.diff(derivative, axis=1)
    return Hull(
        points=points,
        tangent=tangent,
        bulge=0.75 * np.sqrt(((points[:, 1:3] - thirds) ** 2).sum(axis=2)).max(axis=1),
        least_speed=np.divide(along, length, out=np.zeros_like(length), where=along > 0.0),
        bend=np.sqrt((second**2).sum(axis=2)).max(axis=1),
        turn=_turning(derivative),
    )


def turning(table: CurveTable, r: Floats) -> Floats:
    """`Hull.turn` alone."""
    return _turning(np.diff(bezier(table, r), axis=1))


def _turning(derivative: Floats) -> Floats:
    """(I + 1,) running sum of the angles between the Bézier points (I, 3, 3) of the derivative.

    Within an interval the tangent is a positive combination of these three, so it turns by no more.
    """
    a, b = derivative[:, :2], derivative[:, 1:]
    sine = np.sqrt((np.cross(a, b) ** 2).sum(axis=2))
    angle = np.arctan2(sine, (a * b).sum(axis=2)).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(angle)])
