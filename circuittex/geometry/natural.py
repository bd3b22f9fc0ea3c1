"""The stress-free length and shape of fibrils: as much of the woven path as was set into them."""

from __future__ import annotations

import numpy as np

from circuittex.base.arrays import Floats

PARTS = 256
"""Pieces of a path from crossing to crossing in which its length is summed: their fourth order leaves some 1e-10."""
TURNS = 4
"""Steps of Newton's method for the place at a length; the first leaves the square of the spline's own error."""
FINER = 8
"""Pieces from node to node in which the directions of a natural shape are summed, by Simpson's rule."""


def equal_arcs(speed: Floats, span: Floats, places: int) -> tuple[Floats, Floats]:
    """Places t (F, K) from 0 to 1 at equal lengths along paths, and the lengths (F,) of these, mm.

    `speed` (F, 2 n + 1) is |dr/ds| at equal steps of s = t `span` (F,). The length l(t) is summed by Simpson's rule
    over n pieces and is a cubic spline with the speeds as slopes in between, which is inverted.

    >>> t, length = equal_arcs(np.full((1, 5), 1.25), np.array([4.0]), 3)
    >>> t.round(12).tolist(), length.tolist()
    ([[0.0, 0.5, 1.0]], [5.0])
    """
    n = (speed.shape[1] - 1) // 2
    ends, middle = speed[:, ::2], speed[:, 1::2]
    piece = (ends[:, :-1] + 4.0 * middle + ends[:, 1:]) / (6.0 * n)
    reached = np.concatenate([np.zeros((len(speed), 1)), np.cumsum(piece, axis=1)], axis=1)
    total = reached[:, -1:]
    wanted = total * np.linspace(0.0, 1.0, places)
    t = np.broadcast_to(np.linspace(0.0, 1.0, places), wanted.shape)
    for _ in range(TURNS):
        k = np.minimum((t * n).astype(np.int64), n - 1)
        u = t * n - k
        before, after = (np.take_along_axis(reached, k + j, axis=1) for j in (0, 1))
        slope, next_slope = (np.take_along_axis(ends, k + j, axis=1) / n for j in (0, 1))
        rise = after - before
        curved, bent = 3.0 * rise - 2.0 * slope - next_slope, slope + next_slope - 2.0 * rise
        length = before + u * (slope + u * (curved + u * bent))
        rate = n * (slope + u * (2.0 * curved + 3.0 * u * bent))
        t = np.clip(t - (length - wanted) / rate, 0.0, 1.0)
    t = np.concatenate([np.zeros((len(t), 1)), t[:, 1:-1], np.ones((len(t), 1))], axis=1)
    return t, span * total[:, 0]


def lessened(left: Floats, slope: Floats, part: Floats) -> tuple[Floats, Floats]:
    """Slopes of directions that depart from the yarn's axis by `part` of the angle of those with slopes left, slope.

    The slopes are dr/ds across the yarn and upwards; the direction turns in the plane of both.

    >>> lessened(np.array([0.0]), np.array([np.tan(0.6)]), np.array([0.5]))[1].round(12) == np.tan(0.3).round(12)
    array([ True])
    """
    steep = np.hypot(left, slope)
    ratio = np.divide(np.tan(part * np.arctan(steep)), steep, out=np.ones_like(steep) * part, where=steep > 0.0)
    return ratio * left, ratio * slope


def along_directions(left: Floats, slope: Floats, length: Floats) -> Floats:
    """(F, K, 3) places (along, left, up), mm, on curves of `length` (F,) whose unit directions have these slopes.

    `left` and `slope` (F, `FINER` (K - 1) + 1) are at equal lengths along the curves, which begin at zero.
    """
    direction = np.stack([np.ones_like(left), left, slope], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    pairs = direction[:, :-1:2] + 4.0 * direction[:, 1::2] + direction[:, 2::2]
    steps = pairs.reshape(len(left), -1, FINER // 2, 3).sum(axis=2)
    size = length / (left.shape[1] - 1) / 3.0
    places = np.concatenate([np.zeros((len(left), 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    return np.asarray(size[:, None, None] * places)
