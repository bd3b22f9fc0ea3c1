"""A check of which fibril is above that knows nothing of circuittex: NumPy and two polylines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Line = NDArray[np.float64]
ASIDE = 1e-9
"""Of the size of the cell: nothing beside any fibril, and far above rounding."""


def side(warp: Line, weft: Line) -> int:
    """1 where the warp fibril passes over the weft fibril, 0 where under, however they are bent.

    Sum of the signs of all intersections in plan where the warp is above, from all pairs of segments: it changes only
    where one line is drawn through the other, since the ends are held at the edges of the cell. In a symmetric cell
    lines cross at their nodes, which rounding may take from both segments: the weft is seen from a little aside.
    """
    weft = weft + ASIDE * np.ptp(warp[:, :2]) * np.array([1.0, np.sqrt(2.0), 0.0])
    a, u = warp[:-1, None], np.diff(warp, axis=0)[:, None]
    c, v = weft[None, :-1], np.diff(weft, axis=0)[None]
    w = c - a
    with np.errstate(divide="ignore", invalid="ignore"):
        det = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
        s = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / det
        t = (w[..., 0] * u[..., 1] - w[..., 1] * u[..., 0]) / det
    hit = (s >= 0) & (s < 1) & (t >= 0) & (t < 1)
    above = a[..., 2] + s * u[..., 2] > c[..., 2] + t * v[..., 2]
    return int(np.sum(np.sign(det[hit & above])))
