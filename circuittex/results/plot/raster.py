"""Shaded triangles as a picture: every pixel shows the triangle that is nearest to the eye there."""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen

OVERSAMPLING = 2
"""Samples a pixel in either direction, averaged: smooth edges."""


@frozen
class Picture:
    """A picture of a piece of the plane."""

    pixels: Floats
    """(rows, columns, 3) red, green and blue from 0 to 1, the top row first."""
    extent: tuple[float, float, float, float]
    """Left, right, bottom and top of the piece."""


def picture(corners: Floats, colours: Floats, pixels: int) -> Picture:
    """Triangles (T, 3, 3), corners as (right, up, nearness), in their `colours` (T, 3), before white.

    `pixels` is the number of pixels along the longer side of the picture.
    """
    low, high = corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))
    size = float((high - low).max()) / pixels
    shape = np.ceil((high - low) / size).astype(int) + 2  # a pixel of white all round
    low = (low + high - size * shape) / 2
    (left, bottom), (right, top) = low.tolist(), (low + size * shape).tolist()
    samples = np.ones((shape[1] * OVERSAMPLING, shape[0] * OVERSAMPLING, 3))
    # From the plane to samples: a sample's centre has whole coordinates; rows go down.
    scale = OVERSAMPLING / size
    places = corners.copy()
    places[..., 0] = (corners[..., 0] - left) * scale - 0.5
    places[..., 1] = (top - corners[..., 1]) * scale - 0.5
    paint(places, colours, samples, np.full(samples.shape[:2], -np.inf))
    mean = np.zeros((shape[1], shape[0], 3))
    for i, j in np.ndindex(OVERSAMPLING, OVERSAMPLING):
        mean += samples[i::OVERSAMPLING, j::OVERSAMPLING] / OVERSAMPLING**2
    return Picture(mean, (left, right, bottom, top))


@compiled
def paint(corners: Any, colours: Any, samples: Any, nearness: Any) -> None:
    """Fill `samples` (rows, columns, 3) and `nearness` (rows, columns) with the triangles (T, 3, 3) in place.

    A corner is (column, row, nearness). A sample on an edge belongs to the triangles on both sides, so that
    neighbours leave no gap; the nearer one shows, of equals the first.
    """
    rows, columns = nearness.shape
    for t in range(len(corners)):
        x0, y0, z0 = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
        x1, y1, z1 = corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]
        x2, y2, z2 = corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        first, last = max(0, int(np.ceil(min(y0, y1, y2)))), min(rows - 1, int(np.floor(max(y0, y1, y2))))
        left, right = max(0, int(np.ceil(min(x0, x1, x2)))), min(columns - 1, int(np.floor(max(x0, x1, x2))))
        for row in range(first, last + 1):
            for column in range(left, right + 1):
                a = ((x1 - column) * (y2 - row) - (x2 - column) * (y1 - row)) / area
                b = ((x2 - column) * (y0 - row) - (x0 - column) * (y2 - row)) / area
                c = 1.0 - a - b
                if a < -1e-9 or b < -1e-9 or c < -1e-9:
                    continue
                z = a * z0 + b * z1 + c * z2
                if z > nearness[row, column]:
                    nearness[row, column] = z
                    for k in range(3):
                        samples[row, column, k] = colours[t, k]
